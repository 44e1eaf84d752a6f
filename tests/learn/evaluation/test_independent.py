"""Every measure computed once more, by other means: loops, scipy and roma instead of arrays."""

import math

import numpy as np
import pytest
import roma
import torch
from hand_made import disturbed, make_category, sample_of
from scipy.optimize import minimize_scalar
from scipy.spatial import ConvexHull, HalfspaceIntersection
from scipy.spatial.distance import cdist

from r2art.learn.evaluation.calibration import calibrate
from r2art.learn.evaluation.scores import Scores, score, stack, truth
from r2art.learn.evaluation.summary import summarise

CLOSE = {"abs": 1e-6, "rel": 1e-6}
SEEDS = range(8)
PARTS, JOINTS = range(3), range(2)


def case(seed):
    category = make_category()
    sample = sample_of(category, seed)
    right = truth(sample, category)
    said = disturbed(right, np.random.default_rng(seed))
    return category, sample, right, said, score(sample, category, said)


def homogeneous(pose, point):
    return (pose @ [*point, 1.0])[:3]


def model_points(category, sample, part):
    """The prior's points, carried from its box to the instance's one coordinate at a time."""
    out = []
    for point in category.points[part]:
        moved = []
        for k in range(3):
            lower = category.box_center[part][k] - category.box_size[part][k] / 2
            share = (point[k] - lower) / category.box_size[part][k]
            start = sample.box_center[part][k] - sample.box_size[part][k] / 2
            moved.append(start + share * sample.box_size[part][k])
        out.append(moved)
    return out


def posed(category, sample, prediction, part, factor=1.0):
    """Points under a predicted pose whose translation is multiplied by ``factor``."""
    pose = prediction.parts[part].cam_T_part
    R, t = pose[:3, :3], factor * pose[:3, 3]
    return np.array([R @ p + t for p in map(np.array, model_points(category, sample, part))])


def best_factor(category, sample, right, said):
    """Least squares over the stacked coordinates of all points, by the normal equations' solver."""
    rows, wanted = [], []
    for part in PARTS:
        pose = said.parts[part].cam_T_part
        for point, true in zip(
            model_points(category, sample, part),
            posed(category, sample, right, part),
            strict=True,
        ):
            rows.extend(pose[:3, 3])
            wanted.extend(true - pose[:3, :3] @ point)
    return float(np.linalg.lstsq(np.array(rows)[:, None], np.array(wanted), rcond=None)[0][0])


@pytest.mark.parametrize("seed", SEEDS)
def test_distances_of_points(seed):
    category, sample, right, said, found = case(seed)
    factor = best_factor(category, sample, right, said)
    assert float(found.scale) == pytest.approx(factor, **CLOSE)
    for part in PARTS:
        true = posed(category, sample, right, part)
        for suffix, scale in (("", 1.0), ("_aligned", factor)):
            apart = cdist(true, posed(category, sample, said, part, scale))
            add = sum(apart[i][i] for i in range(len(apart))) / len(apart)
            add_s = sum(min(row) for row in apart) / len(apart)
            assert getattr(found, f"add{suffix}")[part] == pytest.approx(add, **CLOSE)
            assert getattr(found, f"add_s{suffix}")[part] == pytest.approx(add_s, **CLOSE)
        widest = max(map(max, cdist(true, true)))
        assert found.diameter[part] == pytest.approx(widest, **CLOSE)


@pytest.mark.parametrize("seed", SEEDS)
def test_rotations_and_centres(seed):
    category, sample, right, said, found = case(seed)
    factor = best_factor(category, sample, right, said)
    for part in PARTS:
        R, R_true = (torch.from_numpy(p.parts[part].cam_T_part[:3, :3]) for p in (said, right))
        angle = float(roma.rotmat_geodesic_distance(R, R_true))
        assert found.rotation[part] == pytest.approx(angle, **CLOSE)
        center = sample.box_center[part]
        true = homogeneous(right.parts[part].cam_T_part, center)
        for suffix, scale in (("", 1.0), ("_aligned", factor)):
            pose = said.parts[part].cam_T_part.copy()
            pose[:3, 3] *= scale
            distance = math.dist(homogeneous(pose, center), true)
            assert getattr(found, f"translation{suffix}")[part] == pytest.approx(distance, **CLOSE)
    z, z_true = (p.parts[0].cam_T_part[2, 3] for p in (said, right))
    assert float(found.depth) == pytest.approx(abs(z - z_true) / z_true, **CLOSE)


