"""`r2art` as a user meets it: results on stdout, everything else on stderr, honest exit codes."""

import io
import json
import re
import subprocess
import sys

import jsonschema
import numpy as np
import pytest
from commands import run
from PIL import Image

from r2art import cli
from r2art.core.prediction import SCHEMA_FILE, Prediction


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A working folder with two photos, of the same name in different folders."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(0)
    for name in ("photo.png", "more/photo.png"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        Image.fromarray(rng.integers(0, 255, (48, 64, 3), np.uint8)).save(name)
    return tmp_path


def files(folder):
    return sorted(p.name for p in folder.iterdir())


def test_one_photo_becomes_overlay_json_and_scene(folder, capsys):
    assert run("predict", "photo.png") == 0
    out, err = capsys.readouterr()
    assert files(folder / "r2art_out") == ["photo.glb", "photo.json", "photo.overlay.png"]
    prediction = Prediction.from_json((folder / "r2art_out" / "photo.json").read_text())
    assert prediction.image_path == "photo.png"
    for part in prediction.parts:
        assert part.name in out
    assert re.search(r"guessed a field of view of (60|45|35)°", err)
    assert "photo.overlay.png" in err
    with Image.open(folder / "r2art_out" / "photo.overlay.png") as overlay:
        assert overlay.width >= 900


def test_photos_of_one_name_do_not_overwrite_each_other(folder, capsys):
    assert run("predict", "photo.png", "more", "./photo.png", "--out", "results") == 0
    assert len(files(folder / "results")) == 6
    stems = {p.name for p in (folder / "results").glob("*.json")}
    assert f"{folder.name}_photo.png.json" in stems
    assert "more_photo.png.json" in stems


def test_json_is_one_line_for_each_photo_and_nothing_else(folder, capsys):
    assert run("predict", "**/*.png", "--json") == 0
    lines = capsys.readouterr().out.splitlines()
    schema = json.loads(SCHEMA_FILE.read_text(encoding="utf-8"))
    for line in lines:
        jsonschema.validate(json.loads(line), schema)
    paths = [json.loads(line)["image"]["path"] for line in lines]
    assert paths == ["more/photo.png", "photo.png"]
    assert not (folder / "r2art_out").exists()
    assert run("predict", "photo.png", "--json", "--out", "results") == 0
    assert len(files(folder / "results")) == 3


def test_options_reach_the_prediction(folder, capsys):
    options = ["--category", "drawer", "--box", "5", "4", "60", "40.5", "--json"]
    assert run("predict", *options, "--camera", "70", "71", "32", "24", "photo.png") == 0
    data = json.loads(capsys.readouterr().out)
    assert data["category"] == {"name": "drawer", "score": None}
    assert data["box"] == [5, 4, 60, 40.5]
    assert data["camera"] == {"fx": 70, "fy": 71, "cx": 32, "cy": 24, "source": "given"}
    assert run("predict", "photo.png", "--fov", "90", "--json") == 0
    assert json.loads(capsys.readouterr().out)["camera"]["fx"] == pytest.approx(32)


def test_masks_belong_to_photos_by_name(folder, capsys):
    for name in ("photo.mask.png", "masks/photo.png"):
        (folder / name).parent.mkdir(exist_ok=True)
        mask = np.zeros((48, 64), np.uint8)
        mask[10:40, 8:50] = 255
        Image.fromarray(mask).save(name)
    boxes = []
    for mask in ("photo.mask.png", "masks"):
        assert run("predict", "photo.png", "--mask", mask, "--json") == 0
        boxes.append(json.loads(capsys.readouterr().out)["box"])
    assert boxes == [[8, 10, 50, 40]] * 2
    (folder / "masks" / "photo.png").rename(folder / "masks" / "other.png")
    assert run("predict", "photo.png", "--mask", "masks", "--json") == 3
    out, err = capsys.readouterr()
    assert out == ""
    assert "no mask named photo" in err
    assert run("predict", "photo.png", "--refine", "0", "--json") == 0
    assert json.loads(capsys.readouterr().out)["refinement"] is None


def save_bad(folder):
    """One file of each kind that cannot be used, and of each odd kind that can."""
    rgb = Image.fromarray(np.random.default_rng(1).integers(0, 255, (40, 60, 3), np.uint8))
    whole = io.BytesIO()
    rgb.save(whole, "PNG")
    (folder / "text.jpg").write_text("dear diary\n" * 50)
    (folder / "truncated.png").write_bytes(whole.getvalue()[:3000])
    (folder / "empty.png").touch()
    Image.new("1", (13_000, 13_000)).save(folder / "huge.png")
    bad = ["text.jpg", "truncated.png", "empty.png", "huge.png", "missing.png"]
    rgb.convert("CMYK").save(folder / "cmyk.jpg")
    Image.fromarray(np.full((40, 60), 30_000, np.uint16)).save(folder / "deep.png")
    rgb.convert("L").save(folder / "grey.png")
    rgb.convert("RGBA").save(folder / "alpha.png")
    rgb.convert("P").save(folder / "palette.gif")
    exif = rgb.getexif()
    exif[0x0112] = 6
    rgb.save(folder / "turned.jpg", exif=exif)
    return bad, ["cmyk.jpg", "deep.png", "grey.png", "alpha.png", "palette.gif", "turned.jpg"]


def test_bad_images_are_told_in_one_line_each_and_do_not_stop_the_others(folder, capsys):
    bad, good = save_bad(folder)
    assert run("predict", *bad, *good, "--json") == 3
    out, err = capsys.readouterr()
    results = {(r := json.loads(line))["image"]["path"]: r for line in out.splitlines()}
    assert list(results) == good
    assert results["turned.jpg"]["image"]["width"] == 40
    errors = [line for line in err.splitlines() if line.startswith("error:")]
    assert len(errors) == len(bad)
    for name, line in zip(bad, errors, strict=True):
        assert name in line
    assert "Traceback" not in err


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (["photo.png", "--box", "900", "0", "990", "50"], 2, "outside the photo"),
        (["photo.png", "--box", "9", "9", "5", "5"], 2, "empty"),
        (["photo.png", "--box", "nan", "0", "9", "9"], 2, "finite"),
        (["photo.png", "--box", "1", "2", "3"], 2, "--box"),
        (["photo.png", "--camera", "-500", "500", "32", "24"], 2, "positive"),
        (["photo.png", "--camera", "500", "inf", "32", "24"], 2, "finite"),
        (["photo.png", "--camera", "500", "500", "32", "24", "--fov", "60"], 2, "--fov"),
        (["photo.png", "--fov", "0"], 2, "180"),
        (["photo.png", "--category", "giraffe"], 2, "drawer, eyeglasses, laptop"),
        (["photo.png", "--out", "photo.png"], 2, "cannot write"),
        (["photo.png", "--nonsense"], 2, "--nonsense"),
        ([], 2, "no image"),
        (["nothing/*.png"], 3, "no images match"),
        (["missing.png"], 3, "no such file"),
        (["photo.png", "--model", "missing.onnx"], 4, "missing.onnx"),
        (["photo.png", "--model", "photo.png"], 4, "not a model"),
    ],
)
def test_mistakes_have_their_exit_code_and_one_clear_word(folder, capsys, arguments, code, says):
    assert run("predict", *arguments) == code
    out, err = capsys.readouterr()
    assert says in err
    assert out == ""
    assert "Traceback" not in err
    if "--nonsense" not in arguments and says != "--box":  # the argument parser draws a frame
        assert err.count("\n") == 1


