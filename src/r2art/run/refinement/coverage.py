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
from r2art.run.refinement.pose import Place, Pose, Posed, motions, posed
from r2art.run.refinement.silhouettes import NEAR, Level

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
    ends = begin + run
    cuts = [edge.astype(float)]
    for axis in (0, 1):
        low = np.floor(np.minimum(begin[:, axis], ends[:, axis]))
        count = (np.floor(np.maximum(begin[:, axis], ends[:, axis])) - low).astype(np.intp)
        which = np.repeat(edge, count)
        step = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        border = low[which] + 1 + step
        at = (border - begin[which, axis]) / run[which, axis]
        cuts.append(which + np.clip(at, 0, 1 - 1e-12))
    at = np.sort(np.concatenate(cuts))
    which = at.astype(np.intp)
    at -= which
    until = np.ones_like(at)
    same = which[1:] == which[:-1]
    until[:-1][same] = at[1:][same]
    middle = (at + until) / 2
    place = begin[which] + middle[:, None] * run[which]
    corner = np.floor(place)
    return Pieces(
        edge=which,
        middle=middle,
        share=until - at,
        row=corner[:, 1].astype(np.intp),
        column=corner[:, 0].astype(np.intp),
        right=1 - (place[:, 0] - corner[:, 0]),
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


def coverage_errors(
    body: Body, pose: Pose, level: Level, *, scale: bool
) -> tuple[FloatArray, FloatArray]:
    """(S, I G²) covered shares less the masks', and their (S, D, I G²) derivatives."""
    shell = body.shell
    assert shell is not None
    at = posed(body, pose)
    start, edge, way = shell.outline(_eyes(body, pose, at))
    ends = shell.edges[edge]
    place = Place(start=start[:, None], part=shell.part[ends], rest=shell.vertices[ends])
    x = place.seen(body, pose, at)
    z = np.maximum(x[..., 2:], NEAR)
    cells, pixels, focal = level.size * FINER, level.size, level.focal * FINER
    uv = np.clip(x[..., :2] / z * focal + level.center * FINER, -cells, 2.0 * cells)
    run = uv[:, 1] - uv[:, 0]
    pieces = cut(uv[:, 0], run)
    image = start * level.images + (place.part[:, 0] if level.images > 1 else 0)
    starts = len(pose.rotation)
    count = starts * level.images
    total = layers(pieces, way * run[:, 1], image, count, cells)
    covered = np.minimum(total, 1.0).reshape(count, pixels, FINER, pixels, FINER)

    bounds = _bounding(pieces, image, total)
    index = image[pieces.edge] * pixels + pieces.row // FINER
    index = (index * pixels + pieces.column // FINER)[bounds]
    used, which = np.unique(pieces.edge[bounds], return_inverse=True)
    moves = motions(body, pose, at, place.pick(used), x[used], scale=scale)
    by_uv = (moves[..., :2] - (x / z)[used][..., None, :2] * moves[..., 2:]) * focal
    by_uv *= (way[used] / FINER**2)[:, None, None, None] / z[used][..., None]
    across = run[used][:, None, None]
    swept = across[..., 0] * by_uv[..., 1] - across[..., 1] * by_uv[..., 0]
    middle, share = pieces.middle[bounds, None], pieces.share[bounds, None]
    flow = share * ((1 - middle) * swept[which, 0] + middle * swept[which, 1])
    slopes = [np.bincount(index, by, count * pixels**2).reshape(starts, -1) for by in flow.T]
    slopes = np.stack(slopes, axis=1)

    wanted, by_border = level.wanted(pose.border)
    slopes[:, body.border] = by_border.reshape(starts, -1)
    weight = level.weight.reshape(-1)
    error = covered.mean(axis=(2, 4)).reshape(starts, -1) - wanted.reshape(starts, -1)
    return error * weight, slopes * weight


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
