"""Places of a photo of which it is known which point of the object they show.

Of each, the network names the part, the point in that part's box, and how far off it may be seen.
Errors are distances in the photo in units of that; far ones count as little more than their
distance does (a pseudo-Huber), for some places are simply taken for others.
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


@dataclass(frozen=True, kw_only=True)
class Correspondences:
    """N places.

    Attributes:
        part: (N,) that each shows.
        coordinates: (N, 3) which point of it, from -0.5 to 0.5 along the axes of its box.
        uv: (N, 2) where (px).
        deviation: (N,) how far (px) the point may be seen from there.
    """

    part: NDArray[np.intp]
    coordinates: FloatArray
    uv: FloatArray
    deviation: FloatArray


def correspondence_errors(
    body: Body, pose: Pose, known: Correspondences, K: FloatArray, *, scale: bool
) -> Errors:
    """Of (S, 2 N) the places' distances along the photo's axes, in deviations.

    Errors and slopes are weighted so that their squares add up to the pseudo-Huber loss, and their
    product is half its gradient.
    """
    at = posed(body.hollow(), pose)
    S, N = len(pose.rotation), len(known.part)
    start, part = np.repeat(np.arange(S), N), np.tile(known.part, S)
    local = known.coordinates * body.size[known.part]
    rest = np.tile(body.center[known.part] + local, (S, 1))
    stretch = np.exp(pose.log_scale)
    moved = stretch[start, 0] * body.center[part] + stretch[start, part] * np.tile(local, (S, 1))
    x = (at.rotation[start, part] @ moved[..., None])[..., 0] + at.translation[start, part]
    z = np.maximum(x[:, 2], NEAR)
    focal, center = K.diagonal()[:2], K[:2, 2]
    off = (x[:, :2] / z[:, None] * focal + center - np.tile(known.uv, (S, 1))).T
    off = off / np.tile(known.deviation, S)
    pull = np.zeros((2, S * N, 3))
    per_unit = focal[:, None] / z / np.tile(known.deviation, S)
    pull[0, :, 0], pull[1, :, 1] = per_unit
    pull[:, :, 2] = -per_unit * x[:, :2].T / z
    loads = wrenches(body, pose, at, start, part, rest, x, pull, scale=scale)
    motions = twists(body, pose, at, scale=scale)
    motions = motions.reshape(S, motions.shape[1], len(body.center), -1)
    slopes = np.einsum("rnq,ndq->ndr", loads, motions[start, :, part])
    root = np.sqrt(1 + (off**2).sum(axis=0))
    weight = np.sqrt(2 / (root + 1))  # of the error: 2 (root - 1) is the loss
    slopes = slopes * (1 / (root * weight))[:, None, None]
    slopes = slopes.reshape(S, N, -1, 2).transpose(0, 2, 1, 3).reshape(S, -1, 2 * N)
    error = (off * weight).reshape(2, S, N).transpose(1, 2, 0).reshape(S, 2 * N)
    return Errors(error=error, slopes=slopes, moving=np.arange(2 * N))
