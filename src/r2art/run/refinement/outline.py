"""How far masks and posed bodies reach in every direction: the quick part of refinement.

The *reach* of a silhouette in a direction is the greatest coordinate of its pixels along it; four
directions make its box, more of them its convex outline. The body's reach moves with the point
that reaches farthest, so a Gauss-Newton step costs no rendering, and it leads home from where no
pixel overlaps. Reaches are in normalised image coordinates, x/z and y/z. Letters as in
`body`; I outlines (of every part, or of the whole), K directions.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.run.refinement.body import Body
from r2art.run.refinement.errors import Errors
from r2art.run.refinement.pose import Pose, posed
from r2art.run.refinement.silhouettes import NEAR
from r2art.run.refinement.twists import twists, wrenches

FloatArray = NDArray[np.floating]

CACHED = 1 << 16
"""Numbers that a core has at hand."""


@dataclass(frozen=True, kw_only=True)
class Outline:
    """The convex outlines of masks.

    Attributes:
        directions: (K, 2) unit.
        reach: (I, K).
        told: (I, K) 0 where the object may reach farther: the mask ends at the image's border, or
            what is not known lies beyond it.
        corners: The box ``x1 y1 x2 y2`` around all of them.
    """

    directions: FloatArray
    reach: FloatArray
    told: FloatArray
    corners: FloatArray

    @property
    def extent(self) -> float:
        """Mean side of the box."""
        return float((self.corners[2:] - self.corners[:2]).mean())


def outline(masks: FloatArray, known: FloatArray, K: FloatArray, count: int) -> Outline:
    """The reach of (I, H, W) masks in ``count`` directions, the box's four among them."""
    angle = 2 * np.pi * np.arange(count) / count
    directions = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    reach, told = zip(
        *[_reach(m, k, K, directions) for m, k in zip(masks, known, strict=True)], strict=True
    )
    reach, told = np.stack(reach), np.stack(told)
    whole = reach[:, :: count // 4].max(axis=0)
    corners = np.array([-whole[2], -whole[3], whole[0], whole[1]])
    return Outline(directions=directions, reach=reach, told=told, corners=corners)


def _reach(
    mask: FloatArray, known: FloatArray, K: FloatArray, directions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Of one mask; an empty one tells nothing."""
    height, width = mask.shape
    inside = mask * known > 0.5
    if not inside.any():
        return np.full(len(directions), -np.inf), np.zeros(len(directions))

    def along(pixels: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
        corners = _row_ends(pixels)
        return corners, directions @ ((corners - K[:2, 2]) / [K[0, 0], K[1, 1]]).T

    corners, reaches = along(inside)
    farthest = reaches.argmax(axis=-1)
    reach = reaches.max(axis=-1)
    at_border = np.any((corners <= 0) | (corners >= [width, height]), axis=-1)
    cut = np.asarray(at_border)[farthest]
    hidden = known < 0.5
    if (_grown(inside) & hidden).any():
        cut |= along(hidden)[1].max(axis=-1) > reach
    return reach, 1.0 - cut


def _row_ends(pixels: NDArray[np.bool_]) -> FloatArray:
    """(N, 2) corners of the first and last pixel of every row that has any."""
    rows = np.flatnonzero(pixels.any(axis=1))
    left = pixels[rows].argmax(axis=1)
    right = pixels.shape[1] - pixels[rows, ::-1].argmax(axis=1)
    x, y = np.concatenate([left, right] * 2), np.concatenate([rows, rows, rows + 1, rows + 1])
    return np.stack([x, y], axis=-1).astype(float)


def _grown(pixels: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """With the pixels beside them."""
    grown = pixels.copy()
    grown[1:] |= pixels[:-1]
    grown[:-1] |= pixels[1:]
    grown[:, 1:] |= pixels[:, :-1]
    grown[:, :-1] |= pixels[:, 1:]
    return grown


def reach_errors(body: Body, pose: Pose, wanted: Outline, *, scale: bool) -> Errors:
    """Of (S, I K) the body's reach and border less the masks'.

    Where an object may reach farther than its mask, only reaching less far is an error.
    """
    at = posed(body, pose)
    S, P, _, M = at.points.shape
    images, count = wanted.reach.shape
    z = np.maximum(at.points[:, :, 2], NEAR)
    uv = at.points[:, :, :2] / z[:, :, None]
    if images == 1:
        uv = uv.transpose(0, 2, 1, 3).reshape(S, 1, 2, P * M)
    farthest = _farthest(uv, wanted.directions)
    part = farthest // M if images == 1 else np.arange(P)[:, None]
    start, part, point = (
        np.broadcast_to(a, farthest.shape).ravel()
        for a in (np.arange(S)[:, None, None], part, farthest % M)
    )
    x = at.points[start, part, :, point]
    z = np.maximum(x[:, 2:], NEAR)
    across = np.tile(wanted.directions, (S * images, 1)) / z
    along = (across * x[:, :2]).sum(axis=-1, keepdims=True)
    error = along.reshape(farthest.shape) - wanted.reach + pose.border[:, None, None]
    pull = np.concatenate([across, -along / z], axis=-1)
    rest = body.points[part, :, point]
    loads = wrenches(body, pose, at, start, part, rest, x, pull, scale=scale)
    by = twists(body, pose, at, scale=scale).reshape(S, -1, P, loads.shape[-1])
    slopes = (by[start, :, part] @ loads[..., None]).reshape(S, images * count, -1)
    slopes[..., body.border] = 1.0
    counts = (wanted.told > 0) | (error < 0) & np.isfinite(error)
    error, counts = np.where(counts, error, 0.0).reshape(S, -1), counts.reshape(S, -1, 1)
    return Errors(
        error=error,
        slopes=(slopes * counts).transpose(0, 2, 1),
        moving=np.arange(images * count),
    )


def _farthest(uv: FloatArray, directions: FloatArray) -> NDArray[np.integer]:
    """(S, I, K) which of (S, I, 2, M) points reach farthest in each direction.

    Some starts at a time and in single precision: products that do not fit the cache take longer.
    """
    uv, directions = uv.astype(np.float32), directions.astype(np.float32)
    few = max(1, CACHED // (len(directions) * uv[0, :, 0].size))
    some = range(0, len(uv), few)
    return np.concatenate([(directions @ uv[k : k + few]).argmax(axis=-1) for k in some])
