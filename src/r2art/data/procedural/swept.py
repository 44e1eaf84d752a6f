"""Bars and rings: a cross section of varying width and height, swept along a curve in space."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from r2art.data.procedural.bands import torus
from r2art.data.procedural.creases import creased
from r2art.data.procedural.sheets import loft
from r2art.data.shape import Material, Surface

FloatArray = NDArray[np.floating]


def swept(
    path: ArrayLike,
    side: ArrayLike,
    width: ArrayLike,
    height: ArrayLike,
    material: Material,
    *,
    radius: float | None = None,
    segments: int = 2,
    closed: bool = False,
    angle: float = 1.0,
    tile: float = 0.1,
) -> Surface:
    """A closed solid around a curve.

    Args:
        path: (K, 3) middle of the cross sections (m).
        side: (3,) or (K, 3) direction in which the width counts; never along the path.
        width: Of the cross section (m), a number or (K,).
        height: The same, square to the width and to the path.
        material: Its look.
        radius: Of the four edges (m); None makes the cross section an ellipse.
        segments: Of each quarter of the cross section.
        closed: Whether the curve returns to its start, which is not repeated.
        angle: See `creases.creased`.
        tile: See `creases.creased`.
    """
    rings = _cross_sections(path, side, width, height, radius, segments, closed)
    if not closed:
        return loft(rings, material, angle=angle, tile=tile)
    faces = torus(*rings.shape[:2])
    return creased(rings.reshape(-1, 3), faces, material, angle=angle, tile=tile)


def mirrored(surface: Surface) -> Surface:
    """The surface seen in the plane x = 0; texts on it turn into mirror writing."""
    flip = np.array([-1.0, 1.0, 1.0])
    return Surface(
        vertices=surface.vertices * flip,
        faces=surface.faces[:, ::-1],
        normals=surface.normals * flip,
        uv=surface.uv,
        material=surface.material,
    )


def _cross_sections(
    path: ArrayLike,
    side: ArrayLike,
    width: ArrayLike,
    height: ArrayLike,
    radius: float | None,
    segments: int,
    closed: bool,
) -> FloatArray:
    """(K, M, 3) rings, counter-clockwise seen from further along the path."""
    path = np.asarray(path, dtype=np.float64)
    if closed:
        tangent = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0)
    else:
        tangent = np.gradient(path, axis=0)
    tangent = _unit(tangent)
    across = np.broadcast_to(np.asarray(side, dtype=np.float64), path.shape)
    across = _unit(across - (across * tangent).sum(axis=-1, keepdims=True) * tangent)
    over = np.cross(tangent, across)
    size = np.stack(np.broadcast_arrays(width, height, np.zeros(len(path)))[:2], axis=-1)
    flat = _outline(size, radius, segments)
    return path[:, None] + flat[..., :1] * across[:, None] + flat[..., 1:] * over[:, None]


def _outline(size: FloatArray, radius: float | None, segments: int) -> FloatArray:
    """(K, M, 2) rounded rectangles, or ellipses, of (K, 2) width and height."""
    if radius is None:
        angle = np.arange(4 * segments) * np.pi / (2 * segments)
        return size[:, None] / 2 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    quarter = np.linspace(0, np.pi / 2, segments + 1)
    angle = (np.arange(4)[:, None] * np.pi / 2 + quarter).ravel()
    corner = np.repeat([[1, 1], [-1, 1], [-1, -1], [1, -1]], segments + 1, axis=0)
    round_off = np.minimum(radius, 0.49 * size.min(axis=-1))[:, None, None]
    arc = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return corner * (size[:, None] / 2 - round_off) + round_off * arc


def _unit(vectors: FloatArray) -> FloatArray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
