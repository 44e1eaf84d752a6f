"""Which categories have a second labelling, that it is stored, and that it must fit the joints."""

import json
from dataclasses import replace

import numpy as np
import pytest

from r2art.core.category import Category, Joint, Symmetry
from r2art.core.prior_text import from_text, to_text
from r2art.data import shards
from r2art.data.categories import CATEGORIES, make_instance, staging, symmetry, with_symmetries
from r2art.data.prior import category_prior

TURNED_OVER = Symmetry(swap=(1, 0), axis="z")


def hinge(parent: int = 0, axis: tuple[float, float, float] = (0.0, -1.0, 0.0), **more) -> Joint:
    known = {"name": "hinge", "kind": "revolute", "pivot": (0.0, 0.0, 0.0), "limits": (0.0, 1.0)}
    return Joint(parent=parent, axis=axis, **(known | more))


@pytest.fixture(scope="module")
def scissors() -> Category:
    return category_prior([make_instance("scissors", s) for s in range(4)], staging("scissors"))


def test_scissors_alone_have_a_second_labelling():
    assert {name: s for name in CATEGORIES if (s := symmetry(name))} == {"scissors": TURNED_OVER}


def test_the_prior_has_it_and_keeps_it(scissors, tmp_path):
    assert scissors.symmetry == TURNED_OVER
    scissors.save(tmp_path / shards.PRIOR)
    assert Category.load(tmp_path / shards.PRIOR).symmetry == TURNED_OVER
    assert from_text(to_text(scissors)).symmetry == TURNED_OVER


def test_priors_of_before_are_read_with_that_of_their_generator(scissors, tmp_path):
    scissors.save(tmp_path / "new.npz")
    with np.load(tmp_path / "new.npz") as file:
        arrays = dict(file)
    meta = json.loads(str(arrays.pop("meta")))
    del meta["symmetry"]
    np.savez(tmp_path / shards.PRIOR, meta=json.dumps(meta), **arrays)
    assert Category.load(tmp_path / shards.PRIOR).symmetry is None
    assert shards.read_prior(tmp_path).symmetry == TURNED_OVER


def test_none_is_given_to_other_objects(scissors):
    assert with_symmetries(replace(scissors, symmetry=None)).symmetry == TURNED_OVER
    slides = replace(scissors.joints[0], kind="prismatic", axis=(0.0, 0.0, 1.0))
    for other in (
        replace(scissors, symmetry=None, name="tongs"),
        replace(scissors, symmetry=None, joints=(slides,)),
    ):
        assert with_symmetries(other) is other


@pytest.mark.parametrize(
    ("swap", "axis", "joints", "fits"),
    [
        ((1, 0), "z", [hinge()], True),
        ((1, 0), "x", [hinge()], True),
        ((1, 0), "y", [hinge()], False),  # the halves would open the other way
        ((0, 1), "y", [hinge()], True),
        ((0, 1), "z", [hinge()], False),
        ((1, 0), "z", [hinge(axis=(-0.02, -0.9997, 0.01))], True),
        ((1, 0), "z", [hinge(axis=(0.0, -0.8, 0.6))], False),
        ((1, 0), "z", [hinge(kind="prismatic")], True),
        ((1, 0, 2), "z", [hinge()], False),
        ((1, 1), "z", [hinge()], False),
        ((1, 2, 0), "z", [hinge(), hinge()], False),
        ((0, 2, 1), "z", [hinge(), hinge(axis=(0.0, 1.0, 0.0))], True),
        ((0, 2, 1), "z", [hinge(), hinge()], False),
        ((0, 2, 1), "z", [hinge(), hinge(axis=(0.0, 1.0, 0.0), kind="prismatic")], False),
        ((0, 2, 1), "z", [hinge(), hinge(1, axis=(0.0, 1.0, 0.0))], False),
        ((2, 1, 0), "z", [hinge(), hinge(1)], True),
    ],
)
def test_it_must_turn_joints_into_joints(swap, axis, joints, fits):
    one = Symmetry(swap=swap, axis=axis)
    assert one.fits(joints) == fits
    parts = len(joints) + 1
    known = {name: np.ones((parts, 3)) for name in ("box_center", "box_size")}
    known |= {name: np.ones((parts, 4, 3)) for name in ("points", "normals")}

    def category() -> Category:
        return Category(
            name="thing",
            part_names=tuple(f"part_{p}" for p in range(parts)),
            joints=tuple(joints),
            areas=np.ones(parts),
            frontal_area=1.0,
            symmetry=one,
            **known,
        )

    if fits:
        assert category().symmetry == one
    else:
        with pytest.raises(ValueError, match="joints of thing"):
            category()
