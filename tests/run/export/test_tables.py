"""Tables hold the numbers of the prediction."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2art.run.export import FORMATS
from r2art.run.export.rotations import quaternion, roll_pitch_yaw


def rows(name, *predictions):
    text = FORMATS[name].encode_all(predictions).decode()
    return list(csv.DictReader(io.StringIO(text)))


def test_quaternions_and_angles_are_those_of_scipy(rng):
    half_turns = [np.diag(d) for d in ([1.0, -1, -1], [-1.0, 1, -1], [-1.0, -1, 1])]
    near = Rotation.from_rotvec(1e-9 * rng.normal(size=3)).as_matrix()
    for R in (Rotation.random(rng=rng).as_matrix(), np.eye(3), near, *half_turns):
        q, angles = quaternion(R), roll_pitch_yaw(R)
        assert q[0] >= 0
        np.testing.assert_allclose(Rotation.from_quat(np.roll(q, -1)).as_matrix(), R, atol=1e-12)
        np.testing.assert_allclose(Rotation.from_euler("xyz", angles).as_matrix(), R, atol=1e-12)


def test_the_csv_is_the_prediction_number_by_number(prediction):
    found = rows("csv", prediction)
    assert [r["part"] for r in found] == [p.name for p in prediction.parts]
    assert [r["joint"] for r in found] == ["", *(j.name for j in prediction.joints)]
    for row, part in zip(found, prediction.parts, strict=True):
        pose = np.eye(4)
        pose[:3, 3] = [float(row[f"{c}_m"]) for c in "xyz"]
        quat = [float(row[f"q{c}"]) for c in "xyzw"]
        pose[:3, :3] = Rotation.from_quat(quat).as_matrix()
        np.testing.assert_allclose(pose, part.cam_T_part, atol=1e-12)
        size = [float(row[f"box_size_{c}_m"]) for c in "xyz"]
        np.testing.assert_array_equal(size, part.box_size)
        assert float(row["confidence"]) == part.confidence
    for row, joint in zip(found[1:], prediction.joints, strict=True):
        assert (row["parent"], row["part"], row["kind"]) == (joint.parent, joint.child, joint.kind)
        assert row["unit"] == {"revolute": "rad", "prismatic": "m"}[joint.kind]
        numbers = [float(row[c]) for c in ("state", "lower", "upper")]
        assert numbers == [joint.state, *joint.limits]
        np.testing.assert_array_equal([float(row[f"axis_{c}"]) for c in "xyz"], joint.axis)
        np.testing.assert_array_equal([float(row[f"pivot_{c}_m"]) for c in "xyz"], joint.pivot)


@pytest.mark.parametrize("folder", ["rgb", "gray"])
def test_photos_of_a_bop_dataset_keep_their_numbers(prediction, folder):
    first = replace(prediction, image_path=f"data/test/000003/{folder}/000012.png")
    second = replace(prediction, image_path=f"test/000001/{folder}/000000.jpg")
    found = rows("bop", first, second)
    expected = [(s, i, k + 1) for s, i in ((3, 12), (1, 0)) for k in range(len(prediction.parts))]
    assert [tuple(int(r[c]) for c in ("scene_id", "im_id", "obj_id")) for r in found] == expected
    elsewhere = replace(prediction, image_path=None)
    assert {(r["scene_id"], r["im_id"]) for r in rows("bop", first, elsewhere)} == {
        ("0", "0"),
        ("0", "1"),
    }
    for row, part in zip(found, prediction.parts, strict=False):
        R, t = (np.array(row[key].split(), float) for key in "Rt")
        np.testing.assert_allclose(R.reshape(3, 3), part.cam_T_part[:3, :3], atol=1e-8)
        np.testing.assert_allclose(t, 1000 * part.cam_T_part[:3, 3], atol=1e-5)
        assert float(row["time"]) == -1
