"""Pictures of an evaluation: errors against what may cause them, and the worst photos."""

import io
import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from r2art.learn.evaluate import Case, Report
from r2art.learn.scores import truth

FloatArray = NDArray[np.floating]
TILE = 384  # px
COLUMNS = 4


def errors(report: Report) -> bytes:
    """PNG: errors of position, rotation and joints against azimuth and joint states."""
    scores, joints = report.given, report.category.joints
    azimuth = np.degrees(scores.azimuth)
    position = 100 * scores.aligned.mean(-1) / scores.diagonal
    rotation = np.degrees(scores.rotation[:, 0])
    columns = max(2, len(joints))
    figure = Figure(figsize=(3.8 * columns, 9), layout="constrained")
    axes = figure.subplots(3, columns, squeeze=False)
    _scatter(axes[0, 0], azimuth, position, "azimuth °", "ADD aligned, % of diagonal")
    _scatter(axes[0, 1], azimuth, rotation, "azimuth °", "rotation of the root °")
    for j, joint in enumerate(joints):
        unit, factor = ("°", 180 / math.pi) if joint.kind == "revolute" else ("cm", 100)
        error, label = factor * scores.state[:, j], f"error of {joint.name} {unit}"
        _scatter(axes[1, j], azimuth, error, "azimuth °", label)
        _scatter(axes[2, j], factor * scores.true_state[:, j], error, f"true state {unit}", label)
    for unused in axes.flat:
        if not unused.get_xlabel():
            unused.set_axis_off()
    figure.suptitle(f"{report.category.name}: {len(azimuth)} photos, box and category given")
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=120)
    return out.getvalue()


def _scatter(axes: Axes, x: FloatArray, y: FloatArray, xlabel: str, ylabel: str) -> None:
    """Dots, and the median in each of ten equally filled bins; failures are left out."""
    good = np.isfinite(y)
    x, y = x[good], y[good]
    axes.set(xlabel=xlabel, ylabel=ylabel)
    if not y.size:
        return
    axes.plot(x, y, ".", ms=3, alpha=0.35, color="#0072B2")
    bins = np.array_split(np.argsort(x), min(10, max(1, y.size // 5)))
    axes.plot([np.median(x[b]) for b in bins], [np.median(y[b]) for b in bins], color="#D55E00")
    axes.set_ylim(0, max(1e-9, 1.2 * float(np.quantile(y, 0.97))))


def worst(report: Report) -> bytes:
    """PNG: the worst photos with box and category given; left the truth, right the prediction."""
    rows = -(-len(report.worst) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * 2 * TILE, rows * (TILE + 24)), "white")
    for k, case in enumerate(report.worst):
        left, top = k % COLUMNS * 2 * TILE, k // COLUMNS * (TILE + 24)
        truly = truth(case.sample, report.category).draw(case.sample.image)
        said = case.prediction.draw(case.sample.image) if case.prediction else None
        for picture, x in ((truly, left), (said, left + TILE)):
            if picture is not None:
                picture.thumbnail((TILE - 4, TILE))
                sheet.paste(picture, (x, top + 24))
        pen = ImageDraw.Draw(sheet)
        pen.text((left + 4, top + 4), _caption(case), "black", ImageFont.load_default(15))
    out = io.BytesIO()
    sheet.save(out, "PNG")
    return out.getvalue()


def _caption(case: Case) -> str:
    if case.prediction is None:
        return f"#{case.index}: truth | no prediction"
    rotation = math.degrees(case.scores.rotation[0])
    return f"#{case.index}: truth | aligned ADD {100 * case.badness:.0f} %, root {rotation:.0f}°"
