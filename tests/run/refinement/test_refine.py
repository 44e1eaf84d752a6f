"""Refinement: derivatives, invariances, and objects that come home."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image, ImageDraw

from r2art.core.category import Category, Joint
from r2art.core.errors import InputError, UsageError
from r2art.core.mesh import Mesh
from r2art.run.refinement.body import body_of
from r2art.run.refinement.coverage import coverage_errors
from r2art.run.refinement.descent import HEAT, descend
from r2art.run.refinement.outline import outline, reach_errors
from r2art.run.refinement.pose import (
    Pose,
    derivatives,
    difference,
    moved,
    pose_of,
    posed,
    rotation_of,
    vector_of,
)
from r2art.run.refinement.problems import problems
from r2art.run.refinement.refine import STEPS, refine, resolutions
from r2art.run.refinement.silhouettes import MARGIN, pixel_errors, pyramid
from r2art.run.refinement.starts import other_states, spread
from r2art.run.refinement.twists import twists, wrenches
from r2art.run.refinement.uncertainty import Uncertainty

SIZE = 160
K = np.array([[220.0, 0, 80], [0, 210, 78], [0, 0, 1]])
SURE = Uncertainty(rotation=0.2, log_depth=0.1, outline=0.005)


def plate_surface(center, size, count, rng):
    """Points, normals and area of a box's surface, drawn at random."""
    area = np.array([size[1] * size[2], size[0] * size[2], size[0] * size[1]])
    axis = rng.choice(3, count, p=area / area.sum())
    side = rng.choice([-1, 1], count)
    points = rng.uniform(-0.5, 0.5, (count, 3))
    points[np.arange(count), axis] = side / 2
    return center + points * size, side[:, None] * np.eye(3)[axis], 2 * area.sum()


@pytest.fixture(scope="module")
def notebook() -> Category:
    """A base with a lid on a hinge and a drawer: two parts that turn and slide."""
    rng = np.random.default_rng(0)
    center = np.array([[0, 0, 0], [0, 0.03, 0], [0.05, 0.0, 0.02]], float)
    size = np.array([[0.34, 0.04, 0.24], [0.34, 0.02, 0.24], [0.2, 0.03, 0.2]])
    surfaces = [plate_surface(c, s, 512, rng) for c, s in zip(center, size, strict=True)]
    points, normals, areas = zip(*surfaces, strict=True)
    joints = (
        Joint(
            name="hinge",
            kind="revolute",
            parent=0,
            axis=(-1.0, 0, 0),
            pivot=(0, 0.02, -0.12),
            limits=(0.0, 2.2),
        ),
        Joint(
            name="slide",
            kind="prismatic",
            parent=0,
            axis=(0, 0, 1.0),
            pivot=(0, 0, 0),
            limits=(0.0, 0.15),
        ),
    )
    return Category(
        name="notebook",
        part_names=("base", "lid", "drawer"),
        joints=joints,
        box_center=center,
        box_size=size,
        points=np.stack(points),
        normals=np.stack(normals),
        areas=np.array(areas),
        frontal_area=0.05,
    )


@pytest.fixture(scope="module", params=["points", "mesh"])
def bodies(notebook, request):
    """Known by points alone, as of old model files, or by a mesh."""
    mesh = box_mesh(notebook.box_center, notebook.box_size)
    return resolutions(replace(notebook, mesh=mesh if request.param == "mesh" else None))


@pytest.fixture(scope="module")
def points(notebook):
    return resolutions(notebook)


def box_mesh(center: np.ndarray, size: np.ndarray) -> Mesh:
    """The boxes themselves."""
    corner = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3, indexing="ij")).reshape(3, -1).T
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([[(a, b, c), (a, c, d)] for a, b, c, d in quads]).reshape(-1, 3)
    parts = np.arange(len(center))
    return Mesh(
        vertices=(center[:, None] + size[:, None] * corner).reshape(-1, 3),
        faces=(faces + 8 * parts[:, None, None]).reshape(-1, 3),
        part=np.repeat(parts, 8),
    )


