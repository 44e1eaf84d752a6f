"""Shading normals for any mesh: smooth where it bends gently, hard where it has an edge."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from r2art.data.procedural.solids import FRAMES
from r2art.data.shape import Material, Surface

FloatArray = NDArray[np.floating]


def creased(
    vertices: ArrayLike,
    faces: ArrayLike,
    material: Material,
    *,
    angle: float = 0.7,
    tile: float = 0.1,
) -> Surface:
    """A mesh whose edges are hard where its faces meet at more than ``angle``.

    Every corner takes the area-weighted mean normal of those faces around its vertex that are
    within ``angle`` (rad) of its own, so that large flat faces stay flat beside their rounded
    edges. Texture coordinates are those of a box that repeats every ``tile`` metres. Faces
    without area are left out.

    Args:
        vertices: (V, 3); vertices are neighbours only where faces share their index.
        faces: (F, 3), counter-clockwise seen from outside.
        material: Its look.
        angle: See above.
        tile: See above.
    """
    vertices = np.asarray(vertices, dtype=np.float64)
    faces = np.asarray(faces)
    weighted = _weighted_normals(vertices[faces])
    area = np.linalg.norm(weighted, axis=-1)
    solid = area > 1e-13  # m²
    faces, weighted, area = faces[solid], weighted[solid], area[solid]
    unit = weighted / area[:, None]
    corners = vertices[faces]
    return Surface(
        vertices=corners.reshape(-1, 3),
        faces=np.arange(faces.size).reshape(-1, 3),
        normals=_corner_normals(faces, weighted, unit, float(np.cos(angle))),
        uv=_box_uv(corners, unit) / tile,
        material=material,
    )


def _weighted_normals(corners: FloatArray) -> FloatArray:
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _corner_normals(
    faces: NDArray[np.integer], weighted: FloatArray, unit: FloatArray, least: float
) -> FloatArray:
    """(3F, 3) sums over the faces around each corner's vertex that agree with its own face."""
    owner = faces.ravel()
    order = np.argsort(owner, kind="stable")
    _, first, count = np.unique(owner[order], return_index=True, return_counts=True)
    start, size = np.repeat(first, count), np.repeat(count, count)
    rank = np.arange(len(order)) - start
    face = order // 3
    total = np.zeros((len(order), 3))
    for step in range(int(count.max())):
        here = np.flatnonzero(step < size)
        other = face[start[here] + (rank[here] + step) % size[here]]
        agrees = np.einsum("cd,cd->c", unit[face[here]], unit[other]) > least
        total[here[agrees]] += weighted[other[agrees]]
    normals = np.empty_like(total)
    normals[order] = total / np.linalg.norm(total, axis=-1, keepdims=True)
    return normals


def _box_uv(corners: FloatArray, unit: FloatArray) -> FloatArray:
    """(3F, 2) coordinates (m) on the side of a box that each face looks at most."""
    frames = FRAMES[np.argmax(np.abs(unit), axis=-1)]
    return np.einsum("fkd,fcd->fkc", corners, frames[:, :2]).reshape(-1, 2)
