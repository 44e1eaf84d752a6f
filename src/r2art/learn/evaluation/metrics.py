"""How wrong a pose is: the measures of the 6D pose literature, for parts and joints.

Everything is in metres and radians; reports convert. Letters: B batch, P parts, M points.
Overlap of boxes is in `overlap`, what many images come to in `statistics`, beside this file.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.spatial.distance import pdist

from r2art.core.category import Category

FloatArray = NDArray[np.floating]

LEAST_SCALE = 1e-3
"""Where even the direction is wrong, the best factor would be 0 or less, and no scene left."""


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
    This is the s that minimises Σ ‖R x + s t − (R* x + t*)‖² over the points of all parts; it is
    positive, at least `LEAST_SCALE`.

    Args:
        points: (P, M, 3) model points.
        pose: (P, 4, 4) predicted poses.
        true_pose: (P, 4, 4) true poses.
    """
    t = pose[:, None, :3, 3]
    wanted = moved(true_pose, points) - moved(pose, points) + t
    norm = (t**2).sum() * points.shape[1]
    return max(float((wanted * t).sum() / norm), LEAST_SCALE) if norm > 0 else 1.0


def rescaled(pose: FloatArray, scale: float) -> FloatArray:
    """(*B, 4, 4) poses whose translations are multiplied by ``scale``."""
    out = pose.copy()
    out[..., :3, 3] *= scale
    return out