def a_pose(body, count: int = 1, seed: int = 0) -> Pose:
    """From the front and above, joints well within their limits."""
    rng = np.random.default_rng(seed)
    R = np.diag([1.0, -1, -1]) @ rotation_of(np.array([0.5, 0, 0]))
    turned = R @ rotation_of(np.array([0, 0.4, 0]) + 0.1 * rng.normal(size=(count, 3)))
    low, high = body.limits.T
    return Pose(
        rotation=turned,
        anchor=np.array([0.02, 0.04, 1.0]) + 0.02 * rng.normal(size=(count, 3)),
        joint_state=low + (high - low) * rng.uniform(0.4, 0.8, (count, len(low))),
        log_scale=np.zeros((count, *body.center.shape)),
        border=np.zeros(count),
    )


def box_masks(body, pose: Pose) -> np.ndarray:
    """(P, H, W) exact masks of the parts' boxes: their projected corners' hulls, drawn."""
    corner = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1)
    corners = body.center[..., None] + body.size[..., None] * corner
    at = posed(body, pose)
    points = at.rotation[0] @ corners + at.translation[0][..., None]
    uv = points[:, :2] / points[:, 2:] * np.array([[K[0, 0]], [K[1, 1]]]) + K[:2, 2:]
    return np.stack([_filled_hull(p.T) for p in uv])


def _filled_hull(points: np.ndarray, fine: int = 8) -> np.ndarray:
    order = sorted(map(tuple, points * fine - 0.5))
    chains = []
    for walk in (order, order[::-1]):
        chain: list = []
        for p in walk:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], p) <= 0:
                chain.pop()
            chain.append(p)
        chains += chain[:-1]
    image = Image.new("L", (SIZE * fine, SIZE * fine))
    ImageDraw.Draw(image).polygon(chains, fill=1)
    shares = np.asarray(image, float).reshape(SIZE, fine, SIZE, fine).mean(axis=(1, 3))
    return (shares > 0.5).astype(float)


def _turn(a, b, c) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def add(body, a: Pose, b: Pose) -> float:
    """Mean distance of the tips of the object's parts in two poses (m)."""
    ends = [posed(body.outlined(), pose).points for pose in (a, b)]
    return float(np.linalg.norm(ends[0] - ends[1], axis=2).mean())


def refined(bodies, start: Pose, masks, **options):
    cam_T_root = np.eye(4)
    cam_T_root[:3, :3] = start.rotation[0]
    cam_T_root[:3, 3] = start.anchor[0] - start.rotation[0] @ bodies[0].anchor
    result = refine(bodies, cam_T_root, start.joint_state[0], masks, K, **options)
    return result, pose_of(bodies[0], result.cam_T_root, result.joint_state)


def off(body, pose: Pose, *, turn=0.3, depth=0.1, joints=0.2, place=0.02) -> Pose:
    root = [*(turn * np.array([0.6, -0.7, 0.4])), place, -place, math.log(1 + depth)]
    span = (body.limits[:, 1] - body.limits[:, 0]) * joints
    return moved(body, pose, np.array([[*root, *(span * [1, -1]), 0.0]]))


@pytest.mark.parametrize("scale", [False, True])
def test_points_move_as_their_derivatives_say(points, scale):
    body, rng = points[0], np.random.default_rng(1)
    pose = a_pose(body, 2)
    pose = Pose(**{**vars(pose), "log_scale": 0.1 * rng.normal(size=pose.log_scale.shape)})
    by_points, by_patches = derivatives(body, pose, posed(body, pose), scale=scale)
    D = by_points.shape[2]
    assert 9 + (9 if scale else 0) == D
    for d in range(D):
        step = np.zeros((2, D))
        step[:, d] = 1e-6
        ahead, behind = (posed(body, moved(body, pose, s)) for s in (step, -step))
        slope = (ahead.points - behind.points) / 2e-6
        np.testing.assert_allclose(slope, by_points[:, :, d], atol=1e-8)
        slope = (ahead.patches - behind.patches) / 2e-6
        np.testing.assert_allclose(slope, by_patches[:, :, d], atol=1e-8)


