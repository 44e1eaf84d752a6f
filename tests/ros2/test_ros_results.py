"""What is published says what the prediction says, and survives the wire."""

import sys
from pathlib import Path

import numpy as np
import pytest
from r2art_ros import results
from r2art_ros.estimate import Estimator
from r2art_ros.settings import Settings
from ros_messages import camera_info, image

import r2art
from r2art.core.camera import Camera
from r2art.core.errors import InputError, UsageError
from r2art.core.image import read_image

ROOT = Path(__file__).resolve().parents[2]
K = np.array([[600.0, 0, 319.5], [0, 600.0, 239.5], [0, 0, 1]])


@pytest.fixture(scope="module")
def photo():
    return read_image(ROOT / "examples" / "laptop.png")


@pytest.fixture(scope="module")
def prediction(photo):
    width, height = photo.width, photo.height
    return r2art.load().predict(photo, Camera(600, 600, 320, 240, width, height), size=0.3)


@pytest.fixture(scope="module")
def messages(raw, header, photo):
    return (
        image(raw, header, photo.pixels, "rgb8"),
        camera_info(raw, header, K, photo.width, photo.height),
    )


def matrix(position, q):
    """A pose of ROS as a matrix: v' = v + 2 w (u × v) + 2 u × (u × v) for q = (u, w)."""
    u, w = np.array([q.x, q.y, q.z]), q.w
    assert np.isclose(u @ u + w * w, 1, atol=1e-12)
    pose = np.eye(4)
    for k, v in enumerate(np.eye(3)):
        pose[:3, k] = v + 2 * w * np.cross(u, v) + 2 * np.cross(u, np.cross(u, v))
    pose[:3, 3] = position.x, position.y, position.z
    return pose


def test_detections_hold_every_part_and_its_box(types, header, prediction):
    sent = types.there_and_back(results.detections(types, prediction, header, "left_"))
    assert sent.header == header
    assert len(sent.detections) == len(prediction.parts)
    for found, part in zip(sent.detections, prediction.parts, strict=True):
        assert found.header == header
        assert found.id == f"left_{prediction.category}/{part.name}"
        (result,) = found.results
        assert result.hypothesis.class_id == f"{prediction.category}/{part.name}"
        assert result.hypothesis.score == part.confidence
        pose = matrix(result.pose.pose.position, result.pose.pose.orientation)
        np.testing.assert_allclose(pose, part.cam_T_part, atol=1e-6)
        box = matrix(found.bbox.center.position, found.bbox.center.orientation)
        size = np.array([found.bbox.size.x, found.bbox.size.y, found.bbox.size.z])
        signs = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1], indexing="ij"), axis=-1)
        corners = (signs * size / 2) @ box[:3, :3].T + box[:3, 3]
        np.testing.assert_allclose(corners, part.corners(), atol=1e-6)


def test_frames_place_every_part_below_the_camera(types, header, prediction):
    sent = types.there_and_back(results.frames(types, prediction, header))
    names = [t.child_frame_id for t in sent.transforms]
    assert names == [f"{prediction.category}/{p.name}" for p in prediction.parts]
    for frame, part in zip(sent.transforms, prediction.parts, strict=True):
        assert frame.header == header
        pose = matrix(frame.transform.translation, frame.transform.rotation)
        np.testing.assert_allclose(pose, part.cam_T_part, atol=1e-6)


def test_joint_states_name_every_joint(types, header, prediction):
    sent = types.there_and_back(results.joint_states(types, prediction, header, "left_"))
    assert sent.header == header
    assert sent.name == [f"left_{j.name}" for j in prediction.joints]
    np.testing.assert_array_equal(sent.position, [j.state for j in prediction.joints])
    assert len(sent.velocity) == len(sent.effort) == 0


def test_the_node_says_what_the_predictor_says(types, header, messages, prediction):
    seen = Estimator(Settings(size=0.3), types).estimate(*messages)
    assert seen.warnings == prediction.warnings
    for told, expected in (
        (seen.detections, results.detections(types, prediction, header)),
        (seen.joint_states, results.joint_states(types, prediction, header)),
        (seen.frames, results.frames(types, prediction, header)),
    ):
        assert types.store.serialize_cdr(told, told.__msgtype__) == types.store.serialize_cdr(
            expected, expected.__msgtype__
        )


def test_below_the_least_score_nothing_is_seen(types, header, messages):
    seen = Estimator(Settings(min_score=1.1, refine=0), types).estimate(*messages)
    assert types.there_and_back(seen.detections).header == header
    assert list(seen.detections.detections) == []
    assert seen.joint_states is None
    assert seen.frames is None
    (told,) = seen.warnings
    assert told.startswith("no object is published: ")  # an empty array is


def test_in_a_blank_image_nothing_is_seen(types, raw, header, photo, messages):
    blank = image(raw, header, np.full_like(photo.pixels, 90), "rgb8")
    seen = Estimator(Settings(), types).estimate(blank, messages[1])
    assert list(seen.detections.detections) == []
    assert seen.frames is None
    assert "blank" in seen.warnings[0]


def test_a_bent_image_is_estimated_with_a_warning(types, raw, header, messages, photo):
    bent = camera_info(raw, header, K, photo.width, photo.height, d=(0.3, 0, 0, 0, 0))
    seen = Estimator(Settings(refine=0), types).estimate(messages[0], bent)
    assert "rectified:=true" in seen.warnings[0]
    assert seen.joint_states is not None


def test_an_object_is_followed_and_anew_where_time_runs_backwards(types, raw, messages):
    estimator = Estimator(Settings(track=True, refine=0), types)
    picture, info = messages
    first = None
    for sec in (10, 11, 12, 5):
        stamp = raw["builtin_interfaces/msg/Time"](sec=sec, nanosec=0)
        picture.header = raw["std_msgs/msg/Header"](stamp=stamp, frame_id="camera")
        seen = estimator.estimate(picture, info)
        assert seen.joint_states.header.stamp.sec == sec
        first = first or seen.joint_states
    np.testing.assert_allclose(seen.joint_states.position, first.position, atol=0.2)


@pytest.mark.parametrize(
    "told", [{"size": -1.0}, {"size": 1.0, "depth": 1.0}, {"track": True, "depth": 1.0}]
)
def test_settings_that_cannot_be_meant(told):
    with pytest.raises(UsageError):
        Settings(**told)


def test_an_unknown_category_is_told_before_any_image(types):
    with pytest.raises(UsageError, match="giraffe"):
        Estimator(Settings(category="giraffe"), types)


def test_uncalibrated_cameras_give_an_error_not_a_pose(types, raw, header, messages, photo):
    nothing = camera_info(raw, header, np.zeros((3, 3)), photo.width, photo.height)
    with pytest.raises(InputError, match="not calibrated"):
        Estimator(Settings(), types).estimate(messages[0], nothing)


def test_nothing_but_the_node_needs_ros():
    assert "rclpy" not in sys.modules
