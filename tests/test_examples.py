"""Every example runs as it stands, is short, and does what it says."""

import json
import runpy
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import r2art
from r2art.data.shards import Dataset

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))
LONGEST = 60


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def example(name):
    """What an example defines."""
    return runpy.run_path(str(EXAMPLES / f"{name}.py"))


def test_there_are_six_and_they_are_short():
    assert [p.name[:2] for p in SCRIPTS] == ["01", "02", "03", "04", "05", "06"]
    for path in SCRIPTS:
        assert len(path.read_text(encoding="utf-8").splitlines()) <= LONGEST, path.name


def test_01_writes_what_it_says(capsys):
    example("01_predict_and_draw")["main"]([])
    for name in ("laptop", "drawer"):
        with Image.open(f"r2art_out/{name}.overlay.png") as overlay:
            overlay.verify()
        text = Path(f"r2art_out/{name}.json").read_text(encoding="utf-8")
        assert r2art.Prediction.from_json(text).category == name
        assert Path(f"r2art_out/{name}.glb").read_bytes()[:4] == b"glTF"
    assert "lid" in capsys.readouterr().out


def test_02_tells_what_each_piece_of_knowledge_changes(capsys):
    example("02_your_camera_and_size")["main"]()
    lines = capsys.readouterr().out.splitlines()
    assert [line.split("(camera ")[1].split(",")[0] for line in lines] == [
        "guessed",
        "exif",
        "given",
        "given",
        "given",
        "given",
    ]
    assert "width 31.0 cm" in lines[4]
    assert "distance 0.800 m" in lines[5]


def test_03_the_hand_goes_as_far_as_the_joint_and_never_turns(capsys):
    parts = example("03_where_to_grasp")
    parts["main"](EXAMPLES / "drawer.png")
    assert len(capsys.readouterr().out.splitlines()) >= 6
    prediction = r2art.load().predict(EXAMPLES / "drawer.png", category="drawer")
    base_T_cam = parts["BASE_T_CAM"]
    np.testing.assert_allclose(base_T_cam[:3, :3] @ base_T_cam[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(base_T_cam) == pytest.approx(1)
    for joint in prediction.joints:
        shut, wide = (parts["grip"](prediction, joint, state) for state in (0.0, 0.2))
        assert np.linalg.norm(wide[:3, 3] - shut[:3, 3]) == pytest.approx(0.2, abs=1e-6)
        np.testing.assert_allclose(wide[:3, :3], shut[:3, :3], atol=1e-6)
        now = parts["grip"](prediction, joint, joint.state)[:3, 3]
        front = prediction.part(joint.child).corners()[:, :, 1].mean(axis=(0, 1))
        np.testing.assert_allclose(now, front, atol=1e-6)


def test_04_follows_the_object_through_all_frames(capsys):
    parts = example("04_follow_a_clip")
    parts["main"](None)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == parts["COUNT"]
    assert all("tracked" in line for line in lines)
    assert Path("r2art_out/last_frame.png").is_file()


def test_05_makes_photos_and_draws_their_labels(capsys):
    example("05_render_a_dataset")["main"]("laptop")
    dataset = Dataset.open(Path("r2art_out/laptop-val"))
    assert len(dataset) == 6
    assert len(capsys.readouterr().out.splitlines()) == 6
    with Image.open("r2art_out/laptop-labels.png") as picture:
        assert min(picture.size) > 400


def test_06_trains_exports_and_predicts(capsys):
    example("06_train_and_export")["main"](1)
    assert r2art.load("r2art_out/drawers.onnx").categories == ("drawer_single",)
    assert "drawer_single: open by" in capsys.readouterr().out


def test_the_notebook_runs_and_holds_no_old_results(monkeypatch):
    monkeypatch.chdir(EXAMPLES)
    notebook = json.loads((EXAMPLES / "quick_start.ipynb").read_text(encoding="utf-8"))
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert len(cells) >= 5
    assert not any(cell["outputs"] for cell in cells)
    scope = {}
    for cell in cells:
        exec(compile("".join(cell["source"]), "quick_start.ipynb", "exec"), scope)
    assert scope["prediction"].category == "laptop"
    assert scope["guessed"].camera_source == "guessed"
