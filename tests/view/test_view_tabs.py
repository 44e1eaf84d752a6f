"""What tabs do to the server, said over the websocket without a browser."""

import socket
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("viser", reason="needs the extra `view`")

from viewer_tab import DRAWER, LAPTOP, Tab, until

from r2art.core.errors import UsageError
from r2art.core.image import read_image
from r2art.run.export.mechanism import part_poses
from r2art.run.export.rotations import quaternion
from r2art.view.server import Viewer


@pytest.fixture
def tab(viewer):
    with Tab(viewer) as tab:
        yield tab


@pytest.fixture
def shown(tab):
    """A tab that shows the laptop."""
    tab.upload(LAPTOP.name, LAPTOP.read_bytes())
    until(lambda: tab.session.prediction, "a prediction")
    until(lambda: "r2art-note" in tab.session.inputs.message.content, "its display")
    return tab


def assert_posed(session, poses):
    for frame, pose in zip(session.results.scene.parts, poses, strict=True):
        np.testing.assert_allclose(frame.wxyz, quaternion(pose[:3, :3]), atol=1e-6)
        np.testing.assert_allclose(frame.position, pose[:3, 3], atol=1e-6)


def test_a_tab_shows_what_the_predictor_says(shown, predictor):
    photo = replace(read_image(LAPTOP), path=Path(LAPTOP.name))
    expected = predictor.predict(photo)
    assert shown.session.prediction.to_dict() == expected.to_dict()
    assert_posed(shown.session, [part.cam_T_part for part in expected.parts])


def test_a_slider_moves_what_hangs_on_its_joint_and_nothing_else(shown):
    session = shown.session
    prediction = session.prediction
    (joint,) = prediction.joints
    shown.set(session.results.sliders[joint.name], 20.0)
    expected = part_poses(prediction, {joint.name: np.radians(20)})
    lid = session.results.scene.parts[1]
    until(lambda: np.allclose(lid.position, expected[1, :3, 3], atol=1e-6), "the lid to move")
    assert not np.allclose(expected[1], prediction.parts[1].cam_T_part, atol=0.01)
    assert_posed(session, expected)


def test_what_the_user_knows_is_used(shown):
    session = shown.session
    shown.set(session.inputs.box, "100, 60 540 450")
    until(lambda: session.prediction.box == (100, 60, 540, 450), "the box to be used")


def test_what_makes_no_sense_is_said_and_the_result_stays(shown):
    session, before = shown.session, shown.session.prediction
    shown.set(session.inputs.box, "1 2 three 4")
    until(lambda: "not made of numbers" in session.inputs.message.content, "an answer")
    shown.set(session.inputs.box, "9000 9000 9100 9100")
    until(lambda: "outside the photo" in session.inputs.message.content, "an answer")
    assert session.prediction is before


def test_a_bad_file_is_refused_by_name_and_the_result_stays(shown):
    session, before = shown.session, shown.session.prediction
    shown.upload("notes.txt", b"no photo")
    until(lambda: "notes.txt is not an image" in session.inputs.message.content, "an answer")
    assert "r2art-error" in session.inputs.message.content
    assert session.prediction is before


def test_an_empty_file_is_refused(tab):
    tab.upload("empty.png", b"")
    until(lambda: "empty.png is empty" in tab.session.inputs.message.content, "an answer")


def test_a_file_above_the_limit_is_refused_even_if_it_lies_about_its_size(tab):
    session = tab.session
    for size, announced in ((1_020_000, 1_020_000), (3_000_000, 10)):  # the limit is 10⁶
        session.inputs.say("")
        tab.upload("large.png", bytes(size), announced=announced)
        until(lambda: "the limit is 1 MB" in session.inputs.message.content, "a refusal")
    tab.upload(LAPTOP.name, LAPTOP.read_bytes())
    until(lambda: session.prediction, "a prediction all the same")


def test_a_name_is_never_markup(tab):
    tab.upload("<img src=x onerror=alert(1)>.png", b"no photo")
    message = tab.session.inputs.message
    until(lambda: "not an image" in message.content, "an answer")
    assert "&lt;img" in message.content
    assert "<img" not in message.content


def test_tabs_do_not_mix(viewer, shown):
    laptop = shown.session.prediction
    with Tab(viewer) as other:
        assert other.session.prediction is None
        other.upload(DRAWER.name, DRAWER.read_bytes())
        until(lambda: other.session.prediction, "a prediction")
        assert other.session.prediction.image_path == "drawer.png"
    assert shown.session.prediction is laptop


def test_a_closed_tab_is_forgotten(viewer):
    with Tab(viewer) as tab:
        session = tab.session
    until(lambda: session not in viewer.sessions.values(), "the end of the session")


def test_pages_of_strangers_get_no_session(viewer):
    before = set(viewer.sessions)
    with Tab(viewer, origin="http://evil.example"), Tab(viewer) as own:
        assert own.session
        assert set(viewer.sessions) - before == {max(viewer.sessions)}


def test_a_photo_given_at_the_start_is_what_every_tab_shows(predictor):
    viewer = Viewer(predictor, read_image(DRAWER), port=0)
    try:
        with Tab(viewer) as tab:
            until(lambda: tab.session.prediction, "a prediction")
            assert tab.session.prediction.image_path == str(DRAWER)
    finally:
        viewer.stop()


def test_a_taken_port_gives_the_next_that_is_free(predictor, viewer):
    taken = int(viewer.url.rpartition(":")[2])
    other = Viewer(predictor, port=taken)
    try:
        assert other.url != viewer.url
    finally:
        other.stop()
    with socket.socket() as probe:
        probe.settimeout(5)
        assert probe.connect_ex(("127.0.0.1", int(other.url.rpartition(":")[2]))) != 0


@pytest.mark.parametrize(
    ("host", "port", "why"),
    [("203.0.113.1", 0, "cannot listen on"), ("127.0.0.1", 70000, "between 0")],
)
def test_where_nobody_can_listen_is_told(predictor, host, port, why):
    with pytest.raises(UsageError, match=why):
        Viewer(predictor, host=host, port=port)
