"""docs/exports.md keeps its word: its commands and its Python run as they stand there."""

import re
import shlex
from pathlib import Path

import numpy as np

from r2art.cli import main
from r2art.core.prediction import Prediction
from r2art.run.export import FORMATS

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "exports.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


def test_commands_and_python_of_the_page_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    (commands,) = blocks("bash")
    for line in commands.splitlines():
        assert main(shlex.split(line)[1:]) == 0
    assert sorted(p.name for p in Path("models").iterdir()) == [
        "laptop.glb",
        "laptop.mjcf.xml",
        "laptop.urdf",
    ]
    assert [p.name for p in Path("tables").iterdir()] == ["laptop.csv"]
    prediction = Prediction.from_json(Path("out/laptop.json").read_text())
    lid = prediction.part("lid").cam_T_part
    _, urdf, mjcf = python = blocks("python")
    for block in python:
        exec(block, scope := {"prediction": prediction, "other": prediction})
        if block == urdf:
            pose = scope["robot"].get_transform("lid", "opencv_camera")
            np.testing.assert_allclose(pose, lid, atol=1e-6)
        if block == mjcf:
            np.testing.assert_allclose(scope["data"].body("lid").xpos, lid[:3, 3], atol=1e-6)


def test_the_page_tells_of_every_format():
    for name, format in FORMATS.items():
        assert re.search(rf"^\| `{name}` \| `\w+{re.escape(format.suffix)}` \|", PAGE, re.MULTILINE)
