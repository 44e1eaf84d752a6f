"""`r2art convert`: many predictions in, files of other programs out."""

import csv
import io
import json
from dataclasses import replace

import mujoco
import numpy as np
import pytest
import trimesh
import yourdfpy
from commands import run

from r2art.core.camera import Camera
from r2art.core.prediction import JointEstimate, PartEstimate, Prediction
from r2art.run.export import FORMATS
from r2art.run.export.rotations import quaternion


def chest(path):
    """A chest with a lid, half open, seen in a photo."""
    cam_T_chest, chest_T_lid = np.diag([1.0, -1, -1, 1]), np.eye(4)
    cam_T_chest[:3, 3] = 0.1, 0.2, 1.5
    chest_T_lid[1:3, 1:3] = [[0, 1], [-1, 0]]
    parts = [
        PartEstimate(
            name=name,
            cam_T_part=pose,
            box_center=np.zeros(3),
            box_size=np.array([0.3, 0.2, 0.1]),
            confidence=0.75,
        )
        for name, pose in (("chest", cam_T_chest), ("lid", cam_T_chest @ chest_T_lid))
    ]
    joint = JointEstimate(
        name="hinge",
        kind="revolute",
        parent="chest",
        child="lid",
        state=np.pi / 2,
        limits=(0.0, 3.0),
        axis=np.array([-1.0, 0, 0]),
        pivot=cam_T_chest[:3, 3],
    )
    return Prediction(
        image_path=path,
        category="chest",
        category_score=None,
        box=(0.0, 0.0, 10.0, 10.0),
        camera=Camera(500, 500, 320, 240, 640, 480),
        camera_source="given",
        parts=tuple(parts),
        joints=(joint,),
    )


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A working folder with two predictions and a clip of three, one line of which is empty."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").mkdir()
    for name in ("a", "b"):
        text = chest(f"photos/{name}.jpg").to_json(indent=2)
        (tmp_path / "out" / f"{name}.json").write_text(text)
    lines = [chest(f"{i}.png").to_dict() for i in range(3)]
    frames = [{"frame_index": i, "prediction": line} for i, line in enumerate(lines)]
    frames[1]["prediction"] = None
    (tmp_path / "clip.jsonl").write_text("\n".join(map(json.dumps, frames)) + "\n")
    return tmp_path


def files(folder):
    return sorted(p.name for p in folder.iterdir())


def test_every_format_loads_where_it_is_meant_for(folder):
    assert run("convert", "out", *(w for f in FORMATS for w in ("--to", f)), "--out", "new") == 0
    singles = [f.suffix for f in FORMATS.values() if f.encode_all is None]
    tables = [f.suffix for f in FORMATS.values() if f.encode_all is not None]
    assert len(singles) + len(tables) == len(FORMATS) == 6
    expected = [f"{name}{suffix}" for name in "ab" for suffix in singles]
    assert files(folder / "new") == sorted([*expected, *(f"predictions{s}" for s in tables)])
    lid = chest("").part("lid").cam_T_part
    robot = yourdfpy.URDF.load(str(folder / "new" / "a.urdf"))
    robot.update_cfg({"hinge": np.pi / 2})
    np.testing.assert_allclose(robot.get_transform("lid", "opencv_camera"), lid, atol=1e-9)
    model = mujoco.MjModel.from_xml_path(str(folder / "new" / "a.mjcf.xml"))
    np.testing.assert_allclose(model.key("photo").qpos, [np.pi / 2])
    scene = trimesh.load_scene(folder / "new" / "a.glb")
    np.testing.assert_allclose(scene.graph["lid"][0], np.diag([1, -1, -1, 1]) @ lid, atol=1e-6)
    again = Prediction.from_json((folder / "new" / "a.json").read_text())
    assert again.to_dict() == chest("photos/a.jpg").to_dict()


