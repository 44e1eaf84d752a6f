"""The magazine of a stapler: its channel, the strip of staples, pusher and rod."""

import numpy as np

from r2art.data.categories.stapler.style import StaplerStyle
from r2art.data.procedural.randomness import between, chance, pick
from r2art.data.procedural.sheets import sheet
from r2art.data.procedural.solids import box, cylinder, decal, plate
from r2art.data.procedural.textures import Texture, seamless
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
_DARK = Material(color=(0.07, 0.07, 0.075), roughness=0.5)
_TILE = 0.06  # m


def magazine(rng: np.random.Generator, style: StaplerStyle) -> list[Surface]:
    """The channel that holds the staples, pressed down, open at the top."""
    half, height = style.magazine
    wall, floor = 0.0008, style.floor
    rear = max(style.hinge[1] - style.heel, style.mouth - style.reach)
    z = np.array([rear, style.mouth - 0.0012])
    outer = _channel(half, floor, floor + height, z)
    inner = _channel(half - wall, floor + wall, floor + height, z)
    pieces = [*sheet(outer, inner, style.steel, tile=_TILE)]
    # the front plate, in front of the slit through which the staples leave
    high = floor + height + between(rng, 0.0, 0.004)
    pieces += plate(
        (-half, floor, style.mouth - 0.0012), (half, high, style.mouth), 2, style.steel, radius=8e-4
    )
    pieces += _slots(rng, style, (-half, floor, rear), (half, floor + height, style.mouth))
    return pieces + _staples(rng, style, rear, wall)


def _channel(half: float, low: float, high: float, z: FloatArray) -> FloatArray:
    """(K, 4, 3) rows of a U that opens upwards, from its left edge to its right."""
    corners = np.array([(-half, high), (-half, low), (half, low), (half, high)])
    flat = np.broadcast_to(corners, (len(z), 4, 2))
    return np.concatenate([flat, np.broadcast_to(z[:, None, None], (len(z), 4, 1))], axis=-1)


def _slots(
    rng: np.random.Generator,
    style: StaplerStyle,
    low: tuple[float, float, float],
    high: tuple[float, float, float],
) -> list[Surface]:
    """The slit through which staples leave, and openings along the underside and the sides."""
    half, long = style.magazine[0], high[2] - low[2]
    at = 1 - 0.003 / long  # the underside is seen with the mouth up
    pieces = [decal(low, high, "bottom", _DARK, at=(0.5, at), size=(1.8 * half, 0.0016), lift=2e-4)]
    if chance(rng, 0.7):
        share = between(rng, 0.3, 0.75)
        size = (half * between(rng, 0.3, 0.8), share * long)
        place = (0.5, between(rng, 0.1, 0.9 - share) + share / 2)
        pieces.append(decal(low, high, "bottom", _DARK, at=place, size=size, lift=2e-4))
    if chance(rng, 0.4):
        size = (between(rng, 0.2, 0.6) * long, 0.0014)
        at = between(rng, 0.35, 0.65)
        for side, along in (("right", 1 - at), ("left", at)):
            place = (along, 0.35)
            pieces.append(decal(low, high, side, _DARK, at=place, size=size, lift=2e-4))
    return pieces


def _staples(
    rng: np.random.Generator, style: StaplerStyle, rear: float, wall: float
) -> list[Surface]:
    """A strip of staples with the pusher and its rod behind."""
    half, height = style.magazine
    low, front = style.floor + wall, style.mouth - 0.0016
    room = front - rear - 0.02
    long = room * between(rng, 0.15, 0.85)
    strip = Material(
        color=(0.8, 0.8, 0.81), texture=_staple_strip(rng), roughness=0.3, metallic=0.9
    )
    wide, tall = half - wall - 0.0003, min(0.006, 0.7 * height)
    pieces = [box((-wide, low, front - long), (wide, low + tall, front), strip, tile=0.008)]
    behind = front - long
    look = pick(rng, (style.steel, _DARK, style.accent))
    pieces.append(box((-wide, low, behind - 0.012), (wide, low + tall + 0.0015, behind), look))
    rod = behind - 0.012 - rear
    if rod > 0.01:
        middle = (0, low + 0.5 * tall, rear + rod / 2)
        pieces += cylinder(middle, 2, 0.0018, rod, style.steel, segments=8)
    return pieces


def _staple_strip(rng: np.random.Generator) -> Texture:
    """Wire beside wire: dark lines between them, across the horizontal."""
    lines = np.tile(np.array([70, 190, 255, 255, 225, 150]), 8)  # 16 wires in 8 mm
    noise = rng.normal(0, 6, len(lines))
    row = np.clip(lines + noise, 0, 255).astype(np.uint8)
    image = np.broadcast_to(row[:, None, None], (len(row), 16, 3))
    return seamless(np.ascontiguousarray(image))
