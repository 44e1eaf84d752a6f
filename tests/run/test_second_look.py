"""A look in the mirror sees the same object: an estimator that is right is right there, too."""

import numpy as np
import pytest

from r2art.core.camera import Camera
from r2art.core.category import Category, Mirror
from r2art.core.image import crop_square
from r2art.data.categories import make_instance, staging
from r2art.data.prior import category_prior
from r2art.run.mirror import FLIPPED, between, in_mirror, out_of_mirror
from r2art.run.model import MASK
from r2art.run.refinement.body import Body, body_of
from r2art.run.refinement.pose import pose_of, posed, rotation_of


@pytest.fixture(scope="module")
def glasses() -> Category:
    objects = [make_instance("eyeglasses", s) for s in range(4)]
    return category_prior(objects, staging("eyeglasses"))


def outputs_of(body: Body, turn, place, state, *, confidence=0.5, scale=1.0):
    """What a model says of the body that stands there."""
    own = body.stretched(scale * body.center, scale * body.size)
    root = np.eye(4)
    root[:3, :3], root[:3, 3] = rotation_of(np.asarray(turn, float)), place
    at = posed(own, pose_of(own, root, np.asarray(state, float)))
    poses = np.tile(np.eye(4), (len(own.center), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = at.rotation[0], at.translation[0]
    return {
        "cam_T_part": poses,
        "box_center": own.center,
        "box_size": own.size,
        "confidence": np.full(len(own.center), confidence),
        "joint_state": np.asarray(state, float),
        "axis": at.axis[0],
        "pivot": at.pivot[0],
        MASK: np.zeros((4, 4)),
    }


def test_the_crop_is_seen_as_through_a_mirrored_camera(pixels):
    camera = Camera(300, 310, 150, 130, 320, 240)
    view = crop_square(pixels, camera, (40, 60, 200, 180), 160, 1.25)
    box = (20.0, 30.0, 120.0, 140.0)
    other, other_box = in_mirror(view, box)
    np.testing.assert_array_equal(other.pixels, view.pixels[:, ::-1])
    assert other_box == (40, 30, 140, 140)
    point = np.array([[0.1, -0.2, 1.5]])
    (u, v), (mirrored_u, mirrored_v) = (
        c.project(p)[0] for c, p in ((view.camera, point), (other.camera, point * [-1, 1, 1]))
    )
    assert (160 - u, v) == pytest.approx((mirrored_u, mirrored_v))
    again, again_box = in_mirror(other, other_box)
    np.testing.assert_array_equal(again.pixels, view.pixels)
    assert (again.camera, again_box) == (view.camera, box)


def test_what_is_seen_in_it_is_brought_back(glasses):
    body = body_of(glasses)
    parents = tuple(j.parent for j in glasses.joints)
    seen = outputs_of(body, (2.5, 0.3, -0.4), (0.1, -0.05, 0.8), (0.4, 1.2))
    seen[MASK] = np.arange(16.0).reshape(4, 4)
    back = out_of_mirror(seen, glasses.mirror, parents)
    assert back["joint_state"].tolist() == [1.2, 0.4]
    np.testing.assert_array_equal(back[MASK], seen[MASK][:, ::-1])
    assert np.linalg.det(back["cam_T_part"][:, :3, :3]) == pytest.approx(1)
    np.testing.assert_allclose(back["cam_T_part"][0, :3, 3], [-0.1, -0.05, 0.8])
    twice = out_of_mirror(back, glasses.mirror, parents)
    for name, value in twice.items():
        np.testing.assert_allclose(value, seen[name], err_msg=name)


def test_the_middle_of_two_looks_is_half_way(glasses):
    body = body_of(glasses)
    one = outputs_of(body, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.4, 1.0), confidence=0.8)
    other = outputs_of(
        body, (0.0, 0.2, 0.0), (0.0, 0.0, 1.0), (0.6, 1.2), confidence=0.2, scale=1.1
    )
    one[MASK], other[MASK] = np.full((4, 4), 0.2), np.full((4, 4), 0.6)
    found = between(body, one, other)
    R = rotation_of(np.array([0.0, 0.1, 0.0]))
    np.testing.assert_allclose(found["cam_T_part"][0, :3, :3], R, atol=1e-9)
    np.testing.assert_allclose(found["joint_state"], [0.5, 1.1])
    np.testing.assert_allclose(found["box_size"], np.sqrt(1.1) * body.size)
    np.testing.assert_allclose(found["confidence"], 0.5)
    np.testing.assert_allclose(found[MASK], 0.4)
    expected = outputs_of(body, (0.0, 0.1, 0.0), (0.0, 0.0, 1.0), (0.5, 1.1), scale=np.sqrt(1.1))
    np.testing.assert_allclose(found["axis"], expected["axis"], atol=1e-9)
    np.testing.assert_allclose(found["cam_T_part"], expected["cam_T_part"], atol=0.004)


def test_a_look_and_itself_are_that_look(glasses):
    body = body_of(glasses)
    one = outputs_of(body, (2.0, 0.5, 0.1), (0.2, 0.1, 0.9), (0.3, 0.8), confidence=0.7)
    for name, value in between(body, one, one).items():
        np.testing.assert_allclose(value, one[name], atol=1e-9, err_msg=name)


@pytest.mark.parametrize("surer", [0, 1])
def test_of_looks_that_contradict_each_other_the_surer_one_counts(glasses, surer):
    body = body_of(glasses)
    turns = (0.0, 0.0, 0.0), (0.0, FLIPPED + 1.0, 0.0)
    looks = [
        outputs_of(body, turn, (0, 0, 1), (0.4, 1.0), confidence=0.9 if k == surer else 0.6)
        for k, turn in enumerate(turns)
    ]
    found = between(body, *looks)
    for name in ("cam_T_part", "confidence", "joint_state"):
        np.testing.assert_allclose(found[name], looks[surer][name], atol=1e-9, err_msg=name)


def test_the_mirror_of_a_laptop_keeps_its_parts():
    assert Mirror(swap=(0, 1)).joint_swap((0,)) == (0,)
