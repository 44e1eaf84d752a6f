"""Calibrated confidences, in a prediction and from a model file."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from r2art.core.camera import Camera
from r2art.core.confidence import Calibration, Weights
from r2art.core.errors import ModelError
from r2art.core.prediction import Refinement
from r2art.run import model as model_module
from r2art.run import predictor as predictor_module
from r2art.run.confidence import calibrated
from r2art.run.model import Model
from r2art.run.predictor import SHIPPED_MODEL, Predictor

FOUND = Calibration(
    refined=Weights(bias=-1.5, slope=0.25, misfit=-0.75), plain=Weights(bias=0.5, slope=0.5)
)
OF_JOINTS = Calibration(refined=Weights(bias=0.5, misfit=-0.25), plain=Weights(slope=0.75))
BOX = (60, 40, 240, 210)
CAMERA = Camera(300, 300, 160, 120, 320, 240)


@pytest.fixture(scope="module")
def raw():
    return Predictor(Model(SHIPPED_MODEL), calibrated=False)


def with_category(monkeypatch, **changes):
    """A predictor of the shipped model, whose metadata say something else of laptops."""
    read = json.loads

    def changed(text):
        about = read(text)
        for described in about["categories"]:
            described.pop("calibration", None)
            described.pop("joint_calibration", None)
            if described["name"] == "laptop":
                described.update(changes)
        return about

    monkeypatch.setattr(model_module, "json", SimpleNamespace(loads=changed))
    return Predictor(Model(SHIPPED_MODEL))


def confidences(prediction):
    return [part.confidence for part in prediction.parts]


@pytest.mark.parametrize("refined", [True, False])
@pytest.mark.parametrize("own_mask", [True, False])
def test_each_kind_of_estimate_has_its_weights(raw, pixels, refined, own_mask):
    said = raw.predict(pixels, CAMERA, "laptop", BOX, refine=0)
    fit = Refinement(steps=3, start_residual=0.2, residual=0.07, converged=True)
    said = replace(said, refinement=fit if refined else None)
    known = replace(raw.category("laptop"), calibration=FOUND, joint_calibration=OF_JOINTS)
    found = calibrated(said, known, own_mask=own_mask)

    def probability(weighed, confidence):
        if refined and own_mask:
            return weighed.refined.probability(confidence, 0.07)
        return weighed.plain.probability(confidence)

    for part, before in zip(found.parts, said.parts, strict=True):
        assert part.confidence == probability(FOUND, before.confidence)
        np.testing.assert_array_equal(part.cam_T_part, before.cam_T_part)
    assert found.joints[0].confidence == probability(OF_JOINTS, said.parts[1].confidence)
    without = replace(known, calibration=None, joint_calibration=None)
    assert calibrated(said, without, own_mask=own_mask).to_dict() == said.to_dict()
    assert said.joints[0].confidence is None


def test_the_predictor_uses_what_the_file_holds(raw, pixels, monkeypatch):
    predictor = with_category(
        monkeypatch, calibration=FOUND.to_dict(), joint_calibration=OF_JOINTS.to_dict()
    )
    asked = (pixels, CAMERA, "laptop", BOX)
    white = np.zeros(pixels.shape[:2], np.uint8)
    white[60:200, 70:220] = 255
    for options in ({}, {"refine": 0}, {"mask": white}):
        before = raw.predict(*asked, **options)
        said = predictor.predict(*asked, **options)
        known = predictor.category("laptop")
        own = calibrated(before, known, own_mask="mask" not in options)
        assert confidences(said) == confidences(own)
        assert said.joints[0].confidence == own.joints[0].confidence
        assert confidences(said) != confidences(before)
        assert all(0 <= c <= 1 for c in confidences(said))
    unknown = predictor.predict(pixels, CAMERA, "drawer", BOX)
    assert confidences(unknown) == confidences(raw.predict(pixels, CAMERA, "drawer", BOX))


def test_warnings_are_about_the_calibrated_confidence(pixels, monkeypatch):
    """A network that is sure of all, and a calibration that knows better; and the reverse."""
    for bias, warned in ((-20.0, True), (20.0, False)):
        weights = {"bias": bias, "slope": 0.0, "misfit": 0.0}
        found = {"refined": weights, "plain": weights}
        predictor = with_category(monkeypatch, calibration=found)
        said = predictor.predict(pixels, CAMERA, "laptop", BOX)
        assert any("low confidence" in w for w in said.warnings) == warned
        assert (min(confidences(said)) < predictor_module.UNSURE_PART) == warned


def test_an_older_file_says_what_the_network_says(raw, pixels, monkeypatch):
    predictor = with_category(monkeypatch)
    assert all(c.calibration is None for c in predictor.model.categories)
    asked = (pixels, CAMERA, "laptop", BOX)
    assert predictor.predict(*asked).to_dict() == raw.predict(*asked).to_dict()


@pytest.mark.parametrize(
    "damage",
    [
        {},
        {"refined": {"bias": 0.0, "slope": 1.0}, "plain": {"bias": 0.0, "slope": 1.0}},
        {**FOUND.to_dict(), "plain": {"bias": float("nan"), "slope": 1.0}},
        {**FOUND.to_dict(), "plain": {"bias": "much", "slope": 1.0}},
        {**FOUND.to_dict(), "plain": None},
    ],
)
def test_a_damaged_calibration_is_told(monkeypatch, damage):
    for what in ("calibration", "joint_calibration"):
        with pytest.raises(ModelError, match=r"metadata of .* is damaged"):
            with_category(monkeypatch, **{what: damage})
