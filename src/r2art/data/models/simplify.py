"""Triangles as a file has them to surfaces to render: welded, few, smoothly shaded.

Quadric edge collapse (fast-simplification, Garland and Heckbert 1997) where there are too many.
"""

from collections.abc import Sequence

import fast_simplification
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from r2art.data.models.model import Patch
from r2art.data.shape import Surface

FloatArray = NDArray[np.floating]
Indices = NDArray[np.integer]

BUDGET = 12_000
"""Triangles of an object."""
LEAST = 64
"""Triangles that a patch keeps, if it has so many."""
CREASE = float(np.cos(np.radians(38)))
_STEPS = 1e6  # positions closer than the patch's size over this are one


def shares(areas: Sequence[float], counts: Sequence[int], budget: int) -> list[int]:
    """How many of its triangles each patch keeps: by the root of its area, none gains any.

    Args:
        areas: Area (m²) of each patch.
        counts: Its triangles.
        budget: Of all together; more only where there are so many patches that the
            `LEAST` of each are more.
    """
    count = np.asarray(counts, dtype=np.int64)
    if count.sum() <= budget:
        return count.tolist()
    weight = np.sqrt(np.asarray(areas, dtype=np.float64)) + 1e-12
    least = np.minimum(count, LEAST)
    kept = least.astype(float)
    short = kept < count
    while short.any():  # what needs less than its share keeps all; the rest is for the others
        left = max(budget - kept[~short].sum() - least[short].sum(), 0.0)
        share = least + left * weight / weight[short].sum()
        full = short & (share >= count)
        if not full.any():
            kept[short] = share[short]
            break
        kept[full] = count[full]
        short &= ~full
    return kept.astype(int).tolist()


def area(patch: Patch) -> float:
    """Of its triangles (m²)."""
    a, b, c = np.moveaxis(patch.corners, 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=-1).sum() / 2)


def simplified(patch: Patch, count: int) -> Patch:
    """About ``count`` of a patch's triangles; textures stay where they are."""
    if len(patch.corners) <= count:
        return patch
    flat = patch.corners.reshape(-1, 3)
    keys = [_steps(flat)]
    if patch.material.texture is not None:
        keys.append(np.round(patch.uv.reshape(-1, 2) * 4096).astype(np.int64))
    first, faces = _unique(np.concatenate(keys, axis=1))
    points, uv = flat[first], patch.uv.reshape(-1, 2)[first]
    faces = _proper(faces.reshape(-1, 3))
    *_, collapses = fast_simplification.simplify(
        np.asarray(points, np.float64),
        faces.astype(np.int32),
        target_count=count,
        return_collapses=True,
    )
    points_left, faces_left, place = fast_simplification.replay_simplification(
        points, faces.astype(np.int32), collapses
    )
    points_left = np.asarray(points_left, dtype=np.float64)
    uv_left = _carried(points, uv, faces, points_left, np.asarray(place))
    corners = points_left[faces_left]
    return Patch(corners=corners, uv=uv_left[faces_left], material=patch.material)


def _carried(
    points: FloatArray, uv: FloatArray, faces: Indices, left: FloatArray, place: Indices
) -> FloatArray:
    """(V, 2) texture coordinates of the points left: to first order those at the nearest one
    of the points that fell into each, so that no seam is crossed.
    """
    distance = np.linalg.norm(points - left[place], axis=1)
    order = np.lexsort((distance, place))
    kept, start = np.unique(place[order], return_index=True)
    nearest = np.zeros(len(left), dtype=np.int64)
    nearest[kept] = order[start]
    step = np.einsum("vij,vj->vi", _gradient(points, uv, faces)[nearest], left - points[nearest])
    return uv[nearest] + step


def _gradient(points: FloatArray, uv: FloatArray, faces: Indices) -> FloatArray:
    """(V, 2, 3) how texture coordinates change with the place, on average around each point."""
    edges = points[faces[:, 1:]] - points[faces[:, :1]]
    change = uv[faces[:, 1:]] - uv[faces[:, :1]]
    (a, b), (_, c) = np.moveaxis(edges @ edges.swapaxes(1, 2), 0, -1)
    doubled = a * c - b * b  # square of the doubled area
    adjugate = np.moveaxis(np.array([[c, -b], [-b, a]]), -1, 0)
    slope = change.swapaxes(1, 2) @ adjugate @ edges / np.maximum(doubled, 1e-300)[:, None, None]
    weight = np.where(np.isfinite(slope).all(axis=(1, 2)), np.sqrt(np.maximum(doubled, 0)), 0.0)
    total, gradient = np.zeros(len(points)), np.zeros((len(points), 2, 3))
    for corner in faces.T:
        np.add.at(total, corner, weight)
        np.add.at(gradient, corner, np.nan_to_num(slope * weight[:, None, None]))
    return gradient / np.maximum(total, 1e-300)[:, None, None]


