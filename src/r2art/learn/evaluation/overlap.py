"""How much two boxes overlap: exactly, in the image and in space.

A box in space is cut into tetrahedra and every plane of the other box clips them. Unlike a
polytope with faces to keep in order, a tetrahedron has no special cases: touching, nested and
equal boxes need no tolerance.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.floating]

THINNEST = 1e-6
"""Extents (m) are raised to this, so that two equal flat boxes overlap wholly, not 0/0."""

# Corners of a cube, x slowest, and the six tetrahedra around its diagonal 0-7.
_CORNERS = np.stack(np.meshgrid([-0.5, 0.5], [-0.5, 0.5], [-0.5, 0.5], indexing="ij"), -1)
_CORNERS = _CORNERS.reshape(8, 3)
_TETRAHEDRA = np.array(
    [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]]
)

# What is left of a tetrahedron whose first k vertices are inside: for each k the pieces, each a
# list of edges (i, j); (i, i) is vertex i, (i, j) the point where the plane cuts that edge.
# With two or three vertices inside a triangular prism remains, which is three tetrahedra.
_PIECES = {
    1: [[(0, 0), (0, 1), (0, 2), (0, 3)]],
    2: [
        [(0, 0), (0, 2), (0, 3), (1, 1)],
        [(0, 2), (0, 3), (1, 1), (1, 2)],
        [(0, 3), (1, 1), (1, 2), (1, 3)],
    ],
    3: [
        [(0, 0), (1, 1), (2, 2), (0, 3)],
        [(1, 1), (2, 2), (0, 3), (1, 3)],
        [(2, 2), (0, 3), (1, 3), (2, 3)],
    ],
}


def image_box_iou(a: FloatArray, b: FloatArray) -> float:
    """Intersection over union of two (4,) boxes x1 y1 x2 y2; 0 where both are empty."""
    extent = np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2])
    common = float(np.prod(np.maximum(extent, 0)))
    union = float(np.prod(np.maximum(a[2:] - a[:2], 0)) + np.prod(np.maximum(b[2:] - b[:2], 0)))
    return common / (union - common) if union > 0 else 0.0


def box_iou(
    cam_T_a: FloatArray, size_a: FloatArray, cam_T_b: FloatArray, size_b: FloatArray
) -> FloatArray:
    """Exact intersection over union of pairs of oriented boxes.

    Args:
        cam_T_a: (*B, 4, 4) poses of frames at the *centre* of box a, along its edges.
        size_a: (*B, 3) full extents of box a (m).
        cam_T_b: (*B, 4, 4) the same of box b.
        size_b: (*B, 3) extents of box b (m).

    Returns:
        (*B,) numbers in [0, 1].
    """
    size_a, size_b = np.maximum(size_a, THINNEST), np.maximum(size_b, THINNEST)
    a_R_cam = np.swapaxes(cam_T_a[..., :3, :3], -1, -2)
    b_R_a = np.swapaxes(a_R_cam @ cam_T_b[..., :3, :3], -1, -2)
    offset = (a_R_cam @ (cam_T_b[..., :3, 3] - cam_T_a[..., :3, 3])[..., None])[..., 0]
    corners = (_CORNERS * size_b[..., None, :]) @ b_R_a + offset[..., None, :]
    tetrahedra = corners.reshape(-1, 8, 3)[:, _TETRAHEDRA].reshape(-1, 4, 3)
    pair = np.repeat(np.arange(len(tetrahedra) // len(_TETRAHEDRA)), len(_TETRAHEDRA))
    half = size_a.reshape(-1, 3) / 2
    for axis in range(3):
        for sign in (-1.0, 1.0):
            height = sign * tetrahedra[..., axis] - half[pair, axis, None]
            tetrahedra, pair = _clip(tetrahedra, height, pair)
    common = np.bincount(pair, _volume(tetrahedra), len(half)).reshape(size_a.shape[:-1])
    union = size_a.prod(axis=-1) + size_b.prod(axis=-1) - common
    return np.clip(common / union, 0.0, 1.0)


def _clip(
    tetrahedra: FloatArray, height: FloatArray, pair: NDArray[np.intp]
) -> tuple[FloatArray, NDArray[np.intp]]:
    """(N', 4, 3) tetrahedra filling those parts of (N, 4, 3) ones whose height is below zero.

    ``height`` (N, 4) is the signed distance of each vertex to the plane, outside positive;
    ``pair`` (N,) the pair of boxes that each belongs to, which its pieces inherit.
    """
    order = np.argsort(height, axis=1)
    height = np.take_along_axis(height, order, axis=1)
    tetrahedra = np.take_along_axis(tetrahedra, order[..., None], axis=1)
    inside = np.count_nonzero(height <= 0, axis=1)
    kept, owners = [tetrahedra[inside == 4]], [pair[inside == 4]]
    for count, pieces in _PIECES.items():
        v, h = tetrahedra[inside == count], height[inside == count]
        for piece in pieces:
            kept.append(np.stack([_on_edge(v, h, i, j) for i, j in piece], axis=1))
            owners.append(pair[inside == count])
    return np.concatenate(kept), np.concatenate(owners)


def _on_edge(vertex: FloatArray, height: FloatArray, i: int, j: int) -> FloatArray:
    """(N, 3) vertex i where i = j, else the point of edge i-j at height zero."""
    if i == j:
        return vertex[:, i]
    along = height[:, i] / (height[:, i] - height[:, j])  # i is inside, j strictly outside
    return vertex[:, i] + along[:, None] * (vertex[:, j] - vertex[:, i])


def _volume(tetrahedra: FloatArray) -> FloatArray:
    """(N,) of (N, 4, 3)."""
    edges = tetrahedra[:, 1:] - tetrahedra[:, :1]
    return np.abs(np.linalg.det(edges)) / 6
