"""Films and sequences: every kind of file gives its frames, or one clear line."""

import sys
import threading
import wave
from fractions import Fraction

import av
import numpy as np
import pytest
from PIL import Image

from r2art.core.errors import InputError, UsageError
from r2art.run.files import films_of
from r2art.run.video.film import upright
from r2art.run.video.source import find_clip
from r2art.run.video.webcam import DEVICES, newest, open_webcam
from r2art.run.video.writer import Film, Lines

TIMES = [0.0, 0.04, 0.08, 0.3, 0.34, 0.9]


def picture(k, size=(96, 64)):
    """Grey that tells its number, with a red corner at the upper left."""
    pixels = np.full((size[1], size[0], 3), 40 + 20 * k, np.uint8)
    pixels[:24, :24] = (250, 0, 0)
    return Image.fromarray(pixels)


@pytest.fixture
def film(tmp_path):
    path = tmp_path / "clip.mp4"
    writer = Film(path)
    for k, at in enumerate(TIMES):
        writer.add(picture(k), at)
    assert not path.exists()
    assert writer.finish()
    return path


def is_red(pixel):
    return pixel[0] > 180 and max(pixel[1:]) < 80


def test_a_film_gives_its_frames_each_at_its_own_time(film):
    source = find_clip(str(film), 30)
    frames = list(source.frames())
    assert (source.name, source.count) == ("clip", len(TIMES))
    assert [f.time for f in frames] == pytest.approx(TIMES, abs=1e-3)
    for k, frame in enumerate(frames):
        assert frame.image.shape == (64, 96, 3)
        assert frame.image[50, 80].mean() == pytest.approx(40 + 20 * k, abs=6)
        assert is_red(frame.image[10, 10])


@pytest.mark.parametrize(("quarters", "corner"), [(1, (10, -10)), (2, (-10, -10)), (3, (-10, 10))])
def test_a_film_recorded_sideways_is_shown_upright(film, quarters, corner):
    """The display matrix turns by quarters, clockwise; `corner` is where the red one must be."""
    cos, sin = [(1, 0), (0, 1), (-1, 0), (0, -1)][quarters]
    matrix = np.array([cos, sin, 0, -sin, cos, 0, 0, 0, 16384]) * 65536
    data = bytearray(film.read_bytes())
    at = data.index(b"tkhd") + 44
    data[at : at + 36] = matrix.astype(">i4").tobytes()
    film.write_bytes(data)
    frames = list(find_clip(str(film), 30).frames())
    shape = (96, 64, 3) if quarters % 2 else (64, 96, 3)
    assert frames[0].image.shape == shape
    assert is_red(frames[0].image[corner])


def test_pixels_that_are_not_square_become_so(tmp_path):
    path = tmp_path / "wide.mkv"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=25)
        stream.width, stream.height, stream.pix_fmt = 96, 64, "yuv420p"
        stream.codec_context.sample_aspect_ratio = Fraction(2, 1)
        for k in range(3):
            container.mux(stream.encode(av.VideoFrame.from_image(picture(k))))
        container.mux(stream.encode(None))
    assert next(find_clip(str(path), 30).frames()).image.shape == (64, 192, 3)


def test_a_frame_that_is_too_large_once_upright_is_refused():
    """The shape of its pixels counts, and its own size, not what the film's head says."""
    frame = av.VideoFrame.from_image(picture(0))
    assert upright(frame, "clip.mp4", 2.0).shape == (64, 192, 3)
    with pytest.raises(InputError, match=r"clip\.mp4 .* 123 megapixels, the limit is 100"):
        upright(frame, "clip.mp4", 20_000.0)


def save_sound(path):
    with wave.open(str(path), "wb") as sound:
        sound.setnchannels(1)
        sound.setsampwidth(2)
        sound.setframerate(8000)
        sound.writeframes(b"\0\0" * 4000)


@pytest.mark.parametrize("kind", ["missing", "empty", "text", "sound", "headless"])
def test_what_is_no_film_is_told_in_one_line(film, tmp_path, kind):
    path = tmp_path / f"{kind}.mp4"
    if kind == "empty":
        path.touch()
    elif kind == "text":
        path.write_text("dear diary\n" * 100)
    elif kind == "sound":
        save_sound(path)
    elif kind == "headless":
        path.write_bytes(film.read_bytes()[200:])
    with pytest.raises(InputError, match=kind) as refused:
        list(find_clip(str(path), 30).frames())
    assert "\n" not in str(refused.value)


