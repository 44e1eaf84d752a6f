import pytest
import roma
import torch
from hypothesis import given
from hypothesis import strategies as st

from r2art.method.rotation import (
    allocentric_to_egocentric,
    directions_are_parallel,
    egocentric_to_allocentric,
    ray_rotation,
    rotation_from_directions,
)
from r2art.method.se3 import rotation_angle

f64 = torch.float64
vector = st.lists(st.floats(-1e3, 1e3, width=32), min_size=3, max_size=3)


def assert_rotation(R: torch.Tensor) -> None:
    eye = torch.eye(3, dtype=R.dtype).expand_as(R)
    torch.testing.assert_close(R.mT @ R, eye, atol=2e-5, rtol=0)
    torch.testing.assert_close(torch.linalg.det(R), torch.ones(R.shape[:-2], dtype=R.dtype))


@given(vector, vector)
def test_any_two_directions_give_a_rotation_and_a_finite_gradient(up, right):
    up, right = (torch.tensor(v, requires_grad=True) for v in (up, right))
    R = rotation_from_directions(up, right)
    assert_rotation(R.detach())
    for gradient in torch.autograd.grad((R * torch.randn(3, 3)).sum(), (up, right)):
        assert gradient.isfinite().all()


@given(vector, st.floats(-10, 10, width=32))
def test_parallel_directions_are_flagged_and_still_give_a_rotation(up, factor):
    up = torch.tensor(up)
    assert directions_are_parallel(up, factor * up)
    assert_rotation(rotation_from_directions(up, factor * up))


def test_a_rotations_own_axes_give_it_back(batch):
    R = roma.random_rotmat(batch or 1, dtype=f64).reshape(*batch, 3, 3)
    up, right = 3 * R[..., 1], 0.2 * R[..., 0]
    torch.testing.assert_close(rotation_from_directions(up, right), R)
    assert not directions_are_parallel(up, right).any()


@pytest.mark.parametrize("angle", [1e-3, 1e-4, 1e-5])
def test_nearly_parallel_directions_give_a_rotation_in_single_precision(angle):
    up, aside = torch.randn(2, 100, 3)
    assert_rotation(rotation_from_directions(up, up + angle * aside))


def test_gram_schmidt_agrees_with_roma_and_keeps_up(batch):
    up, right = torch.randn(2, *batch, 3, dtype=f64)
    R = rotation_from_directions(up, right)
    theirs = roma.special_gramschmidt(torch.stack([up, right], dim=-1))  # up, right, up × right
    torch.testing.assert_close(R[..., 0], theirs[..., 1])
    torch.testing.assert_close(R[..., 1], up / up.norm(dim=-1, keepdim=True))
    torch.testing.assert_close(R[..., 2], -theirs[..., 2])


@pytest.mark.parametrize("dtype", [torch.bfloat16, torch.float16])
def test_half_precision_directions_give_a_float32_rotation(dtype):
    R = rotation_from_directions(torch.randn(8, 3, dtype=dtype), torch.randn(8, 3, dtype=dtype))
    assert R.dtype == torch.float32
    assert_rotation(R)


def test_gram_schmidt_passes_gradcheck():
    up, right = torch.randn(2, 3, 3, dtype=f64, requires_grad=True)
    assert torch.autograd.gradcheck(rotation_from_directions, (up, right))


def random_ray(*batch: int) -> torch.Tensor:
    xy = torch.randn(*batch, 2, dtype=f64)
    return torch.cat([xy, torch.ones(*batch, 1, dtype=f64)], dim=-1)


def test_the_ray_rotation_takes_the_optical_axis_to_the_ray_and_turns_no_further(batch):
    ray = random_ray(*batch)
    R = ray_rotation(ray)
    assert_rotation(R)
    unit = ray / ray.norm(dim=-1, keepdim=True)
    torch.testing.assert_close(R[..., 2], unit)
    torch.testing.assert_close(rotation_angle(torch.eye(3, dtype=f64), R), unit[..., 2].acos())


def test_allocentric_and_egocentric_undo_each_other(batch):
    ray, R = random_ray(*batch), roma.random_rotmat(batch or 1, dtype=f64).reshape(*batch, 3, 3)
    back = allocentric_to_egocentric(egocentric_to_allocentric(R, ray), ray)
    torch.testing.assert_close(back, R)


def test_on_the_optical_axis_both_rotations_are_one():
    R, axis = roma.random_rotmat(4, dtype=f64), torch.tensor([0.0, 0.0, 2.0], dtype=f64)
    torch.testing.assert_close(egocentric_to_allocentric(R, axis), R)


def test_an_object_carried_round_the_camera_shows_the_same_side():
    """What is seen along the ray, R^T ray, depends on the allocentric rotation alone."""
    R, rays = roma.random_rotmat(1, dtype=f64), random_ray(5)
    seen = (
        allocentric_to_egocentric(R, rays).mT @ (rays / rays.norm(dim=-1, keepdim=True))[..., None]
    )
    torch.testing.assert_close(seen, seen[:1].expand_as(seen))
