"""Plates with a hole: finger loops, rings, frames."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from r2art.data.procedural.creases import creased
from r2art.data.procedural.outlines import outward
from r2art.data.procedural.solids import FRAMES
from r2art.data.shape import Material, Surface

FloatArray = NDArray[np.floating]


def band(
    inner: ArrayLike,
    outer: ArrayLike,
    axis: int,
    height: ArrayLike,
    material: Material,
    *,
    radius: float,
    segments: int = 3,
    tile: float = 0.1,
) -> Surface:
    """The closed solid between two outlines, with rounded edges, about the plane through 0.

    Args:
        inner: (N, 2) outline of the hole, in the directions right and up of ``axis`` (see
            `curved.prism`), counter-clockwise.
        outer: (N, 2) outline around it; the points of both belong together one by one.
        axis: Direction of its height.
        height: Of the plate (m), a number or (N,).
        material: Its look.
        radius: Of the edges (m), cut to half the height.
        segments: Of each rounded edge.
        tile: See `creases.creased`.
    """
    inner, outer = np.asarray(inner, dtype=np.float64), np.asarray(outer, dtype=np.float64)
    half = np.broadcast_to(np.asarray(height, dtype=np.float64) / 2, len(outer))[:, None]
    soft = np.minimum(radius, 0.98 * half)
    out, into = outward(outer), outward(inner)
    quarter = np.linspace(0, np.pi / 2, segments + 1)
    arcs = []
    for k, (outline, inset, side) in enumerate(
        ((outer, -out, -1), (inner, into, -1), (inner, into, 1), (outer, -out, 1))
    ):
        angle = quarter + k * np.pi / 2
        away = (soft * (1 - np.abs(np.cos(angle))))[..., None]
        level = side * (half - soft + soft * np.abs(np.sin(angle)))
        arcs.append(
            np.concatenate([outline[:, None] + away * inset[:, None], level[..., None]], axis=-1)
        )
    rings = np.concatenate(arcs, axis=1)
    vertices = rings.reshape(-1, 3) @ FRAMES[axis]
    return creased(vertices, torus(*rings.shape[:2]), material, angle=1.0, tile=tile)


def torus(rows: int, around: int) -> NDArray[np.integer]:
    """Faces of a grid whose rows are rings, and whose last row meets the first."""
    index = np.arange(rows * around).reshape(rows, around)
    ahead, above = np.roll(index, -1, axis=1), np.roll(index, -1, axis=0)
    corner = np.roll(ahead, -1, axis=0)
    a, b, c, d = (corners.ravel() for corners in (index, ahead, corner, above))
    return np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])
