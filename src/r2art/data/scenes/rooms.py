"""What an object stands on and before: floors, tables with edges, walls, rooms."""

import numpy as np
from numpy.typing import NDArray

from r2art.data.procedural.solids import box
from r2art.data.scenes.surroundings import Surroundings, some_material
from r2art.data.shape import Material, Surface

FloatArray = NDArray[np.floating]


def quad(corners: FloatArray, material: Material, repeat: float) -> Surface:
    """A rectangle on which a texture repeats ``repeat`` times each way."""
    normal = np.cross(corners[1] - corners[0], corners[3] - corners[0])
    return Surface(
        vertices=corners,
        faces=np.array([[0, 1, 2], [0, 2, 3]]),
        normals=np.tile(normal / np.linalg.norm(normal), (4, 1)),
        uv=np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * repeat,
        material=material,
    )


def ground(
    rng: np.random.Generator, lower: FloatArray, upper: FloatArray, files: Surroundings
) -> list[Surface]:
    """What is under the box (``lower``, ``upper``), and sometimes walls behind and beside it."""
    kind = rng.random()
    if kind < 0.2:
        return table(rng, lower, upper, files)
    if kind < 0.4:
        return room(rng, lower, upper, files)
    return floor(rng, lower, upper, files)


def floor(
    rng: np.random.Generator, lower: FloatArray, upper: FloatArray, files: Surroundings
) -> list[Surface]:
    """A surface that ends near or far, sometimes with a wall at its back."""
    center = (lower + upper) / 2
    size = float(np.linalg.norm(upper - lower))
    reach = size * (rng.uniform(0.6, 1.5, 4) if rng.random() < 0.5 else rng.uniform(3, 12, 4))
    left, right = center[0] - reach[0], center[0] + reach[1]
    back, front = center[2] - reach[2], center[2] + reach[3]
    wall = rng.random() < 0.3
    if wall:
        back = min(back, lower[2] - 0.02)
        back = lower[2] - rng.uniform(0.02, 0.6) if rng.random() < 0.7 else back
    y = lower[1] - 1e-4
    repeat = float(rng.uniform(1, 4)) * reach.mean() / (2 * size) + 0.3
    surfaces = [_lying((left, right), (back, front), y, some_material(rng, files), repeat)]
    if wall:
        looks = some_material(rng, files)
        surfaces.append(_standing((left, back), (right, back), (y, y + 4 * size), looks, repeat))
    return surfaces


def table(
    rng: np.random.Generator, lower: FloatArray, upper: FloatArray, files: Surroundings
) -> list[Surface]:
    """A table top with edges and legs, over a floor."""
    size = float(np.linalg.norm(upper - lower))
    space = size * rng.uniform(0.05, 0.9, 4)
    y = lower[1] - 1e-4
    left, right = lower[0] - space[0], upper[0] + space[1]
    back, front = lower[2] - space[2], upper[2] + space[3]
    thick, high = size * rng.uniform(0.02, 0.08), size * rng.uniform(0.6, 1.6)
    wood, tile = some_material(rng, files), size * rng.uniform(0.5, 2)
    surfaces = [box([left, y - thick, back], [right, y, front], wood, tile=tile)]
    leg, inset = size * rng.uniform(0.02, 0.06), size * rng.uniform(0, 0.08)
    for x in (left + inset, right - inset - leg):
        for z in (back + inset, front - inset - leg):
            upper_end = [x + leg, y - thick, z + leg]
            surfaces.append(box([x, y - high, z], upper_end, wood, tile=tile))
    far = size * rng.uniform(3, 8)
    spans = (left - far, right + far), (back - far, front + far)
    looks = some_material(rng, files)
    surfaces.append(_lying(*spans, y - high, looks, float(rng.uniform(3, 8))))
    return surfaces


def room(
    rng: np.random.Generator, lower: FloatArray, upper: FloatArray, files: Surroundings
) -> list[Surface]:
    """A floor and two walls that meet in a corner behind the box."""
    size = float(np.linalg.norm(upper - lower))
    space, y = size * rng.uniform(0.05, 1.5, 2), lower[1] - 1e-4
    far, high = size * rng.uniform(4, 8), y + size * rng.uniform(2.5, 5)
    back, front = lower[2] - space[0], upper[2] + far
    paint = some_material(rng, files)
    other = paint if rng.random() < 0.6 else some_material(rng, files)
    repeat = float(rng.uniform(2, 6))
    if rng.random() < 0.5:
        left, right = lower[0] - space[1], upper[0] + far
        side = _standing((left, front), (left, back), (y, high), other, repeat)
    else:
        left, right = lower[0] - far, upper[0] + space[1]
        side = _standing((right, back), (right, front), (y, high), other, repeat)
    return [
        _lying((left, right), (back, front), y, some_material(rng, files), repeat),
        _standing((left, back), (right, back), (y, high), paint, repeat),
        side,
    ]


def _lying(
    x: tuple[float, float], z: tuple[float, float], y: float, material: Material, repeat: float
) -> Surface:
    corners = [(x[0], y, z[1]), (x[1], y, z[1]), (x[1], y, z[0]), (x[0], y, z[0])]
    return quad(np.array(corners), material, repeat)


def _standing(
    start: tuple[float, float],
    end: tuple[float, float],
    y: tuple[float, float],
    material: Material,
    repeat: float,
) -> Surface:
    """A wall from one (x, z) to another."""
    (x0, z0), (x1, z1) = start, end
    corners = [(x0, y[0], z0), (x1, y[0], z1), (x1, y[1], z1), (x0, y[1], z0)]
    return quad(np.array(corners), material, repeat)
