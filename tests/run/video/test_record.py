"""`r2art predict` on clips, as a user meets it, and the pictures it draws."""

import contextlib
import json
import os
import shutil
import signal
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from commands import run
from PIL import Image

from r2art.core.errors import UsageError
from r2art.core.image import Photo
from r2art.core.prediction import JointEstimate, Prediction
from r2art.run.video import Tracked
from r2art.run.video.annotate import Annotator
from r2art.run.video.deviations import Deviations
from r2art.run.video.history import History
from r2art.run.video.plot import Panel, plot
from r2art.run.video.record import Recorder
from r2art.run.video.source import find_clip
from r2art.run.video.writer import Film

COUNT = 3
PHOTO = Path(__file__).resolve().parents[3] / "examples" / "laptop.png"


@pytest.fixture(scope="module")
def pixels():
    with Image.open(PHOTO) as image:
        return np.asarray(image.convert("RGB").resize((320, 240)))


@pytest.fixture(scope="module")
def clip(tmp_path_factory, pixels):
    """A film and a folder of the same few pictures; and a longer film."""
    folder = tmp_path_factory.mktemp("clips")
    (folder / "frames").mkdir()
    films = {n: Film(folder / f"{name}.mp4") for name, n in (("clip", COUNT), ("long", 40))}
    for k in range(40):
        shown = Image.fromarray(np.roll(pixels, k % 7, axis=1))
        for count, film in films.items():
            if k < count:
                film.add(shown, k / 25)
        if k < COUNT:
            shown.save(folder / "frames" / f"{k}.png")
    assert all(film.finish() for film in films.values())
    return folder


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def lines(path):
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


KNOWN = ("--category", "laptop", "--fov", 60, "--refine", 0)


def test_a_film_becomes_a_film_lines_and_a_plot(clip, tmp_path, capsys):
    assert run("predict", clip / "clip.mp4", *KNOWN, "--out", "out") == 0
    names = ["clip.joints.png", "clip.tracked.jsonl", "clip.tracked.mp4"]
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == names
    told = lines(tmp_path / "out" / "clip.tracked.jsonl")
    assert [t["frame_index"] for t in told] == list(range(COUNT))
    assert [t["time"] for t in told] == pytest.approx([k / 25 for k in range(COUNT)], abs=1e-3)
    frames = list(find_clip(str(tmp_path / "out" / "clip.tracked.mp4"), 30).frames())
    assert [f.time for f in frames] == pytest.approx([t["time"] for t in told], abs=1e-3)
    assert frames[0].image.shape[1] == 960
    out, err = capsys.readouterr()
    assert "clip.tracked.jsonl" in err
    assert f"{COUNT} frames" in out


def test_a_film_that_cannot_be_written_costs_neither_the_lines_nor_the_next_clip(
    clip, tmp_path, capsys
):
    (tmp_path / "out" / "clip.tracked.mp4").mkdir(parents=True)  # nothing can take its name
    assert (
        run("predict", clip / "clip.mp4", "--video", clip / "frames", *KNOWN, "--out", "out") == 2
    )
    err = capsys.readouterr().err
    (told,) = (line for line in err.splitlines() if line.startswith("error: "))
    assert "clip.tracked.mp4" in told
    names = {p.name for p in (tmp_path / "out").iterdir() if p.is_file()}
    rest = {"clip.joints.png", "clip.tracked.jsonl"}
    assert names == rest | {f"frames{e}" for e in (".joints.png", ".tracked.jsonl", ".tracked.mp4")}


def test_a_recorder_that_cannot_begin_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(UsageError):
        Recorder(tmp_path, "clip", "clip.mp4")
    assert list(tmp_path.iterdir()) == []


def test_clips_named_alike_have_their_own_results_and_one_named_twice_is_followed_once(
    clip, tmp_path
):
    for name in ("a/clip", "b/CLIP", "clip-2"):
        path = tmp_path / f"{name}.mp4"
        path.parent.mkdir(exist_ok=True)
        shutil.copy(clip / "clip.mp4", path)
    films = ("a/clip.mp4", "clip-2.mp4", "b/CLIP.mp4", "./a/clip.mp4")
    assert run("predict", *films, *KNOWN, "--out", "out") == 0
    results = (tmp_path / "out").glob("*.tracked.jsonl")
    sources = {p.name.removesuffix(".tracked.jsonl"): lines(p)[0]["source"] for p in results}
    assert sources == {"clip": films[0], "clip-2": films[1], "CLIP-3": films[2]}


def test_pictures_are_a_clip_only_where_asked(clip, tmp_path, capsys):
    assert run("predict", "--video", clip / "frames", *KNOWN, "--fps", 10, "--json") == 0
    told = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [t["time"] for t in told] == pytest.approx([0, 0.1, 0.2])
    assert list(tmp_path.iterdir()) == []
    assert run("predict", clip / "frames", *KNOWN, "--json") == 0
    photos = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert {p["schema"] for p in photos} == {"r2art/prediction/1"}


