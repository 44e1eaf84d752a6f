"""Section 4.2: joint states to part poses.

Letters: B batch, J joints, P = J + 1 parts. Metres and radians. Part 0 is the root; joint j
moves part j + 1. At rest every part frame *is* the root frame, so joints need no offsets.
"""

from dataclasses import dataclass, replace

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from r2art.core.category import Category
from r2art.method import se3


@dataclass(frozen=True, kw_only=True)
class KinematicModel:
    """A tree of parts, each hung on its parent by one joint.

    Attributes:
        parent: The part that each joint hangs on; parents come before their children.
        prismatic: True where a joint slides, False where it turns.
        axis: Unit direction of each joint, in the root frame at rest.
        pivot: A point (m) on each joint's line, likewise. It may carry the batch, because it
            follows the instance's deformed shape.
        limits: Least and greatest state of each joint, rad or m.
    """

    parent: tuple[int, ...]
    prismatic: Bool[Tensor, " J"]
    axis: Float[Tensor, "*B J 3"]
    pivot: Float[Tensor, "*B J 3"]
    limits: Float[Tensor, "J 2"]

    def to(self, device: torch.device | str) -> "KinematicModel":
        """The same joints on another device."""
        return replace(self, **{k: v.to(device) for k, v in vars(self).items() if k != "parent"})

    @classmethod
    def from_category(
        cls,
        category: Category,
        device: torch.device | str | None = None,
        dtype: torch.dtype = torch.float32,
    ) -> "KinematicModel":
        """The joints of a category's mean object."""
        joints = category.joints

        def tensor(rows: list[tuple[float, ...]], width: int) -> Tensor:
            return torch.tensor(rows, dtype=dtype, device=device).reshape(len(joints), width)

        return cls(
            parent=tuple(j.parent for j in joints),
            prismatic=torch.tensor(
                [j.kind == "prismatic" for j in joints], dtype=torch.bool, device=device
            ),
            axis=tensor([j.axis for j in joints], 3),
            pivot=tensor([j.pivot for j in joints], 3),
            limits=tensor([j.limits for j in joints], 2),
        )


def joint_motion(
    kinematics: KinematicModel, joint_state: Float[Tensor, "*B J"]
) -> Float[Tensor, "*B J 4 4"]:
    """Move each joint away from rest by its state -- Eqs. 2 and 3.

    A revolute joint turns about the line through its pivot, a prismatic one slides along its
    axis; the result is the identity where the state is zero.

    Args:
        kinematics: Axes and pivots in the root frame at rest.
        joint_state: Angle (rad) of a revolute joint, distance (m) of a prismatic one.

    Deviation: Eq. 2 as printed swaps axis and pivot; docs/paper.md#eq-2.
    """
    zero = torch.zeros_like(joint_state)
    angle = torch.where(kinematics.prismatic, zero, joint_state)
    slide = torch.where(kinematics.prismatic, joint_state, zero)
    R = se3.rotation_about_axis(kinematics.axis, angle)
    t = kinematics.pivot - (R @ kinematics.pivot[..., None])[..., 0]
    return se3.from_rotation_translation(R, t + slide[..., None] * kinematics.axis)


def forward_kinematics(
    kinematics: KinematicModel, joint_state: Float[Tensor, "*B J"]
) -> Float[Tensor, "*B P 4 4"]:
    """Pose of every part in the root frame, ``root_T_part``.

    The product of the motions of all joints between root and part, root first; any tree.
    """
    parent_T_part = joint_motion(kinematics, joint_state)
    eye = torch.eye(4, dtype=parent_T_part.dtype, device=parent_T_part.device)
    root_T_part = [eye.expand(*parent_T_part.shape[:-3], 4, 4)]
    for joint, parent in enumerate(kinematics.parent):
        root_T_part.append(root_T_part[parent] @ parent_T_part[..., joint, :, :])
    return torch.stack(root_T_part, dim=-3)


def joint_states(
    cam_T_part: Float[Tensor, "*B P 4 4"], kinematics: KinematicModel
) -> Float[Tensor, "*B J"]:
    """The states (rad, m) that fit any part poses best, joint by joint; undoes the kinematics.

    A revolute state is the angle of the turn about the joint's axis that is nearest to the
    part's rotation relative to its parent, within half a turn of the middle of its range; a
    prismatic one is the part's displacement along the axis. So poses that no joints made, as
    part-centric ones are, have states, too.
    """
    parent_T_part = se3.inverse(_parents(cam_T_part, kinematics)) @ cam_T_part[..., 1:, :, :]
    R, u = parent_T_part[..., :3, :3], kinematics.axis
    turn = torch.stack(
        [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], -1
    )
    along = (u * (R @ u[..., None])[..., 0]).sum(-1)
    sine, cosine = (turn * u).sum(-1), R.diagonal(dim1=-2, dim2=-1).sum(-1) - along
    middle = kinematics.limits.mean(-1)
    s, c = middle.sin(), middle.cos()
    angle = middle + torch.atan2(sine * c - cosine * s, cosine * c + sine * s)
    slide = (parent_T_part[..., :3, 3] * u).sum(-1)
    return torch.where(kinematics.prismatic, slide, angle)


def joints_in_camera(
    cam_T_part: Float[Tensor, "*B P 4 4"], kinematics: KinematicModel
) -> tuple[Float[Tensor, "*B J 3"], Float[Tensor, "*B J 3"]]:
    """Axis (unit) and pivot (m) of every joint in the camera frame, where they are now.

    A joint rides on its parent part: its parent's current pose carries it from rest.
    """
    cam_T_parent = _parents(cam_T_part, kinematics)
    axis = (cam_T_parent[..., :3, :3] @ kinematics.axis[..., None])[..., 0]
    return axis, se3.transform(cam_T_parent, kinematics.pivot[..., None, :])[..., 0, :]


def _parents(
    cam_T_part: Float[Tensor, "*B P 4 4"], kinematics: KinematicModel
) -> Float[Tensor, "*B J 4 4"]:
    """The pose of every joint's parent part."""
    if not kinematics.parent:
        return cam_T_part[..., :0, :, :]
    return torch.stack([cam_T_part[..., p, :, :] for p in kinematics.parent], dim=-3)
