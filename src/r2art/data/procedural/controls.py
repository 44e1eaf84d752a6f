"""What people press, turn and read on appliances: knobs, buttons, keypads, displays.

All stand on a front that faces +z; ``at`` is a point on it (m).
"""

import numpy as np
from numpy.typing import ArrayLike

from r2art.data.procedural.curved import revolved
from r2art.data.procedural.prints import Point, Print, digits, ink_on
from r2art.data.procedural.randomness import between, chance
from r2art.data.procedural.solids import box, decal, plate, xyz
from r2art.data.shape import Material, Surface
from r2art.data.staging import about


def knob(
    rng: np.random.Generator, at: ArrayLike, radius: float, depth: float, look: Material
) -> list[Surface]:
    """A knob that is turned anywhere, with a mark to read it by."""
    at = np.asarray(at, dtype=np.float64)
    waist = between(rng, 0.75, 0.98) * radius
    profile = [
        (radius, 0.0),
        (radius, 0.15 * depth),
        (waist, 0.25 * depth),
        (0.95 * waist, 0.9 * depth),
        (0.85 * waist, depth),
        (0.0, depth),
    ]
    mark = Material(color=ink_on(look.color), roughness=0.5)
    low, high = (-0.0012, 0.2 * waist, depth - 1e-3), (0.0012, 0.75 * waist, depth + 6e-4)
    pointer = box(low, high, mark)
    turn = about(2, between(rng, -0.75, 0.75) * np.pi)
    turned = Surface(
        vertices=at + pointer.vertices @ turn.T,
        faces=pointer.faces,
        normals=pointer.normals @ turn.T,
        uv=pointer.uv,
        material=mark,
    )
    return [revolved(profile, at, 2, look, segments=18), turned]


def button(at: ArrayLike, size: tuple[float, float], depth: float, look: Material) -> list[Surface]:
    """A button of ``size`` (width, height) that stands out by ``depth``."""
    half = xyz(size[0] / 2, size[1] / 2, 0)
    low, high = np.asarray(at) - half, np.asarray(at) + half + xyz(0, 0, depth)
    edge = min(0.3 * depth, 0.1 * min(size))
    return [*plate(low, high, 2, look, radius=0.3 * min(size), bevel=(0.0, edge), segments=2)]


def display(rng: np.random.Generator, at: ArrayLike, size: tuple[float, float]) -> Surface:
    """A display of ``size`` (width, height); most are lit."""
    lit = between(rng, 0.5, 1.3) if chance(rng, 0.8) else 0.0
    image = digits(rng, size[0] / size[1])
    look = Material(color=(1, 1, 1), texture=image, roughness=0.12, emission=lit)
    return decal(at, at, "front", look, size=size, lift=6e-4)


def print_keypad(sheet: Print, lower: Point, upper: Point, keys: str, columns: int) -> None:
    """Print keys in rows from the upper left, one character on each, within a rectangle."""
    rows = -(-len(keys) // columns)
    wide, tall = (upper[0] - lower[0]) / columns, (upper[1] - lower[1]) / rows
    for k, key in enumerate(keys):
        row, column = divmod(k, columns)
        center = (lower[0] + (column + 0.5) * wide, upper[1] - (row + 0.5) * tall)
        sheet.box(center, (0.86 * wide, 0.8 * tall), 0.002)
        sheet.text(center, 0.4 * tall, key)
