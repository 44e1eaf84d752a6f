"""Rigid motions as plain ``(*B, 4, 4)`` tensors named ``a_T_b``: they map b-coordinates to a.

`forward_kinematics` and all that follows it multiply small matrices; run them outside of
autocast, where a bfloat16 product would cost millimetres.
"""

import torch
from jaxtyping import Float
from torch import Tensor


def skew(v: Float[Tensor, "*B 3"]) -> Float[Tensor, "*B 3 3"]:
    """The matrix ``[v]×`` that multiplies a vector as ``cross(v, ·)`` does."""
    x, y, z = v.unbind(-1)
    o = torch.zeros_like(x)
    return torch.stack([o, -z, y, z, o, -x, -y, x, o], dim=-1).unflatten(-1, (3, 3))


def rotation_about_axis(
    axis: Float[Tensor, "*#B 3"], angle: Float[Tensor, "*#B"]
) -> Float[Tensor, "*B 3 3"]:
    """Rodrigues' formula: turn by ``angle`` (rad) about the unit vector ``axis``.

    ``cosθ I + (1−cosθ) u uᵀ + sinθ [u]×``, with ``u uᵀ = I + [u]×²``.
    """
    k = skew(axis)
    s, c = angle.sin()[..., None, None], angle.cos()[..., None, None]
    return torch.eye(3, dtype=k.dtype, device=k.device) + s * k + (1 - c) * (k @ k)


def from_rotation_translation(
    R: Float[Tensor, "*#B 3 3"], t: Float[Tensor, "*#B 3"]
) -> Float[Tensor, "*B 4 4"]:
    """The pose that rotates by ``R``, then moves by ``t``."""
    batch = torch.broadcast_shapes(R.shape[:-2], t.shape[:-1])
    top = torch.cat([R.expand(*batch, 3, 3), t[..., None].expand(*batch, 3, 1)], dim=-1)
    bottom = torch.eye(4, dtype=top.dtype, device=top.device)[3:]
    return torch.cat([top, bottom.expand(*batch, 1, 4)], dim=-2)


def transform(
    a_T_b: Float[Tensor, "*#B 4 4"], points: Float[Tensor, "*#B N 3"]
) -> Float[Tensor, "*B N 3"]:
    """Carry N points per pose from frame b to frame a."""
    return points @ a_T_b[..., :3, :3].mT + a_T_b[..., None, :3, 3]


def inverse(a_T_b: Float[Tensor, "*B 4 4"]) -> Float[Tensor, "*B 4 4"]:
    """``b_T_a``, by transposing the rotation."""
    R = a_T_b[..., :3, :3].mT
    return from_rotation_translation(R, -(R @ a_T_b[..., :3, 3:])[..., 0])


def rotation_angle(
    Ra: Float[Tensor, "*#B 3 3"], Rb: Float[Tensor, "*#B 3 3"]
) -> Float[Tensor, "*B"]:
    """Angle (rad, in [0, π]) of the rotation between two rotations.

    ``atan2`` of sine and cosine keeps full accuracy at both ends, where ``acos`` of the trace
    loses half its digits and its gradient is infinite; here the gradient is 0 at 0 and π.
    """
    R = Ra.mT @ Rb
    x = R[..., 2, 1] - R[..., 1, 2]
    y = R[..., 0, 2] - R[..., 2, 0]
    z = R[..., 1, 0] - R[..., 0, 1]
    sine = torch.linalg.vector_norm(torch.stack([x, y, z], dim=-1), dim=-1)
    cosine = R.diagonal(dim1=-2, dim2=-1).sum(-1) - 1
    return torch.atan2(sine, cosine)
