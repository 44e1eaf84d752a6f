"""The composition: raw numbers to poses, for every batch shape."""

from dataclasses import replace

import pytest
import torch

from r2art.method import se3
from r2art.method.depth import translation_targets, viewing_ray
from r2art.method.estimate import (
    Estimate,
    estimate,
    share_from_state,
    state_from_share,
    within_limits,
)
from r2art.method.kinematics import joint_motion
from r2art.method.outputs import NodePoses, RawEstimate
from r2art.method.rotation import egocentric_to_allocentric
from r2art.method.shape import Prior


def random_raw(prior: Prior, batch: tuple[int, ...]) -> RawEstimate:
    num_parts, num_joints = prior.box_size.shape[0], len(prior.kinematics.parent)

    def normal(*shape: int) -> torch.Tensor:
        return torch.randn((*batch, *shape), dtype=torch.float64)

    shift = 0.02 * normal(num_parts, 3)
    shift[..., 0, :] = 0
    return RawEstimate(
        up=normal(3),
        right=normal(3),
        phi=0.2 * normal(2),
        log_lambda=0.2 * normal(),
        joint_share=torch.rand(*batch, num_joints, dtype=torch.float64),
        log_scale=0.2 * normal(num_parts, 3),
        center_shift=shift,
        confidence_logit=normal(num_parts),
    )


@pytest.fixture
def prior(chest) -> Prior:
    return Prior.from_category(chest, dtype=torch.float64)


@pytest.fixture
def view(batch) -> tuple[torch.Tensor, torch.Tensor]:
    """Box and intrinsics."""
    corner = 20 * torch.rand(*batch, 2, dtype=torch.float64)
    box = torch.cat([corner, corner + 10 + 40 * torch.rand_like(corner)], dim=-1)
    K = torch.tensor([[90.0, 0, 30], [0, 100, 35], [0, 0, 1]], dtype=torch.float64)
    return box, K.expand(*batch, 3, 3)


def test_the_raw_numbers_can_be_read_off_the_estimate(prior, batch, view):
    box, K = view
    raw = random_raw(prior, batch)
    found = estimate(prior, raw, box, K)
    cam_T_root = found.cam_T_part[..., 0, :, :]
    facing = egocentric_to_allocentric(cam_T_root[..., :3, :3], viewing_ray(box, K))
    up = raw.up / raw.up.norm(dim=-1, keepdim=True)
    torch.testing.assert_close(facing[..., 1], up)
    assert torch.all((facing[..., 0] * raw.right).sum(-1) > 0)
    phi, log_lambda = translation_targets(cam_T_root[..., :3, 3], box, K, prior.frontal_area)
    torch.testing.assert_close(phi, raw.phi)
    torch.testing.assert_close(log_lambda, raw.log_lambda)
    torch.testing.assert_close(found.shape.box_size, prior.box_size * raw.log_scale.exp())
    share = share_from_state(found.joint_state, prior.kinematics.limits)
    torch.testing.assert_close(share, raw.joint_share)


def test_every_pose_is_rigid_and_moved_by_its_joint_alone(prior, batch, view):
    found = estimate(prior, random_raw(prior, batch), *view)
    R = found.cam_T_part[..., :3, :3]
    torch.testing.assert_close(R @ R.mT, torch.eye(3, dtype=R.dtype).expand_as(R))
    assert torch.all(torch.linalg.det(R) > 0)
    motion = joint_motion(found.shape.kinematics, found.joint_state)
    for joint, parent in enumerate(prior.kinematics.parent):
        carried = found.cam_T_part[..., parent, :, :] @ motion[..., joint, :, :]
        torch.testing.assert_close(found.cam_T_part[..., joint + 1, :, :], carried)
        back = se3.transform(
            se3.inverse(found.cam_T_part[..., parent, :, :]), found.pivot[..., joint, None, :]
        )
        pivot = found.shape.kinematics.pivot.expand(*batch, -1, 3)[..., joint, None, :]
        torch.testing.assert_close(back, pivot)


def as_part_centric(prior: Prior, raw: RawEstimate, found: Estimate, box, K) -> RawEstimate:
    """The same poses, said part by part."""
    R = found.cam_T_part[..., 1:, :3, :3]
    center = se3.transform(found.cam_T_part, found.shape.box_center[..., None, :])[..., 1:, 0, :]
    box, K = box[..., None, :], K[..., None, :, :]
    facing = egocentric_to_allocentric(R, viewing_ray(box, K))
    phi, log_lambda = translation_targets(center, box, K, prior.frontal_area)
    nodes = NodePoses(up=2 * facing[..., 1], right=facing[..., 0], phi=phi, log_lambda=log_lambda)
    return replace(raw, nodes=nodes)


def test_part_centric_numbers_give_the_poses_they_describe(prior, batch, view):
    raw = random_raw(prior, batch)
    found = estimate(prior, raw, *view)
    again = estimate(prior, as_part_centric(prior, raw, found, *view), *view)
    torch.testing.assert_close(again.cam_T_part, found.cam_T_part)
    torch.testing.assert_close(again.joint_state, found.joint_state)
    torch.testing.assert_close(again.axis, found.axis)
    torch.testing.assert_close(again.pivot, found.pivot)


def test_parts_that_are_posed_one_by_one_need_no_joint(prior, batch, view):
    """Moving one part's numbers moves that part alone; no joint holds it."""
    raw = random_raw(prior, batch)
    raw = as_part_centric(prior, raw, estimate(prior, raw, *view), *view)
    before = estimate(prior, raw, *view).cam_T_part
    assert raw.nodes is not None
    phi = raw.nodes.phi.clone()
    phi[..., 0, :] += 0.3
    after = estimate(prior, replace(raw, nodes=replace(raw.nodes, phi=phi)), *view).cam_T_part
    same = (before == after).flatten(-2).all(-1)
    assert same[..., [0, 2, 3]].all()
    assert not same[..., 1].any()


def test_a_state_is_a_share_of_its_range(prior, batch):
    limits = prior.kinematics.limits
    share = torch.rand(*batch, 3, dtype=torch.float64)
    torch.testing.assert_close(share_from_state(state_from_share(share, limits), limits), share)
    zero, one = torch.zeros_like(share), torch.ones_like(share)
    torch.testing.assert_close(state_from_share(zero, limits), limits[:, 0].expand(*batch, 3))
    torch.testing.assert_close(state_from_share(one, limits), limits[:, 1].expand(*batch, 3))


def test_users_never_see_a_state_beyond_its_limits(prior, batch):
    share = within_limits(3 * torch.randn(*batch, 3, dtype=torch.float64))
    state = state_from_share(share, prior.kinematics.limits)
    lower, upper = prior.kinematics.limits.unbind(-1)
    assert torch.all((state >= lower) & (state <= upper))
    inside = torch.full((*batch, 3), 0.3, dtype=torch.float64)
    assert torch.equal(within_limits(inside), inside)
