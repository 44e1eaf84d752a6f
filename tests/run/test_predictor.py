"""The shipped model keeps its promises for any photo, camera and box."""

import json
import math
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

import r2art
from r2art.core.camera import Camera
from r2art.core.errors import InputError, ModelError, UsageError
from r2art.core.image import Photo, read_image
from r2art.core.prediction import SCHEMA_FILE, Prediction
from r2art.run import predictor as predictor_module
from r2art.run.predictor import choose_camera

BOX = (60, 40, 240, 210)
CAMERA = Camera(300, 300, 160, 120, 320, 240)


def moved(joint, points):
    """Points (N, 3) of the camera frame, moved by a joint away from rest."""
    if joint.kind == "prismatic":
        return points + joint.state * joint.axis
    arm = points - joint.pivot
    along = (arm @ joint.axis)[:, None] * joint.axis
    across = np.cross(joint.axis, arm)
    cos, sin = math.cos(joint.state), math.sin(joint.state)
    return joint.pivot + along + cos * (arm - along) + sin * across


@pytest.fixture
def predictions(predictor, pixels):
    """The photo taken for each category the model knows."""
    return [predictor.predict(pixels, CAMERA, name, BOX) for name in predictor.categories]


def test_poses_are_rigid(predictions):
    for part in (part for p in predictions for part in p.parts):
        R = part.cam_T_part[:3, :3]
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-5)
        assert np.linalg.det(R) > 0
        np.testing.assert_array_equal(part.cam_T_part[3], [0, 0, 0, 1])
        assert (part.box_size > 0).all()
        assert 0 <= part.confidence <= 1


def test_a_joint_state_moves_the_child_from_its_parents_pose(predictions):
    """At rest all part frames are one, so the child is the parent moved by the joint alone."""
    corners = np.concatenate([np.eye(3), -np.eye(3), np.zeros((1, 3))])
    for prediction in predictions:
        for joint in prediction.joints:
            parent, child = (
                corners @ part.cam_T_part[:3, :3].T + part.cam_T_part[:3, 3]
                for part in (prediction.part(joint.parent), prediction.part(joint.child))
            )
            np.testing.assert_allclose(child, moved(joint, parent), atol=1e-4)
            assert np.linalg.norm(joint.axis) == pytest.approx(1, abs=1e-5)


def test_the_root_lies_in_front_of_the_camera_at_its_boxs_centre_at_rest(predictions):
    for prediction in predictions:
        root = prediction.parts[0]
        assert root.cam_T_part[2, 3] > 0
        np.testing.assert_allclose(root.box_center, 0, atol=1e-6)


def test_every_joint_knows_its_parts_and_limits(predictions):
    for prediction in predictions:
        names = [part.name for part in prediction.parts]
        assert [joint.child for joint in prediction.joints] == names[1:]
        for joint in prediction.joints:
            assert names.index(joint.parent) < names.index(joint.child)
            assert joint.limits[0] < joint.limits[1]


def test_predictions_obey_the_schema(predictor, pixels, predictions):
    schema = json.loads(SCHEMA_FILE.read_text(encoding="utf-8"))
    for prediction in (*predictions, predictor.predict(pixels)):
        text = prediction.to_json()
        jsonschema.validate(json.loads(text), schema)
        assert Prediction.from_json(text).to_dict() == prediction.to_dict()


def test_file_image_and_array_of_one_photo_agree(predictor, pixels, tmp_path):
    path = tmp_path / "photo.png"
    Image.fromarray(pixels).save(path)
    forms = (path, str(path), Image.fromarray(pixels), pixels, read_image(path))
    results = [predictor.predict(form).to_dict() for form in forms]
    assert results[0]["image"]["path"] == str(path)
    for result in results:
        del result["image"]
    assert all(result == results[0] for result in results)


def test_a_photo_stored_sideways_gives_what_the_upright_one_gives(predictor, pixels, tmp_path):
    sideways = Image.fromarray(np.ascontiguousarray(np.rot90(pixels)))
    exif = sideways.getexif()
    exif[0x0112] = 6
    sideways.save(tmp_path / "sideways.png", exif=exif)
    result = predictor.predict(tmp_path / "sideways.png", CAMERA, box=BOX)
    upright = predictor.predict(pixels, CAMERA, box=BOX)
    assert result.to_dict()["parts"] == upright.to_dict()["parts"]


