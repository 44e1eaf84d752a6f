from dataclasses import replace

import numpy as np
import pytest
import roma
import torch
from scipy.linalg import expm

from r2art.method import se3
from r2art.method.kinematics import (
    KinematicModel,
    forward_kinematics,
    joint_motion,
    joint_states,
    joints_in_camera,
)
from r2art.method.shape import Deformation, Prior, deform

f64 = torch.float64


def random_pose() -> torch.Tensor:
    R = roma.random_rotmat(1, dtype=f64)[0]
    return se3.from_rotation_translation(R, torch.randn(3, dtype=f64))


def exponential_of_twist(axis: np.ndarray, pivot: np.ndarray, prismatic: bool, state: float):
    twist = np.zeros((4, 4))
    if prismatic:
        twist[:3, 3] = axis
    else:
        twist[:3, :3] = np.cross(np.eye(3), axis)
        twist[:3, 3] = np.cross(pivot, axis)
    return expm(state * twist)


def chain(arm: KinematicModel) -> KinematicModel:
    """The same six joints one after the other, as of a robot arm of seven parts."""
    return replace(arm, parent=tuple(range(6)))


@pytest.mark.parametrize("shape", [lambda arm: arm, chain], ids=["tree", "chain"])
def test_forward_kinematics_is_a_product_of_exponentials(arm, batch, shape):
    arm = shape(arm)
    joint_state = torch.randn(*batch, 6, dtype=f64)
    actual = forward_kinematics(arm, joint_state).reshape(-1, 7, 4, 4)
    for poses, state in zip(actual, joint_state.reshape(-1, 6), strict=True):
        expected = [np.eye(4)]
        for j, parent in enumerate(arm.parent):
            motion = exponential_of_twist(
                arm.axis[j].numpy(), arm.pivot[j].numpy(), bool(arm.prismatic[j]), float(state[j])
            )
            expected.append(expected[parent] @ motion)
        torch.testing.assert_close(poses, torch.as_tensor(np.stack(expected)))


def test_at_rest_every_part_frame_is_the_root_frame(arm, batch):
    root_T_part = forward_kinematics(arm, torch.zeros(*batch, 6, dtype=f64))
    torch.testing.assert_close(root_T_part, torch.eye(4, dtype=f64).expand(*batch, 7, 4, 4))


def test_a_hinge_leaves_its_own_axis_in_place(arm, batch):
    joint_state = torch.randn(*batch, 6, dtype=f64)
    on_axis = arm.pivot + 0.3 * arm.axis
    moved = se3.transform(joint_motion(arm, joint_state), on_axis[:, None])[..., 0, :]
    still = on_axis[~arm.prismatic]
    torch.testing.assert_close(moved[..., ~arm.prismatic, :], still.expand(*batch, -1, -1))


def test_a_slide_moves_every_point_by_its_state_along_its_axis(arm, batch):
    joint_state, points = torch.randn(*batch, 6, dtype=f64), torch.randn(6, 4, 3, dtype=f64)
    moved = se3.transform(joint_motion(arm, joint_state), points) - points
    step = (joint_state[..., None] * arm.axis)[..., None, :].expand_as(moved)
    torch.testing.assert_close(moved[..., arm.prismatic, :, :], step[..., arm.prismatic, :, :])


def test_opposite_axis_and_state_are_the_same_motion(arm, batch):
    joint_state = torch.randn(*batch, 6, dtype=f64)
    opposite = replace(arm, axis=-arm.axis)
    torch.testing.assert_close(
        forward_kinematics(opposite, -joint_state), forward_kinematics(arm, joint_state)
    )


def test_any_point_of_a_joints_line_serves_as_its_pivot(arm, batch):
    joint_state = torch.randn(*batch, 6, dtype=f64)
    slid = replace(arm, pivot=arm.pivot + torch.randn(6, 1, dtype=f64) * arm.axis)
    torch.testing.assert_close(
        forward_kinematics(slid, joint_state), forward_kinematics(arm, joint_state)
    )


def test_moving_the_camera_leaves_the_joint_states(arm):
    joint_state = 3 * torch.rand(6, dtype=f64)
    cam_T_part = random_pose() @ forward_kinematics(arm, joint_state)
    parent_T_part = se3.inverse(cam_T_part[list(arm.parent)]) @ cam_T_part[1:]
    angle = se3.rotation_angle(torch.eye(3, dtype=f64), parent_T_part[:, :3, :3])
    distance = (parent_T_part[:, :3, 3] * arm.axis).sum(-1)
    torch.testing.assert_close(torch.where(arm.prismatic, distance, angle), joint_state)


