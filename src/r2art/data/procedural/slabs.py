"""Solids of an outline that need not be convex: bent sheets, vaults, notched boards."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from r2art.data.procedural.solids import FRAMES
from r2art.data.shape import Material, Surface

FloatArray = NDArray[np.floating]
_CREASE = np.cos(np.radians(32))  # flatter bends are shaded as round
_QUAD = np.array([[0, 1, 2], [0, 2, 3]])


def bent(
    path: ArrayLike,
    thickness: float,
    axis: int,
    span: tuple[float, float],
    material: Material,
    *,
    inner: Material | None = None,
    tile: float | None = None,
) -> tuple[Surface, ...]:
    """A sheet bent along a (K, 2) path and extruded along ``axis`` over ``span``.

    The path is in the directions that are right and up seen against ``axis`` (see
    `r2art.data.procedural.curved.prism`); the sheet's ``thickness`` (m) lies to its left, so
    that a counter-clockwise path is the outside of a vault. ``inner`` is the look of that side.
    """
    path = np.asarray(path, dtype=np.float64)
    along = np.diff(path, axis=0)
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    left = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    before, after = left[[0, *range(len(left))]], left[[*range(len(left)), -1]]
    half = before + after
    mitre = 2 * half / np.maximum((half**2).sum(axis=-1, keepdims=True), 0.5)
    return slab(path, path + thickness * mitre, axis, span, material, second=inner, tile=tile)


def slab(
    outline: ArrayLike,
    other: ArrayLike,
    axis: int,
    span: tuple[float, float],
    material: Material,
    *,
    second: Material | None = None,
    tile: float | None = None,
) -> tuple[Surface, ...]:
    """The solid between two matched (K, 2) polylines, extruded along ``axis`` over ``span``.

    ``other`` lies to the left of ``outline`` and may look different (``second``). Texture
    coordinates run along ``axis`` first, so that grain does; they repeat every ``tile`` metres.
    """
    first, opposite = np.asarray(outline, dtype=np.float64), np.asarray(other, dtype=np.float64)
    frame, ends = FRAMES[axis], (min(span), max(span))
    scale = tile or max(float(np.linalg.norm(np.diff(first, axis=0), axis=-1).sum()), 1e-9)
    back = opposite[::-1]
    sides = [_strip(first, frame, ends, material, scale)]
    sides.append(_strip(back, frame, ends, second or material, scale))
    for edge in (np.stack([back[-1], first[0]]), np.stack([first[-1], back[0]])):
        sides.append(_strip(edge, frame, ends, material, scale))
    return (*sides, *(_end(first, opposite, frame, ends, k, material, scale) for k in (0, 1)))


def _strip(
    path: FloatArray, frame: FloatArray, ends: tuple[float, float], look: Material, scale: float
) -> Surface:
    """The wall that stands on a path, its outside to the right."""
    step = np.diff(path, axis=0)
    length = np.linalg.norm(step, axis=-1)
    flat = np.stack([step[:, 1], -step[:, 0]], axis=-1) / np.maximum(length, 1e-12)[:, None]
    normals = np.stack([flat, flat], axis=1)
    for k in np.flatnonzero((flat[:-1] * flat[1:]).sum(axis=-1) > _CREASE):
        mean = flat[k] + flat[k + 1]
        normals[k, 1] = normals[k + 1, 0] = mean / np.linalg.norm(mean)
    low, high = ends[0] * frame[2], ends[1] * frame[2]
    base = path @ frame[:2]
    quads = np.stack([base[:-1] + low, base[1:] + low, base[1:] + high, base[:-1] + high], axis=1)
    run = np.concatenate([[0.0], np.cumsum(length)])
    v = np.stack([run[:-1], run[1:], run[1:], run[:-1]], axis=1)
    u = np.broadcast_to(np.array([ends[0], ends[0], ends[1], ends[1]]), v.shape)
    return Surface(
        vertices=quads.reshape(-1, 3),
        faces=(np.arange(len(step))[:, None, None] * 4 + _QUAD).reshape(-1, 3),
        normals=(normals[:, [0, 1, 1, 0]] @ frame[:2]).reshape(-1, 3),
        uv=np.stack([u, v], axis=-1).reshape(-1, 2) / scale,
        material=look,
    )


def _end(
    first: FloatArray,
    other: FloatArray,
    frame: FloatArray,
    ends: tuple[float, float],
    which: int,
    look: Material,
    scale: float,
) -> Surface:
    """One of the two flat ends of a slab."""
    quads = np.stack([first[:-1], first[1:], other[1:], other[:-1]], axis=1)
    order = _QUAD if which else _QUAD[:, ::-1]
    return Surface(
        vertices=quads.reshape(-1, 2) @ frame[:2] + ends[which] * frame[2],
        faces=(np.arange(len(quads))[:, None, None] * 4 + order).reshape(-1, 3),
        normals=np.tile((1 if which else -1) * frame[2], (4 * len(quads), 1)),
        uv=quads.reshape(-1, 2) / scale,
        material=look,
    )


def arc(
    start: tuple[float, float], end: tuple[float, float], rise: float, pieces: int = 12
) -> FloatArray:
    """(pieces + 1, 2) points of the circle through two points, ``rise`` to the right of them.

    The rise is at most half their distance.
    """
    a, b = np.array(start, dtype=np.float64), np.array(end, dtype=np.float64)
    chord = float(np.linalg.norm(b - a))
    if rise <= 1e-9:
        return a + np.linspace(0, 1, pieces + 1)[:, None] * (b - a)
    radius = (chord**2 / 4 + rise**2) / (2 * rise)
    along = (b - a) / chord
    right = np.array([along[1], -along[0]])
    center = (a + b) / 2 + (rise - radius) * right
    half = float(np.arcsin(np.clip(chord / (2 * radius), 0, 1)))
    angle = np.linspace(-half, half, pieces + 1)[:, None]
    return center + radius * (np.sin(angle) * along + np.cos(angle) * right)


def notched(
    lower: tuple[float, float], upper: tuple[float, float], width: float, depth: float
) -> tuple[FloatArray, FloatArray]:
    """The lower and upper outline of a board with a round finger notch in its upper edge.

    Both are (K, 2) polylines in the directions right and up, to be given to `slab`.
    """
    middle, half = (lower[0] + upper[0]) / 2, width / 2
    angle = np.linspace(np.pi, 2 * np.pi, 11)
    notch = np.stack([middle + half * np.cos(angle), upper[1] + depth * np.sin(angle)], axis=-1)
    top = np.concatenate([[(lower[0], upper[1])], notch, [(upper[0], upper[1])]])
    return np.stack([top[:, 0], np.full(len(top), lower[1])], axis=-1), top
