"""What lies in a drawer: folders, clothes, boxes, papers."""

from itertools import pairwise

import numpy as np

from r2art.data.procedural.curved import ellipsoid
from r2art.data.procedural.randomness import Color, between, pick, tinted
from r2art.data.procedural.solids import box, plate
from r2art.data.shape import Material, Surface

_COLORS: tuple[Color, ...] = (
    (0.85, 0.75, 0.5),
    (0.9, 0.9, 0.88),
    (0.2, 0.3, 0.55),
    (0.6, 0.15, 0.15),
    (0.2, 0.4, 0.25),
    (0.1, 0.1, 0.1),
    (0.5, 0.5, 0.52),
    (0.8, 0.5, 0.55),
)
FloatArray = np.ndarray


def contents(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Things inside the box ``lower``..``upper``; nothing reaches out of it."""
    return pick(rng, (_folders, _clothes, _stacks, _clutter))(rng, lower, upper)


def _look(rng: np.random.Generator) -> Material:
    return Material(color=tinted(rng, pick(rng, _COLORS)), roughness=between(rng, 0.4, 0.95))


def _folders(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Upright from front to back, as in a filing drawer."""
    looks = [_look(rng) for _ in range(3)]
    half = min(0.16, 0.47 * (upper[0] - lower[0]))
    middle, z = (lower[0] + upper[0]) / 2, lower[2] + 0.01
    pieces = []
    while z < upper[2] - 0.03 and len(pieces) < 24:
        thick = between(rng, 0.002, 0.02)
        high = lower[1] + (upper[1] - lower[1]) * between(rng, 0.75, 0.99)
        pieces.append(
            box((middle - half, lower[1], z), (middle + half, high, z + thick), pick(rng, looks))
        )
        z += thick + between(rng, 0.004, 0.04)
    return pieces


def _stacks(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Folded clothes in piles, side by side."""
    count = int(rng.integers(1, 4))
    edges = np.linspace(lower[0], upper[0], count + 1)
    pieces: list[Surface] = []
    for a, b in pairwise(edges.tolist()):
        y, deep = lower[1], between(rng, 0.55, 0.95) * (upper[2] - lower[2])
        while y < upper[1] - 0.03 and len(pieces) < 18:
            thick = between(rng, 0.012, 0.03)
            inset = 0.03 * (b - a) + between(rng, 0, 0.006)
            low = (a + inset, y, upper[2] - deep)
            high = (b - inset, y + thick, upper[2] - 0.004 - between(rng, 0, 0.01))
            look = _look(rng)
            pieces += plate(low, high, 1, look, radius=0.02, bevel=0.45 * thick, segments=2)
            y += thick
    return pieces


def _clothes(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Rolled or heaped."""
    size, pieces = upper - lower, []
    for _ in range(int(rng.integers(5, 14))):
        radii = np.array([between(rng, 0.03, 0.07), 0.0, between(rng, 0.03, 0.09)])
        radii[1] = min(between(rng, 0.02, 0.05), 0.48 * size[1])
        radii = np.minimum(radii, 0.48 * size)
        room = np.maximum(size - 2 * radii, 0.0) * (1, 0.15, 1)
        center = lower + radii + rng.random(3) * room
        pieces.append(ellipsoid(center, radii, _look(rng), rings=8, segments=13))
    return pieces


def _clutter(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Boxes, books and stacks of paper, each in its own strip of the drawer."""
    count = int(rng.integers(2, 6))
    edges = np.linspace(lower[0], upper[0], count + 1)
    pieces = []
    for a, b in pairwise(edges.tolist()):
        deep = between(rng, 0.25, 0.9) * (upper[2] - lower[2])
        z = lower[2] + rng.random() * (upper[2] - lower[2] - deep)
        high = lower[1] + between(rng, 0.15, 0.95) * (upper[1] - lower[1])
        inset = 0.06 * (b - a)
        pieces.append(box((a + inset, lower[1], z), (b - inset, high, z + deep), _look(rng)))
    return pieces
