"""Laws of the error measures."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from r2art.learn.evaluation import metrics


def random_poses(rng, *batch):
    poses = np.broadcast_to(np.eye(4), (*batch, 4, 4)).copy()
    n = int(np.prod(batch))
    poses[..., :3, :3] = Rotation.random(n, rng=rng).as_matrix().reshape(*batch, 3, 3)
    poses[..., :3, 3] = rng.normal((0, 0, 1), 0.2, (*batch, 3))
    return poses


@pytest.fixture
def rng():
    return np.random.default_rng(7)


@pytest.mark.parametrize("batch", [(), (2,), (3, 2)])
def test_truth_has_no_error(rng, batch):
    pose, points = random_poses(rng, *batch), rng.normal(0, 0.1, (*batch, 20, 3))
    zero = np.zeros(batch)
    np.testing.assert_array_equal(metrics.add(points, pose, pose), zero)
    np.testing.assert_array_equal(metrics.translation_error(points[..., 0, :], pose, pose), zero)
    R, axis = pose[..., :3, :3], pose[..., :3, 0]
    np.testing.assert_allclose(metrics.rotation_error(R, R), zero, atol=1e-15)
    np.testing.assert_allclose(metrics.axis_error(axis, axis), zero, atol=1e-15)
    np.testing.assert_array_equal(metrics.pivot_error(axis, axis, axis), zero)


def test_add_of_a_pure_shift_is_its_length(rng):
    pose, points = random_poses(rng, 3), rng.normal(0, 0.1, (3, 20, 3))
    moved = pose.copy()
    moved[:, :3, 3] += [0.03, 0, 0.04]
    np.testing.assert_allclose(metrics.add(points, moved, pose), 0.05)
    np.testing.assert_allclose(metrics.translation_error(points[:, 0], moved, pose), 0.05)


def test_add_s_is_never_above_add_and_blind_to_a_symmetry(rng):
    pose, other = random_poses(rng, 2), random_poses(rng, 2)
    half = rng.normal(0, 0.1, (2, 30, 3))
    points = np.concatenate([half, half * (-1, 1, -1)], axis=1)  # same after half a turn about y
    assert np.all(metrics.add_s(points, other, pose) <= metrics.add(points, other, pose))
    turned = pose.copy()
    turned[..., :3, :3] = pose[..., :3, :3] @ np.diag([-1.0, 1, -1])
    np.testing.assert_allclose(metrics.add_s(points, turned, pose), 0, atol=1e-12)
    assert np.all(metrics.add(points, turned, pose) > 0.05)


@pytest.mark.parametrize("degrees", [0, 1e-7, 1, 90, 179, 179.9999999, 180])
def test_rotation_error_is_the_angle_turned_by_at_both_ends_too(rng, degrees):
    R = random_poses(rng)[:3, :3]
    axis = rng.normal(size=3)
    turn = Rotation.from_rotvec(np.radians(degrees) * axis / np.linalg.norm(axis)).as_matrix()
    assert metrics.rotation_error(turn @ R, R) == pytest.approx(np.radians(degrees), abs=1e-14)


def test_a_backwards_axis_is_half_a_turn_wrong():
    axis = np.array([0.6, 0, 0.8])
    assert metrics.axis_error(-axis, axis) == pytest.approx(np.pi)
    assert metrics.axis_error(np.array([0.8, 0, -0.6]), axis) == pytest.approx(np.pi / 2)


def test_a_pivot_may_slide_along_the_true_axis(rng):
    axis = np.array([0, 0.6, 0.8])
    pivot, aside = rng.normal(size=3), np.array([0.02, 0, 0])
    assert metrics.pivot_error(pivot + 3 * axis + aside, pivot, axis) == pytest.approx(0.02)


def test_alignment_undoes_a_wrong_scale(rng):
    pose, points = random_poses(rng, 3), rng.normal(0, 0.1, (3, 20, 3))
    assert metrics.alignment_scale(points, pose, pose) == pytest.approx(1)
    scale = metrics.alignment_scale(points, metrics.rescaled(pose, 1.3), pose)
    assert scale == pytest.approx(1 / 1.3)


def test_no_other_scale_fits_better(rng):
    pose, other = random_poses(rng, 3), random_poses(rng, 3)
    points = rng.normal(0, 0.1, (3, 20, 3))

    def cost(scale):
        predicted = metrics.moved(metrics.rescaled(other, scale), points)
        return ((predicted - metrics.moved(pose, points)) ** 2).sum()

    best = minimize_scalar(cost, bracket=(0.5, 1.5), tol=1e-12).x
    assert metrics.alignment_scale(points, other, pose) == pytest.approx(best, abs=1e-6)


def test_diameter_of_a_box_is_its_diagonal():
    corners = np.stack(np.meshgrid([0, 3], [0, 4], [0, 12]), -1).reshape(1, 8, 3).astype(float)
    np.testing.assert_allclose(metrics.diameter(corners), 13)
