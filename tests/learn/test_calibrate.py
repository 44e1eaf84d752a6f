"""Weights are found that make a confidence a probability, and the model file remembers them."""

import json
from dataclasses import replace

import numpy as np
import onnx
import pytest
from commands import run as r2art

from r2art.core.confidence import Calibration, Weights, log_misfit, log_odds
from r2art.core.errors import InputError
from r2art.core.prediction import Refinement
from r2art.data.source import Fault
from r2art.learn.calibrate import (
    Calibrated,
    Found,
    Judged,
    Parts,
    Worth,
    calibrate,
    cross_validated,
    fit,
    judge,
    with_calibration,
)
from r2art.learn.evaluation.evaluate import evaluate
from r2art.learn.evaluation.scores import truth
from r2art.learn.evaluation.statistics import auroc, calibration_error
from r2art.learn.evaluation.testsets import open_testsets
from r2art.learn.export import export
from r2art.run.model import Model
from r2art.run.predictor import Predictor, load

TRUE = Weights(bias=-0.7, slope=0.4, misfit=-1.2)


def drawn(weights: Weights, photos: int, *, refined: bool = True, parts: int = 4) -> Parts:
    """Parts that are right with just the probability that these weights give them."""
    rng = np.random.default_rng(0)
    photo = np.repeat(np.arange(photos), parts)
    confidence = 1 / (1 + np.exp(-rng.normal(2, 2, len(photo))))
    residual = np.exp(rng.normal(-3.5, 0.6, photos))[photo] if refined else None
    right = rng.uniform(size=len(photo)) < weights.probability(confidence, residual)
    return Parts(photo=photo, confidence=confidence, right=right, residual=residual)


def test_the_weights_behind_the_data_are_found():
    found = fit(drawn(TRUE, 20_000))
    assert found.bias == pytest.approx(TRUE.bias, abs=0.05)
    assert found.slope == pytest.approx(TRUE.slope, abs=0.03)
    assert found.misfit == pytest.approx(TRUE.misfit, abs=0.05)
    plain = Weights(bias=TRUE.bias, slope=TRUE.slope)
    found = fit(drawn(plain, 20_000, refined=False))
    assert found.slope == pytest.approx(plain.slope, abs=0.03)
    assert found.misfit == 0


def test_no_other_weights_near_have_a_smaller_loss():
    parts = drawn(TRUE, 50)

    def loss(weights):
        p = weights.probability(parts.confidence, parts.residual)
        away = np.subtract([weights.bias, weights.slope, weights.misfit], [0, 1, 0])
        return -np.log(np.where(parts.right, p, 1 - p)).sum() + (away**2).sum() / 2

    found = fit(parts)
    for name in ("bias", "slope", "misfit"):
        for step in (-0.02, 0.02):
            assert loss(replace(found, **{name: getattr(found, name) + step})) > loss(found)


def test_what_is_much_too_sure_becomes_a_probability():
    parts = drawn(TRUE, 1500)
    judged = judge(parts)
    assert judged.before.error > 0.2
    assert judged.after.error < 0.05
    assert judged.after.auroc > judged.before.auroc + 0.02  # the residual tells more
    assert judged.before.auroc == auroc(parts.confidence, parts.right)
    assert judged.after.error == calibration_error(cross_validated(parts), parts.right)
    assert judged.photos == 1500


def test_what_is_a_probability_stays_as_it_is():
    found = fit(drawn(Weights(), 20_000))
    assert (found.bias, found.slope, found.misfit) == pytest.approx((0, 1, 0), abs=0.06)


def test_no_photo_has_a_part_in_what_is_said_of_it():
    """Turn the labels of one photo round: what is said of it stays, of others it does not."""
    parts = drawn(TRUE, 20)
    of_one = parts.photo == 7
    turned = replace(parts, right=np.where(of_one, ~parts.right, parts.right))
    before, after = cross_validated(parts), cross_validated(turned)
    np.testing.assert_array_equal(before[of_one], after[of_one])
    assert np.all(before[parts.photo == 8] != after[parts.photo == 8])


@pytest.mark.parametrize("right", [True, False])
@pytest.mark.parametrize("photos", [1, 2, 5, 100])
def test_few_photos_that_are_all_alike_give_weights_that_can_be_meant(photos, right):
    parts = drawn(TRUE, photos)
    parts = replace(parts, right=np.full_like(parts.right, right))
    found = fit(parts)
    assert np.abs([found.bias, found.slope, found.misfit]).max() < 10
    said = found.probability(parts.confidence, parts.residual)
    assert np.abs(said - right).mean() < np.abs(parts.confidence - right).mean()
    judged = judge(parts)
    assert np.isnan(judged.after.auroc)
    assert np.isnan(judged.after.error) == (photos == 1)  # there is none to learn from


