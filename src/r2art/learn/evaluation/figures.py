"""Plots of an evaluation: errors against what may cause them, their histograms, confidence.

All are of the predictions with box and category given. Failures have no finite error and are
left out; the titles tell their number.
"""

import io

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from r2art.core.palette import part_color
from r2art.learn.evaluation.calibration import BINS, least_confident_first, photo_errors
from r2art.learn.evaluation.causes import causes, grouped
from r2art.learn.evaluation.evaluate import Report
from r2art.learn.evaluation.scores import Scores
from r2art.learn.evaluation.summary import Summary
from r2art.learn.evaluation.tabulate import PERCENT, number

FloatArray = NDArray[np.floating]
BLUE, ORANGE, GREY = "#0072B2", "#D55E00", "#888888"
BARS = (8, 40)


def _png(figure: Figure) -> bytes:
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=100)
    return out.getvalue()


def _title(report: Report) -> str:
    failures = int(report.given.scores.failed.sum())
    return (
        f"{report.name}: {len(report.indices)} photos of {report.category.name}, box and category "
        f"given, {failures} failed"
    )


def _joint_errors(report: Report) -> list[tuple[str, FloatArray]]:
    """Heading and (N,) errors of every joint, in degrees or centimetres."""
    units = {"revolute": ("°", 180 / np.pi), "prismatic": ("cm", 100.0)}
    each = zip(report.category.joints, report.given.scores.state.T, strict=True)
    return [(f"error of {j.name}, {units[j.kind][0]}", units[j.kind][1] * e) for j, e in each]


def _panels(title: str, rows: int, columns: int) -> tuple[Figure, NDArray[np.object_]]:
    """A figure and (rows, columns) axes, placed by hand: matplotlib's own layouts take seconds."""
    width, height = 3.7 * columns, 2.7 * rows + 0.5
    figure = Figure(figsize=(width, height))
    axes = figure.subplots(rows, columns, squeeze=False)
    figure.subplots_adjust(
        left=0.65 / width,
        right=1 - 0.2 / width,
        bottom=0.6 / height,
        top=1 - 0.6 / height,
        wspace=0.28,
        hspace=0.35,
    )
    figure.suptitle(title, y=1 - 0.2 / height)
    return figure, axes


def errors(report: Report) -> bytes:
    """PNG: errors of position, rotation and joints (columns) against every cause (rows)."""
    scores, joints = report.given.scores, _joint_errors(report)
    position = 100 * photo_errors(scores)
    rotation = np.degrees(scores.rotation[:, 0])
    rows = causes(scores, report.category)
    figure, axes = _panels(_title(report), max(1, len(rows)), 2 + len(joints))
    for row, cause in zip(axes, rows, strict=False):  # one photo has no causes
        _scatter(row[0], cause.values, position, cause.name, "ADD aligned, % of diagonal")
        _scatter(row[1], cause.values, rotation, cause.name, "rotation of the root, °")
        for j, (label, error) in enumerate(joints):
            _scatter(row[2 + j], cause.joints[:, j], error, cause.joint_names[j], label)
    return _png(figure)


