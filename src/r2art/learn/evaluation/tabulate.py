"""An evaluation in tables for people: millimetres, degrees, percent."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from r2art.learn.evaluation.causes import Group, causes, groups
from r2art.learn.evaluation.evaluate import Report
from r2art.learn.evaluation.statistics import Interval
from r2art.learn.evaluation.summary import JointSummary, PartSummary, Summary, summarise
from r2art.learn.evaluation.tables import Table

MM, CM, PERCENT, DEGREES, MS = 1e3, 1e2, 1e2, 180 / math.pi, 1e3


@dataclass(frozen=True)
class Result:
    """What an evaluation found, and what it comes to, with box and category given and found."""

    report: Report
    given: Summary
    found: Summary

    @classmethod
    def of(cls, report: Report) -> "Result":
        """Summarise a report."""
        modes = (report.given, report.found)
        return cls(report, *(summarise(mode.scores, report.category) for mode in modes))


def number(value: float, unit: float, digits: int) -> str:
    """A figure in another unit; – where there is none."""
    if math.isnan(value):
        return "–"
    return "∞" if math.isinf(value) else f"{unit * value:.{digits}f}"


def interval(i: Interval, unit: float, digits: int, sign: str = "") -> str:
    """A figure and its interval; – where there is none."""
    if math.isnan(i.value):
        return "–"
    ends = ", ".join(number(v, unit, digits) for v in (i.low, i.high))
    return f"{number(i.value, unit, digits)} [{ends}]{sign}"


def tables(result: Result) -> tuple[Table, ...]:
    """Overview, parts, joints, confidence; what is *found* enters the first and last."""
    given = result.given
    of_joints = (joints(given),) if given.joints else ()
    return (overview(result), parts(given), *of_joints, confidence(result))


def overview(result: Result) -> Table:
    """Both modes, over all parts."""
    given, found = result.given, result.found
    symmetric = result.report.category.symmetry is not None
    shares = (f"{PERCENT * s.relabelled:.1f} %" for s in (given, found))
    rows = (
        ("images", str(given.images), str(found.images)),
        ("failures", str(given.failures), str(found.failures)),
        ("2D box IoU", "given", interval(found.box.median, 1, 3)),
        ("category right", "given", f"{PERCENT * found.category_accuracy:.1f} %"),
        *([("other labelling nearer", *shares)] if symmetric else []),
        *((label, of(given), of(found)) for label, of in _OVERVIEW),
        *(
            (f"{g.kind} joint state", _state(g), _state(f))
            for g, f in zip(given.kinds, found.kinds, strict=True)
        ),
        ("time per photo", _time(given), _time(found)),
    )
    title = "Overview: median [95 % interval] over all parts, where nothing else is said"
    return Table(title, ("", "given", "found"), rows)


_OVERVIEW: tuple[tuple[str, Callable[[Summary], str]], ...] = (
    ("rotation", lambda s: interval(s.whole.rotation.median, DEGREES, 1, " °")),
    ("rotation of the root", lambda s: interval(s.parts[0].rotation.median, DEGREES, 1, " °")),
    (
        "ADD, of the diagonal",
        lambda s: interval(s.whole.plain.add_share.median, PERCENT, 1, " %"),
    ),
    (
        "ADD, of the diagonal, scale aligned",
        lambda s: interval(s.whole.aligned.add_share.median, PERCENT, 1, " %"),
    ),
    ("depth error", lambda s: interval(s.depth.median, PERCENT, 1, " %")),
    ("AUC of ADD to 100 mm", lambda s: interval(s.whole.plain.auc_100mm, PERCENT, 1, " %")),
    (
        "AUC of ADD to 10 % of ⌀, scale aligned",
        lambda s: interval(s.whole.aligned.auc_diameter, PERCENT, 1, " %"),
    ),
    ("3D IoU, mean", lambda s: interval(s.whole.plain.overlap.mean, PERCENT, 1, " %")),
    (
        "3D IoU, mean, scale aligned",
        lambda s: interval(s.whole.aligned.overlap.mean, PERCENT, 1, " %"),
    ),
)


def parts(given: Summary) -> Table:
    """Every measure of every part."""
    columns = (*given.parts, given.whole)
    rows = tuple((label, *(of(p) for p in columns)) for label, of in _PARTS)
    title = "Parts, box and category given: median where nothing else is said"
    return Table(title, ("", *(p.name for p in columns)), rows)


_PARTS: tuple[tuple[str, Callable[[PartSummary], str]], ...] = (
    ("ADD, mm", lambda p: number(p.plain.add.median.value, MM, 1)),
    ("ADD, mean, mm", lambda p: number(p.plain.add.mean.value, MM, 1)),
    ("ADD, 90th percentile, mm", lambda p: number(p.plain.add.p90, MM, 1)),
    ("ADD, % of diagonal", lambda p: number(p.plain.add_share.median.value, PERCENT, 1)),
    ("ADD-S, mm", lambda p: number(p.plain.add_s.median.value, MM, 1)),
    ("AUC of ADD to 100 mm, %", lambda p: number(p.plain.auc_100mm.value, PERCENT, 1)),
    ("AUC of ADD to 10 % of ⌀, %", lambda p: number(p.plain.auc_diameter.value, PERCENT, 1)),
    ("rotation, °", lambda p: number(p.rotation.median.value, DEGREES, 1)),
    ("centre, mm", lambda p: number(p.plain.translation.median.value, MM, 1)),
    ("3D IoU, mean, %", lambda p: number(p.plain.overlap.mean.value, PERCENT, 1)),
    ("aligned: ADD, mm", lambda p: number(p.aligned.add.median.value, MM, 1)),
    ("aligned: ADD, mean, mm", lambda p: number(p.aligned.add.mean.value, MM, 1)),
    ("aligned: ADD, % of diagonal", lambda p: number(p.aligned.add_share.median.value, PERCENT, 1)),
    ("aligned: ADD-S, mm", lambda p: number(p.aligned.add_s.median.value, MM, 1)),
    ("aligned: AUC to 100 mm, %", lambda p: number(p.aligned.auc_100mm.value, PERCENT, 1)),
    ("aligned: AUC to 10 % of ⌀, %", lambda p: number(p.aligned.auc_diameter.value, PERCENT, 1)),
    ("aligned: centre, mm", lambda p: number(p.aligned.translation.median.value, MM, 1)),
    ("aligned: 3D IoU, mean, %", lambda p: number(p.aligned.overlap.mean.value, PERCENT, 1)),
    ("confidence AUROC", lambda p: number(p.confidence_auroc, 1, 3)),
)


def joints(given: Summary) -> Table:
    """Every joint."""
    together = given.kinds if len(given.joints) > 1 else ()
    errors = ("state", "mean", "p90", "aligned", "axis °", "pivot mm", "pivot aligned")
    columns = ("joint", *errors, "right %", "ECE %", "AUROC")
    rows = tuple(_joint_row(j) for j in (*given.joints, *together))
    return Table("Joints, box and category given: median where nothing else is said", columns, rows)


def _joint_row(j: JointSummary) -> tuple[str, ...]:
    unit, _ = _unit(j)
    pivots = (j.pivot, j.pivot_aligned)
    return (
        j.name,
        _state(j),
        number(j.state.mean.value, unit, 1),
        number(j.state.p90, unit, 1),
        number(j.state_aligned.median.value, unit, 1),
        number(j.axis.median.value, DEGREES, 1),
        *(number(p.median.value, MM, 1) if p else "–" for p in pivots),
        *(number(share, PERCENT, 1) for share in (j.right, j.confidence_error)),
        number(j.confidence_auroc, 1, 3),
    )


def confidence(result: Result) -> Table:
    """What the confidence is worth, in both modes."""
    both = (result.given.calibration, result.found.calibration)
    share = f"{PERCENT * both[0].rejection.share:.0f} %"
    rows = (
        ("expected calibration error", *(interval(c.error, PERCENT, 1, " %") for c in both)),
        ("AUROC, right parts from wrong", *(interval(c.auroc, 1, 3) for c in both)),
        ("photos with all parts right", *(_percent(c.rejection.right) for c in both)),
        (
            f"the same without the {share} least confident",
            *(_percent(c.rejection.right_kept) for c in both),
        ),
        ("wrong photos that go with them", *(_percent(c.rejection.wrong_removed) for c in both)),
        ("ADD aligned, of the diagonal", *(_percent(c.rejection.error) for c in both)),
        ("the same without them", *(_percent(c.rejection.error_kept) for c in both)),
    )
    return Table("Confidence", ("", "given", "found"), rows)


def _percent(value: float) -> str:
    return number(value, PERCENT, 1) + ("" if math.isnan(value) else " %")


def by_cause(report: Report) -> tuple[Table, ...]:
    """Errors of groups of photos, box and category given, for every cause."""
    scores, category = report.given.scores, report.category
    unit, sign = (DEGREES, "°") if _turns(report) else (CM, "cm")
    columns = ("photos", "rotation °", "ADD, % of diagonal", "aligned", f"state {sign}", "AUC %")
    return tuple(
        Table(
            f"By {cause.name}",
            (cause.name, *columns, "3D IoU %"),
            tuple(_group_row(g, unit) for g in groups(scores, category, cause)),
        )
        for cause in causes(scores, category)
    )


def _turns(report: Report) -> bool:
    return any(j.kind == "revolute" for j in report.category.joints)


def _group_row(g: Group, unit: float) -> tuple[str, ...]:
    failures = f" ({g.failures} failed)" if g.failures else ""
    return (
        f"{g.low:.0f} to {g.high:.0f}",
        f"{g.images}{failures}",
        number(g.rotation, DEGREES, 1),
        number(g.add_share, PERCENT, 1),
        number(g.add_share_aligned, PERCENT, 1),
        number(g.state, unit, 1),
        number(g.auc_100mm, PERCENT, 1),
        number(g.overlap, PERCENT, 1),
    )


def comparison(results: Sequence[Result]) -> Table:
    """One row per dataset, box and category given."""
    columns = ("dataset", "photos", "failed", "rotation °", "state", "ADD mm", "ADD %", "aligned %")
    rows = tuple(
        (
            r.report.name,
            str(g.images),
            str(g.failures),
            number(g.whole.rotation.median.value, DEGREES, 1),
            ", ".join(
                f"{number(k.state.median.value, *_unit(k)[:1], 1)} {_unit(k)[1]}" for k in g.kinds
            ),
            number(g.whole.plain.add.median.value, MM, 1),
            number(g.whole.plain.add_share.median.value, PERCENT, 1),
            number(g.whole.aligned.add_share.median.value, PERCENT, 1),
            number(g.whole.plain.auc_100mm.value, PERCENT, 1),
            number(g.whole.plain.overlap.mean.value, PERCENT, 1),
            number(g.seconds.median.value, MS, 0),
        )
        for r in results
        for g in (r.given,)
    )
    title = "All datasets, box and category given: medians over all parts; ADD in % of the diagonal"
    return Table(title, (*columns, "AUC %", "3D IoU %", "ms"), rows)


def _unit(j: JointSummary) -> tuple[float, str]:
    return (DEGREES, "°") if j.kind == "revolute" else (CM, "cm")


def _state(j: JointSummary) -> str:
    unit, sign = _unit(j)
    return interval(j.state.median, unit, 1, f" {sign}")


def _time(s: Summary) -> str:
    return f"{number(s.seconds.median.value, MS, 1)} ms (p90 {number(s.seconds.p90, MS, 1)})"
