"""The handle of a cutter: a shell around the blade's channel, with slot, nose and grips."""

from dataclasses import dataclass

import numpy as np

from r2art.data.categories.cutter.style import CutterStyle
from r2art.data.procedural.profiles import curve, rounded, stations
from r2art.data.procedural.randomness import between, chance
from r2art.data.procedural.sheets import sheet
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
_DARK = Material(color=(0.035, 0.035, 0.037), roughness=0.7)
_ARC = 4  # segments of each rounded edge
# Columns of a ring, counter-clockwise seen from the nose: where its flat pieces begin.
TOP, LEFT, BOTTOM = _ARC + 2, 2 * _ARC + 5, 3 * _ARC + 8
COLUMNS = 4 * _ARC + 12
TILE = 0.05  # m


@dataclass(frozen=True)
class Shell:
    """The handle's outside as rings of `COLUMNS` points, and the place (m) of each along z."""

    z: FloatArray
    grid: FloatArray

    def row(self, z: float) -> float:
        """Fractional row at a place along z."""
        return float(np.interp(z, self.z, np.arange(len(self.z))))

    def top(self, low: float, high: float) -> float:
        """Greatest height between two places along z."""
        return float(self._between(low, high)[..., 1].max())

    def back(self, low: float, high: float) -> float:
        """Greatest reach to x > 0 between two places along z."""
        return float(self._between(low, high)[..., 0].max())

    def _between(self, low: float, high: float) -> FloatArray:
        return self.grid[(self.z >= low - 1e-9) & (self.z <= high + 1e-9)]


def shell(rng: np.random.Generator, style: CutterStyle) -> tuple[Shell, list[Surface]]:
    """The handle's body, hollow, open at the nose and along the slot."""
    end = style.length / 2
    hole = None
    if chance(rng, 0.45) and style.slot_span[0] + end > 0.018:
        low = -end + max(style.ends[0] * 0.6, 0.0035)
        hole = low, min(low + between(rng, 0.004, 0.008), style.slot_span[0] - 0.003)
    places = stations(-end, style.nose, 0.005, style.ends)
    marks = np.array([*style.slot_span, *(hole or ())])
    free = np.abs(places[:, None] - marks).min(axis=1) > 0.0012
    free[[0, -1]] = True
    z = np.sort(np.concatenate([places[free], marks]))
    half = _half_thickness(style, z)
    left, right = _sides(style, z)
    grid = _slanted(style, rings(style, z, (left, right), half, style.round))
    wide = style.blade[0] / 2 + 4e-4
    cavity = np.array([wide, style.cavity, np.inf])
    inner = np.clip(grid, -cavity, cavity)
    inner[0] = (0.0, 0.0, z[0])
    if style.rail == 0:  # only a slit
        slit = np.array([wide, style.blade[1] / 2 + 2.5e-4, np.inf])
        inner[-1] = np.clip(grid[-1], -slit, slit)
    holes = np.zeros((len(z) - 1, COLUMNS), bool)
    middle = (z[1:] + z[:-1]) / 2
    slotted = (middle > style.slot_span[0]) & (middle < style.slot_span[1])
    holes[slotted, COLUMNS - 1 if style.slot == "back" else TOP] = True
    if hole:
        holed = (middle > hole[0]) & (middle < hole[1])
        holes[holed, TOP] = holes[holed, BOTTOM] = True
    rear, front = inner[:1], inner[-1:]  # both end faces belong to the outside
    surfaces = sheet(
        np.concatenate([rear, grid, front]),
        np.concatenate([rear, inner, front]),
        style.body,
        inside=_DARK,
        wrap=True,
        holes=np.pad(holes, ((1, 1), (0, 0))),
        tile=TILE,
    )
    return Shell(z, grid), list(surfaces)


def _half_thickness(style: CutterStyle, z: FloatArray) -> FloatArray:
    retreat = rounded(z, -style.length / 2, style.nose, style.ends)
    half = curve(z, style.thick)
    return np.maximum(half - 0.7 * retreat, np.minimum(half, style.cavity + 0.0008))


