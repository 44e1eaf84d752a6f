"""Tracking with the shipped model: an example photo that slides past, vanishes and returns."""

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from PIL import Image

from r2art.core.camera import Camera
from r2art.core.errors import InputError, UsageError
from r2art.core.image import read_image
from r2art.core.prediction import SCHEMA_FILE
from r2art.run.video import Frame, Tracked, Tracker, track
from r2art.run.video.frame import TRACK_SCHEMA_FILE
from r2art.run.video.measure import usable
from r2art.run.video.vote import Poll

PHOTO = Path(__file__).resolve().parents[3] / "examples" / "laptop.png"
CAMERA = Camera.from_fov(1.0, 320, 240)
DT = 1 / 30


@pytest.fixture(scope="module")
def pixels():
    with Image.open(PHOTO) as image:
        return np.asarray(image.convert("RGB").resize((320, 240)))


def noisy(pixels, k):
    noise = np.random.default_rng(k).normal(0, 4, pixels.shape)
    return np.clip(pixels + noise, 0, 255).astype(np.uint8)


BLANK = np.full((240, 320, 3), 127, np.uint8)


@pytest.fixture(scope="module")
def seen(predictor, pixels):
    """10 frames of a laptop, 18 of nothing, and 4 of a laptop elsewhere."""
    elsewhere = np.roll(pixels, 40, axis=1)
    pictures = [noisy(pixels, k) for k in range(10)] + [BLANK] * 18
    pictures += [noisy(elsewhere, k) for k in range(4)]
    frames = [Frame(time=5 + k * DT, image=x) for k, x in enumerate(pictures)]
    return list(track(frames, predictor, camera=CAMERA, category="laptop", refine=0))


def test_it_is_tracked_coasts_is_lost_and_found_again(seen):
    status = [s.status for s in seen]
    assert status[:10] == ["tracked"] * 10
    coasting = status[10:].index("lost")
    assert set(status[10 : 10 + coasting]) == {"coasting"}
    assert 14 <= coasting <= 16  # half a second
    assert set(status[10 + coasting : 28]) == {"lost"}
    assert status[28:] == ["tracked"] * 4
    shift = seen[-1].prediction.box[0] - seen[9].prediction.box[0]
    assert shift == pytest.approx(40, abs=12)


def test_what_coasts_grows_unsure_and_what_is_lost_says_nothing(seen):
    coasting = [s for s in seen if s.status == "coasting"]
    rotation = np.array([s.deviations.rotation for s in coasting])
    assert (np.diff(rotation, axis=0) > 0).all()
    assert all(s.measured is None for s in coasting)
    assert any("not seen" in w for w in coasting[-1].prediction.warnings)
    for lost in (s for s in seen if s.status == "lost"):
        assert lost.prediction is lost.deviations is lost.rates is None


def test_noise_of_the_frames_is_smoothed(seen):
    tracked = seen[:10]
    alone = np.array([s.measured.parts[0].cam_T_part[:3, :3] for s in tracked])
    smooth = np.array([s.prediction.parts[0].cam_T_part[:3, :3] for s in tracked])
    assert np.diff(smooth, 2, axis=0).std() < np.diff(alone, 2, axis=0).std() / 2
    sizes = [s.deviations.size for s in tracked]
    assert sizes == sorted(sizes, reverse=True)


def test_every_frame_is_a_prediction_and_obeys_the_schemas(seen):
    prediction, line = (
        jsonschema.Draft202012Validator(json.loads(p.read_text()))
        for p in (SCHEMA_FILE, TRACK_SCHEMA_FILE)
    )
    assert {s.status for s in seen} == {"tracked", "coasting", "lost"}
    for s in seen[::2]:
        data = json.loads(json.dumps(s.to_dict("clip.mp4"), allow_nan=False))
        line.validate(data)
        if s.prediction is not None:
            prediction.validate(data["prediction"])
            low, high = s.prediction.joints[0].limits
            assert low <= s.prediction.joints[0].state <= high
            assert s.prediction.category == "laptop"


def test_parts_and_joints_of_the_smoothed_object_belong_together(seen):
    """The lid is the base turned about the hinge, as in every prediction."""
    p = seen[5].prediction
    joint, (base, lid) = p.joints[0], p.parts
    turn = lid.cam_T_part @ np.linalg.inv(base.cam_T_part)
    np.testing.assert_allclose(turn[:3, :3] @ joint.axis, joint.axis, atol=1e-9)
    np.testing.assert_allclose(turn[:3, :3] @ joint.pivot + turn[:3, 3], joint.pivot, atol=1e-9)
    assert (np.trace(turn[:3, :3]) - 1) / 2 == pytest.approx(np.cos(joint.state), abs=1e-9)


def test_a_known_size_fixes_all_lengths(predictor, pixels):
    frames = [Frame(time=k * DT, image=noisy(pixels, k)) for k in range(3)]
    known = {"camera": CAMERA, "category": "laptop", "refine": 0}
    free = list(track(frames, predictor, **known))
    sized = list(track(frames, predictor, **known, size=0.5))
    for a, b in zip(free, sized, strict=True):
        assert np.max(b.prediction.parts[0].box_size) == pytest.approx(0.5)
        assert b.prediction.joints[0].state == a.prediction.joints[0].state
        assert (b.prediction.scale.source, b.deviations.size) == ("size", 0)
        uv = [CAMERA.project(x.prediction.parts[1].corners()) for x in (a, b)]
        np.testing.assert_allclose(*uv, atol=1e-6)