def test_nothing_at_all_is_the_identity():
    none = drawn(TRUE, 0)
    assert fit(none) == Weights()
    assert fit(replace(none, residual=None)) == Weights()


@pytest.fixture
def test(datasets):
    return open_testsets(datasets["laptop"])[0]


def unsteady(test):
    """The truth, and every third time the lid is elsewhere; refinement finds it all, with a
    residual that tells nothing."""

    def predict(sample, category, refined):
        said = truth(sample, test.source.category)
        if refined:
            fit = Refinement(steps=3, start_residual=0.1, residual=0.03, converged=True)
            return replace(said, refinement=fit)
        pose = said.parts[1].cam_T_part.copy()
        wrong = round(1e6 * pose[0, 0]) % 3 == 0
        pose[:3, 3] += 0.2 * wrong
        lid = replace(said.parts[1], cam_T_part=pose)
        hinge = replace(said.joints[0], state=said.joints[0].state + 0.5 * wrong)
        return replace(said, parts=(said.parts[0], lid), joints=(hinge,))

    return predict


def test_right_is_what_the_evaluation_calls_right(test):
    predict = unsteady(test)
    (found,), broken = calibrate([test], predict)
    assert broken == []
    for refined in (True, False):
        scores = evaluate(
            test, lambda s, given_box, r=refined: predict(s, "laptop", r)
        ).given.scores
        for kind, right in ((found.parts, scores.right), (found.joints, scores.state_right)):
            judged = kind.refined if refined else kind.plain
            assert judged.right == right.mean()
            assert judged.before.error == pytest.approx(1 - right.mean())  # it says 1 of each
            assert judged.photos == len(test.source)
    for kind in (found.parts, found.joints):
        assert kind.refined.right == 1 > kind.plain.right > 0.5
    assert found.category == "laptop"


def test_datasets_of_one_category_are_taken_together(test):
    (alone,), _ = calibrate([test], unsteady(test))
    (twice,), _ = calibrate([test, test], unsteady(test))
    for kind in ("parts", "joints"):
        one, both = getattr(alone, kind), getattr(twice, kind)
        assert both.plain.photos == 2 * one.plain.photos
        assert both.plain.right == one.plain.right


def test_what_cannot_be_read_or_predicted_is_told_and_left_out(test):
    class Damaged:
        category = test.source.category

        def __len__(self):
            return 6

        def __getitem__(self, index):
            if index == 2:
                raise Fault("photo 2", "image", "no pixels")
            return test.source[index]

    calls = []

    def predict(sample, category, refined):
        calls.append(refined)
        if len(calls) == 4:  # the second photo, without refinement
            raise InputError("no finite answer")
        return unsteady(test)(sample, category, refined)

    damaged = replace(test, source=Damaged())
    (found,), broken = calibrate([damaged], predict)
    for kind in (found.parts, found.joints):
        assert kind.refined.photos == kind.plain.photos == 4
    assert broken == [f"{test.name}, photo 1: no finite answer", "photo 2: image: no pixels"]

    def never(sample, category, refined):
        raise InputError("no finite answer")

    with pytest.raises(InputError, match=r"no photo of .* can be used; .*no finite answer"):
        calibrate([damaged], never)


def test_a_model_that_sees_no_masks_has_only_plain_estimates(test):
    (found,), _ = calibrate([test], lambda s, c, refined: unsteady(test)(s, c, False))
    for kind in (found.parts, found.joints):
        assert kind.refined is None
        assert kind.calibration.refined == Weights()
        assert kind.calibration.plain != Weights()


FOUND = Calibration(
    refined=Weights(bias=-1.5, slope=0.25, misfit=-0.75), plain=Weights(bias=0.5, slope=0.5)
)
OF_JOINTS = Calibration(refined=Weights(bias=0.5, misfit=-0.25), plain=Weights(slope=0.75))
WORTH = Worth(error=0.1, auroc=0.9)
JUDGED = Judged(photos=3, right=0.5, before=WORTH, after=WORTH)
RESULT = Calibrated(
    category="laptop",
    parts=Found(calibration=FOUND, refined=JUDGED, plain=JUDGED),
    joints=Found(calibration=OF_JOINTS, refined=JUDGED, plain=JUDGED),
)


def about(path):
    (meta,) = onnx.load(path).metadata_props
    return json.loads(meta.value)


def test_only_the_metadata_change(model_file, tmp_path):
    before = onnx.load(model_file)
    after = with_calibration(before, [RESULT])
    assert after.graph.SerializeToString() == before.graph.SerializeToString()
    (tmp_path / "calibrated.onnx").write_bytes(after.SerializeToString())
    old, new = about(model_file), about(tmp_path / "calibrated.onnx")
    drawer, laptop = new["categories"]
    assert "calibration" not in drawer
    assert Calibration.from_dict(laptop.pop("calibration")) == FOUND
    assert Calibration.from_dict(laptop.pop("joint_calibration")) == OF_JOINTS
    assert new == old
    again = with_calibration(after, [])
    assert again.metadata_props == before.metadata_props


