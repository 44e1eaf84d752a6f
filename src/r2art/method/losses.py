"""The base losses on what the network predicts, which the paper does not give.

One number per sample each (``*B``), without units, so that weights near 1 suit them all.
"""

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from r2art.method.kinematics import KinematicModel
from r2art.method.projection import box_size, project
from r2art.method.shape import Deformation, Shape

ROBUST = 0.05
"""Where the smooth-L1 losses turn from square to linear: 5 % of the box, the range, the size."""


def direction_loss(
    predicted: Float[Tensor, "*B 3"], true: Float[Tensor, "*B 3"]
) -> Float[Tensor, "*B"]:
    """Pseudo-Huber of the chord between two directions of any length: their angle, for small ones.

    Linear from 3° on, so that objects seen the wrong way round do not outweigh the others, and
    between two answers that are both likely it takes one, not the middle. In [0, 1.95].
    """
    chord_squared = 2 - 2 * F.cosine_similarity(predicted, true, dim=-1, eps=1e-6)
    return _pseudo_huber(chord_squared)


def distance_loss(
    predicted: Float[Tensor, "*B 3"], true: Float[Tensor, "*B 3"]
) -> Float[Tensor, "*B"]:
    """Pseudo-Huber of the distance between two points."""
    return _pseudo_huber((predicted - true).square().sum(-1))


def _pseudo_huber(squared: Tensor) -> Tensor:
    return (squared + ROBUST**2).sqrt() - ROBUST


def offset_loss(phi: Float[Tensor, "*B 2"], true: Float[Tensor, "*B 2"]) -> Float[Tensor, "*B"]:
    """Smooth L1 of the projected root origin's offset φ (in box sizes)."""
    return _smooth_l1(phi - true).mean(-1)


def depth_loss(log_lambda: Float[Tensor, "*B"], true: Float[Tensor, "*B"]) -> Float[Tensor, "*B"]:
    """L1 of log λ: the relative depth error, for small ones."""
    return (log_lambda - true).abs()


def joint_state_loss(
    joint_state: Float[Tensor, "*B J"], true: Float[Tensor, "*B J"], kinematics: KinematicModel
) -> Float[Tensor, "*B"]:
    """Smooth L1 of the joint states, each in units of its range, mean over the joints."""
    span = (kinematics.limits[:, 1] - kinematics.limits[:, 0]).clamp_min(1e-3)
    return _smooth_l1((joint_state - true) / span).mean(-1)


def shape_loss(predicted: Deformation, true: Deformation, prior: Shape) -> Float[Tensor, "*B"]:
    """Smooth L1 of log-scales, and of centre shifts in units of their part's diagonal."""
    diagonal = torch.linalg.vector_norm(prior.box_size, dim=-1, keepdim=True)
    scale = _smooth_l1(predicted.log_scale - true.log_scale)
    shift = _smooth_l1((predicted.center_shift - true.center_shift) / diagonal)
    return (scale + shift).mean((-2, -1))


def reprojection_loss(
    predicted: Float[Tensor, "*B N 3"],
    true: Float[Tensor, "*B N 3"],
    K: Float[Tensor, "*B 3 3"],
    box: Float[Tensor, "*B 4"],
) -> Float[Tensor, "*B"]:
    """Smooth L1 between where N points project and where they should, in box sizes.

    Args:
        predicted: For instance the corners of all part boxes, in the camera frame (m).
        true: The same points at their true places.
        K: Intrinsics of the image the box is in.
        box: Around the object, ``x1 y1 x2 y2`` (px).
    """
    error = (project(predicted, K) - project(true, K)) / box_size(box)[..., None, :]
    return _smooth_l1(error).mean((-2, -1))


def _smooth_l1(error: Tensor) -> Tensor:
    size = error.abs()
    near = size.clamp_max(ROBUST)  # never squares what is far, so nothing overflows
    return near.square() / (2 * ROBUST) + (size - near)