def test_a_guessed_camera_is_the_same_in_all_frames(predictor, pixels):
    frames = [Frame(time=k * DT, image=noisy(pixels, k)) for k in range(3)]
    known = {"category": "laptop", "refine": 0}
    cameras = {s.prediction.camera for s in track(frames, predictor, look_ahead=2, **known)}
    assert len(cameras) == 1
    for live in track(frames[:1], predictor, look_ahead=0, **known):
        assert live.prediction.camera_source == "guessed"
        assert any("guessed" in w for w in live.prediction.warnings)


def test_the_first_frames_vote(predictor, pixels):
    poll = Poll()
    vote = predictor.predict(pixels, CAMERA, refine=0)
    wrong = predictor.predict(pixels, CAMERA, "drawer", refine=0)
    for ballot in (wrong, vote, vote):
        poll = poll.after(ballot)
    assert poll.category == "laptop"
    assert poll.camera == CAMERA
    assert Poll().after(predictor.predict(BLANK, CAMERA, refine=0)).ballots == ()


def test_a_rejected_frame_neither_votes_nor_begins_anything(predictor, pixels):
    """Whatever the network says of it otherwise: the same answer counts once it is not rejected."""
    vote = predictor.predict(pixels, CAMERA, refine=0)
    rejected = replace(vote, rejected="it looks like nothing this model knows")
    assert usable(vote)
    assert not usable(rejected)
    assert [len(Poll().after(p).ballots) for p in (vote, rejected)] == [1, 0]


def test_one_odd_frame_among_the_first_decides_nothing(predictor, pixels):
    with Image.open(PHOTO.with_name("drawer.png")) as image:
        drawer = np.asarray(image.convert("RGB").resize((320, 240)))
    pictures = [drawer, *(noisy(pixels, k) for k in range(4))]
    frames = [Frame(time=k * DT, image=x) for k, x in enumerate(pictures)]
    for look_ahead in (5, 0):
        seen = list(track(frames, predictor, camera=CAMERA, refine=0, look_ahead=look_ahead))
        found = [s.prediction.category for s in seen if s.prediction is not None]
        assert found[-3:] == ["laptop"] * 3
        assert (found[0] == "drawer") == (look_ahead == 0)


def test_frames_that_cannot_be_used_are_refused_or_coasted_over(predictor, pixels):
    tracker = Tracker(predictor, camera=CAMERA, category="laptop")
    tracker.step(Frame(time=1.0, image=pixels))
    broken = tracker.step(Frame(time=1.1, image=None, fault="frame.png is damaged"))
    assert broken.status == "coasting"
    assert "frame.png is damaged" in broken.prediction.warnings
    with pytest.raises(UsageError, match="order of their times"):
        tracker.step(Frame(time=0.5, image=pixels))
    with pytest.raises(InputError, match="one size"):
        tracker.step(Frame(time=1.2, image=pixels[:200]))
    with pytest.raises(UsageError, match="drawer, eyeglasses, laptop"):
        Tracker(predictor, category="giraffe")


@pytest.mark.parametrize("camera", [CAMERA, None])
def test_a_frame_of_another_size_has_no_vote_and_ends_the_clip_where_it_comes(
    predictor, pixels, camera
):
    frames = [Frame(time=k * DT, image=x) for k, x in enumerate([pixels, pixels, pixels[:200]])]
    seen = []
    with pytest.raises(InputError, match="frame 2 has 320×200 px"):
        seen.extend(track(frames, predictor, camera=camera, refine=0))
    assert [s.status for s in seen] == ["tracked"] * 2


def test_nothing_at_all_is_lost_from_the_beginning(predictor):
    frames = [Frame(time=k * DT, image=BLANK) for k in range(3)]
    for s in track(frames, predictor):
        assert (s.status, s.prediction) == ("lost", None)
        assert isinstance(s, Tracked)
    assert list(track([], predictor)) == []


def test_a_given_box_is_where_it_begins(predictor, pixels):
    found = predictor.predict(read_image(pixels), CAMERA, "laptop").box
    frames = [Frame(time=0.0, image=pixels)]
    (first,) = track(frames, predictor, camera=CAMERA, category="laptop", box=found)
    assert first.measured.box == found
    assert first.measured.refinement is not None
    with pytest.raises(UsageError, match="outside"):
        list(track(frames, predictor, camera=CAMERA, category="laptop", box=(900, 0, 990, 9)))


@pytest.mark.parametrize("look_ahead", [0, 5])
def test_a_given_box_is_of_the_first_frame_that_is_a_picture(predictor, pixels, look_ahead):
    found = predictor.predict(read_image(pixels), CAMERA, "laptop").box
    pictures = [None, pixels, pixels]
    frames = [Frame(time=k * DT, image=x) for k, x in enumerate(pictures)]
    known = {"camera": CAMERA, "refine": 0, "look_ahead": look_ahead}
    seen = list(track(frames, predictor, box=found, **known))
    assert [s.status for s in seen] == ["lost", "tracked", "tracked"]
    assert seen[1].measured.box == found
    # A blank first picture has had it: what is found later lies where it is, not in that corner.
    frames = [Frame(time=k * DT, image=x) for k, x in enumerate([BLANK, pixels])]
    later = list(track(frames, predictor, box=(0, 0, 40, 40), **known))[-1]
    assert later.measured.box == pytest.approx(found, abs=12)
