"""A dataset of hand-made labels, evaluated by predictors whose errors are known."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from r2art.core.camera import Camera
from r2art.core.category import Category, Joint
from r2art.core.errors import InputError
from r2art.data import shards
from r2art.data.pose import root_T_part
from r2art.data.sample import Sample
from r2art.learn.evaluate import evaluate
from r2art.learn.report import run_eval
from r2art.learn.scores import truth
from r2art.learn.summary import summarise

N = 24
CENTER = np.array([[0, 0, 0], [0, 0.02, 0], [0, 0, 0.1]])
SIZE = np.array([[0.3, 0.02, 0.2], [0.3, 0.01, 0.2], [0.2, 0.01, 0.1]])


def make_category():
    """A body with a hinged lid and a tray that slides out."""
    points = CENTER[:, None] + SIZE[:, None] * np.random.default_rng(0).uniform(
        -0.5, 0.5, (3, 64, 3)
    )
    lid = Joint(
        name="hinge",
        kind="revolute",
        parent=0,
        axis=(-1, 0, 0),
        pivot=(0, 0.01, -0.1),
        limits=(0, 2),
    )
    tray = Joint(
        name="slide", kind="prismatic", parent=0, axis=(0, 0, 1), pivot=(0, 0, 0.1), limits=(0, 0.1)
    )
    return Category(
        name="box",
        part_names=("body", "lid", "tray"),
        joints=(lid, tray),
        box_center=CENTER,
        box_size=SIZE,
        points=points,
        normals=np.zeros_like(points),
        areas=np.ones(3),
        frontal_area=0.05,
    )


def make_sample(category, seed):
    rng = np.random.default_rng(seed)
    joint_state = rng.uniform([j.limits[0] for j in category.joints], [2, 0.1])
    cam_T_root = np.eye(4)
    cam_T_root[:3, :3] = np.diag([1, -1, -1]) @ Rotation.random(rng=rng).as_matrix()
    cam_T_root[:3, 3] = [*rng.normal(0, 0.05, 2), rng.uniform(0.6, 1.2)]
    return Sample(
        image=np.full((48, 64, 3), 200, np.uint8),
        mask=np.zeros((48, 64), np.uint8),
        depth=np.zeros((48, 64), np.float32),
        camera=Camera(60, 60, 32, 24, 64, 48),
        box=np.array([10.0, 8, 50, 40]),
        cam_T_part=cam_T_root @ root_T_part(category.joints, joint_state),
        joint_state=joint_state,
        box_center=CENTER,
        box_size=SIZE,
        axis=np.array([j.axis for j in category.joints]),
        pivot=np.array([j.pivot for j in category.joints]),
        visible=np.ones(3),
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("data") / "box-test"
    folder.mkdir()
    category = make_category()
    category.save(folder / shards.PRIOR)
    manifest = {
        "format": shards.FORMAT,
        "category": "box",
        "n": N,
        "seed": 0,
        "split": "test",
        "size": 64,
    }
    manifest |= {"backgrounds": False, "shards": 1}
    (folder / shards.MANIFEST).write_text(json.dumps(manifest))
    rows = [shards.to_row(i, make_sample(category, i)) for i in range(N)]
    shards.write_shard(shards.shard_path(folder, 0), rows)
    return folder


@pytest.fixture
def dataset(folder):
    return shards.Dataset.open(folder)


def moved_away(prediction, factor):
    """The prediction with the whole scene scaled about the camera."""
    parts = []
    for part in prediction.parts:
        pose = part.cam_T_part.copy()
        pose[:3, 3] *= factor
        parts.append(replace(part, cam_T_part=pose, box_size=part.box_size))
    return replace(prediction, parts=tuple(parts))


def test_truth_is_perfect_in_every_measure(dataset):
    report = evaluate(dataset, lambda sample, given_box: truth(sample, dataset.category))
    for scores in (report.given, report.found):
        for name in ("add", "add_s", "aligned", "rotation", "translation", "depth"):
            np.testing.assert_allclose(getattr(scores, name), 0, atol=1e-9, err_msg=name)
        for name in ("state", "axis"):
            np.testing.assert_allclose(getattr(scores, name), 0, atol=1e-9, err_msg=name)
        np.testing.assert_allclose(scores.pivot[:, 0], 0, atol=1e-9)
        for name in ("overlap", "scale", "box", "category"):
            np.testing.assert_allclose(getattr(scores, name), 1, atol=1e-9, err_msg=name)
    summary = summarise(report.given, dataset.category)
    assert summary.whole.auc_100mm == pytest.approx(1)
    assert summary.whole.auc_diameter == pytest.approx(1)
    assert summary.failures == 0


def test_a_scene_at_the_wrong_scale_is_wrong_in_depth_and_right_once_aligned(dataset):
    report = evaluate(
        dataset, lambda sample, given_box: moved_away(truth(sample, dataset.category), 1.1)
    )
    np.testing.assert_allclose(report.given.depth, 0.1, rtol=1e-9)
    np.testing.assert_allclose(report.given.scale, 1 / 1.1)
    np.testing.assert_allclose(report.given.aligned, 0, atol=1e-9)
    assert np.all(report.given.add > 0.05)


def test_failures_count_as_failures(dataset):
    calls = iter(range(2 * N))

    def predict(sample, given_box):
        if next(calls) % 8 < 2:  # every fourth photo, in both modes
            raise InputError("the model gives no finite answer for this photo")
        return truth(sample, dataset.category)

    report = evaluate(dataset, predict)
    summary = summarise(report.given, dataset.category)
    assert summary.failures == N / 4
    assert summary.whole.auc_100mm == pytest.approx(0.75)
    assert summary.whole.overlap.mean == pytest.approx(0.75)
    assert summary.whole.add.p90 == np.inf
    assert summary.whole.add.mean == pytest.approx(0, abs=1e-12)
    assert report.worst[0].badness == np.inf


def test_another_category_is_a_failure_but_its_box_still_counts(dataset):
    def predict(sample, given_box):
        right = truth(sample, dataset.category)
        return right if given_box else replace(right, category="sofa", box=(10, 8, 50, 24))

    found = summarise(evaluate(dataset, predict).found, dataset.category)
    assert found.category_accuracy == 0
    assert found.failures == N
    assert found.box.median == pytest.approx(0.5)


def test_nothing_predicted_is_an_error(dataset):
    with pytest.raises(InputError, match="no photo could be predicted"):
        evaluate(dataset, lambda sample, given_box: None)


def test_the_command_writes_tables_files_and_pictures(folder, dataset, tmp_path, capsys):
    model, out, results = tmp_path / "m.onnx", tmp_path / "out", tmp_path / "results.md"
    model.write_bytes(b"any file has a checksum")
    results.write_text("# Results\n\n<!-- begin speed -->\nkept\n<!-- end speed -->\n")

    def predict(sample, given_box):
        wrong = moved_away(truth(sample, dataset.category), 1.05)
        return wrong if sample.joint_state[0] < 1.5 else None

    run_eval(folder, predict, model, limit=4, results=results)
    run_eval(folder, predict, model, out=out, limit=12, results=results)
    shown = capsys.readouterr().out
    assert "lid" in shown
    assert "slide" in shown
    page = results.read_text()
    assert page.count("<!-- begin eval-box -->") == 1
    assert "kept" in page
    assert "12 photos" in page
    assert str(folder.parent) not in page
    report = json.loads((out / "report.json").read_text())
    assert report["given"]["images"] == 12
    assert report["given"]["failures"] > 0
    assert [p["name"] for p in report["given"]["parts"]] == ["body", "lid", "tray"]
    rows = list(csv.DictReader((out / "images.csv").read_text().splitlines()))
    assert len(rows) == 24
    assert float(rows[0]["depth"]) == pytest.approx(0.05) or rows[0]["depth"] == "inf"
    for picture in ("errors.png", "worst.png"):
        with Image.open(out / picture) as image:
            image.load()
    assert sorted(p.name for p in out.iterdir()) == [
        *("errors.png", "images.csv", "report.json", "report.md", "worst.png")
    ]