@pytest.mark.parametrize("scale", [False, True])
def test_wrenches_on_twists_are_covectors_on_motions(notebook, points, scale):
    body, rng = body_of(notebook), np.random.default_rng(1)
    pose = a_pose(body, 2)
    pose = Pose(**{**vars(pose), "log_scale": 0.1 * rng.normal(size=pose.log_scale.shape)})
    at = posed(body, pose)
    start, part, point = rng.integers(2, size=40), rng.integers(3, size=40), np.arange(40)
    pull = rng.normal(size=(40, 3))
    rest, x = body.points[part, :, point], at.points[start, part, :, point]
    loads = wrenches(body, pose, at, start, part, rest, x, pull, scale=scale)
    by_part = twists(body, pose, at, scale=scale).reshape(2, -1, 3, loads.shape[-1])
    by_points, _ = derivatives(body, pose, at, scale=scale)
    np.testing.assert_allclose(
        np.einsum("ndq,nq->nd", by_part[start, :, part], loads),
        np.einsum("ndi,ni->nd", by_points[start, part, :, :, point], pull),
        atol=1e-12,
    )


def test_out_of_the_picture_nothing_moves(notebook):
    """Where no outline crosses a pixel, errors are those of an empty picture, without slopes."""
    mesh = box_mesh(notebook.box_center, notebook.box_size)
    body = resolutions(replace(notebook, mesh=mesh))[0]
    pose = a_pose(body, 2)
    masks = box_masks(body, a_pose(body)).max(axis=0, keepdims=True)
    known = np.ones_like(masks)
    corners = outline(masks, known, K, 16).corners
    (level,) = pyramid(masks, known, K, corners, (28,), soft=False)
    aside = replace(pose, anchor=pose.anchor + np.array([40.0, 0, 0]))
    found = coverage_errors(body, aside, level, scale=True)
    assert found.slopes.size == 0
    assert np.abs(found.error).max() > 0.5
    assert np.isfinite(found.error).all()


@pytest.mark.parametrize("by_part", [False, True])
@pytest.mark.parametrize("what", ["points", "mesh", "outline"])
def test_errors_move_as_their_derivatives_say(notebook, by_part, what):
    """Those of the rendered masks' own softness are left out: it follows the rendering."""
    mesh = box_mesh(notebook.box_center, notebook.box_size)
    body = resolutions(replace(notebook, mesh=mesh if what == "mesh" else None))[0]
    pose = replace(
        a_pose(body, 2),
        border=np.array([0.001, -0.003]),
        # No edges of two parts may coincide: where they part, coverage has a kink.
        log_scale=0.05 * np.random.default_rng(3).normal(size=(2, 3, 3)),
    )
    masks = box_masks(body, a_pose(body))
    masks = masks if by_part else masks.max(axis=0, keepdims=True)
    known = np.ones_like(masks)
    around = outline(masks, known, K, 16)
    shown = masks if what == "mesh" else 0 * masks
    soft = what != "mesh"
    (level,) = pyramid(shown, known, K, around.corners, (28,), soft=soft, borders=2)

    def measure(p):
        if what == "outline":
            return reach_errors(body, p, around, scale=True)
        errors = pixel_errors if what == "points" else coverage_errors
        return errors(body, p, level, scale=True)

    found = measure(pose)
    slopes = np.zeros((2, found.slopes.shape[1], found.error.shape[1]))
    slopes[..., found.moving] = found.slopes
    for d in range(slopes.shape[1]):
        step = np.zeros((2, slopes.shape[1]))
        step[:, d] = 1e-7
        numeric = (measure(moved(body, pose, step)).error - found.error) / 1e-7
        np.testing.assert_allclose(numeric, slopes[:, d], atol=2e-4 * np.abs(slopes).max())


def test_the_difference_of_two_poses_leads_from_one_to_the_other(bodies):
    pose = a_pose(bodies[0], 3)
    step = 0.01 * np.random.default_rng(0).uniform(-1, 1, (3, 18))
    there = moved(bodies[0], pose, step)
    np.testing.assert_allclose(difference(bodies[0], there, pose, scale=True), step, atol=1e-9)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-4, 1.0, 3.0])
def test_rotations_and_their_vectors_are_inverse(angle):
    vector = angle * np.array([[0.6, 0.0, -0.8]])
    R = rotation_of(vector)
    np.testing.assert_allclose(R @ R.transpose(0, 2, 1), np.eye(3)[None], atol=1e-12)
    np.testing.assert_allclose(vector_of(R), vector, atol=1e-9)


