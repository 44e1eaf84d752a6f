"""`r2art doctor` finds a sound installation sound, and tells what is wrong with another."""

import json
from dataclasses import replace

import numpy as np
import pytest
from commands import run

from r2art.core.errors import R2ArtError
from r2art.run import predictor, selftest
from r2art.run.export.mechanism import joint_motion
from r2art.run.installation import extras, requirement, versions


@pytest.fixture
def stored(tmp_path, monkeypatch):
    """Replaces what the package has stored; call it with what to change."""

    def change(**changes):
        file = tmp_path / "selftest.json"
        data = json.loads(selftest.STORED.read_text())
        file.write_text(json.dumps(data | changes))
        monkeypatch.setattr(selftest, "STORED", file)

    return change


def test_what_is_shipped_is_sound(capsys):
    """If the model has just been replaced: `python -m r2art.run.selftest`."""
    assert run("doctor") == 0
    out, err = capsys.readouterr()
    assert err == ""
    for word in ("onnxruntime", "python", "extra train", "as released", "self-test"):
        assert word in out


def test_as_json_it_says_the_same(capsys):
    assert run("doctor", "--json") == 0
    report = json.loads(capsys.readouterr().out)
    assert report["versions"] == versions()
    assert report["extras"] == extras()
    assert report["model"]["as_released"] is True
    assert report["self_test"]["passed"] is True
    assert report["faults"] == []


def test_another_model_is_noticed(stored, capsys):
    stored(model_sha256="0" * 64)
    assert run("doctor") == 1
    out, err = capsys.readouterr()
    assert "python -m r2art.run.selftest" in err
    assert "passed" in out


def test_another_prediction_is_noticed(stored, capsys):
    prediction = selftest.expected().prediction
    stored(prediction=prediction.scaled(1.1, "size").to_dict())
    assert run("doctor", "--json") == 1
    out, err = capsys.readouterr()
    assert json.loads(out)["self_test"]["passed"] is False
    assert len(json.loads(out)["faults"]) == 1
    assert "self-test" in err


def test_a_damaged_model_is_a_fault_and_no_crash(tmp_path, monkeypatch, capsys):
    for content in (b"no model", None):
        file = tmp_path / "r2art.onnx"
        file.unlink(missing_ok=True)
        if content is not None:
            file.write_bytes(content)
        for module in (predictor, selftest):
            monkeypatch.setattr(module, "SHIPPED_MODEL", file)
        assert run("doctor", "--json") == 1
        out, err = capsys.readouterr()
        assert str(file) in " ".join(json.loads(out)["faults"])
        assert "error: " in err


def test_damaged_memory_of_the_release_is_a_fault(stored, capsys):
    stored(prediction={})
    assert run("doctor") == 1
    assert "selftest.json" in capsys.readouterr().err


def test_what_is_recorded_is_what_is_stored(tmp_path, monkeypatch):
    before = selftest.expected()
    monkeypatch.setattr(selftest, "STORED", tmp_path / "new.json")
    assert selftest.record() == tmp_path / "new.json"
    after = selftest.expected()
    assert after.model_sha256 == before.model_sha256
    assert selftest.difference(after.prediction, before.prediction).is_small


def test_differences_are_measured():
    wanted = selftest.expected().prediction
    same = selftest.difference(wanted, wanted)
    assert max(same.rotation, same.joint, same.length) < 1e-6
    assert same.is_small
    turned = []
    for part in wanted.parts:
        turn = joint_motion("revolute", np.array([0, 0.6, 0.8]), part.cam_T_part[:3, 3], 0.02)
        turned.append(replace(part, cam_T_part=turn @ part.cam_T_part))
    found = selftest.difference(replace(wanted, parts=tuple(turned)), wanted)
    assert found.rotation == pytest.approx(0.02, abs=1e-6)
    assert found.length < 1e-6
    assert not found.is_small
    opened = tuple(replace(joint, state=joint.state + 0.03) for joint in wanted.joints)
    found = selftest.difference(replace(wanted, joints=opened), wanted)
    assert found.joint == pytest.approx(0.03)
    assert not found.is_small
    far = selftest.difference(wanted.scaled(1.02, "size"), wanted)
    assert far.length == pytest.approx(0.02, abs=2e-3)
    assert not far.is_small
    other = replace(wanted, category="drawer")
    assert not selftest.difference(other, wanted).is_small


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("numpy>=1.26", ("numpy", None)),
        ("torch>=2.10; extra == 'train'", ("torch", "train")),
        ('mkdocstrings[python]>=0.27 ; extra == "docs"', ("mkdocstrings", "docs")),
        ("x.y-z (>=1) ; python_version < '3.12' and extra == 'a-b'", ("x.y-z", "a-b")),
        ("tomli; python_version < '3.11'", ("tomli", None)),
    ],
)
def test_requirements_are_read_as_metadata_writes_them(text, expected):
    assert requirement(text) == expected


def test_the_error_of_a_missing_release_file_is_one_users_see(tmp_path, monkeypatch):
    monkeypatch.setattr(selftest, "STORED", tmp_path / "none.json")
    with pytest.raises(R2ArtError, match="reinstall"):
        selftest.expected()