def test_a_run_has_no_calibration_and_a_model_file_written_anew_keeps_its(model_file, tmp_path):
    assert all("calibration" not in c for c in about(model_file)["categories"])
    assert all(c.calibration is None for c in load(model_file).model.categories)
    old, new = tmp_path / "old.onnx", tmp_path / "new.onnx"
    old.write_bytes(with_calibration(onnx.load(model_file), [RESULT]).SerializeToString())
    export(old, new)
    for path in (old, new):
        drawer, laptop = load(path).model.categories
        assert (drawer.calibration, laptop.calibration) == (None, FOUND)
        assert (drawer.joint_calibration, laptop.joint_calibration) == (None, OF_JOINTS)


def test_from_photos_to_a_model_that_says_probabilities(model_file, datasets, tmp_path, capsys):
    out, again = tmp_path / "calibrated.onnx", tmp_path / "again.onnx"
    data = ["--data", datasets["laptop"]]
    assert r2art("calibrate", model_file, *data, "--out", out, "--json") == 0
    printed = capsys.readouterr()
    told = json.loads(printed.out)
    assert "no data of drawer" in printed.err
    assert list(told) == ["laptop"]
    known = Model(out)
    drawer, laptop = known.categories
    assert drawer.calibration is None
    kinds = (laptop.calibration, laptop.joint_calibration)
    for found, kind in zip(kinds, ("parts", "joints"), strict=True):
        assert found == Calibration.from_dict(told["laptop"][kind]["calibration"])

    source = open_testsets(datasets["laptop"])[0].source
    raw, calibrated = Predictor(known, calibrated=False), Predictor(known)
    for index in range(3):
        sample = source[index]
        asked = (sample.image, sample.camera, "laptop", sample.box.tolist())
        for refine in (6, 0):
            said = calibrated.predict(*asked, refine=refine)
            before = raw.predict(*asked, refine=refine)
            assert load(model_file).predict(*asked, refine=refine).to_dict() == before.to_dict()
            fit = said.refinement

            def probability(found, confidence, fit=fit):
                weights, residual = (found.refined, fit.residual) if fit else (found.plain, None)
                return weights.probability(confidence, residual)

            for part, untouched in zip(said.parts, before.parts, strict=True):
                assert part.confidence == probability(laptop.calibration, untouched.confidence)
                np.testing.assert_array_equal(part.cam_T_part, untouched.cam_T_part)
            lid = before.parts[1].confidence
            assert said.joints[0].confidence == probability(laptop.joint_calibration, lid)
            assert before.joints[0].confidence is None

    judged = told["laptop"]["parts"]["plain"]
    assert judged["photos"] == len(source)
    assert judged["after"]["error"] < judged["before"]["error"]
    assert r2art("calibrate", out, *data, "--out", again) == 0
    assert again.read_bytes() == out.read_bytes()
    printed = capsys.readouterr().out.splitlines()
    rows = [line.split() for line in printed if "laptop" in line and "parts" in line]
    errors = [f"{judged[when]['error']:.3f}" for when in ("before", "after")]
    assert rows[-1][5:8] == [errors[0], "→", errors[1]]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([], "no data given"),
        (["--data", "laptop", "--out", "none/out.onnx"], "there is no folder none"),
        (["--data", "laptop", "model", "none.onnx"], "no model at none.onnx"),
    ],
)
def test_what_cannot_be_meant_is_said_before_the_work(
    model_file, datasets, tmp_path, monkeypatch, capsys, given, message
):
    monkeypatch.chdir(tmp_path)
    given = [datasets.get(word, word) for word in given]
    model = model_file if "model" not in given else given.pop()
    given = [word for word in given if word != "model"]
    out = [] if "--out" in given else ["--out", "out.onnx"]
    assert r2art("calibrate", model, *given, *out) != 0
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out.onnx").exists()


def test_photos_of_training_are_warned_of(model_file, datasets, tmp_path, monkeypatch, capsys):
    manifest = datasets["drawer"] / "manifest.json"
    before = manifest.read_text()
    manifest.write_text(json.dumps({**json.loads(before), "split": "train"}))
    monkeypatch.chdir(tmp_path)
    try:
        assert r2art("calibrate", model_file, "--data", datasets["drawer"], "--out", "o.onnx") == 0
    finally:
        manifest.write_text(before)
    assert "is of the train split; calibrate on val" in capsys.readouterr().err


def test_features_are_finite_for_any_confidence_and_residual():
    assert np.all(np.isfinite(log_odds([0, 1e-30, 0.5, 1])))
    assert np.all(np.isfinite(log_misfit([0, 1e-30, 1, 1e30])))
    assert log_odds(0.5) == log_misfit(0.03) == 0
