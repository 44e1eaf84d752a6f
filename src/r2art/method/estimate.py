"""The flow of the method in one function: raw numbers to the poses of all parts.

Training, evaluation and export call this same composition.
"""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

from r2art.method import se3
from r2art.method.depth import root_translation, viewing_ray
from r2art.method.kinematics import forward_kinematics, joint_states, joints_in_camera
from r2art.method.outputs import NodePoses, RawEstimate
from r2art.method.rotation import allocentric_to_egocentric, rotation_from_directions
from r2art.method.shape import Deformation, Prior, Shape, deform

GREATEST_LOGARITHM = 5.0
"""What a network that went astray says beyond it would only overflow further on."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Everything known about the object in a photo.

    Attributes:
        cam_T_part: Pose of every part.
        joint_state: Angle (rad) or distance (m) of every joint.
        shape: The deformed prior, at rest in the root frame.
        axis: Unit direction of every joint in the camera frame, as the object stands.
        pivot: A point (m) on every joint's line, likewise.
    """

    cam_T_part: Float[Tensor, "*B P 4 4"]
    joint_state: Float[Tensor, "*B J"]
    shape: Shape
    axis: Float[Tensor, "*B J 3"]
    pivot: Float[Tensor, "*B J 3"]


def state_from_share(share: Float[Tensor, "*B J"], limits: Float[Tensor, "J 2"]) -> Tensor:
    """Joint states (rad, m) from their share of the range."""
    return limits[:, 0] + share * (limits[:, 1] - limits[:, 0])


def share_from_state(state: Float[Tensor, "*B J"], limits: Float[Tensor, "J 2"]) -> Tensor:
    """The inverse of `state_from_share`."""
    return (state - limits[:, 0]) / (limits[:, 1] - limits[:, 0])


def estimate(
    prior: Prior,
    raw: RawEstimate,
    box: Float[Tensor, "*B 4"],
    K: Float[Tensor, "*B 3 3"],
) -> Estimate:
    """Sections 4.1 and 4.2 in order: rotation, translation, shape, joints, all part poses.

    Args:
        prior: The category's mean object.
        raw: The network's numbers; logarithms beyond ±5 (factors of 148) count as ±5.
        box: The object's 2D box (px) ...
        K: ... and the intrinsics, both of the crop the network has seen.
    """
    R, t = _pose(raw, box, K, prior.frontal_area)
    cam_T_root = se3.from_rotation_translation(R, t)
    log_scale = raw.log_scale.clamp(-GREATEST_LOGARITHM, GREATEST_LOGARITHM)
    shape = deform(prior, Deformation(log_scale=log_scale, center_shift=raw.center_shift))
    if raw.nodes is None:
        joint_state = state_from_share(raw.joint_share, prior.kinematics.limits)
        root_T_part = forward_kinematics(shape.kinematics, joint_state)
        cam_T_part = cam_T_root[..., None, :, :] @ root_T_part
    else:
        cam_T_node = _node_poses(raw.nodes, shape, box, K, prior.frontal_area)
        cam_T_part = torch.cat([cam_T_root[..., None, :, :], cam_T_node], dim=-3)
        joint_state = joint_states(cam_T_part, shape.kinematics)
    axis, pivot = joints_in_camera(cam_T_part, shape.kinematics)
    return Estimate(
        cam_T_part=cam_T_part, joint_state=joint_state, shape=shape, axis=axis, pivot=pivot
    )


def _pose(
    raw: RawEstimate | NodePoses, box: Tensor, K: Tensor, frontal_area: float
) -> tuple[Float[Tensor, "*B 3 3"], Float[Tensor, "*B 3"]]:
    """Section 4.1: rotation and place in the camera frame."""
    R_facing = rotation_from_directions(raw.up, raw.right)
    log_lambda = raw.log_lambda.clamp(-GREATEST_LOGARITHM, GREATEST_LOGARITHM)
    t = root_translation(raw.phi, log_lambda, box, K, frontal_area)
    return allocentric_to_egocentric(R_facing, viewing_ray(box, K)), t


def _node_poses(
    nodes: NodePoses, shape: Shape, box: Tensor, K: Tensor, frontal_area: float
) -> Float[Tensor, "*B J 4 4"]:
    """Part-centric: every part as a rigid object of its own, placed by its box's centre."""
    R, center = _pose(nodes, box[..., None, :], K[..., None, :, :], frontal_area)
    t = center - (R @ shape.box_center[..., 1:, :, None])[..., 0]
    return se3.from_rotation_translation(R, t)


def within_limits(raw_share: Float[Tensor, "*B J"]) -> Float[Tensor, "*B J"]:
    """Joint shares as a user may see them: never beyond the limits."""
    return torch.clamp(raw_share, 0.0, 1.0)
