import math

import pytest
import roma
import torch
from scipy.linalg import expm

from r2art.method import se3

f64 = torch.float64


def unit(*shape: int) -> torch.Tensor:
    v = torch.randn(*shape, dtype=f64)
    return v / v.norm(dim=-1, keepdim=True)


def random_pose(*batch: int) -> torch.Tensor:
    R = roma.random_rotmat(batch or 1, dtype=f64).reshape(*batch, 3, 3)
    return se3.from_rotation_translation(R, torch.randn(*batch, 3, dtype=f64))


def test_rodrigues_is_the_matrix_exponential(batch):
    axis, angle = unit(*batch, 3), 4 * torch.randn(batch, dtype=f64)
    twist = se3.skew(axis * angle[..., None])
    expected = [expm(w.numpy()) for w in twist.reshape(-1, 3, 3)]
    actual = se3.rotation_about_axis(axis, angle).reshape(-1, 3, 3)
    torch.testing.assert_close(actual, torch.stack([torch.as_tensor(R) for R in expected]))


def test_turning_back_about_the_opposite_axis_is_the_same_turn(batch):
    axis, angle = unit(*batch, 3), torch.randn(batch, dtype=f64)
    torch.testing.assert_close(
        se3.rotation_about_axis(axis, angle), se3.rotation_about_axis(-axis, -angle)
    )


def test_half_a_turn_is_the_same_both_ways(batch):
    axis, pi = unit(*batch, 3), torch.full(batch, math.pi, dtype=f64)
    half_turn = se3.rotation_about_axis(axis, pi)
    torch.testing.assert_close(half_turn, se3.rotation_about_axis(-axis, pi))
    torch.testing.assert_close(half_turn, half_turn.mT)


def test_skew_is_the_cross_product(batch):
    v, w = torch.randn(2, *batch, 3, dtype=f64)
    torch.testing.assert_close((se3.skew(v) @ w[..., None])[..., 0], torch.linalg.cross(v, w))


def test_a_pose_times_its_inverse_leaves_points_in_place(batch):
    a_T_b, points = random_pose(*batch), torch.randn(*batch, 5, 3, dtype=f64)
    there = se3.transform(a_T_b, points)
    torch.testing.assert_close(se3.transform(se3.inverse(a_T_b), there), points)


def test_transforming_twice_is_transforming_by_the_product(batch):
    a_T_b, b_T_c, points = random_pose(*batch), random_pose(*batch), torch.randn(5, 3, dtype=f64)
    torch.testing.assert_close(
        se3.transform(a_T_b, se3.transform(b_T_c, points)), se3.transform(a_T_b @ b_T_c, points)
    )


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 1.0, 3.0, math.pi - 1e-6, math.pi])
@pytest.mark.parametrize(("dtype", "atol"), [(torch.float32, 1e-6), (f64, 1e-14)])
def test_rotation_angle_is_accurate_and_has_a_finite_gradient(batch, angle, dtype, atol):
    Ra = roma.random_rotmat(batch or 1, dtype=dtype).reshape(*batch, 3, 3)
    turn = se3.rotation_about_axis(unit(*batch, 3), torch.tensor(angle, dtype=f64)).to(dtype)
    Rb = (Ra @ turn).requires_grad_()
    actual = se3.rotation_angle(Ra, Rb)
    torch.testing.assert_close(actual, torch.full(batch, angle, dtype=dtype), atol=atol, rtol=1e-6)
    (gradient,) = torch.autograd.grad(actual.sum(), Rb)
    assert gradient.isfinite().all()


def test_rotation_angle_agrees_with_roma_and_ignores_order(batch):
    Ra, Rb = roma.random_rotmat((2, *batch), dtype=f64)
    angle = se3.rotation_angle(Ra, Rb)
    torch.testing.assert_close(angle, roma.rotmat_geodesic_distance(Ra, Rb))
    torch.testing.assert_close(angle, se3.rotation_angle(Rb, Ra))
