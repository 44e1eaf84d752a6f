"""The arm of a stapler: magazine with staples, driver, cover with its prints.

Built as pressed down, level on the base; `rest_tilt` lifts it to where its spring holds it.
"""

from dataclasses import dataclass

import numpy as np

from r2art.core.category import Joint
from r2art.data.categories.stapler.magazine import magazine
from r2art.data.categories.stapler.style import StaplerStyle
from r2art.data.pose import joint_matrix, transformed
from r2art.data.procedural.brands import brand
from r2art.data.procedural.curved import ellipsoid
from r2art.data.procedural.profiles import arch, curve, rounded, stations
from r2art.data.procedural.randomness import between, chance, pick
from r2art.data.procedural.sheets import draped, sampled, sheet
from r2art.data.procedural.solids import box, cylinder, plate
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
_DARK = Material(color=(0.07, 0.07, 0.075), roughness=0.5)
_TILE = 0.06  # m


@dataclass(frozen=True)
class Cover:
    """The outside of the cover as a grid, and the places (m) of its rows along z."""

    z: FloatArray
    grid: FloatArray

    def row(self, z: float) -> float:
        """Fractional row at a place along z."""
        return float(np.interp(z, self.z, np.arange(len(self.z))))

    def column(self, x: float) -> float:
        """Fractional column at a place across, in the middle row."""
        across = self.grid[len(self.z) // 2, :, 0]
        return float(np.interp(-x, -across, np.arange(self.grid.shape[1])))


def arm(rng: np.random.Generator, style: StaplerStyle) -> list[Surface]:
    """All that turns about the hinge, at rest."""
    cover_rng, inner_rng, print_rng = rng.spawn(3)
    pieces = magazine(inner_rng, style) + _driver(style)
    if style.kind == "heavy":
        pieces += _head(inner_rng, style)
    if style.reach < style.length:
        pieces += _beam(inner_rng, style)
    shell = _turned(_cover(cover_rng, print_rng, style), style.lift, style, _cover_rear(style))
    return _turned(pieces + shell, style.gap, style, style.hinge[1])


def _turned(pieces: list[Surface], rise: float, style: StaplerStyle, place: float) -> list[Surface]:
    """Turned about a line at hinge height so that the front rises by ``rise`` (m)."""
    joint = Joint(
        name="rest",
        kind="revolute",
        parent=0,
        axis=(-1.0, 0.0, 0.0),
        pivot=(0.0, style.hinge[0], place),
        limits=(0.0, 1.0),
    )
    motion = joint_matrix(joint, float(np.arcsin(rise / (style.mouth - place))))
    return [transformed(piece, motion) for piece in pieces]


def _cover_rear(style: StaplerStyle) -> float:
    """Where along z the cover is hinged."""
    return max(style.hinge[1], style.mouth - style.reach)


def _driver(style: StaplerStyle) -> list[Surface]:
    """The blade that drives the staples, from within the magazine up into the cover."""
    half, height = style.magazine
    z = style.mouth - 0.0024
    inner = _cover_grid(style, style.wall)
    ceiling = float(sampled(inner.grid, inner.row(z - 0.002), 6.5)[1])
    low, high = style.floor + 0.6 * height, ceiling + 0.93 * style.lift - 0.0005
    wide = 0.75 * half
    if high < low + 0.002:
        return []
    return [box((-wide, low, z - 0.004), (wide, high, z), style.steel)]


def _head(rng: np.random.Generator, style: StaplerStyle) -> list[Surface]:
    """The guide around the driver of a heavy-duty stapler."""
    half, height = style.magazine
    low = style.floor + between(rng, 0.1, 0.5) * height
    high = style.floor + height + between(rng, 0.5, 0.8) * style.lift
    look = pick(rng, (style.steel, style.cover, style.base))
    x, long = half + 0.0012, between(rng, 0.016, 0.035)
    inside = max(style.cover_half[2] - style.wall - x - 0.0004, 0.0)
    x += min(inside, between(rng, 0.0, 0.002))
    z = style.mouth + 0.0012
    return [*plate((-x, low, z - long), (x, high, z), 1, look, radius=0.003, bevel=0.001)]


def _beam(rng: np.random.Generator, style: StaplerStyle) -> list[Surface]:
    """What carries the head of a long-reach stapler."""
    half, height = style.magazine
    rear, front = style.hinge[1] - style.heel, style.mouth - 0.8 * style.reach
    low, high = style.floor + 0.001, style.floor + height + between(rng, 0.0, 0.006)
    look = pick(rng, (style.cover, style.steel, style.base))
    x = half + between(rng, 0.0002, 0.0012)
    high = min(high, style.hinge[0] + style.tail)
    return [*plate((-x, low, rear), (x, high, front), 0, look, radius=0.004, bevel=0.0015)]


def _cover(
    rng: np.random.Generator, print_rng: np.random.Generator, style: StaplerStyle
) -> list[Surface]:
    cover = _cover_grid(style, 0.0)
    inner = _cover_grid(style, style.wall)
    inside = _DARK if chance(rng, 0.3) else style.cover
    if style.kind == "vintage":
        inside = style.steel
    pieces = [*sheet(cover.grid, inner.grid, style.cover, inside=inside, tile=_TILE)]
    if style.kind == "vintage" and chance(rng, 0.5):
        pieces += _press_knob(rng, style, cover)
    return pieces + _prints(print_rng, style, cover)


def _cover_grid(style: StaplerStyle, inset: float) -> Cover:
    """The cover's outside, or what lies ``inset`` below it."""
    top_of_magazine = style.floor + style.magazine[1]
    rear, front = _cover_rear(style), style.mouth + style.overhang
    start = rear - style.tail
    nose, fall = style.nose
    z = stations(start, front, 0.008, (style.tail, nose))
    span = front - rear
    share = (0.0, 0.35, 0.7, 1.0)
    crown = curve(
        z,
        [
            (rear + s * span, top_of_magazine + style.crown * c)
            for s, c in zip(share, style.crown_shape, strict=True)
        ],
    )
    skirt = curve(
        z,
        [
            (rear, top_of_magazine - style.skirt[0] * style.magazine[1]),
            (front - 0.5 * span, top_of_magazine - style.skirt[1] * style.magazine[1]),
            (front, top_of_magazine - style.skirt[1] * style.magazine[1]),
        ],
    )
    behind = rounded(z, start, front, (style.tail, 0.0)) / style.tail
    ahead = rounded(z, start, front, (0.0, nose)) / nose
    level = style.hinge[0]
    top = crown + behind * (level + 0.15 * style.tail - crown) - ahead * fall * (crown - skirt)
    bottom = skirt + behind * (level - 0.15 * style.tail - skirt)
    half = curve(
        z,
        [
            (rear, style.cover_half[0]),
            (rear + 0.5 * span, style.cover_half[1]),
            (front, style.cover_half[2]),
        ],
    )
    half = half - 0.35 * (half - 0.5 * style.magazine[0]) * ahead
    top = np.maximum(top - inset, bottom + 2e-4)
    across = (half - inset) * _roundness(style)
    rows = arch(
        np.clip(z, start + inset, front - inset),
        half - inset,
        bottom,
        top,
        (across, np.maximum(0.75 * style.crown * _roundness(style) + 0.001 - inset, 5e-4)),
        segments=5,
    )
    return Cover(z, rows)


def _roundness(style: StaplerStyle) -> float:
    return {"vintage": 0.25, "modern": 0.85, "heavy": 0.4}.get(style.kind, 0.6)


def _press_knob(rng: np.random.Generator, style: StaplerStyle, cover: Cover) -> list[Surface]:
    """The round head on which old staplers are struck."""
    radius = style.cover_half[2] * between(rng, 1.05, 1.5)
    z = style.mouth - radius * between(rng, 0.6, 1.0)
    y = float(sampled(cover.grid, cover.row(z), 6.5)[1])
    look = pick(rng, (style.cover, style.steel, style.accent))
    tall = between(rng, 0.003, 0.007)
    disc = cylinder((0, y + tall / 2 - 0.001, z), 1, radius, tall, look, segments=18, bevel=0.0012)
    if chance(rng, 0.5):
        return [*disc]
    dome = ellipsoid((0, 0, 0), (radius, radius, tall), look, polar=(0, np.pi / 2), segments=17)
    x, up, front = np.eye(3)
    turn = np.stack([x, -front, up])
    place = np.array([0, y - 0.0005, z])
    return [
        Surface(
            vertices=place + dome.vertices @ turn,
            faces=dome.faces,
            normals=dome.normals @ turn,
            uv=dome.uv,
            material=look,
        )
    ]


def _prints(rng: np.random.Generator, style: StaplerStyle, cover: Cover) -> list[Surface]:
    """Name, grip inlay, stickers."""
    rear, front = _cover_rear(style), style.mouth + style.overhang - style.nose[0]
    span = front - rear
    pieces: list[Surface] = []
    if style.kind in ("modern", "heavy", "classic", "mini") and chance(rng, 0.4):
        ends = (rear + between(rng, 0.3, 0.6) * span, front + 0.4 * style.nose[0])
        places = stations(*ends, 0.01, (0.005, 0.005))
        retreat = rounded(places, *ends, (0.005, 0.005)) / 0.005
        rows = np.array([cover.row(z) for z in places])
        edge = between(rng, 2.5, 5.0)
        across = np.linspace(-1, 1, 9) * (1 - 0.5 * retreat)[:, None]
        grid = sampled(cover.grid, rows[:, None], 6.5 + (6.5 - edge) * across)
        pieces.append(draped(grid, style.accent, lift=4e-4))
    if chance(rng, 0.75):
        pieces += _name(rng, style, cover, rear, span)
    return pieces


def _name(
    rng: np.random.Generator, style: StaplerStyle, cover: Cover, rear: float, span: float
) -> list[Surface]:
    """The maker's name on top, or on both sides."""
    look, aspect = brand(rng, style.cover)
    on_top = chance(rng, 0.5)
    tall = style.cover_half[1] * 0.55 if on_top else 0.35 * style.crown + 0.0012
    long = min(aspect * tall, 0.5 * span)
    middle = rear + span * between(rng, 0.3, 0.7)
    rows = np.linspace(cover.row(middle - long / 2), cover.row(middle + long / 2), 9)
    if on_top:
        columns = np.linspace(cover.column(tall / 2), cover.column(-tall / 2), 5)
        grid = sampled(cover.grid, rows, columns[:, None])
        return [draped(grid[:, ::-1] if chance(rng, 0.5) else grid[::-1], look)]
    right = sampled(cover.grid, rows[::-1], np.linspace(0.35, 0.8, 3)[:, None])
    left = sampled(cover.grid, rows, np.linspace(12.65, 12.2, 3)[:, None])
    return [draped(right, look), draped(left, look)]