@settings(deadline=None, max_examples=20, suppress_health_check=list(HealthCheck))
@given(
    center=st.tuples(st.floats(0, 320), st.floats(0, 240)),
    size=st.tuples(st.floats(2, 400), st.floats(2, 400)),
    focal=st.floats(30, 30_000),
)
def test_any_box_and_focal_length_give_finite_poses(predictor, pixels, center, size, focal):
    low, high = np.subtract(center, np.divide(size, 2)), np.add(center, np.divide(size, 2))
    box = (*low, *high)
    camera = Camera(focal, focal, 160, 120, 320, 240)
    try:
        result = predictor.predict(pixels, camera, "laptop", box)
    except UsageError:  # too little of it lies in the photo
        inside = np.minimum(high, (320, 240)) - np.maximum(low, 0)
        assert np.prod(inside) < 0.1 * np.prod(size) * 1.0001
    else:
        assert result.box == pytest.approx(box)
        assert result.parts[0].cam_T_part[2, 3] > 0


@pytest.mark.parametrize(("width", "height"), [(1, 1), (3, 700), (700, 3)])
def test_photos_of_odd_sizes_give_an_answer(predictor, width, height):
    result = predictor.predict(np.full((height, width, 3), 90, np.uint8))
    assert result.camera.width == width


def test_the_model_finds_box_and_category_by_itself(predictor, pixels):
    result = predictor.predict(pixels, CAMERA)
    x1, y1, x2, y2 = result.box
    assert x1 < x2
    assert y1 < y2
    assert result.category in predictor.categories
    assert 0 <= result.category_score <= 1


@pytest.mark.parametrize("grey", [0, 90, 255])
def test_a_blank_photo_is_rejected(predictor, pixels, grey):
    blank = np.full_like(pixels, grey)
    blank[1::2] = max(0, grey - 3)  # the noise of a sensor
    for known in ({}, {"category": "laptop", "box": BOX}):
        result = predictor.predict(blank, **known)
        assert result.rejected == "the photo is blank"
        assert json.loads(result.to_json())["rejected"] == result.rejected
    assert predictor.predict(Path(__file__).parents[2] / "examples" / "laptop.png").rejected is None


def test_a_model_may_say_that_it_knows_nothing_like_it():
    known = ("laptop", "drawer")
    nothing = predictor_module._nothing_known
    assert nothing(np.array([0.6, 0.4]), known) is None  # of before models could
    assert nothing(np.array([0.6, 0.35, 0.05]), known) is None
    reason = nothing(np.array([0.1, 0.2, 0.7]), known)
    assert reason is not None
    assert "70%" in reason
    assert "laptop, drawer" in reason


def test_what_is_given_is_kept(predictor, pixels):
    result = predictor.predict(pixels, CAMERA, "drawer", BOX)
    assert (result.camera, result.camera_source) == (CAMERA, "given")
    assert (result.category, result.category_score, result.box) == ("drawer", None, BOX)
    assert predictor.predict(pixels, CAMERA, "drawer").category == "drawer"
    assert predictor.predict(pixels, CAMERA, box=BOX).box == BOX


@pytest.mark.parametrize(
    ("focal", "source"), [(None, "guessed"), (400.0, "exif"), (0.5, "guessed"), (1e9, "guessed")]
)
def test_the_camera_is_read_or_guessed(pixels, focal, source):
    camera, found = choose_camera(Photo(pixels, focal), None)
    assert found == source
    expected = focal if source == "exif" else 160 / math.tan(math.radians(30))
    assert (camera.fx, camera.fy) == pytest.approx((expected, expected))
    assert (camera.cx, camera.cy, camera.width, camera.height) == (160, 120, 320, 240)