def _sides(style: CutterStyle, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    retreat = rounded(z, -style.length / 2, style.nose, style.ends)
    least = style.blade[0] / 2 + 0.0009
    behind = z < 0  # the blade's channel needs no room in the rear end
    left = curve(z, style.belly) - retreat
    taper = [(style.slot_span[1], style.back), (style.nose, least + style.shoulder)]
    right = curve(z, taper) - retreat
    room = np.where(behind, 0.3 * least, least)
    return -np.maximum(left, room), np.maximum(right, room)


def _slanted(style: CutterStyle, grid: FloatArray) -> FloatArray:
    """The nose cut off at a slant, its rows behind following more and more."""
    start = style.slot_span[1]
    share = np.clip((grid[..., 2] - start) / (style.nose - start), 0, 1)
    across = grid[..., 0] - grid[-1, :, 0].min()
    grid[..., 2] -= share * np.minimum(style.slant * across, 0.7 * (style.nose - start))
    return grid


def rings(
    style: CutterStyle,
    z: FloatArray,
    sides: tuple[FloatArray, FloatArray],
    half: FloatArray,
    radii: tuple[float, float],
) -> FloatArray:
    """(K, COLUMNS, 3) cross sections that begin and end at the slot in the narrow side.

    Args:
        style: Tells where the slots are.
        z: (K,) place of each.
        sides: (K,) reach to x < 0 and to x > 0.
        half: (K,) half the thickness.
        radii: Of the edges, across and upright, as shares of the most that fits.
    """
    left, right = sides
    slot = style.slot_half if style.slot == "back" else style.cavity * 0.5
    slot = np.minimum(slot, half - 2e-4)
    middle = np.clip(style.lateral, left + 0.003, right - 0.003)
    width = style.slot_half if style.slot == "face" else 0.002
    across = radii[0] * np.minimum(right - middle, middle - left) * 0.98
    across = np.minimum(across, np.minimum(right - middle, middle - left) - width - 3e-4)
    across = np.maximum(across, 1e-4)
    upright = np.maximum(radii[1] * (half - slot) * 0.98, 1e-4)
    angle = np.linspace(0, np.pi / 2, _ARC + 1)
    cos, sin = np.cos(angle), np.sin(angle)

    def column(*values: FloatArray | float) -> FloatArray:
        return np.stack([np.broadcast_to(v, z.shape) for v in values], axis=-1)

    outer_right = (right - across)[:, None] + across[:, None] * cos
    outer_left = (left + across)[:, None] - across[:, None] * cos
    high = (half - upright)[:, None] + upright[:, None] * sin
    x = [
        column(right),
        outer_right,
        column(middle + width, middle - width),
        outer_left[:, ::-1],
        column(left, left),
        outer_left,
        column(middle - width, middle + width),
        outer_right[:, ::-1],
        column(right),
    ]
    flat = column(half, half)
    y = [column(slot), high, flat, high[:, ::-1], column(slot, -slot)]
    y += [-high, -flat, -high[:, ::-1], column(-slot)]
    deep = np.broadcast_to(z[:, None], (len(z), COLUMNS))
    return np.stack([np.concatenate(x, axis=1), np.concatenate(y, axis=1), deep], axis=-1)


def rail(style: CutterStyle) -> list[Surface]:
    """The steel channel that guides a snap-off blade and stands out of the nose."""
    wide = style.blade[0] / 2 + 3.5e-4
    thin = 3e-4
    z = np.array([style.slot_span[0] + 0.002, style.nose, style.length / 2])
    flat = np.broadcast_to
    half = flat(style.cavity - 5e-5, z.shape)
    grid = rings(style, z, (flat(-wide, z.shape), flat(wide, z.shape)), half, (0.1, 0.5))
    slant = 0.5 * (grid[-1, :, 0] + wide)
    grid[-1, :, 2] -= np.minimum(slant, 0.9 * style.rail)
    inside = np.array([wide - thin, style.cavity - 5e-5 - thin, np.inf])
    holes = np.zeros((2, COLUMNS), bool)
    holes[:, COLUMNS - 1 if style.slot == "back" else TOP] = True
    return [*sheet(grid, np.clip(grid, -inside, inside), style.steel, wrap=True, holes=holes)]