@pytest.mark.parametrize("seed", SEEDS)
def test_joints(seed):
    category, sample, right, said, found = case(seed)
    factor = best_factor(category, sample, right, said)
    for j in JOINTS:
        joint, true = said.joints[j], right.joints[j]
        cosine = sum(a * b for a, b in zip(joint.axis, true.axis, strict=True))
        assert found.axis[j] == pytest.approx(math.acos(cosine), **CLOSE)
        for suffix, scale in (("", 1.0), ("_aligned", factor)):
            state = joint.state * (scale if joint.kind == "prismatic" else 1)
            error = getattr(found, f"state{suffix}")[j]
            assert error == pytest.approx(abs(state - true.state), **CLOSE)
            off = getattr(found, f"pivot{suffix}")[j]
            if joint.kind == "prismatic":
                assert math.isnan(off)
                continue
            line = minimize_scalar(
                lambda s, p=scale * joint.pivot, t=true: math.dist(p, t.pivot + s * t.axis) ** 2
            )
            assert off == pytest.approx(math.sqrt(line.fun), **CLOSE)


def halfspaces(pose, center, size):
    """Rows a, b of the six sides of a box, a · x + b <= 0 inside, in the camera frame."""
    out = []
    for axis in range(3):
        for sign in (-1, 1):
            normal = sign * pose[:3, axis]
            face = np.array(center, float)
            face[axis] += sign * size[axis] / 2
            out.append([*normal, -normal @ homogeneous(pose, face)])
    return np.array(out)


def common_volume(planes, inner):
    """Volume within all planes around a point in their inside."""
    return ConvexHull(HalfspaceIntersection(planes, inner).intersections).volume


def point_in_both(a, b, rng):
    """The deepest of many points of box a within all planes, or None where none is."""
    pose, center, size = a
    local = center + rng.uniform(-0.5, 0.5, (40_000, 3)) * size
    points = local @ pose[:3, :3].T + pose[:3, 3]
    depth = (points @ b[:, :3].T + b[:, 3]).max(axis=1)
    own = (points @ halfspaces(*a)[:, :3].T + halfspaces(*a)[:, 3]).max(axis=1)
    worst = np.maximum(depth, own)
    return points[worst.argmin()] if worst.min() < 0 else None


@pytest.mark.parametrize("seed", SEEDS)
def test_overlaps_of_boxes_in_space(seed):
    category, sample, right, said, found = case(seed)
    factor = best_factor(category, sample, right, said)
    rng = np.random.default_rng(seed)
    compared = 0
    for part in PARTS:
        true = right.parts[part]
        truly = halfspaces(true.cam_T_part, true.box_center, true.box_size)
        for suffix, scale in (("", 1.0), ("_aligned", factor)):
            estimate = said.parts[part]
            pose = estimate.cam_T_part.copy()
            pose[:3, 3] *= scale
            center, size = scale * estimate.box_center, scale * estimate.box_size
            inner = point_in_both((pose, center, size), truly, rng)
            iou = getattr(found, f"overlap{suffix}")[part]
            if inner is None:
                assert iou < 1e-3  # at most a sliver that random points have missed
                continue
            planes = np.concatenate([halfspaces(pose, center, size), truly])
            common = common_volume(planes, inner)
            expected = common / (math.prod(size) + math.prod(true.box_size) - common)
            assert iou == pytest.approx(expected, **CLOSE)
            compared += 1
    assert compared >= 2


