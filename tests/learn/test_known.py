"""Objects that are all the same: their keypoints are learned, exported and fitted to."""

import json
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
import onnxruntime
import pytest
import torch

from r2art.core.category import Category
from r2art.core.image import crop_square
from r2art.data import shards
from r2art.data.categories import make_instance
from r2art.data.objects import Procedural
from r2art.data.prior import KEYPOINTS, category_prior
from r2art.data.shards import Dataset
from r2art.data.synth import Synth, synthesise
from r2art.learn import checkpoint, exported
from r2art.learn import train as train_module
from r2art.learn.augment import Crops, crops
from r2art.learn.chance import Chance
from r2art.learn.export import export
from r2art.learn.memory import Photos
from r2art.learn.objective import corners_in_camera, keypoint_losses, true_shape
from r2art.learn.train import Training, train
from r2art.method import se3
from r2art.method.keypoints import Keypoints, place_of
from r2art.method.projection import project
from r2art.method.shape import Prior
from r2art.run.model import KEYPOINT_OUTPUTS
from r2art.run.predictor import load

NAME, COUNT = "robot", 12
SIZE = 64


@dataclass(frozen=True)
class OneObject(Procedural):
    """A category of one stapler, in many poses."""

    def instance(self, seed: int, photos=()):
        del seed
        return replace(make_instance("stapler", 3, photos), category=NAME)

    def prior(self) -> Category:
        return category_prior([self.instance(seed) for seed in range(3)], self.staging)


