"""The blade of a cutter with its slider."""

import numpy as np

from r2art.data.categories.cutter.handle import Shell
from r2art.data.categories.cutter.style import CutterStyle
from r2art.data.procedural.curved import prism
from r2art.data.procedural.profiles import arch, curve
from r2art.data.procedural.randomness import between, chance
from r2art.data.procedural.sheets import draped, loft
from r2art.data.procedural.solids import box, xyz
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
_LINE = Material(color=(0.3, 0.3, 0.31), roughness=0.5, metallic=0.6)
_HOLE = Material(color=(0.05, 0.05, 0.05), roughness=0.6)


def blade(rng: np.random.Generator, style: CutterStyle, handle: Shell) -> list[Surface]:
    """All that slides, drawn in."""
    blade_rng, slider_rng = rng.spawn(2)
    low = style.slot_span[0]
    tail = low + (0.5 if style.trapezoid else 0.15) * style.slider[0]
    return [*_steel(blade_rng, style, tail), *_slider(slider_rng, style, handle, low)]


def _steel(rng: np.random.Generator, style: CutterStyle, tail: float) -> list[Surface]:
    wide, thick = style.blade
    edge, spine = -wide / 2, wide / 2
    bevel = edge + wide * between(rng, 0.09, 0.2)
    tip = style.length / 2 - between(rng, 0.0, 0.003) + (0.0 if chance(rng, 0.6) else 0.0015)
    front = between(rng, 0.6, 0.72) if style.trapezoid else between(rng, 0.52, 0.62)
    rear = front if style.trapezoid else 0.0
    if style.trapezoid:
        tail = tip - between(rng, 0.056, 0.061)
    section = np.array(
        [
            (spine, -thick / 2),
            (spine, thick / 2),
            (bevel, thick / 2),
            (edge, 0.0),
            (bevel, -thick / 2),
        ]
    )
    away = section[:, 0] - edge
    ends = (tail + rear * away, tip - front * away)
    rows = np.stack([np.column_stack([section, z]) for z in ends])
    look = Material(
        color=style.steel.color,
        texture=style.steel.texture,
        roughness=between(rng, 0.28, 0.45),
        metallic=0.95,
    )
    ground = Material(color=(0.86, 0.86, 0.87), roughness=between(rng, 0.28, 0.42), metallic=0.95)
    pieces = [loft(rows, look, angle=0.1, tile=0.05)]
    for k in ((2, 3), (3, 4)):  # the ground edge, on both faces
        pieces.append(draped(rows[:, list(k)], ground, lift=2e-5))
    if style.trapezoid:
        return pieces + _notches(rng, style, tail, tip)
    return pieces + _scores(rng, style, (tail, tip), front)


def _scores(
    rng: np.random.Generator, style: CutterStyle, span: tuple[float, float], slope: float
) -> list[Surface]:
    """Lines along which the blade snaps, on both faces."""
    wide, thick = style.blade
    step = 0.005 if wide < 0.01 else 0.01
    half = 0.00022
    x = np.array([-wide / 2, wide / 2])
    pieces = []
    for place in np.arange(span[1] - step, span[0] + step, -step):
        z = place - slope * (x - x[0])
        for up, order in ((1, 1), (-1, -1)):
            y = up * thick / 2
            rows = np.array([[(x[k], y, z[k] + dz) for dz in (-half, half)] for k in (0, 1)])
            pieces.append(draped(rows[:, ::order], _LINE, lift=4e-5))
    return pieces


def _notches(
    rng: np.random.Generator, style: CutterStyle, tail: float, tip: float
) -> list[Surface]:
    """Where the holder grips a trapezoid blade."""
    wide, thick = style.blade
    middle, spine = (tail + tip) / 2, wide / 2
    pieces = []
    for dz in (-0.0045, 0.0045) if chance(rng, 0.6) else (0.0,):
        for up in (1, -1):
            x, z = np.array([spine - 0.0035, spine]), middle + dz + np.array([-0.0014, 0.0014])
            rows = np.array([[(a, up * thick / 2, b) for b in z] for a in x])
            pieces.append(draped(rows[:, ::up], _HOLE, lift=4e-5))
    return pieces


def _slider(
    rng: np.random.Generator, style: CutterStyle, handle: Shell, low: float
) -> list[Surface]:
    """The thumb slider outside, its neck through the slot, the carrier of the blade inside."""
    long, tall, form = style.slider
    wide, span = style.blade[0], (low, low + long + style.travel)
    neck = style.slot_half - 3e-4
    reach = 0.3 * long
    middle = low + long / 2
    inner = style.cavity - 4e-4
    carrier = box(
        (-0.3 * wide, -inner, low + 0.001), (0.5 * wide, inner, low + 0.9 * long), style.accent
    )
    if style.slot == "back":
        surface = handle.back(*span) + 2e-4
        stem = box(
            (0.4 * wide, -neck, middle - reach), (surface, neck, middle + reach), style.button
        )
        half = 0.85 * handle.top(middle - 1e-3, middle + style.travel)
        half = max(min(half, 0.0075), neck + 0.0008)
        turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        place = xyz(surface, 0, 0)
    else:
        surface = handle.top(*span) + 2e-4
        x = style.lateral
        stem = box((x - neck, 0, middle - reach), (x + neck, surface, middle + reach), style.button)
        half = max(min(0.32 * (style.back + wide / 2), 0.007), neck + 0.0012)
        turn, place = np.eye(3), xyz(x, surface, 0)
    if form == "wheel":
        return [carrier, stem, *_wheel(style, place + xyz(0, 0, middle), tall, 0.5 * long)]
    pad = _pad(rng, form, long, tall, half) @ turn
    return [carrier, stem, loft(pad + place + xyz(0, 0, low), style.button, angle=0.5)]


def _pad(rng: np.random.Generator, form: str, long: float, tall: float, half: float) -> FloatArray:
    """Rows of a ribbed pad that lies on y = 0, its z from 0 to ``long``."""
    ribs = max(4, round(long / between(rng, 0.0016, 0.0026)))
    z = np.concatenate([[0.0], (np.arange(2 * ribs) + 0.5) / (2 * ribs) * long, [long]])
    shape = {
        "hump": [(0, 0.5), (0.35, 0.75), (0.6, 0.8), (1, 0.45)],
        "ramp": [(0, 0.3), (0.5, 0.6), (0.85, 1.0), (1, 0.8)],
        "flat": [(0, 0.5), (0.1, 0.6), (0.9, 0.6), (1, 0.5)],
    }[form]
    top = tall * curve(z / long, shape)
    groove = np.concatenate([[0.0], np.tile([0.0, 0.0, 1.0, 1.0], ribs)[: 2 * ribs], [0.0]])
    top = top - 0.0006 * groove
    return arch(z, half, 0.0, top, 0.0008, segments=2)


def _wheel(style: CutterStyle, center: FloatArray, tall: float, radius: float) -> list[Surface]:
    """A knurled screw that clamps the blade."""
    radius = min(radius, 0.009)
    angle = np.arange(48) * 2 * np.pi / 48
    reach = radius * np.where(np.arange(48) % 4 < 2, 1.0, 0.92)
    x, z = center[0] + reach * np.cos(angle), center[2] - reach * np.sin(angle)
    outline = np.column_stack([x, -z])
    return [*prism(outline, 1, (center[1], center[1] + tall + 0.002), style.button)]
