"""`r2art data`: what its commands print and write, and their exit codes."""

import hashlib
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from r2art import cli
from r2art.data import objects, prior, shards
from r2art.data import synth as synthesis
from r2art.data.objects import Procedural
from r2art.data.shards import Dataset
from r2art.data.synth import Synth, synth

N = 3


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """A dataset; not to be changed."""
    folder = tmp_path_factory.mktemp("made") / "laptops"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(objects, "PRIOR_INSTANCES", 8)
        patch.setattr(prior, "_VIEWS", 8)
        job = Synth(
            objects=Procedural("laptop"),
            n=N,
            seed=1,
            split="test",
            size=64,
            backgrounds=None,
            out=folder,
            workers=1,
        )
        synth(job)
    return folder


@pytest.fixture
def damaged(made, tmp_path) -> Path:
    """The same, the pose in its second row of NaN, without hashes."""
    shutil.copytree(made, folder := tmp_path / "damaged")
    (folder / "SHA256SUMS").unlink()
    rows = list(Dataset.open(folder).rows())
    rows[1]["cam_T_part"][0] = np.nan
    shards.write_shard(shards.shard_path(folder, 0), rows)
    return folder


def run(*arguments: object) -> int | str | None:
    try:
        return cli.main(["data", *map(str, arguments)])
    except SystemExit as stopped:
        return stopped.code


def test_show_draws_a_sheet_of_the_samples_asked_for(made, tmp_path, capsys):
    out = tmp_path / "sheet.png"
    assert run("show", made, "--index", 0, 2, "--tile", 100, "--out", out) == 0
    with Image.open(out) as sheet:
        assert sheet.width == 200
    assert str(out) in capsys.readouterr().err


def test_show_prints_labels_as_json(made, capsys):
    assert run("show", made, "-n", 2, "--json") == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [line["category"]["name"] for line in lines] == ["laptop", "laptop"]


def test_show_draws_the_others_where_one_is_broken(damaged, tmp_path, capsys):
    out = tmp_path / "sheet.png"
    assert run("show", damaged, "--tile", 100, "--out", out) == 3
    assert out.exists()
    assert "error: " in capsys.readouterr().err


def test_check_tells_nothing_of_a_sound_dataset_and_names_what_is_damaged(made, damaged, capsys):
    assert run("check", made) == 0
    assert "3 samples, no fault" in capsys.readouterr().out
    assert run("check", damaged) == 1
    assert "row 1: cam_T_part" in capsys.readouterr().out
    assert run("check", damaged, "--json") == 1
    told = json.loads(capsys.readouterr().out)
    assert told["samples"] == N
    assert [fault["field"] for fault in told["faults"]] == ["cam_T_part"]


def test_a_conversion_is_the_same_dataset_and_goes_on_where_it_was(made, tmp_path, capsys):
    out = tmp_path / "copy"
    assert run("convert", made, "--out", out) == 0
    sums = (out / "SHA256SUMS").read_bytes()
    shards.shard_path(out, 0).unlink()
    (out / "SHA256SUMS").unlink()
    assert run("convert", made, "--out", out) == 0
    assert (out / "SHA256SUMS").read_bytes() == sums
    before, after = Dataset.open(made), Dataset.open(out)
    for index in range(N):
        np.testing.assert_array_equal(after[index].cam_T_part, before[index].cam_T_part)
        np.testing.assert_array_equal(after[index].mask, before[index].mask)
    assert run("check", out) == 0
    capsys.readouterr()


def test_bop_writes_the_dataset_s_own_split(made, tmp_path):
    assert run("bop", made, "-n", 1, "--out", tmp_path / "bop") == 0
    assert (tmp_path / "bop" / "test" / "000000" / "scene_gt.json").exists()


def test_hash_is_one_number_for_the_whole(made, tmp_path, capsys):
    shutil.copytree(made, folder := tmp_path / "copy")
    assert run("hash", folder) == 0
    whole = capsys.readouterr().out.strip()
    assert whole == hashlib.sha256((folder / "SHA256SUMS").read_bytes()).hexdigest()
    assert (folder / "SHA256SUMS").read_bytes() == (made / "SHA256SUMS").read_bytes()


def test_synth_says_what_is_there_and_what_is_missing(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(objects, "PRIOR_INSTANCES", 2)
    monkeypatch.setattr(prior, "_VIEWS", 2)
    monkeypatch.setattr(synthesis, "SHARD_SIZE", 1)
    out = tmp_path / "data"
    command = ["synth", "laptop", "-n", 2, "--size", 32, "--workers", 1, "--out", out, "--shard"]
    assert cli.main([*map(str, command), "2/2"]) == 0
    assert "its share; 1 of 2 shards are still missing" in capsys.readouterr().err
    assert cli.main([*map(str, command), "1/2"]) == 0
    assert "(2 photos of laptop)" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (["show", "nothing"], 3, "there is no folder nothing"),
        (["show", "empty"], 3, "is no dataset that r2art knows"),
        (["show", "DATA", "--index", "3"], 2, "samples 0 to 2, not 3"),
        (["show", "DATA", "-n", "0"], 2, "-n of at least 1"),
        (["show", "DATA", "--tile", "9"], 2, "--tile must be 64 to 4096"),
        (["show", "DATA", "--category", "drawer"], 3, "is of category laptop, not drawer"),
        (["show", "DATA", "--split", "train"], 3, "is of split test, not train"),
        (["show", "DATA", "--out", "gone/sheet.png"], 3, "cannot write gone/sheet.png"),
        (["check", "DATA", "--tolerance", "0"], 2, "--tolerance must lie between 0 and 1"),
        (["check", "DATA", "--category", "drawer"], 3, "is of category laptop, not drawer"),
        (["convert", "DATA", "-n", "0", "--out", "x"], 2, "-n of at least 1"),
        (["convert", "DATA", "--out", "DATA"], 3, "already holds another dataset"),
        (["bop", "DATA", "--out", "DATA"], 2, "is not empty"),
        (["hash", "empty"], 3, "holds no manifest.json"),
        (["draw", "DATA"], 2, "no command 'draw' in `r2art data`"),
    ],
)  # fmt: skip
def test_mistakes_are_one_line(made, tmp_path, monkeypatch, capsys, arguments, code, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    assert run(*(str(made) if a == "DATA" else a for a in arguments)) == code
    err = capsys.readouterr().err
    assert says in err
    assert err.count("\n") == 1