def test_without_the_extra_it_says_what_to_install(clip, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    assert run("predict", clip / "clip.mp4") == 2
    assert "pip install 'r2art[video]'" in capsys.readouterr().err
    assert run("predict", "--webcam") == 2
    assert "pip install 'r2art[video]'" in capsys.readouterr().err
    # Pictures need no decoder: only the annotated film is left out.
    assert run("predict", "--video", clip / "frames", *KNOWN, "--out", "out") == 0
    assert "pip install 'r2art[video]'" in capsys.readouterr().err
    names = sorted(p.name for p in (tmp_path / "out").iterdir())
    assert not any(n.endswith("mp4") for n in names)
    assert "frames.tracked.jsonl" in names


def test_interrupted_it_keeps_what_is_done(clip, tmp_path, capsys):
    def interrupt():
        """Once the first lines are written, and again if it goes on for many more."""
        wanted, until = 1, time.monotonic() + 60
        while time.monotonic() < until and not (tmp_path / "out" / "long.tracked.jsonl").exists():
            with contextlib.suppress(FileNotFoundError):
                growing = list((tmp_path / "out").glob(".long.tracked.jsonl*"))
                size = growing[0].stat().st_size if growing else 0
                if size >= wanted:
                    wanted = size + 20_000
                    os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.01)

    threading.Thread(target=interrupt, daemon=True).start()
    assert run("predict", clip / "long.mp4", *KNOWN, "--out", "out") == 130
    err = capsys.readouterr().err
    assert "interrupted after" in err
    assert "Traceback" not in err
    told = lines(tmp_path / "out" / "long.tracked.jsonl")
    assert 0 < len(told) < 40
    frames = list(find_clip(str(tmp_path / "out" / "long.tracked.mp4"), 30).frames())
    assert abs(len(frames) - len(told)) <= 1
    assert not [p for p in (tmp_path / "out").iterdir() if p.name.endswith(".tmp")]


def test_what_a_cut_off_film_shows_is_kept(tmp_path, capsys):
    film = Film(tmp_path / "cut.mp4")
    noise = np.random.default_rng(0)
    for k in range(30):
        film.add(Image.fromarray(noise.integers(0, 255, (64, 96, 3), np.uint8)), k / 30)
    film.finish()
    whole = (tmp_path / "cut.mp4").read_bytes()
    (tmp_path / "cut.mp4").write_bytes(whole[: len(whole) // 2])
    assert run("predict", "cut.mp4", *KNOWN, "--json", "--out", "out") == 3
    out, err = capsys.readouterr()
    assert "cut.mp4 ends after" in err
    told = lines(tmp_path / "out" / "cut.tracked.jsonl")
    assert told == [json.loads(line) for line in out.splitlines()]
    frames = list(find_clip(str(tmp_path / "out" / "cut.tracked.mp4"), 30).frames())
    assert len(frames) == len(told) > 0


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (["missing.mp4"], 3, "missing.mp4"),
        (["text.mp4"], 3, "not a film"),
        (["--video", "nothing"], 3, "no such file"),
        (["text.mp4", "--depth", 1], 2, "--size"),
        (["text.mp4", "--mask", "m.png"], 2, "--mask"),
        (["--video", ".", "--fps", 0], 2, "--fps"),
        (["--webcam", 987], 3, "webcam 987"),
    ],
)
def test_mistakes_have_their_exit_code_and_one_clear_word(tmp_path, capsys, arguments, code, says):
    (tmp_path / "text.mp4").write_text("dear diary\n" * 100)
    assert run("predict", *arguments, "--json") == code
    out, err = capsys.readouterr()
    assert says in err
    assert out == ""
    assert "Traceback" not in err
    assert not list(tmp_path.glob("**/*tracked*"))


def test_curves_are_drawn_where_the_numbers_say():
    panel = Panel((100, 10, 300, 110), start=0.0, end=2.0, low=0.0, high=1.0)
    places = panel.at(np.array([0.0, 1.0, 2.0]), np.array([0.0, 0.5, 7.0]))
    assert places == [(100, 110), (200, 60), (300, 10)]
    joint = JointEstimate(
        name="hinge",
        kind="revolute",
        parent="base",
        child="lid",
        state=1.0,
        limits=(0.0, 2.3),
        axis=np.array([1.0, 0, 0]),
        pivot=np.zeros(3),
    )
    history = History(joints=(joint,))
    for k in range(20):
        gone = 8 <= k < 12
        history.times.append(k / 10)
        history.status.append("lost" if gone else "tracked")
        history.states.append([] if gone else [0.1 * k])
        history.deviations.append([] if gone else [0.05])
        history.measured.append([] if gone else [0.1 * k])
    assert np.isnan(history.curve("states", 0)).sum() == 4
    assert len(history.last(0.5).times) == 6
    drawn = np.asarray(plot(history)).astype(int)
    orange = (drawn[..., 0] > 200) & (drawn[..., 1] > 120) & (drawn[..., 2] < 90)
    x = np.flatnonzero(orange[60:190].any(axis=0))
    middle = [np.flatnonzero(orange[60:190, c]).mean() for c in (x[0], x[-1])]
    assert middle[0] > middle[1] + 50  # it rises
    assert np.diff(x).max() > 100  # with a gap


def test_every_annotated_frame_has_the_size_of_the_first(predictor, pixels):
    prediction: Prediction = predictor.predict(pixels, refine=0)
    sure = Deviations(
        rotation=np.ones(3),
        position=np.ones(3),
        size=0.1,
        joints=np.full(len(prediction.joints), 0.1),
        rates=np.ones(len(prediction.joints)),
    )
    annotator = Annotator()
    found = {"status": "tracked", "prediction": prediction, "deviations": sure}
    frames = [
        Tracked(index=0, time=0.0, status="lost", photo=Photo(pixels)),
        Tracked(index=1, time=0.1, photo=Photo(pixels), **found),
        Tracked(index=2, time=0.2, status="lost"),
    ]
    sizes = set()
    for frame in frames:
        annotator.add(frame)
        sizes.add(annotator.draw(frame).size)
    assert len(sizes) == 1
