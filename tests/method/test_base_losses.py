from dataclasses import replace

import roma
import torch

from r2art.method.kinematics import KinematicModel
from r2art.method.losses import (
    depth_loss,
    direction_loss,
    joint_state_loss,
    offset_loss,
    reprojection_loss,
    shape_loss,
)
from r2art.method.projection import resize_intrinsics
from r2art.method.shape import Deformation, Prior

f64 = torch.float64
K = torch.tensor([[60.0, 0.0, 24.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], dtype=f64)
BOX = torch.tensor([10.0, 12.0, 30.0, 40.0], dtype=f64)


def random(*shape: int) -> torch.Tensor:
    return torch.randn(shape, dtype=f64)


def corners(*batch: int) -> torch.Tensor:
    return random(*batch, 16, 3) + torch.tensor([0.0, 0.0, 8.0], dtype=f64)


def test_the_direction_loss_sees_the_angle_only(batch):
    R = roma.random_rotmat(batch or 1, dtype=f64).reshape(*batch, 3, 3)
    a, b = random(*batch, 3), random(*batch, 3)
    loss = direction_loss(a, b)
    assert loss.shape == batch
    torch.testing.assert_close(direction_loss(3 * a, 0.1 * b), loss)
    turned = [(R @ v[..., None])[..., 0] for v in (a, b)]
    torch.testing.assert_close(direction_loss(*turned), loss)
    torch.testing.assert_close(direction_loss(a, a), torch.zeros(batch, dtype=f64))
    assert torch.all((direction_loss(a, -a) > 1.9) & (direction_loss(a, -a) < 2))


def test_the_direction_loss_takes_one_of_two_likely_answers():
    one, other = torch.eye(3, dtype=f64)[:2]
    between = torch.nn.functional.normalize(one + other, dim=0)
    likely = torch.tensor([0.6, 0.4], dtype=f64)
    both = torch.stack([one, other])
    at_one, at_middle = (
        (likely * direction_loss(answer.expand(2, 3), both)).sum() for answer in (one, between)
    )
    assert at_one < at_middle


def test_every_loss_is_zero_at_the_truth_and_positive_elsewhere(chest, batch):
    prior = Prior.from_category(chest, dtype=f64)
    kinematics = prior.kinematics
    phi, state, points = random(*batch, 2), random(*batch, 3), corners(*batch)
    log_lambda, scale, shift = random(*batch), random(*batch, 4, 3), random(*batch, 4, 3)
    camera, box = K.expand(*batch, 3, 3), BOX.expand(*batch, 4)

    def losses(error: float):
        return [
            offset_loss(phi + error, phi),
            depth_loss(log_lambda + error, log_lambda),
            joint_state_loss(state + error, state, kinematics),
            shape_loss(
                Deformation(log_scale=scale + error, center_shift=shift),
                Deformation(log_scale=scale, center_shift=shift),
                prior,
            ),
            shape_loss(
                Deformation(log_scale=scale, center_shift=shift + error),
                Deformation(log_scale=scale, center_shift=shift),
                prior,
            ),
            reprojection_loss(points + error, points, camera, box),
            direction_loss(points[..., 0, :] + error, points[..., 0, :]),
        ]

    for at_truth, near, far in zip(losses(0.0), losses(0.01), losses(0.3), strict=True):
        assert at_truth.shape == batch
        torch.testing.assert_close(at_truth, torch.zeros(batch, dtype=f64))
        assert (near > 0).all()
        assert (near < far).all()


def test_joint_states_count_in_units_of_their_range(chest):
    """A drawer measured in centimetres is as wrong as one measured in metres."""
    kinematics = KinematicModel.from_category(chest, dtype=f64)
    in_centimetres = replace(kinematics, limits=100 * kinematics.limits)
    a, b = random(5, 3), random(5, 3)
    torch.testing.assert_close(
        joint_state_loss(100 * a, 100 * b, in_centimetres), joint_state_loss(a, b, kinematics)
    )


def test_center_shifts_count_in_units_of_their_part(chest, batch):
    prior = Prior.from_category(chest, dtype=f64)
    in_centimetres = replace(prior, box_size=100 * prior.box_size)
    scale, a, b = random(*batch, 4, 3), random(*batch, 4, 3), random(*batch, 4, 3)

    def loss(unit: float, reference: Prior):
        first, second = (Deformation(log_scale=scale, center_shift=unit * x) for x in (a, b))
        return shape_loss(first, second, reference)

    torch.testing.assert_close(loss(100, in_centimetres), loss(1, prior))


def test_reprojection_does_not_see_the_resolution(batch):
    a, b = corners(*batch), corners(*batch)
    camera, box = K.expand(*batch, 3, 3), BOX.expand(*batch, 4)
    half = reprojection_loss(a, b, resize_intrinsics(camera, 0.5), 0.5 * box)
    torch.testing.assert_close(half, reprojection_loss(a, b, camera, box))


def test_one_wild_corner_pulls_no_harder_than_a_bad_one():
    true, bad = corners(1), corners(1)
    bad[0, 0, 0] += 1e3
    bad.requires_grad_()
    camera, box = K[None], BOX[None]
    (gradient,) = torch.autograd.grad(reprojection_loss(bad, true, camera, box).sum(), bad)
    assert gradient[0, 0, 0].abs() < 2 * gradient[0, 1:, 0].abs().max()


def test_base_losses_pass_gradcheck(chest):
    prior = Prior.from_category(chest, dtype=f64)
    state, true_state = random(2, 3), random(2, 3)
    scale, shift = random(2, 4, 3).requires_grad_(), random(2, 4, 3).requires_grad_()
    true = Deformation(log_scale=random(2, 4, 3), center_shift=random(2, 4, 3))
    check = torch.autograd.gradcheck
    a, b = random(2, 3).requires_grad_(), random(2, 3)
    assert check(lambda x: direction_loss(x, b), (a,))
    assert check(lambda x: offset_loss(x, b[:, :2]), (a.detach()[:, :2].requires_grad_(),))
    assert check(lambda x: depth_loss(x, b[:, 0]), (a.detach()[:, 0].requires_grad_(),))
    assert check(
        lambda x: joint_state_loss(x, true_state, prior.kinematics), (state.requires_grad_(),)
    )
    assert check(
        lambda s, c: shape_loss(Deformation(log_scale=s, center_shift=c), true, prior),
        (scale, shift),
    )
    points, camera, box = corners(2), K.expand(2, 3, 3), BOX.expand(2, 4)
    assert check(
        lambda x: reprojection_loss(x, points, camera, box), (corners(2).requires_grad_(),)
    )
