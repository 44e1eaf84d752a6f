"""The pinhole camera on tensors: points to pixels, and the box around them.

Pixels as everywhere: an image covers [0, width] × [0, height]. Metres in the camera frame.
"""

import torch
from jaxtyping import Float
from torch import Tensor

MIN_DEPTH = 0.01
"""Metres. What is nearer, or behind the camera, is projected as if it were this far."""


def project(
    points: Float[Tensor, "*#B N 3"], K: Float[Tensor, "*#B 3 3"]
) -> Float[Tensor, "*B N 2"]:
    """Pixels of N camera-frame points (m) per camera; finite for every finite point."""
    z = points[..., 2:].clamp_min(MIN_DEPTH)
    focal = torch.stack([K[..., 0, 0], K[..., 1, 1]], dim=-1)
    return points[..., :2] / z * focal[..., None, :] + K[..., None, :2, 2]


def resize_intrinsics(K: Float[Tensor, "*B 3 3"], scale: float) -> Float[Tensor, "*B 3 3"]:
    """Intrinsics of the same image sampled at ``scale`` times its width and height."""
    return torch.cat([K[..., :2, :] * scale, K[..., 2:, :]], dim=-2)


def box_of_points(uv: Float[Tensor, "*B N 2"], softness: float = 0.0) -> Float[Tensor, "*B 4"]:
    """The box ``x1 y1 x2 y2`` around points, wherever they are: it is not cut to the image.

    Args:
        uv: Pixels.
        softness: 0 takes the extreme points, whose gradient moves one point per side. Above
            it, a mean over the points within about so many pixels of the side replaces them,
            which shares the gradient and draws the box in a little.
    """
    if softness == 0:
        return torch.cat([uv.amin(-2), uv.amax(-2)], dim=-1)
    lower = (torch.softmax(-uv / softness, dim=-2) * uv).sum(-2)
    upper = (torch.softmax(uv / softness, dim=-2) * uv).sum(-2)
    return torch.cat([lower, upper], dim=-1)


def box_size(box: Float[Tensor, "*B 4"]) -> Float[Tensor, "*B 2"]:
    """Width and height (px) of ``x1 y1 x2 y2``."""
    return box[..., 2:] - box[..., :2]


def box_center(box: Float[Tensor, "*B 4"]) -> Float[Tensor, "*B 2"]:
    """Middle (px) of ``x1 y1 x2 y2``."""
    return (box[..., :2] + box[..., 2:]) / 2
