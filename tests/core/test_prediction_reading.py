"""What breaks a rule of the prediction JSON is refused, by the name of its field."""

import copy
import json
import re
from dataclasses import replace

import jsonschema
import numpy as np
import pytest

from r2art.core.errors import InputError
from r2art.core.prediction import SCHEMA_FILE, Prediction, Refinement, Scale

NEWER = {("scale",), ("refinement",), ("rejected",)}
"""Fields that older files of the same version lack."""
JUNK = (None, True, -1, 1.5, 10**400, "", "word", [], [1, 2], [[]], {}, {"name": "x"})


@pytest.fixture
def complete(laptop):
    """The JSON of a prediction with every field there is."""
    refinement = Refinement(steps=3, start_residual=0.02, residual=0.01, converged=True)
    return replace(laptop, refinement=refinement, scale=Scale(spread=0.1)).to_dict()


@pytest.fixture(scope="module")
def schema():
    return jsonschema.Draft202012Validator(json.loads(SCHEMA_FILE.read_text(encoding="utf-8")))


def fields(value, path=()):
    """The path of everything within a JSON value."""
    inner = value.items() if isinstance(value, dict) else enumerate(value)
    for key, child in inner:
        yield (*path, key)
        if isinstance(child, dict | list):
            yield from fields(child, (*path, key))


def place(path):
    """A path as messages write it."""
    return "".join(f"[{k}]" if isinstance(k, int) else f".{k}" for k in path).lstrip(".")


def changed(data, path, value):
    """The data with another value at a path."""
    data = copy.deepcopy(data)
    home = data
    for key in path[:-1]:
        home = home[key]
    home[path[-1]] = value
    return data


def without(data, path):
    data = changed(data, path, None)
    home = data
    for key in path[:-1]:
        home = home[key]
    del home[path[-1]]
    return data


def test_every_number_comes_back_to_the_last_digit(complete):
    assert Prediction.from_json(json.dumps(complete)).to_dict() == complete
    assert Prediction.from_dict(complete).to_dict() == complete
    assert Prediction.from_json(json.dumps(complete).encode()).to_dict() == complete


def refusal(data):
    """What is said against it; None where nothing is, and no other error comes of it."""
    try:
        Prediction.from_dict(data)
    except InputError as error:
        return str(error)
    return None


def test_junk_in_any_field_is_refused_where_the_schema_refuses_it(complete, schema):
    """And the message names the field, or what holds it."""
    refused = 0
    for path in fields(complete):
        for junk in JUNK:
            broken = changed(complete, path, junk)
            if (message := refusal(broken)) is None:
                assert schema.is_valid(broken), (place(path), junk)
                continue
            refused += 1
            if path[-1] not in ("schema", "name"):  # joints speak of names, too
                named, here = re.findall(r"`([^`]+)`", message)[0], place(path)
                assert here.startswith(named) or named.startswith(here), (here, junk, message)
    assert refused > 500


def test_a_missing_field_is_named(complete):
    for path in fields(complete):
        if (
            isinstance(path[-1], str)
            and path not in NEWER
            and path[0::2] != ("joints", "confidence")
        ):
            with pytest.raises(InputError, match=re.escape(f"`{place(path)}` is missing")):
                Prediction.from_dict(without(complete, path))


@pytest.mark.parametrize(
    ("path", "value", "rule"),
    [
        (("parts", 1, "cam_T_part"), (2 * np.eye(4)).tolist(), "rotation"),
        (("parts", 1, "cam_T_part"), np.diag([1, 1, -1, 1]).tolist(), "rotation"),
        (("joints", 0, "axis"), [0, 0, 2], "length 1"),
        (("joints", 0, "limits"), [1, 0], "begin above"),
        (("joints", 0, "parent"), "lid", "one of base"),
        (("joints", 0, "child"), "base", "'lid'"),
        (("parts", 1, "name"), "base", "twice"),
        (("joints",), [], "one for each part"),
        (("camera", "fx"), 0, "positive"),
        (("camera", "fx"), float("nan"), "finite"),
        (("units", "length"), "mm", "one of m, got 'mm'"),
    ],
)
def test_what_cannot_be_an_object_is_refused(complete, path, value, rule):
    with pytest.raises(InputError, match=rule) as caught:
        Prediction.from_dict(changed(complete, path, value))
    assert f"`{place(path)}" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


def test_fields_of_the_future_are_passed_over(complete):
    for path in [(), ("camera",), ("parts", 0), ("joints", 0)]:
        later = changed(complete, (*path, "later"), [1, 2, 3])
        assert Prediction.from_dict(later).to_dict() == complete


@pytest.mark.parametrize("text", [b"\xff", "{", "[" * 100_000, '{"schema": NaN}'])
def test_what_is_no_json_is_no_crash(text):
    with pytest.raises(InputError, match="prediction"):
        Prediction.from_json(text)
