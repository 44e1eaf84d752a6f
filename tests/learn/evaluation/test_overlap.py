"""Laws of box overlap, and two other ways to compute it."""

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection
from scipy.spatial.transform import Rotation

from r2art.learn.evaluation.overlap import box_iou, image_box_iou

SIZE = np.array([0.34, 0.02, 0.23])


def random_pose(rng, spread=0.1):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(rng=rng).as_matrix()
    pose[:3, 3] = rng.normal(0, spread, 3)
    return pose


def shifted(*offset):
    pose = np.eye(4)
    pose[:3, 3] = offset
    return pose


def halfspaces(pose, size):
    """(6, 4) rows a, b of the box as a · x + b <= 0."""
    normals = np.concatenate([pose[:3, :3].T, -pose[:3, :3].T])
    return np.column_stack([normals, -(normals @ pose[:3, 3]) - np.tile(size, 2) / 2])


def iou_by_convex_hull(cam_T_a, size_a, cam_T_b, size_b):
    planes = np.concatenate([halfspaces(cam_T_a, size_a), halfspaces(cam_T_b, size_b)])
    # The middle of the largest ball within all planes; its radius is negative where none fits.
    ball = linprog(
        [0, 0, 0, -1],
        planes @ np.diag([1, 1, 1, 0]) + [0, 0, 0, 1],
        -planes[:, 3],
        bounds=(None, None),
    )
    if ball.x[3] < 1e-9:
        return 0.0
    common = ConvexHull(HalfspaceIntersection(planes, ball.x[:3]).intersections).volume
    return common / (size_a.prod() + size_b.prod() - common)


@pytest.mark.parametrize("seed", range(40))
def test_iou_agrees_with_the_hull_of_the_intersected_half_spaces(seed):
    rng = np.random.default_rng(seed)
    a, b = random_pose(rng), random_pose(rng)
    size_a, size_b = rng.uniform(0.05, 0.6, (2, 3))
    expected = iou_by_convex_hull(a, size_a, b, size_b)
    assert box_iou(a, size_a, b, size_b) == pytest.approx(expected, abs=1e-9)


def test_iou_agrees_with_counting_random_points():
    rng = np.random.default_rng(0)
    a, b = random_pose(rng, 0.05), random_pose(rng, 0.05)
    size_a, size_b = np.array([0.5, 0.3, 0.4]), np.array([0.4, 0.4, 0.3])
    in_a = rng.uniform(-0.5, 0.5, (200_000, 3)) * size_a
    in_b_frame = (in_a @ a[:3, :3].T + a[:3, 3] - b[:3, 3]) @ b[:3, :3]
    common = np.all(np.abs(in_b_frame) <= size_b / 2, axis=1).mean() * size_a.prod()
    expected = common / (size_a.prod() + size_b.prod() - common)
    assert box_iou(a, size_a, b, size_b) == pytest.approx(expected, abs=0.005)


@pytest.mark.parametrize("seed", range(10))
def test_iou_is_symmetric_and_does_not_depend_on_the_camera(seed):
    rng = np.random.default_rng(seed)
    a, b, world = random_pose(rng), random_pose(rng), random_pose(rng, 3)
    size_a, size_b = rng.uniform(0.1, 0.5, (2, 3))
    iou = box_iou(a, size_a, b, size_b)
    assert box_iou(b, size_b, a, size_a) == pytest.approx(iou, abs=1e-12)
    assert box_iou(world @ a, size_a, world @ b, size_b) == pytest.approx(iou, abs=1e-12)


@pytest.mark.parametrize("size", [SIZE, SIZE * (1, 0, 1), SIZE * (1, 0, 0), SIZE * 0])
def test_a_box_overlaps_itself_wholly_even_when_flat(size):
    pose = random_pose(np.random.default_rng(3))
    assert box_iou(pose, size, pose, size) == pytest.approx(1, abs=1e-6)


def test_a_box_turned_onto_itself_overlaps_wholly():
    turned = np.eye(4)
    turned[:3, :3] = Rotation.from_euler("y", 90, degrees=True).as_matrix()
    assert box_iou(np.eye(4), SIZE, turned, SIZE[[2, 1, 0]]) == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize(
    ("b", "size_b", "expected"),
    [
        (shifted(0.17, 0, 0), SIZE, 1 / 3),  # half of each
        (shifted(0.34, 0, 0), SIZE, 0),  # touching faces
        (shifted(0.34, 0.02, 0.23), SIZE, 0),  # touching corners
        (shifted(5, 0, 0), SIZE, 0),
        (shifted(0, 0, 0), SIZE / 2, 1 / 8),  # nested
        (shifted(0.085, 0.005, 0), SIZE / 2, 1 / 8),  # nested, sharing faces
        (shifted(0, 0, 0), 3 * SIZE, 1 / 27),
    ],
)
def test_iou_of_aligned_boxes(b, size_b, expected):
    assert box_iou(np.eye(4), SIZE, b, size_b) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [
        ((0, 0, 2, 2), (0, 0, 2, 2), 1),
        ((0, 0, 2, 2), (1, 0, 3, 2), 1 / 3),
        ((0, 0, 2, 2), (2, 0, 4, 2), 0),
        ((0, 0, 2, 2), (5, 5, 6, 6), 0),
        ((0, 0, 4, 4), (1, 1, 2, 2), 1 / 16),
        ((1, 1, 1, 1), (1, 1, 1, 1), 0),
    ],
)
def test_iou_in_the_image(a, b, expected):
    assert image_box_iou(np.array(a, float), np.array(b, float)) == pytest.approx(expected)


def test_many_pairs_at_once_are_as_each_alone():
    rng = np.random.default_rng(5)
    a = np.stack([random_pose(rng) for _ in range(6)]).reshape(2, 3, 4, 4)
    b = np.stack([random_pose(rng) for _ in range(6)]).reshape(2, 3, 4, 4)
    size_a, size_b = rng.uniform(0.1, 0.5, (2, 2, 3, 3))
    b[1, 2, :3, 3] += 9  # one pair that does not meet
    together = box_iou(a, size_a, b, size_b)
    assert together.shape == (2, 3)
    assert together[1, 2] == 0
    assert (together > 0).sum() >= 3
    for i in np.ndindex(2, 3):
        assert together[i] == pytest.approx(box_iou(a[i], size_a[i], b[i], size_b[i]), abs=1e-14)