def test_a_film_that_was_cut_off_gives_what_there_is_and_then_says_so(tmp_path):
    path = tmp_path / "cut.mp4"
    writer = Film(path)
    noise = np.random.default_rng(0)
    for k in range(60):
        writer.add(Image.fromarray(noise.integers(0, 255, (64, 96, 3), np.uint8)), k / 30)
    writer.finish()
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    frames = []
    with pytest.raises(InputError, match=r"cut\.mp4 ends after \d+ frames"):
        frames.extend(find_clip(str(path), 30).frames())
    assert 5 < len(frames) < 50


def test_pictures_are_frames_in_the_order_of_their_numbers(tmp_path):
    for k in (1, 2, 10, 3):
        picture(k).save(tmp_path / f"frame_{k}.png")
    (tmp_path / "frame_2.png").write_bytes(b"no picture")
    source = find_clip(str(tmp_path), 10)
    frames = list(source.frames())
    assert source.count == 4
    assert [f.time for f in frames] == pytest.approx([0, 0.1, 0.2, 0.3])
    assert "frame_2.png" in frames[1].fault
    assert frames[1].image is None
    assert [f.image.pixels[50, 80, 0] for f in frames if f.image] == [60, 100, 240]
    assert find_clip(str(tmp_path / "*.png"), 10).name == tmp_path.name
    with pytest.raises(UsageError, match="fps"):
        find_clip(str(tmp_path), 0)


def test_films_are_known_by_their_endings(film, tmp_path):
    assert films_of("a.MP4") == ["a.MP4"]
    assert films_of("a.png") == films_of(str(tmp_path)) == []
    (tmp_path / "clip.tracked.mp4").touch()
    assert films_of(str(tmp_path / "*.mp4")) == [str(film)]


def test_a_result_is_whole_or_not_there(tmp_path):
    for kind, ending in ((Film, "mp4"), (Lines, "jsonl")):
        path = tmp_path / f"nothing.{ending}"
        assert not kind(path).finish()
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(UsageError, match="cannot write"):
        Film(tmp_path / "missing" / "clip.mp4")


@pytest.mark.parametrize("error", [av.error.ExternalError, av.error.InvalidDataError])
def test_an_error_of_the_encoder_is_one_line_and_leaves_nothing(tmp_path, error):
    """Such errors are no OSErrors; the stream in the encoder's place raises one."""

    class Broken:
        def encode(self, frame):
            raise error(1, "out of order")

    writer = Film(tmp_path / "clip.mp4")
    writer.add(picture(0), 0.0)
    writer._stream = Broken()
    with pytest.raises(UsageError, match=r"cannot write to .*clip\.mp4: out of order"):
        writer.add(picture(1), 0.1)
    with pytest.raises(UsageError, match="out of order"):
        writer.finish()
    assert list(tmp_path.iterdir()) == []


def test_films_of_odd_size_and_repeated_times_are_valid(tmp_path):
    writer = Film(tmp_path / "odd.mp4")
    for k in range(4):
        writer.add(picture(k, (97, 65)), 0.5)
    writer.finish()
    frames = list(find_clip(str(tmp_path / "odd.mp4"), 30).frames())
    assert len(frames) == 4
    assert frames[0].image.shape == (66, 98, 3)


def test_live_pictures_are_dropped_rather_than_late():
    """What comes while the reader works on one picture is gone, but for the newest."""
    at_work, all_taken = threading.Event(), threading.Event()

    def camera():
        yield 0
        at_work.wait(20)
        yield from range(1, 40)
        all_taken.set()

    pictures = newest(camera())
    assert next(pictures) == 0
    at_work.set()
    assert all_taken.wait(20)
    assert list(pictures) == [39]


def test_a_camera_is_read_until_it_ends(monkeypatch):
    """FFmpeg's test picture in the place of a webcam, which a test machine lacks."""
    monkeypatch.setitem(DEVICES, sys.platform, ("lavfi", "testsrc=size=160x120:duration=1"))
    source = open_webcam("0")
    assert source.live
    frames = list(source.frames())
    times = [f.time for f in frames]
    assert times == sorted(times)
    assert 0 < len(frames) <= 25
    assert {f.image.shape for f in frames} == {(120, 160, 3)}
    assert frames[-1].image.std() > 20


def test_a_camera_that_fails_says_so_after_its_last_picture():
    def camera():
        yield 1
        raise InputError("unplugged")

    with pytest.raises(InputError, match="unplugged"):
        list(newest(camera()))
