"""Every look names the category, and all of them together decide."""

from itertools import pairwise

import numpy as np
import pytest

import r2art
from r2art.core.camera import Camera
from r2art.core.image import read_image
from r2art.run.looks import all_scores, find, together
from r2art.run.model import SCORES, Model
from r2art.run.predictor import Predictor

CAMERA = Camera(300, 300, 160, 120, 320, 240)
BOX = (60, 40, 240, 210)


class Swayed(Model):
    """The shipped model, but each look names the category that is next in a list."""

    def __init__(self, model: Model, said: list[dict[str, float]]) -> None:
        self.__dict__ = dict(model.__dict__)
        self.runs = 0
        self._said = said

    def _run(self, view, box, cameras, names):
        found = super()._run(view, box, cameras, names)
        said = self._said[min(self.runs, len(self._said) - 1)]
        self.runs += 1
        if SCORES in found:
            scores = np.full(len(self.categories) + 1, 0.01)
            for k, category in enumerate(self.categories):
                scores[k] = said.get(category.name, 0.01)
            found[SCORES] = (scores / scores.sum())[None]
        return found


LAPTOP, DRAWER, STRONG = {"laptop": 0.6}, {"drawer": 0.6}, {"drawer": 0.95}


@pytest.fixture
def swayed(predictor):
    def make(*said: dict[str, float]) -> Predictor:
        return Predictor(Swayed(predictor.model, list(said)))

    return make


def test_together_is_the_geometric_mean():
    a, b = np.array([0.8, 0.1, 0.1]), np.array([0.2, 0.7, 0.1])
    expected = np.sqrt(a * b) / np.sqrt(a * b).sum()
    np.testing.assert_allclose(together(a, b), expected)
    np.testing.assert_allclose(together(a, a, a), a)
    assert together(np.array([1.0, 0]), np.array([0, 1.0])).tolist() == [0.5, 0.5]


def test_looks_at_the_pose_may_outvote_the_first(swayed, pixels):
    """Two faint ones for a laptop, two strong ones for a cabinet: it is posed as a cabinet."""
    predictor = swayed(LAPTOP, LAPTOP, STRONG)
    found = predictor.predict(pixels, CAMERA)
    assert found.category == "drawer"
    assert len(found.parts) == 4
    plain = r2art.load().predict(pixels, CAMERA, "drawer", found.box)
    for part, other in zip(found.parts, plain.parts, strict=True):
        np.testing.assert_allclose(part.cam_T_part, other.cam_T_part)


def test_who_agrees_pays_for_no_more_looks(swayed, pixels):
    predictor = swayed(LAPTOP)
    assert predictor.predict(pixels, CAMERA).category == "laptop"
    assert predictor.model.runs == 4  # photo, crop, pose, mirror
    assert swayed(LAPTOP).predict(pixels, CAMERA, "laptop", BOX).category == "laptop"
    counts = []
    for said, asked in (
        ((LAPTOP,), {"refine": 0}),  # no mirror
        ((LAPTOP,), {"box": BOX}),  # the crop is that of the pose
        ((LAPTOP,), {"box": BOX, "category": "laptop"}),
        ((LAPTOP, LAPTOP, STRONG), {}),  # pose and mirror again
    ):
        predictor = swayed(*said)
        predictor.predict(pixels, CAMERA, **asked)
        counts.append(predictor.model.runs)
    assert counts == [3, 3, 2, 6]


def test_a_given_category_stays_and_is_doubted(swayed, pixels):
    found = swayed(LAPTOP, LAPTOP, STRONG).predict(pixels, CAMERA, "laptop")
    assert found.category == "laptop"
    assert any("takes this for a drawer" in warning for warning in found.warnings)


def test_a_category_without_a_mirror_is_named_there_too(swayed, pixels):
    predictor = swayed({"scissors": 0.9})
    assert predictor.predict(pixels, CAMERA).category == "scissors"
    assert predictor.model.runs == 4


def test_the_score_is_that_of_all_looks(predictor, pixels):
    photo = read_image(pixels)
    scores = all_scores(predictor.model, photo, CAMERA)
    found = predictor.predict(pixels, CAMERA)
    best = predictor.categories.index(found.category)
    assert found.category_score == pytest.approx(scores[best], abs=1e-9)
    assert scores.sum() == pytest.approx(1)
    assert found.box == find(predictor.model, photo, CAMERA).box
    looked = [find(predictor.model, photo, CAMERA, box).box for box in (BOX, found.box)]
    assert all(a != b for a, b in pairwise(looked))
    assert looked[0] == BOX