@pytest.mark.parametrize("size", [7, 28, 112])
def test_a_window_keeps_what_is_in_it(size):
    """Also where its squares are smaller than pixels."""
    masks = np.zeros((2, SIZE, SIZE))
    masks[:, 40:100, 50:120] = np.random.default_rng(0).uniform(size=(2, 60, 70))
    box = (np.array([50, 40, 120, 100]) - np.tile(K[:2, 2], 2)) / np.tile(np.diag(K)[:2], 2)
    (level,) = pyramid(masks, np.ones_like(masks), K, box, (size,), soft=False)
    side = 70 * (1 + 2 * MARGIN)
    area = level.shares[0].sum(axis=(1, 2)) * (side / size) ** 2
    np.testing.assert_allclose(area, masks.sum(axis=(1, 2)))
    assert (level.weight == 1).all()


def test_thinning_keeps_the_surface(notebook):
    body = body_of(notebook)
    for count in (48, 300, 5000):
        thin = body.thinned(count)
        areas = [np.linalg.norm(b.patches, axis=1).sum(axis=-1) for b in (body, thin)]
        np.testing.assert_allclose(areas[1], areas[0])
    assert body.thinned(48).points.shape == (3, 3, 16)


def test_a_stretched_body_has_the_boxes_asked_for(notebook):
    body = body_of(notebook)
    size = body.size * [1.2, 0.9, 1.1]
    center = body.center + np.array([[0, 0, 0], [0, 0.01, 0], [0.02, 0, 0]])
    stretched = body.stretched(center, size)
    extent = np.ptp(stretched.tips, axis=-1)
    np.testing.assert_allclose(extent, size)
    back = stretched.stretched(body.center, body.size)
    for name in ("points", "patches", "pivot", "tips"):
        np.testing.assert_allclose(getattr(back, name), getattr(body, name), atol=1e-12)


def test_the_outline_of_a_body_is_that_of_its_mask(bodies):
    pose = a_pose(bodies[0])
    masks = box_masks(bodies[0], pose)
    wanted = outline(masks, np.ones_like(masks), K, 32)
    error = reach_errors(bodies[0].outlined(), pose, wanted, scale=False).error
    assert np.abs(error).max() < 1.0 / K[1, 1]  # a pixel


@pytest.mark.parametrize("by_part", [False, True])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_an_object_comes_home(bodies, by_part, seed):
    true = a_pose(bodies[0], seed=seed)
    masks = box_masks(bodies[0], true)
    start = off(bodies[0], true)
    result, pose = refined(bodies, start, masks if by_part else masks.max(axis=0), uncertainty=SURE)
    assert add(bodies[0], start, true) > 0.08
    assert add(bodies[0], pose, true) < 0.012
    assert result.residual < 0.02 < result.start_residual
    assert result.steps > 3


def test_it_comes_home_from_where_no_pixel_overlaps(bodies):
    true = a_pose(bodies[0])
    start = off(bodies[0], true, place=0.5, depth=0.3)
    unsure = Uncertainty(place=0.5, log_depth=0.3, outline=0.005)
    masks = box_masks(bodies[0], true)
    assert (masks.max(axis=0) * box_masks(bodies[0], start).max(axis=0)).sum() == 0
    _, pose = refined(bodies, start, masks, uncertainty=unsure)
    assert add(bodies[0], pose, true) < 0.015


def test_several_starts_find_what_one_does_not(bodies):
    true = a_pose(bodies[0])
    masks = box_masks(bodies[0], true)
    start = off(bodies[0], true, turn=1.3, joints=0.3)
    unsure = Uncertainty(rotation=0.7, joint=0.3, outline=0.005)
    one, _ = refined(bodies, start, masks, uncertainty=unsure)
    many, pose = refined(bodies, start, masks, uncertainty=unsure, starts=16)
    assert many.residual <= one.residual + 1e-3
    assert add(bodies[0], pose, true) < 0.03


