"""How wrong a pose is: the measures of the 6D pose literature, for parts and joints.

Everything is in metres and radians; reports convert. Letters: B batch, P parts, M points.
Overlap of boxes is in `r2art.learn.overlap`.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.spatial.distance import pdist
from scipy.stats import rankdata

from r2art.core.category import Category

FloatArray = NDArray[np.floating]


def model_points(category: Category, box_center: FloatArray, box_size: FloatArray) -> FloatArray:
    """(P, M, 3) model points of an instance: the prior's, stretched from its boxes to these.

    Args:
        category: The prior.
        box_center: (P, 3) centres of the instance's part boxes at rest (m).
        box_size: (P, 3) their extents (m).
    """
    stretch = box_size / category.box_size
    from_center = category.points - category.box_center[:, None]
    return box_center[:, None] + stretch[:, None] * from_center


def moved(cam_T_part: FloatArray, points: FloatArray) -> FloatArray:
    """(*B, M, 3) points in the camera frame, from (*B, 4, 4) poses and (*B, M, 3) points."""
    return points @ np.swapaxes(cam_T_part[..., :3, :3], -1, -2) + cam_T_part[..., None, :3, 3]


def add(points: FloatArray, pose: FloatArray, true_pose: FloatArray) -> FloatArray:
    """(*B,) mean distance (m) between the model points under two (*B, 4, 4) poses."""
    apart = moved(pose, points) - moved(true_pose, points)
    return np.linalg.norm(apart, axis=-1).mean(axis=-1)


def add_s(points: FloatArray, pose: FloatArray, true_pose: FloatArray) -> FloatArray:
    """(P,) mean distance (m) from each point, truly posed, to the nearest one as predicted.

    The measure for parts that look the same from several sides; never above `add`.
    """
    predicted, true = moved(pose, points), moved(true_pose, points)
    return np.array([KDTree(a).query(b)[0].mean() for a, b in zip(predicted, true, strict=True)])


def diameter(points: FloatArray) -> FloatArray:
    """(P,) largest distance (m) between any two model points of a part."""
    return np.array([pdist(part).max() for part in points])


def auc(errors: FloatArray, tau: float) -> float:
    """Area under the recall curve up to ``tau``, as a share of 1; exact, not sampled.

    Recall at t is the share of errors ≤ t, a step function. One error e contributes the time
    from e to tau, so the area is the mean of max(0, 1 − e/tau). Failures are inf and give 0.
    """
    return float(np.clip(1 - np.asarray(errors) / tau, 0, 1).mean())


def rotation_error(R: FloatArray, R_true: FloatArray) -> FloatArray:
    """(*B,) geodesic angle (rad, 0 to π) between (*B, 3, 3) rotations."""
    A = np.swapaxes(R_true, -1, -2) @ R
    skew = np.stack([A[..., 2, 1], A[..., 0, 2], A[..., 1, 0]], -1) - np.stack(
        [A[..., 1, 2], A[..., 2, 0], A[..., 0, 1]], -1
    )
    # atan2 is exact at both ends, where the usual arccos loses half of the digits.
    return np.arctan2(np.linalg.norm(skew, axis=-1), np.trace(A, axis1=-2, axis2=-1) - 1)


def translation_error(center: FloatArray, pose: FloatArray, true_pose: FloatArray) -> FloatArray:
    """(*B,) how far (m) the pose carries the (*B, 3) centre of a part's true box astray.

    The frame's origin would be a poor choice: that of a lid lies in the base, outside of it.
    """
    apart = moved(pose, center[..., None, :]) - moved(true_pose, center[..., None, :])
    return np.linalg.norm(apart[..., 0, :], axis=-1)


def axis_error(axis: FloatArray, true_axis: FloatArray) -> FloatArray:
    """(*B,) angle (rad, 0 to π) between directions; a joint that turns backwards is π wrong."""
    cross = np.linalg.norm(np.cross(axis, true_axis), axis=-1)
    return np.arctan2(cross, (axis * true_axis).sum(-1))


def pivot_error(pivot: FloatArray, true_pivot: FloatArray, true_axis: FloatArray) -> FloatArray:
    """(*B,) distance (m) of a pivot from the true axis, a line; where on it does not matter."""
    return np.linalg.norm(np.cross(pivot - true_pivot, true_axis), axis=-1)


def alignment_scale(points: FloatArray, pose: FloatArray, true_pose: FloatArray) -> float:
    """The factor on all predicted translations that brings the object nearest to the truth.

    One photo does not tell size from distance: a scene scaled about the camera looks the same.
    This is the s that minimises Σ ‖R x + s t − (R* x + t*)‖² over the points of all parts.

    Args:
        points: (P, M, 3) model points.
        pose: (P, 4, 4) predicted poses.
        true_pose: (P, 4, 4) true poses.
    """
    t = pose[:, None, :3, 3]
    wanted = moved(true_pose, points) - moved(pose, points) + t
    norm = (t**2).sum() * points.shape[1]
    return float((wanted * t).sum() / norm) if norm > 0 else 1.0


def rescaled(pose: FloatArray, scale: float) -> FloatArray:
    """(*B, 4, 4) poses whose translations are multiplied by ``scale``."""
    out = pose.copy()
    out[..., :3, 3] *= scale
    return out


def auroc(score: FloatArray, positive: NDArray[np.bool_]) -> float:
    """Chance that a positive outscores a negative (ties count half); nan if one is missing."""
    score, positive = np.ravel(score), np.ravel(positive)
    n = np.count_nonzero(positive)
    pairs = n * (positive.size - n)
    if pairs == 0:
        return float("nan")
    return float((rankdata(score)[positive].sum() - n * (n + 1) / 2) / pairs)


def bootstrap_median(
    values: FloatArray, resamples: int = 1000, level: float = 0.95, seed: int = 0
) -> tuple[float, float]:
    """Interval that holds the median of all ``values`` with probability ``level``.

    Args:
        values: (N, ...) one row per image; whole rows are drawn again, because the parts of one
            image err together. Failures may be inf.
        resamples: How many times N rows are drawn with replacement.
        level: Of confidence.
        seed: Of the draws.
    """
    n = len(values)
    rows = values.reshape(n, -1)
    draws = np.random.default_rng(seed).integers(n, size=(resamples, n))
    # Ten at a time, for many images make large arrays.
    drawn = (rows[d].reshape(len(d), -1) for d in np.array_split(draws, -(-resamples // 10)))
    medians = np.concatenate([np.median(d, axis=1) for d in drawn])
    low, high = np.quantile(medians, [(1 - level) / 2, (1 + level) / 2], method="nearest")
    return float(low), float(high)
