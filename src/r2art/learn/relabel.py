"""Labels for a wrongly stated camera: the pose that looks most alike through it."""

from collections.abc import Sequence
from math import lcm

import torch
from jaxtyping import Float
from torch import Tensor

from r2art.method import se3
from r2art.method.depth import root_translation, translation_targets, viewing_ray
from r2art.method.projection import project
from r2art.method.rotation import allocentric_to_egocentric, egocentric_to_allocentric


def poses_through(
    stated_K: Sequence[Float[Tensor, "B 3 3"]],
    cam_T_part: Sequence[Float[Tensor, "B P 4 4"]],
    points: Sequence[Float[Tensor, "B P N 3"]],
    box: Sequence[Float[Tensor, "B 4"]],
    K: Sequence[Float[Tensor, "B 3 3"]],
) -> list[Float[Tensor, "B P 4 4"]]:
    """Part poses that project ``points`` through ``stated_K`` as nearly as can be to where the
    true camera sees them. The object moves as one: its joints and its size stay.

    All arguments are lists over categories, which may have different numbers of parts.

    Args:
        stated_K: Intrinsics that a user states.
        cam_T_part: True part poses.
        points: In the frame of each part (m), for instance its box's corners.
        box: The object's box (px).
        K: True intrinsics.
    """
    root_T_part = [se3.inverse(poses[:, :1]) @ poses for poses in cam_T_part]
    in_root = [se3.transform(T, p).flatten(1, 2) for T, p in zip(root_T_part, points, strict=True)]
    count = lcm(*(p.shape[1] for p in in_root))  # points of each count as often as the others
    in_root = [p.repeat(1, count // p.shape[1], 1) for p in in_root]
    cam_T_root = torch.cat([poses[:, 0] for poses in cam_T_part])
    moved = root_through(
        torch.cat(list(stated_K)),
        cam_T_root,
        torch.cat(in_root),
        torch.cat(list(box)),
        torch.cat(list(K)),
    )
    roots = moved.split([len(poses) for poses in cam_T_part])
    return [root[:, None] @ T for root, T in zip(roots, root_T_part, strict=True)]


def root_through(
    stated_K: Float[Tensor, "B 3 3"],
    cam_T_root: Float[Tensor, "B 4 4"],
    in_root: Float[Tensor, "B N 3"],
    box: Float[Tensor, "B 4"],
    K: Float[Tensor, "B 3 3"],
) -> Float[Tensor, "B 4 4"]:
    """The same of root poses alone, with points in the root's frame."""
    seen = project(se3.transform(cam_T_root, in_root), K)
    # Start: the same look relative to the viewing ray, the same offset and depth correction.
    facing = egocentric_to_allocentric(cam_T_root[:, :3, :3], viewing_ray(box, K))
    phi, log_lambda = translation_targets(cam_T_root[:, :3, 3], box, K, 1.0)
    start = se3.from_rotation_translation(
        allocentric_to_egocentric(facing, viewing_ray(box, stated_K)),
        root_translation(phi, log_lambda, box, stated_K, 1.0),
    )
    return refit_pose(in_root, seen, start, stated_K)


def refit_pose(
    points: Float[Tensor, "B N 3"],
    uv: Float[Tensor, "B N 2"],
    cam_T_root: Float[Tensor, "B 4 4"],
    K: Float[Tensor, "B 3 3"],
    steps: int = 5,
) -> Float[Tensor, "B 4 4"]:
    """Gauss-Newton on the reprojection error of known correspondences.

    Args:
        points: In the root frame (m).
        uv: Where they are seen (px).
        cam_T_root: A start from which every point lies in front of the camera.
        K: Intrinsics to see them through.
        steps: Damped steps; from a good start five are plenty.

    Returns:
        The refined pose; the start itself where the fit did not improve on it.
    """
    pose = cam_T_root
    for _ in range(steps):
        J, residual = _linearised(points, uv, pose, K)
        normal = J.mT @ J
        damping = 1e-4 * torch.diagonal(normal, dim1=-2, dim2=-1) + 1e-9
        step = torch.linalg.solve(normal + torch.diag_embed(damping), J.mT @ residual[..., None])
        pose = _moved(pose, step[..., 0])
    better = _error(points, uv, pose, K) < _error(points, uv, cam_T_root, K)
    return torch.where(better[:, None, None], pose, cam_T_root)


def _error(points: Tensor, uv: Tensor, pose: Tensor, K: Tensor) -> Float[Tensor, " B"]:
    return (project(se3.transform(pose, points), K) - uv).square().sum((-2, -1))


def _moved(pose: Tensor, step: Float[Tensor, "B 6"]) -> Tensor:
    """Turn about the camera's axes by ``step[:3]``, then shift by ``step[3:]``."""
    angle = torch.linalg.vector_norm(step[:, :3], dim=-1).clamp_min(1e-12)
    turn = se3.rotation_about_axis(step[:, :3] / angle[:, None], angle)
    return se3.from_rotation_translation(turn @ pose[:, :3, :3], pose[:, :3, 3] + step[:, 3:])


def _linearised(points: Tensor, uv: Tensor, pose: Tensor, K: Tensor) -> tuple[Tensor, Tensor]:
    """Jacobian (B, 2N, 6) of the pixels to a step of `_moved`, and what is missing (B, 2N)."""
    turned = points @ pose[:, :3, :3].mT
    camera = turned + pose[:, None, :3, 3]
    z = camera[..., 2].clamp_min(1e-2)
    focal = torch.stack([K[:, 0, 0], K[:, 1, 1]], dim=-1)[:, None]
    zero = torch.zeros_like(z)
    du = torch.stack([1 / z, zero, -camera[..., 0] / z**2], dim=-1)
    dv = torch.stack([zero, 1 / z, -camera[..., 1] / z**2], dim=-1)
    d_camera = torch.stack([du, dv], dim=-2) * focal[..., None]
    J = torch.cat([-d_camera @ se3.skew(turned), d_camera], dim=-1)
    return J.flatten(1, 2), (uv - project(camera, K)).flatten(1)