def test_where_none_fits_there_are_more_starts(bodies):
    true = a_pose(bodies[0])
    masks = box_masks(bodies[0], true).max(axis=0)
    unsure = Uncertainty(rotation=1.0, joint=0.4, outline=0.005)
    far = off(bodies[0], true, turn=2.0, joints=0.4)
    _, lost = refined(bodies, far, masks, uncertainty=unsure, starts=1)
    found, pose = refined(bodies, far, masks, uncertainty=unsure, starts=2)
    assert add(bodies[0], lost, true) > 0.2
    assert add(bodies[0], pose, true) < 0.01
    near = off(bodies[0], true)
    at_once, _ = refined(bodies, near, masks, uncertainty=SURE, starts=2)
    assert at_once.steps <= sum(STEPS) < found.steps


@pytest.mark.parametrize("field", [None, 2])
def test_of_more_starts_than_a_field_the_better_half_runs_on(bodies, field):
    true = a_pose(bodies[0])
    masks = box_masks(bodies[0], true).max(axis=0, keepdims=True)
    estimate = off(bodies[0], true)
    outlines = problems(bodies, [], estimate, masks, np.ones_like(masks), K, SURE).outline
    running = []

    def counted(pose):
        running.append(len(pose.rotation))
        return outlines.measure(pose)

    starts = spread(bodies[0], estimate, SURE, 8)
    before = outlines.system(starts)[0]
    problem = replace(outlines, measure=counted)
    _, cost, steps, _ = descend(problem, starts, 3 * HEAT, field=field)
    halves = [8, 4, 2] if field else [8, 8, 8]
    assert running == [8, *(n for n in halves for _ in range(HEAT))]
    assert steps == 3 * HEAT
    assert (cost <= before).all()


def test_moving_the_camera_leaves_the_joints_alone(bodies):
    """The window moves with the object: another principal point is another picture of the same."""
    true = a_pose(bodies[0])
    masks = box_masks(bodies[0], true)
    start = off(bodies[0], true)
    result, _ = refined(bodies, start, masks)
    shifted = np.array([[1, 0, 7], [0, 1, -5], [0, 0, 1]]) @ K
    cam_T_root = np.eye(4)
    cam_T_root[:3, :3] = start.rotation[0]
    cam_T_root[:3, 3] = start.anchor[0] - start.rotation[0] @ bodies[0].anchor
    assert masks[:, 8:-8, 8:-8].sum() == masks.sum()
    moved_masks = np.roll(masks, (-5, 7), axis=(1, 2))
    again = refine(bodies, cam_T_root, start.joint_state[0], moved_masks, shifted)
    np.testing.assert_allclose(again.joint_state, result.joint_state, atol=1e-6)
    np.testing.assert_allclose(again.cam_T_root, result.cam_T_root, atol=1e-6)


def test_joints_stay_within_their_limits(bodies):
    true = a_pose(bodies[0])
    shut = Pose(**{**vars(true), "joint_state": np.zeros((1, 2))})
    masks = box_masks(bodies[0], shut)
    result, _ = refined(bodies, off(bodies[0], shut), masks, uncertainty=SURE)
    low, high = bodies[0].limits.T
    assert (result.joint_state >= low).all()
    assert (result.joint_state <= high).all()
    assert result.joint_state[0] < 0.15


def test_a_sure_estimate_stays_where_it_is(bodies):
    true = a_pose(bodies[0])
    start = off(bodies[0], true)
    sure = Uncertainty(rotation=1e-4, place=1e-4, log_depth=1e-4, joint=1e-4, outline=0.05)
    _, pose = refined(bodies, start, box_masks(bodies[0], true), uncertainty=sure)
    assert add(bodies[0], pose, start) < 0.002


def test_a_longer_object_is_found_to_be_longer(bodies):
    body = bodies[0]
    size = body.size * np.array([[1.1, 1, 1], [1.1, 1, 1], [1, 1, 1]])
    longer = body.stretched(body.center, size)
    true = a_pose(longer)
    free = Uncertainty(rotation=0.1, log_depth=0.02, log_scale=0.1, outline=0.005)
    result, _ = refined(bodies, true, box_masks(longer, true), uncertainty=free)
    assert 0.05 < result.log_scale[0, 0] < 0.15
    assert abs(result.log_scale[0, 2]) < 0.05


