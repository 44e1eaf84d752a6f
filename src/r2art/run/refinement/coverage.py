"""Silhouettes of closed meshes: the exact share of every pixel that is covered.

Seen faces add up to layers, L(p) = 1 or more within the silhouette, and the coverage is
min(L, 1). The edges at which seen faces end say all of it: a piece of an edge in a pixel adds the
area to its right in its row. The derivative is a boundary integral: the area that a moving edge
sweeps, in those pixels that are not wholly covered.

Letters as in `body`; I images (one per part, or one of all) of G × G pixels, N edges, C pieces.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.run.refinement.body import Body
from r2art.run.refinement.errors import Errors
from r2art.run.refinement.pose import Pose, Posed, posed
from r2art.run.refinement.silhouettes import NEAR, Level
from r2art.run.refinement.twists import twists, wrenches

FloatArray = NDArray[np.floating]
Indices = NDArray[np.integer]

FINER = 3
"""Cells along a pixel's side. Layers are cut off at 1 in every cell: where two edges of layers
one behind the other share a cell, as those of a thin wall do, it counts as covered too much."""
FULL = 1 - 1e-9
"""Layers of a cell that is wholly covered."""


@dataclass(frozen=True, kw_only=True)
class Pieces:
    """Straight edges, cut where they leave a pixel.

    Attributes:
        edge: (C,) the edge each belongs to.
        middle: (C,) where on it, from 0 to 1.
        share: (C,) how much of it.
        row: (C,) of pixels.
        column: (C,) likewise.
        right: (C,) mean share of the pixel's width to the right of it.
    """

    edge: Indices
    middle: FloatArray
    share: FloatArray
    row: Indices
    column: Indices
    right: FloatArray


def cut(begin: FloatArray, run: FloatArray) -> Pieces:
    """Cut edges from (N, 2) ``begin`` to ``begin + run`` (px) at all pixel borders."""
    edge = np.arange(len(begin))
    cuts = [edge.astype(float)]
    for x, dx in zip(begin.T, run.T, strict=True):
        first, last = np.floor(x), np.floor(x + dx)
        count = np.abs(last - first).astype(np.intp)
        which = np.repeat(edge, count)
        step = np.arange(1, len(which) + 1) - np.repeat(np.cumsum(count) - count, count)
        border = np.minimum(first, last)[which] + step
        at = (border - x[which]) / dx[which]
        cuts.append(which + np.clip(at, 0, 1 - 1e-12))
    at = np.sort(np.concatenate(cuts))
    which = at.astype(np.intp)
    at -= which
    until = np.ones_like(at)
    np.copyto(until[:-1], at[1:], where=which[1:] == which[:-1])
    middle = (at + until) / 2
    x, y = (b[which] + middle * r[which] for b, r in zip(begin.T, run.T, strict=True))
    column = np.floor(x)
    return Pieces(
        edge=which,
        middle=middle,
        share=until - at,
        row=np.floor(y).astype(np.intp),
        column=column.astype(np.intp),
        right=1 - (x - column),
    )


def layers(pieces: Pieces, fall: FloatArray, image: Indices, count: int, size: int) -> FloatArray:
    """(count, G, G) how many layers of seen faces each pixel has.

    Args:
        pieces: Of all edges.
        fall: (N,) how far (px) each edge leads down, with the faces to its left.
        image: (N,) to which of ``count`` images it belongs.
        size: G.
    """
    rows = np.flatnonzero((pieces.row >= 0) & (pieces.row < size) & (pieces.column < size))
    edge, column = pieces.edge[rows], pieces.column[rows]
    area = fall[edge] * pieces.share[rows]
    beyond = column < 0
    right = np.where(beyond, 1.0, pieces.right[rows])
    wide = size + 1
    index = (image[edge] * size + pieces.row[rows]) * wide + np.where(beyond, 0, column)
    total = np.bincount(index, area * right, count * size * wide + 1)
    total += np.bincount(index + 1, area * (1 - right), count * size * wide + 1)
    return total[:-1].reshape(count, size, wide)[..., :-1].cumsum(axis=-1)


def coverage_errors(body: Body, pose: Pose, level: Level, *, scale: bool) -> Errors:
    """Of (S, I G²) covered shares less the masks'."""
    shell = body.shell
    assert shell is not None
    at = posed(body, pose)
    start, edge, way = shell.outline(_eyes(body, pose, at))
    starts, parts = at.rotation.shape[:2]
    ends = shell.edges[edge].T
    part = shell.part[ends[0]]
    vertices = _vertices(body, pose, at)
    cells, pixels, focal = level.size * FINER, level.size, level.focal * FINER
    uv = vertices[:, :2] / np.maximum(vertices[:, 2:], NEAR) * focal[:, None]
    uv = np.clip(uv + level.center[:, None] * FINER, -cells, 2.0 * cells)
    uv = np.stack([uv[start, 0, ends], uv[start, 1, ends]])
    run = uv[:, 1] - uv[:, 0]
    pieces = cut(uv[:, 0].T, run.T)
    image = part if level.images > 1 else np.zeros_like(part)
    count = starts * level.images
    total = layers(pieces, way * run[1], start * level.images + image, count, cells)
    covered = _pooled(np.minimum(total, 1.0)).reshape(starts, -1)

    bounds = _bounding(pieces, start * level.images + image, total)
    which, middle, share = pieces.edge[bounds], pieces.middle[bounds], pieces.share[bounds]
    pixel = (image[which] * pixels + pieces.row[bounds] // FINER) * pixels
    pixel += pieces.column[bounds] // FINER
    wanted, by_border = level.wanted(pose.border)
    by_border = by_border.reshape(starts, -1)
    moving = np.bincount(pixel, minlength=covered.shape[1]) > 0
    moving = np.flatnonzero(moving | by_border.any(axis=0))
    place = np.empty(covered.shape[1], np.intp)
    place[moving] = np.arange(len(moving))

    used, which = _numbered(which, len(edge))
    ends, start, part = ends[:, used], start[used], part[used]
    x = vertices[start, :, ends]
    z = np.maximum(x[..., 2], NEAR)
    normal = np.stack([-run[1, used], run[0, used]]) * way[used] / FINER**2
    across = normal[:, None] * focal[:, None, None] / z
    pull = np.stack([*across, -(across * x[..., :2].transpose(2, 0, 1)).sum(axis=0) / z], axis=-1)
    rest = shell.vertices[ends]
    loads = wrenches(body, pose, at, start, part, rest, x, pull, scale=scale)
    begin, end = loads.transpose(0, 2, 1)
    flow = share * (begin[:, which] + middle * (end - begin)[:, which])
    index = (start * parts + part)[which] * len(moving) + place[pixel]
    size = starts * parts * len(moving)
    swept = np.stack([np.bincount(index, by, size) for by in flow])
    swept = swept.reshape(len(flow), starts, parts, len(moving)).transpose(1, 2, 0, 3)
    swept = swept.reshape(starts, parts * len(flow), len(moving))
    slopes = twists(body, pose, at, scale=scale) @ swept
    slopes[:, body.border] = by_border[:, moving]
    weight = level.weight.reshape(-1)
    return Errors(
        error=(covered - wanted.reshape(starts, -1)) * weight,
        slopes=slopes * weight[moving],
        moving=moving,
    )


def _numbered(which: Indices, count: int) -> tuple[Indices, Indices]:
    """Those of ``count`` that occur, and where among them each is."""
    used = np.flatnonzero(np.bincount(which, minlength=count))
    place = np.empty(count, np.intp)
    place[used] = np.arange(len(used))
    return used, place[which]


def _vertices(body: Body, pose: Pose, at: Posed) -> FloatArray:
    """(S, 3, V) the shell's vertices in the camera frame (m)."""
    shell = body.shell
    assert shell is not None
    at_rest = shell.vertices[None]
    if pose.log_scale.any():
        scale, center = np.exp(pose.log_scale), body.center[shell.part]
        at_rest = scale[:, :1] * center + scale[:, shell.part] * (at_rest - center)
    return shell.placed(at_rest.swapaxes(-1, -2), at.rotation, at.translation)


def _pooled(cells: FloatArray) -> FloatArray:
    """(..., G, G) means of the FINER² cells of every pixel."""
    rows = np.sum([cells[..., k::FINER, :] for k in range(FINER)], axis=0)
    return np.sum([rows[..., k::FINER] for k in range(FINER)], axis=0) / FINER**2


def _bounding(pieces: Pieces, image: Indices, total: FloatArray) -> Indices:
    """Pieces in cells that are not wholly covered: those whose move changes anything."""
    size = total.shape[-1]
    inside = (pieces.row >= 0) & (pieces.row < size) & (pieces.column >= 0)
    inside = np.flatnonzero(inside & (pieces.column < size))
    layers_there = total[image[pieces.edge[inside]], pieces.row[inside], pieces.column[inside]]
    return inside[layers_there < FULL]


def _eyes(body: Body, pose: Pose, at: Posed) -> FloatArray:
    """(S, P, 3) the camera's place in every part's frame at rest, before it is scaled."""
    eye = -(at.rotation.transpose(0, 1, 3, 2) @ at.translation[..., None])[..., 0]
    scale = np.exp(pose.log_scale)
    return (eye - scale[:, :1] * body.center) / scale + body.center