@pytest.mark.parametrize(
    ("box", "says"),
    [
        ((400, 10, 500, 60), "outside"),
        ((-90, -90, 10, 10), "outside"),
        ((100, 50, 90, 60), "empty"),
        ((10, 10, 10, 60), "empty"),
        ((0, 0, math.nan, 9), "finite"),
        ((0, 0, math.inf, 9), "finite"),
        ((0, 0, 9), "four"),
        ("abcd", "four"),
        (7, "four"),
    ],
)
def test_a_box_that_cannot_be_meant_is_refused(predictor, pixels, box, says):
    with pytest.raises(UsageError, match=says):
        predictor.predict(pixels, box=box)


def test_a_camera_of_another_image_is_refused(predictor, pixels):
    with pytest.raises(UsageError, match="640×480"):
        predictor.predict(pixels, Camera(600, 600, 320, 240, 640, 480))


def test_an_unknown_category_is_answered_with_the_known_ones(predictor, pixels):
    with pytest.raises(UsageError, match="drawer, eyeglasses, laptop"):
        predictor.predict(pixels, category="giraffe")


def test_no_infinite_answer_leaves(predictor, pixels):
    with pytest.raises(InputError, match="finite"):
        predictor.predict(pixels, Camera(1e30, 1e30, 160, 120, 320, 240), "laptop", BOX)


@pytest.fixture(scope="module")
def shipped():
    return predictor_module.SHIPPED_MODEL.read_bytes()


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (b"r2art/model/1", b"r2art/model/9", "r2art/model/9"),
        (b"\x0a\x05r2art", b"\x0a\x05other", "no r2art metadata"),
        (b'"crop_margin"', b'"crap_margin"', "damaged"),
        (b'"laptop"', b'"lap-op"', "lacks the outputs lap-op"),
    ],
)
def test_a_model_that_is_not_ours_is_refused(shipped, tmp_path, old, new, says):
    assert old in shipped
    path = tmp_path / "model.onnx"
    path.write_bytes(shipped.replace(old, new))
    with pytest.raises(ModelError, match=says) as refused:
        r2art.load(path)
    assert refused.value.exit_code == 4


@pytest.mark.parametrize("content", [None, b"", b"not a model at all", b"truncated"])
def test_a_model_file_that_is_none_is_refused_in_one_line(shipped, tmp_path, content):
    path = tmp_path / "model.onnx"
    if content is not None:
        path.write_bytes(shipped[:5000] if content == b"truncated" else content)
    with pytest.raises(ModelError, match="model") as refused:
        r2art.load(path)
    assert "\n" not in str(refused.value)


def test_a_known_length_fixes_all_others(predictor, pixels):
    free = predictor.predict(pixels, CAMERA, "laptop", BOX)
    assert free.scale.source == "prior"
    longest = float(np.max(free.parts[0].box_size))
    sized = predictor.predict(pixels, CAMERA, "laptop", BOX, size=1.5 * longest)
    deep = predictor.predict(pixels, CAMERA, "laptop", BOX, depth=0.7)
    assert (sized.scale.source, deep.scale.source) == ("size", "depth")
    assert np.max(sized.parts[0].box_size) == pytest.approx(1.5 * longest)
    assert deep.parts[0].cam_T_part[2, 3] == pytest.approx(0.7)
    for known in (sized, deep):
        for part, before in zip(known.parts, free.parts, strict=True):
            uv, uv_before = CAMERA.project(part.corners()), CAMERA.project(before.corners())
            np.testing.assert_allclose(uv, uv_before, atol=1e-6)
        assert known.joints[0].state == free.joints[0].state
    assert not [w for w in sized.warnings if "times as large" in w]


def test_a_length_in_millimetres_is_doubted(predictor, pixels):
    odd = predictor.predict(pixels, CAMERA, "laptop", BOX, size=340)
    assert [w for w in odd.warnings if "times as large" in w]


@pytest.mark.parametrize(
    ("lengths", "message"),
    [
        ({"size": 0.3, "depth": 1.0}, "one of them"),
        ({"size": 0.0}, "positive number of metres"),
        ({"depth": math.nan}, "positive number of metres"),
        ({"depth": -1.0}, "positive number of metres"),
    ],
)
def test_lengths_that_cannot_be_meant_are_refused(predictor, pixels, lengths, message):
    with pytest.raises(UsageError, match=message):
        predictor.predict(pixels, CAMERA, "laptop", BOX, **lengths)