def test_what_is_not_known_does_not_pull(bodies):
    """A bar hides part of the object; only where this is said does it come home."""
    true = a_pose(bodies[0])
    masks = box_masks(bodies[0], true)
    known = np.ones((SIZE, SIZE))
    known[:, 95:] = 0
    start = off(bodies[0], true, turn=0.1, depth=0.05, joints=0.05)
    sure = Uncertainty(rotation=0.06, log_depth=0.05, joint=0.05, outline=0.005)
    hidden = masks * known
    _, told = refined(bodies, start, hidden, known=known, uncertainty=sure)
    _, untold = refined(bodies, start, hidden, uncertainty=sure)
    assert add(bodies[0], told, true) < 0.5 * add(bodies[0], untold, true)
    assert add(bodies[0], told, true) < add(bodies[0], start, true)


def test_it_may_be_stopped_at_any_time_and_is_never_worse(bodies):
    true = a_pose(bodies[0])
    masks = box_masks(bodies[0], true)
    start = off(bodies[0], true)
    residuals = []
    for steps in ((0, 0, 0, 0, 0), (6, 0, 0, 0, 0), (6, 4, 0, 0, 0), (6, 12, 0, 4, 0)):
        result, _ = refined(bodies, start, masks, steps=steps)
        assert result.residual <= result.start_residual
        assert result.steps <= sum(steps)
        residuals.append(result.residual)
    assert all(after <= before + 2e-3 for before, after in pairwise(residuals))
    assert residuals[-1] < 0.1 * residuals[0]
    at_once, pose = refined(bodies, start, masks, seconds=0.0)
    assert at_once.steps == 0
    assert not at_once.converged
    assert add(bodies[0], pose, start) < 1e-9


def test_the_first_start_is_the_estimate_and_the_others_surround_it(bodies):
    estimate = a_pose(bodies[0])
    starts = spread(bodies[0], estimate, Uncertainty(rotation=0.5), 16)
    np.testing.assert_allclose(starts.rotation[0], estimate.rotation[0])
    np.testing.assert_allclose(starts.joint_state[0], estimate.joint_state[0])
    turns = vector_of(starts.rotation @ estimate.rotation.transpose(0, 2, 1))[1:]
    assert np.linalg.norm(turns.mean(axis=0)) < 0.15
    np.testing.assert_allclose(np.sort(np.linalg.norm(turns, axis=1))[[0, -1]], [0.4, 0.8])


@pytest.mark.parametrize(
    ("masks", "error"),
    [
        (np.zeros((SIZE, SIZE)), InputError),
        (np.full((SIZE, SIZE), np.nan), InputError),
        (np.ones((2, SIZE, SIZE)), UsageError),
        (np.ones(SIZE), UsageError),
    ],
)
def test_masks_that_cannot_be_meant_are_refused(bodies, masks, error):
    with pytest.raises(error, match="mask"):
        refined(bodies, a_pose(bodies[0]), masks)


def test_an_uncertainty_must_be_positive():
    with pytest.raises(UsageError, match="log_depth is 0"):
        Uncertainty(log_depth=0)


def test_a_mask_that_is_too_wide_all_round_is_seen_to_be(bodies):
    """Only the border's own freedom tells it from an object that is nearer."""
    true = a_pose(bodies[0])
    wide = np.stack([_grown(m, 2) for m in box_masks(bodies[0], true)])
    start = off(bodies[0], true, turn=0.1, depth=0.05, joints=0.05)
    sure = Uncertainty(rotation=0.06, log_depth=0.05, joint=0.05, outline=0.005)
    _, blind = refined(bodies, start, wide, uncertainty=sure)
    _, seeing = refined(bodies, start, wide, uncertainty=replace(sure, border=0.03))
    assert add(bodies[0], seeing, true) < 0.6 * add(bodies[0], blind, true)


def _grown(mask: np.ndarray, pixels: int) -> np.ndarray:
    shifts = range(-pixels, pixels + 1)
    return np.max([np.roll(mask, (dy, dx), (0, 1)) for dy in shifts for dx in shifts], axis=0)


def test_other_states_change_one_joint_at_a_time(bodies):
    pose = a_pose(bodies[0])
    others = other_states(bodies[0], pose, 4)
    changed = others.joint_state != pose.joint_state
    assert changed.sum(axis=1).tolist() == [0] + 8 * [1]
    low, high = bodies[0].limits.T
    assert ((others.joint_state >= low) & (others.joint_state <= high)).all()
