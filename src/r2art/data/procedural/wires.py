"""Straight wires, many at once: racks, grids, baskets, grilles, cutlery."""

import numpy as np
from numpy.typing import ArrayLike

from r2art.data.shape import Material, Surface


def wires(ends: ArrayLike, radius: float, material: Material, *, sides: int = 4) -> Surface:
    """Closed prisms between pairs of points, shaded as if they were round.

    Args:
        ends: (N, 2, 3) the two ends of every wire (m), which must differ.
        radius: Of the circle around the cross section (m).
        material: Their look.
        sides: Of the cross section.
    """
    ends = np.asarray(ends, dtype=np.float64)
    along = ends[:, 1] - ends[:, 0]
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    least = np.eye(3)[np.argmin(np.abs(along), axis=-1)]
    side = np.cross(along, least)
    side /= np.linalg.norm(side, axis=-1, keepdims=True)
    over = np.cross(along, side)
    angle = (np.arange(sides) + 0.5) * 2 * np.pi / sides
    normals = (
        np.cos(angle)[:, None] * side[:, None] + np.sin(angle)[:, None] * over[:, None]
    )  # (N, sides, 3)
    rings = ends[:, :, None] + radius * normals[:, None]  # (N, 2, sides, 3)
    count = len(ends)
    first = np.arange(count)[:, None, None] * 2 * sides
    return Surface(
        vertices=rings.reshape(-1, 3),
        faces=(first + _faces(sides)).reshape(-1, 3),
        normals=np.repeat(normals[:, None], 2, axis=1).reshape(-1, 3),
        uv=np.zeros((count * 2 * sides, 2)),
        material=material,
    )


def _faces(sides: int) -> np.ndarray:
    """Faces of one wire: its sides, then both ends."""
    here = np.arange(sides)
    ahead = np.roll(here, -1)
    far, far_ahead = here + sides, ahead + sides
    fan = np.arange(1, sides - 1)
    zero = np.zeros_like(fan)
    return np.concatenate(
        [
            np.stack([here, ahead, far_ahead], axis=-1),
            np.stack([here, far_ahead, far], axis=-1),
            np.stack([zero, fan + 1, fan], axis=-1),
            np.stack([zero, fan, fan + 1], axis=-1) + sides,
        ]
    )
