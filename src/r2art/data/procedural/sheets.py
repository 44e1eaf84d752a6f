"""Bent sheets with thickness and holes, lofts, and prints draped over them.

All are given as grids of points: K rows along the object, N points around or across each. Rows
run counter-clockwise seen from the last one, as in `solids.skin`.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from r2art.data.procedural.creases import creased
from r2art.data.procedural.solids import skin
from r2art.data.shape import Material, Surface

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]


def sheet(
    outer: ArrayLike,
    inner: ArrayLike,
    material: Material,
    *,
    inside: Material | None = None,
    wrap: bool = False,
    holes: ArrayLike | None = None,
    angle: float = 0.7,
    tile: float = 0.1,
) -> tuple[Surface, ...]:
    """The solid between two grids: a shell, a channel, a tube, a folded plate.

    Args:
        outer: (K, N, 3) its outside.
        inner: (K, N, 3) its inside, point by point behind the outside.
        material: Look of the outside.
        inside: Look of the inside and of the edges around holes; by default ``material``.
        wrap: Whether each row closes to a ring.
        holes: (K - 1, N) or, unless it wraps, (K - 1, N - 1): cells that are cut out.
        angle: See `creases.creased`.
        tile: See `creases.creased`.
    """
    outer, inner = np.asarray(outer, dtype=np.float64), np.asarray(inner, dtype=np.float64)
    rows, around = outer.shape[:2]
    quads = _quads(rows, around, wrap)
    if holes is not None:
        quads = quads[~np.asarray(holes, dtype=bool).ravel()]
    rim = _rim(quads)
    behind = rows * around
    walls = np.stack([rim[:, 1], rim[:, 0], rim[:, 0] + behind, rim[:, 1] + behind], axis=-1)
    back = np.concatenate([quads[:, ::-1] + behind, walls])
    vertices = np.concatenate([outer.reshape(-1, 3), inner.reshape(-1, 3)])
    return (
        creased(vertices, _halves(quads), material, angle=angle, tile=tile),
        creased(vertices, _halves(back), inside or material, angle=angle, tile=tile),
    )


def loft(rings: ArrayLike, material: Material, *, angle: float = 0.7, tile: float = 0.1) -> Surface:
    """A closed solid through (K, N, 3) rings; each end is a fan about its middle."""
    rings = np.asarray(rings, dtype=np.float64)
    rows, around = rings.shape[:2]
    vertices = np.concatenate([rings.reshape(-1, 3), rings[[0, -1]].mean(axis=1)])
    here = np.arange(around)
    ahead = np.roll(here, -1)
    low, last = np.full(around, rows * around), (rows - 1) * around
    faces = np.concatenate(
        [
            _halves(_quads(rows, around, wrap=True)),
            np.stack([ahead, here, low], axis=-1),
            np.stack([here + last, ahead + last, low + 1], axis=-1),
        ]
    )
    return creased(vertices, faces, material, angle=angle, tile=tile)


def draped(grid: ArrayLike, material: Material, *, lift: float = 2e-4) -> Surface:
    """A print on a curved face: its (K, N, 3) points ``lift`` metres above, uv over [0, 1].

    The image's right runs along each row and its up along the rows, so that seen from outside
    it is upright where the first row is the lowest.
    """
    grid = np.asarray(grid, dtype=np.float64)
    cells = np.cross(grid[1:, 1:] - grid[:-1, :-1], grid[1:, :-1] - grid[:-1, 1:])
    around = np.pad(cells, ((1, 1), (1, 1), (0, 0)))
    normals = around[1:, 1:] + around[:-1, 1:] + around[1:, :-1] + around[:-1, :-1]
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    rows, across = grid.shape[:2]
    u, v = np.meshgrid(np.linspace(0, 1, across), np.linspace(0, 1, rows))
    return skin(grid + lift * normals, normals, np.stack([u, v], -1), material, wrap=False)


def sampled(grid: ArrayLike, rows: ArrayLike, columns: ArrayLike) -> FloatArray:
    """Points of a (K, N, 3) grid at fractional rows and columns, by bilinear interpolation.

    ``rows`` and ``columns`` broadcast to the shape of the result, (*S, 3).
    """
    grid = np.asarray(grid, dtype=np.float64)
    at = [
        np.clip(np.asarray(v, float), 0, n - 1)
        for v, n in zip((rows, columns), grid.shape[:2], strict=True)
    ]
    low = [np.minimum(v.astype(int), n - 2) for v, n in zip(at, grid.shape[:2], strict=True)]
    (a, b), (i, j) = [(v - k)[..., None] for v, k in zip(at, low, strict=True)], low
    first = grid[i, j] * (1 - b) + grid[i, j + 1] * b
    return first * (1 - a) + (grid[i + 1, j] * (1 - b) + grid[i + 1, j + 1] * b) * a


def _quads(rows: int, around: int, wrap: bool) -> IntArray:
    """(C, 4) corners of every cell, counter-clockwise, row by row."""
    index = np.arange(rows * around).reshape(rows, around)
    here = index if wrap else index[:, :-1]
    ahead = np.roll(index, -1, axis=1) if wrap else index[:, 1:]
    return np.stack([here[:-1], ahead[:-1], ahead[1:], here[1:]], axis=-1).reshape(-1, 4)


def _halves(quads: IntArray) -> IntArray:
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _rim(quads: IntArray) -> IntArray:
    """(E, 2) directed edges that only one cell has."""
    edges = np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2)
    base = int(quads.max()) + 1
    forth, back = edges @ np.array([base, 1]), edges @ np.array([1, base])
    return edges[~np.isin(forth, back)]
