"""Joint states over time as a picture: the run tier has no plotting library, and needs none.

A panel per joint. The line is the smoothed state, the band one standard deviation to either side,
dots are what each frame says alone; where the background is lighter the object was not seen.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from r2art.core.legend import state_text
from r2art.core.palette import CARD, GREY, WHITE, Color, part_color
from r2art.core.pen import SUPERSAMPLE, font
from r2art.core.prediction import JointEstimate
from r2art.run.video.history import History

FloatArray = NDArray[np.floating]

PLOT, UNSEEN, GRID = (34, 37, 44), (62, 56, 44), (58, 62, 71)
LEGEND = "line: smoothed    band: ± 1 standard deviation    dots: each frame alone"
STEPS = (1, 2, 5, 10, 15, 30, 45, 60, 90, 180)
TIME_STEPS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 60, 120, 300, 600, 1800, 3600)
TICKS = 4
"""Most steps along an axis."""


@dataclass(frozen=True)
class Panel:
    """Where a joint's curve is drawn.

    Attributes:
        box: x1 y1 x2 y2 (px of the picture).
        start: Time (s) at its left ...
        end: ... and right side.
        low: State at its lower side ...
        high: ... and at its upper one.
    """

    box: tuple[float, float, float, float]
    start: float
    end: float
    low: float
    high: float

    def at(self, time: FloatArray, state: FloatArray) -> list[tuple[float, float]]:
        """Places (px) of points."""
        x1, y1, x2, y2 = self.box
        x = x1 + (np.asarray(time) - self.start) / (self.end - self.start) * (x2 - x1)
        share = (np.asarray(state) - self.low) / (self.high - self.low)
        y = y2 - np.clip(share, 0, 1) * (y2 - y1)
        return list(zip(x.tolist(), y.tolist(), strict=True))


def plot(history: History, width: int = 960) -> Image.Image:
    """All of a clip, a panel for each joint below the other."""
    unit = width / 960
    count = max(1, len(history.joints))
    size = (width, round((220 * count + 34) * unit))
    span = _span(history, 0.1)
    boxes = [(0, 220 * unit * k, width, 220 * unit * (k + 1)) for k in range(count)]
    picture = draw_panels(history, size, boxes, span, unit)
    pen = ImageDraw.Draw(picture)
    pen.text((64 * unit, size[1] - 20 * unit), LEGEND, GREY, font(14 * unit), "lm")
    return picture


def draw_panels(
    history: History,
    size: tuple[int, int],
    boxes: Sequence[tuple[float, float, float, float]],
    span: tuple[float, float],
    unit: float,
) -> Image.Image:
    """A picture with a joint's panel in each of ``boxes`` (px, with room for its labels)."""
    layer = Image.new("RGB", (SUPERSAMPLE * size[0], SUPERSAMPLE * size[1]), CARD)
    pen = ImageDraw.Draw(layer)
    panels = []
    for j, (joint, box) in enumerate(zip(history.joints, boxes, strict=False)):
        panel = _panel(joint, box, span, unit)
        panels.append(panel)
        fine = Panel(_scaled(panel.box), panel.start, panel.end, panel.low, panel.high)
        _draw_curve(pen, history, j, fine, SUPERSAMPLE * unit)
    picture = layer.reduce(SUPERSAMPLE)
    for j, panel in enumerate(panels):
        _write_labels(ImageDraw.Draw(picture), history, j, panel, unit)
    return picture


def _span(history: History, least: float) -> tuple[float, float]:
    times = history.times or [0.0]
    return times[0], max(times[-1], times[0] + least)


def _panel(
    joint: JointEstimate,
    box: tuple[float, float, float, float],
    span: tuple[float, float],
    unit: float,
) -> Panel:
    x1, y1, x2, y2 = box
    inner = (x1 + 64 * unit, y1 + 34 * unit, x2 - 20 * unit, y2 - 28 * unit)
    return Panel(inner, *span, *joint.limits)


