"""Scissors turned over look the same, and no measure tells which half was called which."""

import io
from dataclasses import fields, replace

import numpy as np
import pytest
from hand_made import disturbed, make_category, write_dataset
from hand_made import sample_of as hand_made
from PIL import Image
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from r2art.core.camera import Camera
from r2art.core.category import Category
from r2art.data.categories import make_instance, staging
from r2art.data.pose import posed_vertices, root_T_part
from r2art.data.prior import category_prior
from r2art.data.sample import Sample
from r2art.data.shape import Instance
from r2art.data.staging import UPRIGHT
from r2art.learn.evaluation.equivalent import nearer_labels, relabelled
from r2art.learn.evaluation.evaluate import evaluate
from r2art.learn.evaluation.metrics import moved
from r2art.learn.evaluation.scores import Scores, score, truth
from r2art.learn.evaluation.tabulate import Result, overview
from r2art.learn.evaluation.testsets import open_testsets
from r2art.learn.evaluation.worst import COLUMNS, LINE, TILE, worst


@pytest.fixture(scope="module")
def some() -> list[Instance]:
    return [make_instance("scissors", seed) for seed in range(24)]


@pytest.fixture(scope="module")
def category(some) -> Category:
    return category_prior(some[:8], staging("scissors"))


def sample_of(instance: Instance, seed: int) -> Sample:
    """Somewhere before the camera, more or less open; the photo shows nothing."""
    rng = np.random.default_rng(seed)
    center, size = instance.part_boxes()
    state = rng.uniform(*np.transpose([j.limits for j in instance.joints]))
    cam_T_root = np.eye(4)
    cam_T_root[:3, :3] = Rotation.random(rng=rng).as_matrix()
    cam_T_root[:3, 3] = [*rng.normal(0, 0.03, 2), rng.uniform(0.3, 0.8)]
    parts = len(instance.part_names)
    return Sample(
        image=np.full((48, 64, 3), 200, np.uint8),
        mask=rng.choice([0, *range(1, parts + 1), 255], (48, 64)).astype(np.uint8),
        depth=np.zeros((48, 64), np.float32),
        camera=Camera(60, 60, 32, 24, 64, 48),
        box=np.array([10.0, 8, 50, 40]),
        cam_T_part=cam_T_root @ root_T_part(instance.joints, state),
        joint_state=state,
        box_center=center,
        box_size=size,
        axis=np.array([j.axis for j in instance.joints]),
        pivot=np.array([j.pivot for j in instance.joints]),
        visible=rng.uniform(0.2, 1, parts),
        amodal=rng.integers(0, 1 << parts, (48, 64)).astype(np.uint16),
    )


def corners(sample: Sample) -> np.ndarray:
    """(P, 8, 3) of the part boxes, in the camera frame."""
    signs = np.stack(np.meshgrid(*[[-0.5, 0.5]] * 3, indexing="ij"), -1).reshape(-1, 3)
    at_rest = sample.box_center[:, None] + signs * sample.box_size[:, None]
    return moved(sample.cam_T_part, at_rest)


def test_the_state_moves_the_relabelled_parts_to_where_they_are(some, category):
    for seed, instance in enumerate(some):
        before = sample_of(instance, seed)
        after = relabelled(before, category)
        joints = tuple(
            replace(joint, axis=tuple(axis), pivot=tuple(pivot))
            for joint, axis, pivot in zip(instance.joints, after.axis, after.pivot, strict=True)
        )
        root_to_parts = root_T_part(joints, after.joint_state)
        np.testing.assert_allclose(
            after.cam_T_part[0] @ root_to_parts, after.cam_T_part, atol=1e-12
        )
        np.testing.assert_allclose(after.axis, before.axis, atol=1e-12)
        np.testing.assert_allclose(after.box_center[0], 0, atol=1e-12)


def test_the_relabelled_boxes_are_where_the_others_were(some, category):
    for seed, instance in enumerate(some):
        before = sample_of(instance, seed)
        after = relabelled(before, category)
        for new, old in ((0, 1), (1, 0)):
            distance, nearest = KDTree(corners(before)[old]).query(corners(after)[new])
            np.testing.assert_allclose(distance, 0, atol=1e-12)
            assert len(set(nearest)) == 8
            assert after.visible[new] == before.visible[old]
            assert np.array_equal(after.mask == new + 1, before.mask == old + 1)
            assert np.array_equal(after.amodal >> new & 1, before.amodal >> old & 1)
        for value in (0, 255):
            assert np.array_equal(after.mask == value, before.mask == value)


