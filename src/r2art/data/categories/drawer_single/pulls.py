"""By what small drawers are pulled besides handles: tabs, rings, card holders, holes."""

import numpy as np

from r2art.data.categories.drawer.style import CabinetStyle
from r2art.data.procedural.curved import tube
from r2art.data.procedural.randomness import Color, between, pick
from r2art.data.procedural.slabs import bent, notched, slab
from r2art.data.procedural.solids import cylinder, decal, plate, xyz
from r2art.data.procedural.textures import label
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
_RIBBONS: tuple[Color, ...] = (
    (0.7, 0.1, 0.1),
    (0.1, 0.1, 0.1),
    (0.35, 0.2, 0.1),
    (0.15, 0.25, 0.45),
    (0.9, 0.88, 0.82),
)
_HOLE = Material(color=(0.03, 0.03, 0.03), roughness=0.9)


def notched_front(
    rng: np.random.Generator, style: CabinetStyle, lower: FloatArray, upper: FloatArray
) -> list[Surface]:
    """A front with a round finger notch in its upper edge."""
    wide = min(between(rng, 0.022, 0.034), 0.4 * (upper[0] - lower[0]))
    depth = min(0.5 * wide, 0.4 * (upper[1] - lower[1]))
    low, high = (lower[0], lower[1]), (upper[0], upper[1])
    first, other = notched(low, high, wide, depth)
    return [*slab(first, other, 2, (lower[2], upper[2]), style.front_look, tile=style.tile)]


def tab(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """A loop of ribbon or leather through the front."""
    look = Material(color=pick(rng, _RIBBONS), roughness=0.7)
    room = upper[1] - lower[1]
    wide, out = min(0.016, 0.3 * room), min(between(rng, 0.016, 0.03), 0.9 * room)
    y, z, thick = (lower[1] + upper[1]) / 2, upper[2], 0.0016
    x = (lower[0] + upper[0]) / 2
    high = 0.35 * wide
    path = np.array(  # right and up seen against x: -z and y
        [
            (-z, y + high),
            (-z - 0.8 * out, y + 0.8 * high),
            (-z - out, y),
            (-z - 0.8 * out, y - 0.8 * high),
            (-z, y - high),
        ]
    )
    return [*bent(path, thick, 0, (x - wide / 2, x + wide / 2), look)]


def ring(look: Material, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """A drop ring on a round plate."""
    room = upper[1] - lower[1]
    r = min(0.016, 0.26 * room)
    at = xyz((lower[0] + upper[0]) / 2, (lower[1] + upper[1]) / 2 + 0.8 * r, upper[2])
    rose = cylinder(at + xyz(0, 0, 0.001), 2, 0.55 * r, 0.002, look, segments=14)
    eye = cylinder(at + xyz(0, 0, 0.003), 2, 0.22 * r, 0.006, look, segments=8)
    angle = np.linspace(0, 2 * np.pi, 19)
    path = at + np.stack([r * np.sin(angle), r * np.cos(angle) - r, 0 * angle + 0.005], axis=-1)
    return [*rose, *eye, tube(path, 0.11 * r + 5e-4, look, up=(0, 0, 1), segments=6)]


def card_holder(
    rng: np.random.Generator, look: Material, lower: FloatArray, upper: FloatArray
) -> list[Surface]:
    """A metal frame with a written card, as on filing drawers."""
    size = upper - lower
    wide = min(0.07, 0.5 * size[0])
    tall = min(0.5 * wide, 0.3 * size[1])
    at = xyz((lower[0] + upper[0]) / 2, lower[1] + 0.74 * size[1], upper[2])
    half = xyz(wide / 2, tall / 2, 0)
    card = Material(color=(1, 1, 1), texture=label(rng), roughness=0.8)
    frame = plate(at - half, at + half + xyz(0, 0, 0.0015), 2, look, radius=0.002)
    face = (at - half, at + half + xyz(0, 0, 0.0015))
    return [*frame, decal(*face, "front", card, size=(0.84 * wide, 0.72 * tall))]


def hole(lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """A finger hole through the front."""
    r = min(0.012, 0.24 * (upper[1] - lower[1]))
    at = xyz((lower[0] + upper[0]) / 2, (lower[1] + upper[1]) / 2, upper[2])
    return [*cylinder(at, 2, r, 6e-4, _HOLE, segments=18)]