def test_help_teaches_and_version_tells(capsys):
    assert run("--help") == 0
    out = capsys.readouterr().out
    for name in cli.COMMANDS:
        assert f"  {name} " in out
    assert "r2art predict laptop.jpg" in out
    assert run("predict", "--help") == 0
    assert "--camera FX FY CX CY" in capsys.readouterr().out
    assert run("--version") == 0
    assert capsys.readouterr().out.startswith("r2art 0.")
    assert run() == 2


def test_a_forgotten_command_is_guessed(folder, capsys):
    assert run("photo.png") == 2
    assert "r2art predict photo.png" in capsys.readouterr().err


def test_a_command_of_the_learn_tier_says_what_to_install(capsys, monkeypatch):
    def learn() -> int:
        import torch  # noqa: F401

        return 0

    monkeypatch.setitem(sys.modules, "torch", None)
    monkeypatch.setitem(cli.COMMANDS, "learn", learn)
    assert run("learn") == 2
    assert "pip install 'r2art[train]'" in capsys.readouterr().err


def test_an_interrupted_command_ends_quietly(capsys, monkeypatch):
    def wait() -> int:
        raise KeyboardInterrupt

    monkeypatch.setitem(cli.COMMANDS, "wait", wait)
    assert run("wait") == 130
    assert capsys.readouterr().err == "error: interrupted\n"


def test_the_run_tier_needs_no_torch_and_import_r2art_almost_nothing(folder):
    script = (
        "import sys, r2art; assert 'numpy' not in sys.modules; "
        "from r2art.cli import main; assert main(['predict', 'photo.png']) == 0; "
        "heavy = {'torch', 'scipy', 'trimesh', 'onnx', 'matplotlib'} & set(sys.modules); "
        "assert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
