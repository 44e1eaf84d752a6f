"""Section 4.1: the root's rotation from two directions, seen along the viewing ray.

The network predicts the root's up (y) and right (x) axes in the *allocentric* frame: the
camera frame turned so that its z axis is the ray through the box centre. An object that moves
sideways keeps its looks, and its allocentric rotation, while its egocentric one changes.
"""

import torch
from jaxtyping import Bool, Float
from torch import Tensor

PARALLEL_SINE = 1e-2
"""Below this sine of the angle between up and right, the rotation is not to be trusted."""


def rotation_from_directions(
    up: Float[Tensor, "*B 3"], right: Float[Tensor, "*B 3"]
) -> Float[Tensor, "*B 3 3"]:
    """Gram-Schmidt: the rotation with columns x (right), y (up) and z = x × y (front).

    Up keeps its direction exactly; right is made orthogonal to it. Lengths do not matter. Any
    finite input gives a rotation: a zero or parallel direction is replaced by an arbitrary
    one, without gradient. Half precision is widened to float32.
    """
    wide = torch.promote_types(up.dtype, torch.float32)
    up, right = up.to(wide), right.to(wide)
    e_x, e_y = torch.eye(3, dtype=wide, device=up.device)[:2]
    y = _unit(up, otherwise=e_y)
    x = _unit(_orthogonal_part(_unit(right, otherwise=e_x), y), otherwise=_any_orthogonal(y))
    return torch.stack([x, y, torch.linalg.cross(x, y)], dim=-1)


def directions_are_parallel(
    up: Float[Tensor, "*B 3"], right: Float[Tensor, "*B 3"], sine: float = PARALLEL_SINE
) -> Bool[Tensor, "*B"]:
    """Whether the two directions are too nearly parallel to tell a rotation."""
    cross = torch.linalg.vector_norm(torch.linalg.cross(up.float(), right.float()), dim=-1)
    up_norm, right_norm = (torch.linalg.vector_norm(v.float(), dim=-1) for v in (up, right))
    return cross <= sine * up_norm * right_norm


def ray_rotation(ray: Float[Tensor, "*B 3"]) -> Float[Tensor, "*B 3 3"]:
    """The smallest rotation that takes the optical axis (0, 0, 1) to ``ray``.

    Args:
        ray: Any length; in front of the camera (z > 0).
    """
    x, y, z = (ray / torch.linalg.vector_norm(ray, dim=-1, keepdim=True)).unbind(-1)
    k = 1 / (1 + z)
    rows = [1 - k * x * x, -k * x * y, x, -k * x * y, 1 - k * y * y, y, -x, -y, z]
    return torch.stack(rows, dim=-1).unflatten(-1, (3, 3))


def allocentric_to_egocentric(
    R: Float[Tensor, "*#B 3 3"], ray: Float[Tensor, "*#B 3"]
) -> Float[Tensor, "*B 3 3"]:
    """From a rotation relative to the viewing ray to one in the camera frame."""
    return ray_rotation(ray) @ R


def egocentric_to_allocentric(
    R: Float[Tensor, "*#B 3 3"], ray: Float[Tensor, "*#B 3"]
) -> Float[Tensor, "*B 3 3"]:
    """From a rotation in the camera frame to one relative to the viewing ray."""
    return ray_rotation(ray).mT @ R


def _unit(v: Float[Tensor, "*B 3"], otherwise: Float[Tensor, "*#B 3"]) -> Float[Tensor, "*B 3"]:
    norm = torch.linalg.vector_norm(v, dim=-1, keepdim=True)
    return torch.where(norm > 1e-6, v / norm.clamp_min(1e-6), otherwise)


def _orthogonal_part(v: Float[Tensor, "*B 3"], unit: Float[Tensor, "*B 3"]) -> Tensor:
    # Twice: what rounding leaves of ``unit`` after the first pass matters when the rest is small.
    v = v - (v * unit).sum(-1, keepdim=True) * unit
    return v - (v * unit).sum(-1, keepdim=True) * unit


def _any_orthogonal(unit: Float[Tensor, "*B 3"]) -> Float[Tensor, "*B 3"]:
    unit = unit.detach()
    x, y, z = unit.unbind(-1)
    o = torch.zeros_like(x)
    flat = torch.where((z.abs() < 0.7)[..., None], _stack(-y, x, o), _stack(-z, o, x))
    return flat / torch.linalg.vector_norm(flat, dim=-1, keepdim=True)


def _stack(x: Tensor, y: Tensor, z: Tensor) -> Tensor:
    return torch.stack([x, y, z], dim=-1)