def test_twice_relabelled_is_the_first(some, category):
    before = sample_of(some[3], 5)
    again = relabelled(relabelled(before, category), category)
    for name, value in vars(before).items():
        if isinstance(value, np.ndarray):
            np.testing.assert_allclose(getattr(again, name), value, atol=1e-12, err_msg=name)


def test_equal_scissors_turned_over_are_the_same_scissors(some, category):
    """The same mesh, seen from above under the old poses and the new; curled tips aside."""
    for seed, instance in enumerate(some):
        before = sample_of(instance, seed)
        after = relabelled(before, category)
        size = np.linalg.norm(before.box_size, axis=1).max()
        root_T_cam = np.linalg.inv(before.cam_T_part[0])
        old, new = (
            posed_vertices(instance, root_T_cam @ s.cam_T_part)[:, ::2] for s in (before, after)
        )
        apart = np.concatenate([KDTree(a).query(b)[0] for a, b in ((old, new), (new, old))])
        if instance.rests == (UPRIGHT,):
            assert np.quantile(apart, 0.95) < 1e-3 * size
            assert apart.max() < 5e-3 * size
        else:
            assert apart.max() > 0.02 * size


def test_a_relabelled_prediction_is_scored_as_the_other_one(some, category):
    for seed, instance in enumerate(some[:8]):
        sample = sample_of(instance, seed)
        other = relabelled(sample, category)
        assert nearer_labels(sample, category, truth(sample, category)) is sample
        said = disturbed(truth(sample, category), np.random.default_rng(seed))
        one, two = score(sample, category, said), score(other, category, said)
        assert one.relabelled + two.relabelled == 1
        for field in fields(Scores):
            if field.name not in ("relabelled", "seconds"):
                a, b = getattr(one, field.name), getattr(two, field.name)
                np.testing.assert_allclose(a, b, atol=1e-9, err_msg=field.name)


def test_it_is_never_scored_worse_than_under_the_given_labels(some, category):
    plain = replace(category, symmetry=None)
    for seed, instance in enumerate(some[:8]):
        sample = sample_of(instance, seed)
        said = disturbed(truth(sample, category), np.random.default_rng(seed))
        free, bound = score(sample, category, said), score(sample, plain, said)
        assert free.add_aligned.mean() <= bound.add_aligned.mean() + 1e-12
        wrong = truth(relabelled(sample, category), category)
        assert score(sample, plain, wrong).rotation.max() > 1
        assert score(sample, plain, wrong).relabelled == 0


def test_an_evaluation_of_relabelled_predictions_is_perfect(some, category, tmp_path):
    samples = [sample_of(instance, seed) for seed, instance in enumerate(some[:6])]
    test = open_testsets(write_dataset(tmp_path / "scissors-test", category, samples))[0]
    seen = []

    def predict(sample, given_box):
        seen.append(None)
        labels = relabelled(sample, category) if len(seen) % 4 < 2 else sample
        return truth(labels, category)

    report = evaluate(test, predict)
    for mode in (report.given, report.found):
        for name in ("add", "add_s", "rotation", "translation", "state", "axis", "pivot", "depth"):
            np.testing.assert_allclose(getattr(mode.scores, name), 0, atol=1e-9, err_msg=name)
        for name in ("overlap", "scale", "box"):
            np.testing.assert_allclose(getattr(mode.scores, name), 1, atol=1e-9, err_msg=name)
    result = Result.of(report)
    assert result.given.relabelled == result.found.relabelled == 0.5
    assert ("other labelling nearer", "50.0 %", "50.0 %") in overview(result).rows
    with Image.open(io.BytesIO(worst(report))) as sheet:
        pixels = np.asarray(sheet)
    first_row = pixels[LINE : LINE + TILE // 2].reshape(TILE // 2, COLUMNS, 2, TILE, 3)
    assert np.ptp(first_row) > 100
    truths, predictions = first_row[:, :, 0], first_row[:, :, 1]
    assert (truths == predictions).all()


def test_a_category_without_a_symmetry_has_one_labelling(tmp_path):
    category = make_category()
    sample = hand_made(category, 0)
    said = disturbed(truth(sample, category), np.random.default_rng(0))
    assert nearer_labels(sample, category, said) is sample
    assert score(sample, category, said).relabelled == 0
    with pytest.raises(ValueError, match="one labelling"):
        relabelled(sample, category)
    test = open_testsets(write_dataset(tmp_path / "box-test", category, [sample]))[0]
    shown = overview(Result.of(evaluate(test, lambda *_: said)))
    assert "other labelling nearer" not in {name for name, *_ in shown.rows}
