import numpy as np
import pytest

from r2art.core.category import Category, Joint
from r2art.core.prior_text import from_text, to_text


@pytest.fixture
def category() -> Category:
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(2, 1000, 3))
    hinge = Joint(
        name="hinge",
        kind="revolute",
        parent=0,
        axis=(1.0, 0, 0),
        pivot=(0.1, 0.2, 0.3),
        limits=(0, 2.5),
    )
    return Category(
        name="thing",
        part_names=("base", "lid"),
        joints=(hinge,),
        box_center=rng.normal(size=(2, 3)),
        box_size=rng.uniform(0.1, 0.4, (2, 3)),
        points=rng.uniform(-0.3, 0.3, (2, 1000, 3)),
        normals=normals / np.linalg.norm(normals, axis=-1, keepdims=True),
        areas=np.array([0.3, 0.2]),
        frontal_area=0.05,
    )


def test_a_prior_comes_back_thinner_and_within_a_millimetre(category):
    back = from_text(to_text(category))
    assert back.points.shape == (2, 500, 3)
    np.testing.assert_allclose(back.points, category.points[:, ::2], atol=2e-4)
    np.testing.assert_allclose(back.normals, category.normals[:, ::2], atol=1e-3)
    np.testing.assert_allclose(back.box_size, category.box_size)
    np.testing.assert_allclose(back.areas, category.areas)
    assert back.joints == category.joints
    assert (back.name, back.part_names) == (category.name, category.part_names)


def test_the_text_is_small_and_plain(category):
    text = to_text(category, points=256)
    assert len(text) < 20_000
    assert text.isascii()


def test_few_points_are_all_kept(category):
    assert from_text(to_text(category, points=5000)).points.shape == category.points.shape
