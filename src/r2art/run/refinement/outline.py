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
from r2art.run.refinement.pose import Place, Pose, motions, posed
from r2art.run.refinement.silhouettes import NEAR

FloatArray = NDArray[np.floating]


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


def reach_errors(
    body: Body, pose: Pose, wanted: Outline, *, scale: bool
) -> tuple[FloatArray, FloatArray]:
    """(S, I K) the body's reach and border less the masks', and its (S, D, I K) derivatives.

    Where an object may reach farther than its mask, only reaching less far is an error.
    """
    at = posed(body, pose)
    S, P, _, M = at.points.shape
    images, count = wanted.reach.shape
    z = np.maximum(at.points[:, :, 2], NEAR)
    along = wanted.directions @ (at.points[:, :, :2] / z[:, :, None])
    if images == 1:
        along = along.transpose(0, 2, 1, 3).reshape(S, 1, count, P * M)
    farthest = along.argmax(axis=-1)
    error = np.take_along_axis(along, farthest[..., None], -1)[..., 0] - wanted.reach
    error += pose.border[:, None, None]
    part = farthest // M if images == 1 else np.arange(P)[:, None]
    part = np.broadcast_to(part, farthest.shape)
    start, point = np.arange(S)[:, None, None], farthest % M
    x = at.points[start, part, :, point]
    place = Place(start=start, part=part, rest=body.points[part, :, point])
    moves = motions(body, pose, at, place, x, scale=scale)
    distance = np.maximum(x[..., 2], NEAR)
    by_xy = moves[..., :2] - (x[..., None, :2] / distance[..., None, None]) * moves[..., 2:]
    slopes = (by_xy * wanted.directions[:, None]).sum(axis=-1) / distance[..., None]
    slopes[..., body.border] = 1.0
    counts = (wanted.told > 0) | (error < 0) & np.isfinite(error)
    error, slopes = np.where(counts, error, 0.0), slopes * counts[..., None]
    return error.reshape(S, -1), slopes.reshape(S, images * count, -1).transpose(0, 2, 1)
