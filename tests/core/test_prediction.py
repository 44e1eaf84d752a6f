"""A prediction is exactly its JSON, and its JSON is exactly what the schema says."""

import copy
import json
from dataclasses import replace

import jsonschema
import numpy as np
import pytest

from r2art.core.errors import InputError, UsageError
from r2art.core.prediction import SCHEMA_FILE, Prediction, Scale


@pytest.fixture(scope="module")
def schema():
    schema = json.loads(SCHEMA_FILE.read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


@pytest.mark.parametrize("indent", [None, 2])
def test_json_there_and_back_is_the_same_prediction(laptop, indent):
    again = Prediction.from_json(laptop.to_json(indent=indent))
    assert again.to_dict() == laptop.to_dict()
    np.testing.assert_array_equal(again.part("lid").cam_T_part, laptop.part("lid").cam_T_part)


def test_indented_json_keeps_vectors_on_one_line(laptop):
    lines = laptop.to_json(indent=2).splitlines()
    assert '  "box": [101.5, 40.0, 520.0, 460.25],' in lines
    assert max(map(len, lines)) < 120
    assert len(lines) < 100


def test_the_schema_accepts_a_prediction(laptop, schema):
    schema.validate(laptop.to_dict())
    unscored = replace(laptop, category_score=None, image_path=None)
    schema.validate(unscored.to_dict())


def leaves(value, path=()):
    """The path of every field of a JSON value."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield (*path, key)
            yield from leaves(inner, (*path, key))
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from leaves(inner, (*path, i))


def test_the_schema_wants_every_field_and_no_other(laptop, schema):
    complete = laptop.to_dict()
    paths = list(leaves(complete))
    assert len(paths) > 30
    for *parents, key in paths:
        broken = copy.deepcopy(complete)
        home = broken
        for parent in parents:
            home = home[parent]
        value = home.pop(key)
        assert not schema.is_valid(broken), f"{parents} without {key}"
        home.update({key: value, "surplus": 1})
        assert not schema.is_valid(broken), f"{parents} with a surplus field"


def test_what_was_written_before_scales_were_told_is_still_read(laptop):
    old = laptop.to_dict()
    del old["scale"]
    assert Prediction.from_json(json.dumps(old)).scale == Scale(source="prior", spread=None)


def test_a_larger_object_farther_away_looks_the_same(laptop):
    sliding = replace(laptop.joints[0], kind="prismatic", state=0.2, limits=(0.0, 0.4))
    twice = replace(laptop, joints=(sliding,)).scaled(2.0, "depth")
    for before, after in zip(laptop.parts, twice.parts, strict=True):
        np.testing.assert_allclose(after.corners(), 2 * before.corners(), atol=1e-12)
        seen = laptop.camera.project(after.corners())
        np.testing.assert_allclose(seen, laptop.camera.project(before.corners()), atol=1e-9)
        np.testing.assert_array_equal(after.cam_T_part[:3, :3], before.cam_T_part[:3, :3])
    (joint,) = twice.joints
    assert (joint.state, joint.limits) == (0.4, (0.0, 0.8))
    np.testing.assert_allclose(joint.pivot, 2 * sliding.pivot)
    np.testing.assert_array_equal(joint.axis, sliding.axis)
    assert laptop.scaled(2.0, "size").joints[0].state == laptop.joints[0].state  # an angle
    assert twice.scale == Scale(source="depth")
    for factor in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(UsageError, match="positive"):
            laptop.scaled(factor, "size")


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_no_number_but_a_finite_one_enters(laptop, bad):
    pose = laptop.parts[0].cam_T_part.copy()
    pose[1, 2] = bad
    for change in (
        {"category_score": bad},
        {"box": (0.0, bad, 1.0, 1.0)},
        {"parts": (replace(laptop.parts[0], cam_T_part=pose), laptop.parts[1])},
        {"joints": (replace(laptop.joints[0], state=bad),)},
    ):
        with pytest.raises(InputError):
            replace(laptop, **change)


@pytest.mark.parametrize(
    "text",
    ["", "no json", "[]", "3", "null", "{}", '{"schema": "r2art/prediction/2"}', "NaN"],
)
def test_what_is_no_prediction_is_refused(text):
    with pytest.raises(InputError, match="prediction"):
        Prediction.from_json(text)


def test_a_prediction_with_a_field_missing_is_refused(laptop):
    for key in ("parts", "camera", "box", "category"):
        data = laptop.to_dict()
        del data[key]
        with pytest.raises(InputError, match=key):
            Prediction.from_json(json.dumps(data))


def test_corners_are_named_by_right_up_and_front(laptop):
    """The base's front left corner on top is (0, 1, 1), as docs/prediction.md says."""
    base = laptop.part("base")
    right, up, front = base.cam_T_part[:3, :3].T
    corners = base.corners()
    np.testing.assert_allclose(corners[1, 1, 1] - corners[0, 1, 1], 0.34 * right)
    np.testing.assert_allclose(corners[0, 1, 1] - corners[0, 0, 1], 0.02 * up)
    np.testing.assert_allclose(corners[0, 1, 1] - corners[0, 1, 0], 0.22 * front)
    middle = corners.mean(axis=(0, 1, 2))
    np.testing.assert_allclose(middle, base.cam_T_part[:3, 3], atol=1e-12)


def test_the_lids_far_edge_is_the_one_away_from_the_hinge(laptop):
    corners = laptop.part("lid").corners()
    hinge = laptop.joint("hinge")
    distance = np.linalg.norm(np.cross(corners - hinge.pivot, hinge.axis), axis=-1)
    assert distance[:, :, 1].min() > 0.2 > 0.05 > distance[:, :, 0].max()
