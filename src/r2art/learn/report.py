"""An evaluation for people and programs: tables, Markdown, JSON, CSV, and the command itself.

Files for programs hold metres, radians and shares of 1; tables millimetres, degrees, percent.
"""

import csv
import hashlib
import io
import json
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

from r2art.core.errors import InputError
from r2art.data.shards import Dataset, write_atomically
from r2art.learn import figures
from r2art.learn.evaluate import Predict, Report, evaluate
from r2art.learn.results import write_section
from r2art.learn.scores import Scores
from r2art.learn.summary import JointSummary, PartSummary, Spread, Summary, summarise

FORMAT = "r2art/report/1"
MM, CM, PERCENT, DEGREES = 1e3, 1e2, 1e2, 180 / math.pi


@dataclass(frozen=True)
class Table:
    """Rows of text under a title, for the terminal and for Markdown alike."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def rich(self) -> RichTable:
        """The table for a terminal."""
        table = RichTable(title=self.title, title_justify="left", box=box.SIMPLE_HEAD)
        for k, column in enumerate(self.columns):
            table.add_column(column, justify="right" if k else "left")
        for row in self.rows:
            table.add_row(*map(Text, row))  # as Text, for in strings [0.1, 0.2] would be a style
        return table

    def markdown(self) -> str:
        """The table for a Markdown page."""
        rule = ["---"] + ["---:"] * (len(self.columns) - 1)
        lines = [f"| {' | '.join(row)} |" for row in (self.columns, rule, *self.rows)]
        return "\n".join([f"**{self.title}**", "", *lines])


def run_eval(
    data: Path,
    predict: Predict,
    model: Path,
    out: Path | None = None,
    limit: int | None = None,
    results: Path | None = None,
) -> Report:
    """`r2art eval`: evaluate, print the tables, and write what was asked for.

    Args:
        data: Folder that `r2art synth` has filled.
        predict: See `Predict`.
        model: The model file behind ``predict``; its checksum goes into the report.
        out: Folder for report.json, images.csv, report.md, errors.png and worst.png.
        limit: Only so many photos.
        results: Page whose section on this category is to be written anew.
    """
    if out is not None:
        _make_folder(out)
    report = evaluate(Dataset.open(data), predict, limit)
    given, found = (summarise(s, report.category) for s in (report.given, report.found))
    shown = tables(given, found)
    console = Console()
    if not console.is_terminal:
        console.width = 140  # a file or a pipe need not wrap
    for table in shown:
        console.print(table.rich())
    page = markdown(report, shown, data, model, limit)
    if results is not None:
        write_section(results, f"eval-{report.category.name}", page)
    if out is not None:
        write_atomically(out / "report.md", page.encode())
        write_atomically(out / "report.json", to_json(report, given, found, model).encode())
        write_atomically(out / "images.csv", to_csv(report).encode())
        write_atomically(out / "errors.png", figures.errors(report))
        write_atomically(out / "worst.png", figures.worst(report))
        Console(stderr=True).print(
            f"wrote {out}/report.md .json, images.csv, errors.png, worst.png"
        )
    return report


def tables(given: Summary, found: Summary) -> tuple[Table, ...]:
    """Overview, parts and joints; ``found`` only enters the overview."""
    overview = (
        ("images", str(given.images), str(found.images)),
        ("failures", str(given.failures), str(found.failures)),
        ("2D box IoU", "given", _interval(found.box, 1, 3)),
        ("category right", "given", f"{PERCENT * found.category_accuracy:.1f} %"),
        *((label, of(given), of(found)) for label, of in _OVERVIEW),
        *(
            (f"{g.kind} joint state", _state(g), _state(f))
            for g, f in zip(given.kinds, found.kinds, strict=True)
        ),
    )
    parts = (*given.parts, given.whole)
    together = given.kinds if len(given.joints) > 1 else ()
    return (
        Table("Overview: median [95 % interval] over all parts", ("", "given", "found"), overview),
        Table(
            "Parts, box and category given: median where nothing else is said",
            ("", *(p.name for p in parts)),
            tuple((label, *(of(p) for p in parts)) for label, of in _PARTS),
        ),
        Table(
            "Joints, box and category given",
            ("joint", "state", "mean", "p90", "axis °", "pivot mm"),
            tuple(_joint_row(j) for j in (*given.joints, *together)),
        ),
    )


_OVERVIEW: tuple[tuple[str, Callable[[Summary], str]], ...] = (
    ("rotation", lambda s: _interval(s.whole.rotation, DEGREES, 1) + " °"),
    ("rotation of the root", lambda s: _interval(s.parts[0].rotation, DEGREES, 1) + " °"),
    ("ADD, of the diagonal", lambda s: _interval(s.whole.add_share, PERCENT, 1) + " %"),
    ("the same, scale aligned", lambda s: _interval(s.whole.aligned_share, PERCENT, 1) + " %"),
    ("depth error", lambda s: _interval(s.depth, PERCENT, 1) + " %"),
    ("3D IoU, mean", lambda s: f"{s.whole.overlap.mean:.3f}"),
    ("confidence AUROC", lambda s: _number(s.whole.confidence_auroc, 1, 3)),
)


_PARTS: tuple[tuple[str, Callable[[PartSummary], str]], ...] = (
    ("ADD, mm", lambda p: _number(p.add.median, MM, 1)),
    ("ADD, mean, mm", lambda p: _number(p.add.mean, MM, 1)),
    ("ADD, 90th percentile, mm", lambda p: _number(p.add.p90, MM, 1)),
    ("ADD-S, mm", lambda p: _number(p.add_s.median, MM, 1)),
    ("AUC of ADD to 100 mm, %", lambda p: _number(p.auc_100mm, PERCENT, 1)),
    ("AUC of ADD to 10 % of ⌀, %", lambda p: _number(p.auc_diameter, PERCENT, 1)),
    ("ADD, % of diagonal", lambda p: _number(p.add_share.median, PERCENT, 1)),
    ("ADD aligned, % of diagonal", lambda p: _number(p.aligned_share.median, PERCENT, 1)),
    ("rotation, °", lambda p: _number(p.rotation.median, DEGREES, 1)),
    ("centre, mm", lambda p: _number(p.translation.median, MM, 1)),
    ("3D IoU, mean", lambda p: _number(p.overlap.mean, 1, 3)),
    ("confidence AUROC", lambda p: _number(p.confidence_auroc, 1, 3)),
)


def _state(j: JointSummary) -> str:
    unit, name = (DEGREES, "°") if j.kind == "revolute" else (CM, "cm")
    return f"{_interval(j.state, unit, 1)} {name}"


def _joint_row(j: JointSummary) -> tuple[str, ...]:
    unit = DEGREES if j.kind == "revolute" else CM
    return (
        j.name,
        _state(j),
        _number(j.state.mean, unit, 1),
        _number(j.state.p90, unit, 1),
        _number(j.axis.median, DEGREES, 1),
        _number(j.pivot.median, MM, 1) if j.pivot else "–",
    )


def _number(value: float, unit: float, digits: int) -> str:
    if math.isnan(value):
        return "–"
    return "∞" if math.isinf(value) else f"{unit * value:.{digits}f}"


def _interval(s: Spread, unit: float, digits: int) -> str:
    ends = ", ".join(_number(v, unit, digits) for v in (s.low, s.high))
    return f"{_number(s.median, unit, digits)} [{ends}]"


def synth_command(manifest: dict[str, Any], folder: str) -> str:
    """The command that makes the dataset again."""
    m = manifest
    if "source" in m:
        return f"r2art data convert {m['source']} --out {folder}"
    backgrounds = " --backgrounds DIR" if m["backgrounds"] else ""
    return (
        f"r2art synth {m['category']} -n {m['n']} --seed {m['seed']} --split {m['split']} "
        f"--size {m['size']}{backgrounds} --out {folder}"
    )


def markdown(
    report: Report, shown: tuple[Table, ...], data: Path, model: Path, limit: int | None
) -> str:
    """The section of `docs/results.md` on one category."""
    n, name, folder = len(report.indices), report.category.name, data.resolve().name
    size, checksum = describe(model)
    some = f" --limit {limit}" if limit is not None else ""
    facts = (
        f"{n} photos of {n} {name}s of the {report.manifest['split']} split, made by",
        f"`{synth_command(report.manifest, folder)}`,",
        f"predicted by `{model.name}` ({size:.1f} MB, SHA-256 `{checksum[:16]}`) with",
        f"`r2art eval --data {folder}{some} --results docs/results.md`.",
    )
    reading = (
        "*Given*: the model is told the object's 2D box and category, as in the literature; "
        "*found*: it is told neither. The camera is known in both. ADD is the mean distance of "
        "the model points; *aligned*: after the best common factor on the translations of each "
        "image, which one photo cannot tell. *Centre*: displacement of the part's box centre. "
        "p90: 90th percentile. AUROC: how well the confidence tells parts within 10 % of their "
        "diameter (aligned) from others. Failures count as infinitely wrong, except in means."
    )
    parts = [f"## Accuracy: {name}", "\n".join(facts), *(t.markdown() for t in shown), reading]
    return "\n\n".join(parts)


def describe(model: Path) -> tuple[float, str]:
    """Size (MB) and SHA-256 of a model file."""
    content = model.read_bytes()
    return len(content) / 1e6, hashlib.sha256(content).hexdigest()


def to_json(report: Report, given: Summary, found: Summary, model: Path) -> str:
    """Everything a table tells, in SI units; what is infinite or unknown is null."""
    size, checksum = describe(model)
    content = {
        "format": FORMAT,
        "units": {"length": "m", "angle": "rad"},
        "category": report.category.name,
        "dataset": report.manifest,
        "model": {"name": model.name, "megabytes": round(size, 3), "sha256": checksum},
        "given": asdict(given),
        "found": asdict(found),
    }
    return json.dumps(_finite(content), indent=1, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def to_csv(report: Report) -> str:
    """One row per photo and mode (given, found), in metres and radians."""
    out = io.StringIO()
    names = ("index", "mode", "message", *_columns(report))
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    for mode, scores in (("given", report.given), ("found", report.found)):
        n = len(report.indices)
        values = [np.reshape(getattr(scores, f.name), (n, -1)) for f in fields(Scores)]
        for i, row in enumerate(np.concatenate(values, axis=1)):
            message = report.messages[i] if mode == "given" else ""
            writer.writerow((report.indices[i], mode, message, *(f"{v:.6g}" for v in row)))
    return out.getvalue()


def _columns(report: Report) -> list[str]:
    parts = report.category.part_names
    joints = [j.name for j in report.category.joints]
    per = {"state": joints, "axis": joints, "pivot": joints, "true_state": joints}
    columns = []
    for f in fields(Scores):
        single = getattr(report.given, f.name).ndim == 1
        columns += [f.name] if single else [f"{f.name}.{n}" for n in per.get(f.name, parts)]
    return columns


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot write to {out}: {error.strerror}") from None