def _scatter(axes: Axes, x: FloatArray, y: FloatArray, xlabel: str, ylabel: str) -> None:
    """Dots, and the median in each of up to ten equally filled bins."""
    good = np.isfinite(y)
    x, y = x[good], y[good]
    axes.set(xlabel=xlabel, ylabel=ylabel)
    if not y.size:
        return
    axes.plot(x, y, ".", ms=3, alpha=0.35, color=BLUE)
    group = grouped(x, min(10, max(1, y.size // 10)))
    bins = [group == k for k in np.unique(group)]
    style = "-" if len(bins) > 1 else "_"
    axes.plot([np.median(x[b]) for b in bins], [np.median(y[b]) for b in bins], style, color=ORANGE)
    axes.set_ylim(0, max(1e-9, 1.2 * float(np.quantile(y, 0.97))))


def histograms(report: Report) -> bytes:
    """PNG: how often which error occurs, part by part and joint by joint."""
    s, diagonal = report.given.scores, report.given.scores.diagonal[:, None]
    names, joints = report.category.part_names, _joint_errors(report)
    of_parts = (
        ("ADD, mm", 1e3 * s.add),
        ("ADD, % of diagonal", 100 * s.add / diagonal),
        ("ADD aligned, % of diagonal", 100 * s.add_aligned / diagonal),
        ("ADD-S aligned, % of diagonal", 100 * s.add_s_aligned / diagonal),
        ("rotation, °", np.degrees(s.rotation)),
        ("centre, mm", 1e3 * s.translation),
        ("3D IoU, %", 100 * s.overlap),
        ("3D IoU aligned, %", 100 * s.overlap_aligned),
    )
    count = len(of_parts) + len(joints)
    figure, axes = _panels(_title(report), -(-count // 4), 4)
    axes = axes.ravel()
    for panel, (label, values) in zip(axes, of_parts, strict=False):
        _histogram(panel, label, values, names)
    for panel, (label, values) in zip(axes[len(of_parts) :], joints, strict=False):
        _histogram(panel, label, values[:, None], ("",))
    for unused in axes[count:]:
        unused.set_axis_off()
    if not s.failed.all():
        axes[0].legend(fontsize="small")
    return _png(figure)


def _histogram(axes: Axes, label: str, values: FloatArray, names: tuple[str, ...]) -> None:
    """One line per column, medians dashed; what exceeds the 98th percentile is in the last bar."""
    finite = values[np.isfinite(values)]
    axes.set(xlabel=label, ylabel="photos")
    if not finite.size:
        return
    end = max(float(np.quantile(finite, 0.98)), 1e-9)
    bars = int(np.clip(1.5 * len(values) ** 0.5, *BARS))
    edges = np.linspace(0, end, bars + 1)
    for part, name in enumerate(names):
        color = tuple(c / 255 for c in part_color(part)) if len(names) > 1 else BLUE
        column = values[np.isfinite(values[:, part]), part]
        heights, _ = np.histogram(np.minimum(column, end), edges)
        axes.stairs(heights, edges, color=color, label=name, lw=1.5)
        if column.size:
            axes.axvline(float(np.median(column)), color=color, ls="--", lw=1)
    axes.set_xlim(0, end)


def calibration(report: Report, summary: Summary) -> bytes:
    """PNG: the reliability diagram, and what rejecting unsure photos brings."""
    figure = Figure(figsize=(15, 4.4), layout="constrained")
    reliability, counts, rejection = figure.subplots(1, 3)
    found = summary.calibration
    filled = [b for b in found.bins if b.count]
    x, y = [b.confidence for b in filled], [b.right for b in filled]
    area = np.array([b.count for b in filled])
    reliability.plot([0, 1], [0, 1], color=GREY, ls="--", lw=1)
    reliability.plot(x, y, color=BLUE, lw=1)
    reliability.scatter(x, y, 10 + 190 * area / area.max(), color=BLUE)
    reliability.set(
        xlabel="confidence",
        ylabel="share of parts that are right",
        title=(
            f"calibration error {number(found.error.value, PERCENT, 1)} %, "
            f"AUROC {number(found.auroc.value, 1, 3)}"
        ),
        xlim=(0, 1.03),
        ylim=(0, 1.03),
    )
    counts.bar([b.low for b in found.bins], [b.count for b in found.bins], 1 / BINS, align="edge")
    counts.set(xlabel="confidence", ylabel="parts", xlim=(0, 1))
    _rejection(rejection, report.given.scores)
    figure.suptitle(_title(report))
    return _png(figure)


def _rejection(axes: Axes, scores: Scores) -> None:
    """Error and share of right photos among those kept, as the least confident are rejected."""
    kept = scores.all_right[least_confident_first(scores)]
    error = 100 * photo_errors(scores)[least_confident_first(scores)]
    n = int(np.ceil(0.95 * len(kept)))  # the last few photos would only show noise
    rejected = 100 * np.arange(n) / len(kept)
    axes.plot(rejected, [100 * kept[k:].mean() for k in range(n)], color=BLUE)
    axes.set(xlabel="least confident photos rejected, %", ylim=(0, 102))
    axes.set_ylabel("photos with all parts right, %", color=BLUE)
    other = axes.twinx()
    other.plot(rejected, [np.median(error[k:]) for k in range(n)], color=ORANGE)
    other.set_ylabel("median ADD aligned, % of diagonal", color=ORANGE)
    other.set_ylim(bottom=0)
