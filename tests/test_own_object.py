"""docs/your_object.md and docs/your_dataset.md keep their word: small, but as they stand there."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from test_docs import ROOT, commands, python

import r2art
from r2art.cli import main
from r2art.data.categories import make_instance, staging
from r2art.data.scenes.scene import make_sample
from r2art.data.scenes.surroundings import Surroundings
from r2art.data.shards import Dataset

SMALL = {"-n 8000": "-n 4 --size 96 --workers 1", "train tiny": "train smoke"}


@pytest.fixture
def desk(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    with Image.open(ROOT / "examples" / "drawer.png") as photo:
        photo.convert("RGB").resize((320, 240)).save(tmp_path / "photo.jpg")
    return tmp_path


def run(line):
    for full, small in SMALL.items():
        line = line.replace(full, small)
    assert main(shlex.split(line)[1:]) == 0, line


def test_a_urdf_becomes_a_model_in_five_commands(desk, capsys):
    five = commands(ROOT / "docs" / "your_object.md")[:5]
    assert [line.split()[1] for line in five] == ["prior", "synth", "train", "export", "predict"]
    assert all(any(full in line for line in five) for full in SMALL)
    for line in five:
        run(line)
    assert "parts body, drawer, door" in capsys.readouterr().err
    assert r2art.load("cabinet.onnx").categories == ("cabinet",)
    prediction = json.loads(Path("r2art_out/photo.json").read_text())
    assert [p["name"] for p in prediction["parts"]] == ["body", "drawer", "door"]
    assert [j["kind"] for j in prediction["joints"]] == ["prismatic", "revolute"]


def labelled(seed):
    rng = np.random.default_rng(seed)
    instance = make_instance("laptop", seed)
    return make_sample(rng, instance, staging("laptop"), Surroundings(), 64)


def test_photos_with_labels_become_a_dataset(desk):
    page = ROOT / "docs" / "your_dataset.md"
    samples = [labelled(seed) for seed in range(2)]
    Path("my_photos").mkdir()
    for k, sample in enumerate(samples):
        Image.fromarray(sample.image).save(f"my_photos/{k}.png")
        camera = sample.camera
        numbers = ("box", "cam_T_part", "joint_state", "box_center", "box_size", "axis", "pivot")
        labels = {name: getattr(sample, name) for name in (*numbers, "visible", "mask")}
        np.savez(
            f"my_photos/{k}.npz", camera=[camera.fx, camera.fy, camera.cx, camera.cy], **labels
        )
    laptop, urdf, check, show, train = commands(page)
    run(urdf)
    run(laptop)
    scope = {"__name__": "page"}
    for block in python(page):
        exec(compile(block, page.name, "exec"), scope)
    run(check)
    run(show)
    dataset = Dataset.open(Path("data/mine"))
    assert len(dataset) == 2
    for k, sample in enumerate(samples):
        np.testing.assert_allclose(dataset[k].cam_T_part, sample.cam_T_part)
        np.testing.assert_array_equal(dataset[k].mask, sample.mask)
    assert "--data data/mine" in train