def test_joint_states_undo_the_kinematics(arm, batch):
    """Also beyond half a turn, as long as it is the range that lies there."""
    limits = torch.tensor([[1.0, 5.0]], dtype=f64).expand(6, 2)
    for joints in (arm, chain(arm), replace(arm, limits=limits)):
        state = joints.limits[:, 0] + 4 * torch.rand(*batch, 6, dtype=f64)
        cam_T_part = random_pose() @ forward_kinematics(joints, state)
        torch.testing.assert_close(joint_states(cam_T_part, joints), state)


def test_the_state_of_a_pose_that_no_joint_made_is_the_nearest(arm, batch):
    cam_T_part = se3.from_rotation_translation(
        roma.random_rotmat((*batch, 7), dtype=f64), torch.randn(*batch, 7, 3, dtype=f64)
    )
    state = joint_states(cam_T_part, arm)
    parent_T_part = se3.inverse(cam_T_part[..., list(arm.parent), :, :]) @ cam_T_part[..., 1:, :, :]

    def distance(change: float):
        turned = joint_motion(arm, state + change)
        away = se3.rotation_angle(turned[..., :3, :3], parent_T_part[..., :3, :3])
        return away[..., ~arm.prismatic]

    for change in (-2.0, -0.01, 0.01, 2.0):
        assert (distance(0.0) <= distance(change)).all()


def test_a_pivot_moves_with_the_part_that_it_moves(chest, batch):
    """Its place within the part's box, in shares of the box, is that in the prior."""
    prior = Prior.from_category(chest, dtype=f64)
    log_scale, shift = torch.randn(2, *batch, 4, 3, dtype=f64)
    shift[..., 0, :] = 0
    shape = deform(prior, Deformation(log_scale=log_scale, center_shift=shift))

    def share(of):
        return (of.kinematics.pivot - of.box_center[..., 1:, :]) / of.box_size[..., 1:, :]

    torch.testing.assert_close(share(shape), share(prior).expand(*batch, 3, 3))
    state = torch.rand(*batch, 3, dtype=f64)
    moved = joint_motion(shape.kinematics, state)[..., 0, :, :]  # the hinge
    pivot = shape.kinematics.pivot[..., :1, :]
    torch.testing.assert_close(se3.transform(moved, pivot), pivot)


def test_joints_in_the_camera_are_the_lines_the_parts_move_along(arm, batch):
    """Opening one joint further turns its part about that joint's line in the camera frame."""
    cam_T_root, joint_state = random_pose(), torch.randn(*batch, 6, dtype=f64)
    cam_T_part = cam_T_root @ forward_kinematics(arm, joint_state)
    axis, pivot = joints_in_camera(cam_T_part, arm)
    more = torch.full((*batch, 6), 0.7, dtype=f64)
    motion = joint_motion(replace(arm, axis=axis, pivot=pivot), more)
    for j in range(6):
        further = joint_state.clone()
        further[..., j] += 0.7
        expected = (cam_T_root @ forward_kinematics(arm, further))[..., j + 1, :, :]
        torch.testing.assert_close(motion[..., j, :, :] @ cam_T_part[..., j + 1, :, :], expected)


def test_pivots_may_differ_within_a_batch(arm, batch):
    joint_state = torch.randn(*batch, 6, dtype=f64)
    pivot = torch.randn(*batch, 6, 3, dtype=f64)
    together = forward_kinematics(
        replace(arm, axis=arm.axis.expand_as(pivot), pivot=pivot), joint_state
    )
    alone = [
        forward_kinematics(replace(arm, pivot=q), s)
        for q, s in zip(pivot.reshape(-1, 6, 3), joint_state.reshape(-1, 6), strict=True)
    ]
    torch.testing.assert_close(together.reshape(-1, 7, 4, 4), torch.stack(alone))


def test_a_category_keeps_its_joints(chest):
    kinematics = KinematicModel.from_category(chest, dtype=f64)
    assert kinematics.parent == (0, 1, 0)
    assert kinematics.prismatic.tolist() == [False, True, True]
    assert kinematics.axis.tolist() == [list(j.axis) for j in chest.joints]
    assert kinematics.limits.tolist() == [list(j.limits) for j in chest.joints]


def test_forward_kinematics_passes_gradcheck(arm):
    state = torch.randn(2, 6, dtype=f64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda s: forward_kinematics(arm, s), (state,))