def test_a_table_holds_a_row_for_each_part_of_each_photo(folder):
    assert run("convert", "out/*.json", "--to", "csv", "--to", "bop", "--out", "new") == 0
    rows = list(csv.DictReader(io.StringIO((folder / "new" / "predictions.csv").read_text())))
    assert [(r["image"], r["part"], r["joint"]) for r in rows] == [
        (f"photos/{name}.jpg", *moved)
        for name in "ab"
        for moved in (("chest", ""), ("lid", "hinge"))
    ]
    truth = chest("").part("lid").cam_T_part
    q = [float(rows[1][f"q{c}"]) for c in "wxyz"]
    np.testing.assert_allclose(q, quaternion(truth[:3, :3]), atol=1e-12)
    np.testing.assert_allclose([float(rows[1][f"{c}_m"]) for c in "xyz"], truth[:3, 3])
    assert (float(rows[1]["state"]), rows[1]["unit"]) == (np.pi / 2, "rad")
    assert {rows[0][c] for c in ("state", "unit", "pivot_z_m", "category_score")} == {""}
    rows = list(csv.DictReader(io.StringIO((folder / "new" / "predictions.bop.csv").read_text())))
    numbers = [(r["scene_id"], r["im_id"], r["obj_id"]) for r in rows]
    assert numbers == [("0", "0", "1"), ("0", "0", "2"), ("0", "1", "1"), ("0", "1", "2")]
    R, t = (np.array(rows[3][k].split(), float) for k in "Rt")
    np.testing.assert_allclose(R.reshape(3, 3), truth[:3, :3], atol=1e-9)
    np.testing.assert_allclose(t, 1000 * truth[:3, 3], atol=1e-6)


def test_a_clip_becomes_a_file_for_each_frame_that_shows_the_object(folder, capsys):
    assert run("convert", "clip.jsonl", "--to", "json", "--to", "csv", "--out", "new") == 0
    assert files(folder / "new") == ["clip-000000.json", "clip-000001.json", "predictions.csv"]
    last = Prediction.from_json((folder / "new" / "clip-000001.json").read_text())
    assert last.image_path == "2.png"
    assert "(2 files)" in capsys.readouterr().err


def test_no_frame_of_a_clip_takes_the_name_of_another_prediction(folder):
    (folder / "CLIP-000001.json").write_text(chest("single.jpg").to_json())
    names = ("clip.jsonl", "CLIP-000001.json")
    assert run("convert", *names, "--to", "json", "--out", "new") == 0
    images = {
        p.stem: Prediction.from_json(p.read_text()).image_path for p in (folder / "new").iterdir()
    }
    expected = {"clip-000000": "0.png", "clip-000001-2": "2.png", "CLIP-000001": "single.jpg"}
    assert images == expected


def test_what_is_broken_is_told_in_one_line_and_does_not_stop_the_others(folder, capsys):
    (folder / "out" / "a.json").write_text("{}")
    (folder / "out" / "photo.json").write_bytes(b"\x89PNG\r\n")
    (folder / "out" / "empty.json").touch()
    assert run("convert", "out", "missing.json", "none/*.json", "--to", "urdf", "--out", "new") == 3
    assert files(folder / "new") == ["b.urdf"]
    errors = [e for e in capsys.readouterr().err.splitlines() if e.startswith("error: ")]
    assert len(errors) == 5
    for name in ("a.json", "photo.json", "empty.json", "missing.json", "none/*.json"):
        assert sum(name in error for error in errors) == 1
    assert any("`schema` is missing" in error for error in errors)


def test_a_rejected_photo_is_converted_and_said_to_be_one(folder, capsys):
    doubtful = replace(chest("a.jpg"), rejected="the photo is blank")
    (folder / "out" / "a.json").write_text(doubtful.to_json())
    assert run("convert", "out", "--to", "csv", "--out", "new") == 0
    (told,) = (e for e in capsys.readouterr().err.splitlines() if e.startswith("rejected: "))
    assert "the photo is blank" in told
    rows = csv.DictReader(io.StringIO((folder / "new" / "predictions.csv").read_text()))
    assert [r["rejected"] for r in rows] == ["the photo is blank"] * 2 + [""] * 2


@pytest.mark.parametrize("options", [[], ["--to", "step"], ["--to", "urdf", "--to", "step"]])
def test_an_unknown_format_is_refused_before_anything_is_written(folder, capsys, options):
    assert run("convert", "out", *options, "--out", "new") == 2
    assert "urdf" in capsys.readouterr().err
    assert not (folder / "new").exists()


def test_the_help_names_every_format(capsys):
    assert run("convert", "--help") == 0
    help_text = capsys.readouterr().out
    for name in FORMATS:
        assert f"{name}: " in help_text
