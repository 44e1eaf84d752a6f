"""Closed curves in a plane, counter-clockwise: the shapes of lenses, loops and holes.

An outline is (N, 2) points, the first not repeated at the end.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.floating]


def oval(radii: ArrayLike, exponents: ArrayLike, count: int = 48) -> FloatArray:
    """Four quarters of superellipses about the origin, joined smoothly.

    Args:
        radii: Reach (m) to the right, up, left and down.
        exponents: Of the quarters, from the right upwards: 2 is round, 4 nearly square.
        count: Points, evenly spaced.
    """
    right, up, left, down = np.asarray(radii, dtype=np.float64).tolist()
    power = 2 / np.asarray(exponents, dtype=np.float64)
    angle = (np.arange(800) + 0.5) * 2 * np.pi / 800
    quarter = power[np.arange(800) // 200]
    cos, sin = np.cos(angle), np.sin(angle)
    x = np.where(cos > 0, right, left) * np.sign(cos) * np.abs(cos) ** quarter
    y = np.where(sin > 0, up, down) * np.sign(sin) * np.abs(sin) ** quarter
    return evenly(np.stack([x, y], axis=-1), count)


def polygon(corners: int, radius: float, sharpness: float = 14.0, count: int = 48) -> FloatArray:
    """A regular polygon with a side on its right, its corners the sharper the higher the power."""
    angle = np.arange(800) * 2 * np.pi / 800
    sides = np.arange(corners) * 2 * np.pi / corners
    facing = np.maximum(np.cos(angle[:, None] - sides), 0.0)
    reach = radius * (facing**sharpness).sum(axis=-1) ** (-1 / sharpness)
    return evenly(np.stack([np.cos(angle), np.sin(angle)], axis=-1) * reach[:, None], count)


def evenly(outline: ArrayLike, count: int) -> FloatArray:
    """The same outline through ``count`` points at even distances."""
    points = np.asarray(outline, dtype=np.float64)
    points = np.concatenate([points, points[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=-1))])
    at = np.arange(count) * along[-1] / count
    return np.stack([np.interp(at, along, points[:, k]) for k in range(2)], axis=-1)


def outward(outline: ArrayLike) -> FloatArray:
    """(N, 2) unit normals that point out of the outline."""
    points = np.asarray(outline, dtype=np.float64)
    along = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    normals = np.stack([along[:, 1], -along[:, 0]], axis=-1)
    return normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def grown(outline: ArrayLike, by: ArrayLike) -> FloatArray:
    """The outline moved outward by ``by`` (m), a number or (N,)."""
    points = np.asarray(outline, dtype=np.float64)
    return points + outward(points) * np.broadcast_to(by, len(points))[:, None]