def surface(patch: Patch) -> Surface | None:
    """A patch as a surface, hard edges where it is creased; None if it has no area."""
    flat, flat_uv = patch.corners.reshape(-1, 3), patch.uv.reshape(-1, 2)
    _, welded = _unique(_steps(flat))
    faces = welded.reshape(-1, 3)
    keep = _is_proper(faces) & (_doubled(patch.corners) > 0)
    if not keep.any():
        return None
    faces, flat = faces[keep], patch.corners[keep].reshape(-1, 3)
    flat_uv = patch.uv[keep].reshape(-1, 2)
    group, normals = _smoothed(faces, patch.corners[keep])
    uv_steps = np.round(flat_uv * 1e6).astype(np.int64)
    first, corner = _unique(np.concatenate([group[:, None], uv_steps], axis=1))
    return Surface(
        vertices=flat[first],
        faces=corner.reshape(-1, 3),
        normals=normals[group[first]],
        uv=flat_uv[first],
        material=patch.material,
    )


def _smoothed(faces: Indices, corners: FloatArray) -> tuple[Indices, FloatArray]:
    """Which corners share a normal, and these normals.

    Corners at one vertex belong together if one gets from one to the other over edges that are
    no creases.

    Returns:
        (3 F,) group of each corner, and (G, 3) unit normals of the groups.
    """
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    unit = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    corner = np.arange(faces.size).reshape(-1, 3)
    start, end = corner.ravel(), np.roll(corner, -1, axis=1).ravel()
    ends = np.stack([faces.ravel()[start], faces.ravel()[end]])
    turned = ends[0] > ends[1]
    start, end = np.where(turned, end, start), np.where(turned, start, end)
    order = np.lexsort(np.sort(ends, axis=0))
    start, end, ends = start[order], end[order], np.sort(ends, axis=0)[:, order]
    same = (ends[:, 1:] == ends[:, :-1]).all(axis=0)  # the next half edge lies on the same edge
    face, next_face = start[:-1] // 3, start[1:] // 3
    smooth = same & (np.einsum("ij,ij->i", unit[face], unit[next_face]) > CREASE)
    a = np.concatenate([start[:-1][smooth], end[:-1][smooth]])
    b = np.concatenate([start[1:][smooth], end[1:][smooth]])
    graph = coo_matrix((np.ones(len(a), dtype=bool), (a, b)), shape=(faces.size, faces.size))
    count, group = connected_components(graph, directed=False)
    normals = np.zeros((count, 3))
    np.add.at(normals, group, (_angles(corners)[..., None] * unit[:, None]).reshape(-1, 3))
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    alone = np.zeros((count, 3))
    alone[group] = np.repeat(unit, 3, axis=0)
    return group, np.where(length > 1e-6, normals / np.maximum(length, 1e-6), alone)


def _angles(corners: FloatArray) -> FloatArray:
    """(F, 3) angle (rad) at each corner: what a triangle has to say about a vertex's normal."""
    forward = np.roll(corners, -1, axis=1) - corners
    backward = np.roll(corners, 1, axis=1) - corners
    across = np.linalg.norm(np.cross(forward, backward), axis=-1)
    return np.arctan2(across, np.einsum("fci,fci->fc", forward, backward))


def _steps(points: FloatArray) -> Indices:
    size = float(np.ptp(points, axis=0).max()) or 1.0
    return np.round((points - points.min(axis=0)) * (_STEPS / size)).astype(np.int64)


def _unique(keys: Indices) -> tuple[Indices, Indices]:
    """Index of the first row of each kind, and the kind of every row."""
    kind = np.zeros(len(keys), dtype=np.int64)
    for column in keys.T:  # far faster than sorting whole rows
        _, value = np.unique(column, return_inverse=True)
        _, kind = np.unique(kind * (value.max() + 1) + value, return_inverse=True)
    _, first = np.unique(kind, return_index=True)
    return first, kind


def _is_proper(faces: Indices) -> NDArray[np.bool_]:
    return np.asarray((np.diff(np.sort(faces, axis=1), axis=1) > 0).all(axis=1))


def _proper(faces: Indices) -> Indices:
    """Triangles of three different vertices."""
    return faces[_is_proper(faces)]


def _doubled(corners: FloatArray) -> FloatArray:
    a, b, c = np.moveaxis(corners, 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=-1)