def test_facts_about_the_photo():
    _, sample, right, _, found = case(0)
    camera = np.linalg.inv(right.parts[0].cam_T_part)[:3, 3]
    assert found.azimuth == pytest.approx(math.atan2(camera[0], camera[2]), **CLOSE)
    level = math.asin(camera[1] / np.linalg.norm(camera))
    assert found.elevation == pytest.approx(level, **CLOSE)
    corners = [
        homogeneous(np.eye(4), sample.box_center[p] + np.array(s) * sample.box_size[p] / 2)
        for p in PARTS
        for s in ((-1, -1, -1), (1, 1, 1))
    ]
    spans = [max(c[k] for c in corners) - min(c[k] for c in corners) for k in range(3)]
    assert found.diagonal == pytest.approx(math.hypot(*spans), **CLOSE)
    assert found.box_side == 40
    assert found.inside == 1
    # 10 8 50 40 against 13 6 51 45
    assert found.box == pytest.approx(37 * 32 / (40 * 32 + 38 * 39 - 37 * 32), **CLOSE)


def recall_area(errors, tau):
    """Integral of the recall curve to ``tau``, step by step."""
    steps = sorted(min(e, tau) for e in errors)
    area, recall, at = 0.0, 0, 0.0
    for step in steps:
        area += recall / len(errors) * (step - at)
        recall, at = recall + (step < tau), step
    return (area + recall / len(errors) * (tau - at)) / tau


@pytest.fixture(scope="module")
def many() -> Scores:
    """Forty photos, every eighth failed."""
    category, out = make_category(), []
    for seed in range(40):
        sample = sample_of(category, seed)
        said = disturbed(truth(sample, category), np.random.default_rng(seed))
        out.append(score(sample, category, said if seed % 8 else None))
    return stack(out)


def test_figures_of_many_photos(many):
    summary = summarise(many, make_category())
    assert summary.failures == 5
    for p, part in enumerate(summary.parts):
        for suffix, poses in (("", part.plain), ("_aligned", part.aligned)):
            add = getattr(many, f"add{suffix}")[:, p].tolist()
            finite = [e for e in add if math.isfinite(e)]
            assert poses.add.mean.value == pytest.approx(sum(finite) / len(finite), **CLOSE)
            middle = sorted(add)[19:21]
            assert poses.add.median.value == pytest.approx(sum(middle) / 2, **CLOSE)
            assert poses.auc_100mm.value == pytest.approx(recall_area(add, 0.1), **CLOSE)
            relative = [e / d for e, d in zip(add, many.diameter[:, p], strict=True)]
            assert poses.auc_diameter.value == pytest.approx(recall_area(relative, 0.1), **CLOSE)
            shares = [e / d for e, d in zip(add, many.diagonal, strict=True) if math.isfinite(e)]
            assert poses.add_share.mean.value == pytest.approx(sum(shares) / 35, **CLOSE)
            overlaps = getattr(many, f"overlap{suffix}")[:, p]
            assert poses.overlap.mean.value == pytest.approx(sum(overlaps) / 40, **CLOSE)


def test_calibration(many):
    pairs = [
        (many.confidence[i, p], many.add_aligned[i, p] <= 0.1 * many.diameter[i, p])
        for i in range(40)
        for p in PARTS
    ]
    found = calibrate(many)
    error = 0.0
    for k in range(10):
        inside = [(c, r) for c, r in pairs if k / 10 <= c < (k + 1) / 10 or (k == 9 and c == 1)]
        if inside:
            apart = sum(c for c, _ in inside) / len(inside) - sum(r for _, r in inside) / len(
                inside
            )
            error += len(inside) / len(pairs) * abs(apart)
    assert found.error.value == pytest.approx(error, **CLOSE)
    wins = [
        1.0 if c > d else 0.5 if c == d else 0.0 for c, r in pairs for d, s in pairs if r and not s
    ]
    assert found.auroc.value == pytest.approx(sum(wins) / len(wins), **CLOSE)
    photos = sorted(range(40), key=lambda i: min(many.confidence[i]))[8:]
    right = [all(r for _, r in pairs[3 * i : 3 * i + 3]) for i in range(40)]
    assert found.rejection.right == sum(right) / 40
    assert found.rejection.right_kept == pytest.approx(sum(right[i] for i in photos) / 32, **CLOSE)