def _scaled(box: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    x1, y1, x2, y2 = (SUPERSAMPLE * v for v in box)
    return x1, y1, x2, y2


def _draw_curve(
    pen: ImageDraw.ImageDraw, history: History, j: int, panel: Panel, unit: float
) -> None:
    x1, y1, x2, y2 = panel.box
    pen.rectangle(panel.box, PLOT)
    times = np.array(history.times)
    for k in np.flatnonzero(np.array(history.status) != "tracked"):
        until = times[min(k + 1, len(times) - 1)]
        (left, _), (right, _) = panel.at(np.array([times[k], until]), np.zeros(2))
        pen.rectangle((max(left, x1), y1, max(right, left + 1), y2), UNSEEN)
    for state in _ticks(history.joints[j]):
        ((_, y),) = panel.at(np.array([panel.start]), np.array([state]))
        pen.line([(x1, y), (x2, y)], GRID, max(1, round(unit)))
    color = part_color(j + 1)
    state, deviation = history.curve("states", j), history.curve("deviations", j)
    for run in _runs(state):
        upper = panel.at(times[run], (state + deviation)[run])
        lower = panel.at(times[run], (state - deviation)[run])
        if len(run) > 1:
            pen.polygon(upper + lower[::-1], _dimmed(color))
    alone = history.curve("measured", j)
    told = np.flatnonzero(np.isfinite(alone))
    for place in panel.at(times[told], alone[told]):
        pen.circle(place, 1.8 * unit, GREY)
    for run in _runs(state):
        places = panel.at(times[run], state[run])
        pen.line(places, color, round(2.4 * unit), "curve")
        pen.circle(places[-1], 1.6 * unit, color)


def _write_labels(
    pen: ImageDraw.ImageDraw, history: History, j: int, panel: Panel, unit: float
) -> None:
    joint = history.joints[j]
    x1, y1, x2, y2 = panel.box
    small = font(13 * unit)
    now = ""
    if history.states[-1]:
        now = f"{state_text(joint)} ± {state_text(joint, history.deviations[-1][j])}"
    title = font(17 * unit)
    if title.getlength(f"{joint.name}   {now}") > x2 - x1:
        title = small
    pen.text((x1, y1 - 15 * unit), joint.name, WHITE, title, "lm")
    pen.text((x2, y1 - 15 * unit), now, part_color(j + 1), title, "rm")
    for state in _ticks(joint):
        ((_, y),) = panel.at(np.array([panel.start]), np.array([state]))
        pen.text((x1 - 8 * unit, y), _tick_text(joint, state), GREY, small, "rm")
    step = _step(panel.end - panel.start, TIME_STEPS, 2 * TICKS)
    first = np.ceil(panel.start / step - 1e-6) * step
    for time in np.arange(first, panel.end + 1e-6, step):
        ((x, _),) = panel.at(np.array([time]), np.array([panel.low]))
        if x < x2 - 12 * unit:
            pen.text(
                (x, y2 + 12 * unit),
                f"{abs(time) if abs(time) < 1e-9 else time:g}"[:6],
                GREY,
                small,
                "mm",
            )
    pen.text((x2, y2 + 12 * unit), "s", GREY, small, "rm")


def _runs(values: FloatArray) -> list[NDArray[np.intp]]:
    """Stretches of indices without a gap."""
    told = np.flatnonzero(np.isfinite(values))
    return [r for r in np.split(told, np.flatnonzero(np.diff(told) > 1) + 1) if len(r)]


def _ticks(joint: JointEstimate) -> FloatArray:
    """States (rad, m) at whole degrees or centimetres."""
    unit = np.pi / 180 if joint.kind == "revolute" else 0.01
    low, high = (v / unit for v in joint.limits)
    step = _step(high - low, STEPS, TICKS)
    return np.arange(np.ceil(low / step) * step, high + 1e-9, step) * unit


def _tick_text(joint: JointEstimate, state: float) -> str:
    return f"{np.degrees(state):.0f}°" if joint.kind == "revolute" else f"{100 * state:.0f} cm"


def _step(length: float, steps: Sequence[float], most: int) -> float:
    return next((s for s in steps if length / s <= most), float(np.ceil(length / most)))


def _dimmed(color: Color) -> Color:
    r, g, b = (round(0.35 * c + 0.65 * p) for c, p in zip(color, PLOT, strict=True))
    return r, g, b