@pytest.fixture(scope="module")
def known_data(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp(NAME)
    objects = OneObject("stapler")
    job = Synth(
        objects=objects, n=COUNT, seed=0, split="train", size=SIZE, backgrounds=None, out=folder
    )
    objects.prior().save(folder / shards.PRIOR)
    rows = [shards.to_row(i, synthesise(job, i)) for i in range(COUNT)]
    shards.write_shard(shards.shard_path(folder, 0), rows)
    manifest = {"format": shards.FORMAT, "category": NAME, "n": COUNT, "shards": 1}
    (folder / shards.MANIFEST).write_text(json.dumps(manifest))
    return folder


@pytest.fixture(scope="module")
def known_photos(known_data) -> Photos:
    return Photos.from_dataset(Dataset.open(known_data))


@pytest.fixture(scope="module")
def known_run(known_data, datasets, run, small, tmp_path_factory) -> Path:
    """A known object, learned beside what a run knows already."""
    out = tmp_path_factory.mktemp("known")
    recipe = small(
        steps=60,
        learning_rate=4e-3,
        taught="known",
        groups=2,
        turns={NAME: 99, "laptop": 1, "drawer": 0},
        seed=2,
    )
    data = (known_data, *datasets.values())
    job = Training(recipe=replace(recipe, cascade_from=None), data=data, init=run, out=out)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(train_module, "LOG_EVERY", 5)
        train(job)
    return out


@pytest.fixture(scope="module")
def known_model(known_run, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("model") / "known.onnx"
    export(known_run, path)
    return path


def test_keypoints_lie_on_the_parts_and_apart(known_photos):
    prior = known_photos.category
    assert prior.keypoints is not None
    assert prior.keypoints.shape == (2, KEYPOINTS, 3)
    for points, surface, center in zip(
        prior.keypoints, prior.points, prior.box_center, strict=True
    ):
        np.testing.assert_array_equal(points[0], center)
        gap = np.linalg.norm(points[1:, None] - surface, axis=-1).min(axis=1)
        assert gap.max() == 0
        among = np.linalg.norm(points[:, None] - points, axis=-1)[np.triu_indices(KEYPOINTS, 1)]
        assert among.min() > 0.15 * np.linalg.norm(np.ptp(surface, axis=0))


def test_objects_that_differ_have_none(photos):
    assert all(some.category.keypoints is None for some in photos.values())


def test_they_are_kept_in_files(known_photos, tmp_path):
    known_photos.category.save(tmp_path / "some.npz")
    again = Category.load(tmp_path / "some.npz")
    np.testing.assert_array_equal(again.keypoints, known_photos.category.keypoints)


@pytest.fixture
def truth(known_photos) -> tuple[Prior, Crops, torch.Tensor]:
    """Crops, and where their keypoints are seen: within the parts' projected boxes."""
    prior = Prior.from_category(known_photos.category)
    made = crops(
        known_photos, torch.arange(8), SIZE, Chance(0, torch.device("cpu")), None, augment=False
    )
    uv = project(
        se3.transform(made.cam_T_part, prior.keypoints.expand(8, -1, -1, -1)), made.K[:, None]
    )
    corners = project(corners_in_camera(true_shape(prior, made), made.cam_T_part), made.K)
    assert (uv.flatten(1, 2) > corners.amin(1, keepdim=True) - 1).all()
    assert (uv.flatten(1, 2) < corners.amax(1, keepdim=True) + 1).all()
    return prior, made, uv.flatten(1, 2)


def said(uv: torch.Tensor, log_deviation: float) -> Keypoints:
    """Maps with a bell of one place's width round each."""
    side = SIZE // 4
    at = 4 * (torch.arange(side) + 0.5)
    x, y = (-0.5 * ((at - uv[..., k, None]) / 4).square() for k in (0, 1))
    logits = y[..., :, None] + x[..., None, :]
    place, _ = place_of(logits, 4)
    return Keypoints(logits=logits, uv=place, log_deviation=torch.full(uv.shape[:2], log_deviation))


def test_losses_are_least_where_keypoints_are(truth):
    prior, made, uv = truth
    right = keypoint_losses(prior.keypoints, said(uv, 0.0), made)
    for shift in (torch.tensor([3.0, 0.0]), torch.tensor([0.0, -3.0])):
        wrong = keypoint_losses(prior.keypoints, said(uv + shift, 0.0), made)
        assert wrong["keypoint"] > right["keypoint"] + 1.5
        assert wrong["keypoint_map"] > right["keypoint_map"] + 0.1


def test_the_stated_deviation_is_best_as_large_as_the_error(truth):
    prior, made, uv = truth
    off = uv + torch.tensor([6.0, 0.0])
    said_to_be = [
        float(keypoint_losses(prior.keypoints, said(off, log), made)["keypoint"])
        for log in (0.0, float(np.log(3.0)), 3.0)
    ]
    assert said_to_be[1] < min(said_to_be[0], said_to_be[2])


def test_nothing_else_is_changed(run, known_run):
    before, _ = checkpoint.load_network(run)
    after, _ = checkpoint.load_network(known_run)
    own = ("known_objects.", f"heads.{NAME}.", "category_logits.", "found_box.", "photo_summary.")
    kept, theirs = before.state_dict(), after.state_dict()
    shared = [k for k in theirs if not k.startswith(own)]
    assert any(k.startswith("heads.laptop.") for k in shared)
    for key in shared:
        torch.testing.assert_close(theirs[key], kept[key], rtol=0, atol=0, msg=key)
    for key in ("found_box.0.weight", "category_logits.0.weight"):
        assert not torch.equal(theirs[key], kept[key])


def test_answers_that_are_known_keep_their_place():
    state = {"category_logits.2.bias": torch.zeros(4), "category_logits.0.bias": torch.zeros(2)}
    given = {
        "category_logits.2.bias": torch.tensor([1.0, 2, 3]),
        "category_logits.0.bias": torch.ones(2),
    }
    found = exported.matched_answers(state, given, ("a", "new", "b"), ("b", "a"))
    assert list(found) == ["category_logits.2.bias"]
    assert found["category_logits.2.bias"].tolist() == [2, 0, 1, 3]


def test_the_network_learns_to_find_them(known_run):
    terms = [json.loads(line) for line in (known_run / "log.jsonl").read_text().splitlines()]
    for name, least in (("keypoint", 0.1), ("keypoint_map", 0.05)):
        learned = terms[0][name] - np.mean([t[name] for t in terms[-4:]])
        assert learned > least, name


def test_a_model_file_says_where_they_are(known_run, known_model, known_photos):
    predictor = load(known_model)
    category = predictor.category(NAME)
    assert category.has_keypoints
    assert not predictor.category("laptop").has_keypoints
    np.testing.assert_allclose(
        category.prior().keypoints, known_photos.category.keypoints, atol=1e-6
    )
    network, _ = checkpoint.load_network(known_run)
    session = onnxruntime.InferenceSession(known_model, providers=["CPUExecutionProvider"])
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, (1, SIZE, SIZE, 3), np.uint8)
    K = np.array([[70.0, 0, 30], [0, 72, 33], [0, 0, 1]], np.float32)
    for views in (1, 3):
        feed = {
            "image": image,
            "K": np.tile(K, (views, 1, 1)),
            "box": np.tile(np.float32([8, 10, 50, 56]), (views, 1)),
        }
        names = [f"{NAME}.{field}" for field in (*KEYPOINT_OUTPUTS, "cam_T_part")]
        uv, deviation, poses = session.run(names, feed)
        assert poses.shape == (views, 2, 4, 4)
        with torch.no_grad():
            x = torch.from_numpy(image).permute(0, 3, 1, 2).float() / 127.5 - 1
            expected = network.keypoints(NAME, network.features(x)[1])
        np.testing.assert_allclose(uv, expected.uv, atol=0.3)  # px: weights are bytes
        np.testing.assert_allclose(deviation, expected.log_deviation.exp(), rtol=3e-2)


def test_a_prediction_is_fitted_to_them(known_model, known_data):
    predictor = load(known_model)
    sample = Dataset.open(known_data)[0]
    asked = (sample.image, sample.camera, NAME, sample.box.tolist())
    alone, fitted = (predictor.predict(*asked, refine=steps) for steps in (0, 6))
    assert alone.refinement is None
    assert fitted.refinement is not None
    assert fitted.refinement.residual < fitted.refinement.start_residual
    for part, box in zip(fitted.parts, predictor.category(NAME).prior().box_size, strict=True):
        np.testing.assert_allclose(part.box_size, box, rtol=1e-5)
    view = crop_square(sample.image, sample.camera, asked[3], predictor.model.input_size, 1.25)
    outputs = predictor.model.pose(view, view.from_photo(asked[3]), predictor.category(NAME))
    assert {"keypoint", "keypoint_deviation"} <= set(outputs)
    assert {f.name for f in fields(fitted.refinement)} >= {"residual", "start_residual"}
