"""Datasets are functions of their arguments, whatever happens to the process that makes them."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from r2art.core.errors import InputError, UsageError
from r2art.data import objects, shards, synth
from r2art.data.objects import SPLITS, Procedural, instance_seed
from r2art.data.surroundings import read_picture
from r2art.data.synth import Synth, synthesise

PER_SHARD, PRIOR_OF = 4, 2
JOB = Synth(
    objects=Procedural("laptop"),
    n=22,
    seed=5,
    split="train",
    size=32,
    backgrounds=None,
    out=Path("unused"),
    workers=1,
)


@pytest.fixture
def small_shards(monkeypatch):
    monkeypatch.setattr(synth, "SHARD_SIZE", PER_SHARD)
    monkeypatch.setattr(objects, "PRIOR_INSTANCES", PRIOR_OF)


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def encoded(job: Synth, index: int) -> dict:
    return shards.to_row(index, synthesise(job, index))


RUN = f"""
import sys
from pathlib import Path
from r2art.data import objects, synth

if __name__ == "__main__":
    synth.SHARD_SIZE, objects.PRIOR_INSTANCES = {PER_SHARD}, {PRIOR_OF}
    synth.synth(synth.Synth(
        objects=objects.Procedural("laptop"), n={JOB.n}, seed={JOB.seed}, split={JOB.split!r},
        size={JOB.size}, backgrounds=None, out=Path(sys.argv[1]), workers=1,
    ))
"""


def test_a_killed_run_started_again_leaves_the_files_of_an_undisturbed_one(
    tmp_path, small_shards, capfd
):
    job, script = replace(JOB, out=tmp_path / "killed"), tmp_path / "run.py"
    script.write_text(RUN)
    process = subprocess.Popen(
        [sys.executable, script, job.out], stderr=subprocess.DEVNULL, start_new_session=True
    )
    try:
        while not shards.shard_path(job.out, 0).exists():
            assert process.poll() is None
            time.sleep(0.005)
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    done = set(job.out.glob("shard-*.parquet"))
    assert 1 <= len(done) < 6  # it was killed in the middle
    # ... of writing the last shard, say.
    last = shards.shard_path(job.out, 5)
    last.with_name(last.name + ".part").write_bytes(b"PAR1 torn")
    synth.synth(job)

    whole = replace(job, out=tmp_path / "whole")
    synth._prepare(whole)
    for number in range(6):
        block = range(PER_SHARD * number, min(JOB.n, PER_SHARD * (number + 1)))
        shards.write_shard(shards.shard_path(whole.out, number), [encoded(job, i) for i in block])
    assert contents(job.out) == contents(whole.out)

    before = {path: path.stat().st_mtime_ns for path in job.out.glob("shard-*")}
    synth.synth(job)  # nothing is missing: nothing is touched
    assert before == {path: path.stat().st_mtime_ns for path in job.out.glob("shard-*")}
    assert len(shards.Dataset.open(job.out)) == JOB.n
    assert capfd.readouterr().out == ""  # progress belongs on stderr


def test_a_sample_depends_on_its_index_and_the_job_alone():
    third = encoded(JOB, 3)
    encoded(JOB, 1)
    assert encoded(JOB, 3) == third
    others = (
        replace(JOB, seed=6),
        replace(JOB, split="val"),
        replace(JOB, objects=Procedural("drawer")),
    )
    images = {encoded(job, 3)["image"] for job in others}
    assert len(images | {third["image"], encoded(JOB, 4)["image"]}) == 5


def test_no_object_is_in_two_splits_whatever_the_seeds():
    seeds = [
        instance_seed(category, split, seed, index)
        for category in ("laptop", "drawer")
        for split in SPLITS
        for seed in (0, 1, 7)
        for index in range(1000)
    ]
    assert len(set(seeds)) == len(seeds)
    assert min(seeds) >= 0


def test_two_datasets_do_not_mix(tmp_path, small_shards):
    job = replace(JOB, out=tmp_path)
    synth._prepare(job)
    before = contents(tmp_path)
    for other, odd in [
        (replace(job, seed=6), "seed"),
        (replace(job, split="test"), "split"),
        (replace(job, n=23), "n"),
        (replace(job, size=48), "size"),
        (replace(job, objects=Procedural("drawer")), "category"),
    ]:
        with pytest.raises(InputError, match=rf"another dataset \(differs in {odd}\)"):
            synth.synth(other)
    assert contents(tmp_path) == before
    synth._prepare(replace(job, workers=3))  # the number of workers decides nothing


def test_a_folder_that_cannot_be_written_gives_one_clear_error(tmp_path, small_shards):
    (tmp_path / "file").write_text("no folder")
    for out in (tmp_path / "file", tmp_path / "file" / "sub"):
        with pytest.raises(InputError, match=r"cannot write to .*file.*choose another --out"):
            synth.synth(replace(JOB, out=out))


def test_missing_backgrounds_are_told_before_anything_is_written(tmp_path):
    job = replace(JOB, out=tmp_path / "out", backgrounds=tmp_path / "none")
    with pytest.raises(InputError, match=r"backgrounds folder .*none does not exist"):
        synth.synth(job)
    assert not job.out.exists()


def test_a_damaged_background_is_named(tmp_path):
    (tmp_path / "bad.jpg").write_bytes(b"not a picture")
    with pytest.raises(InputError, match=r"cannot read the background .*bad\.jpg"):
        read_picture(tmp_path / "bad.jpg")


def test_backgrounds_are_seen(tmp_path):
    Image.fromarray(np.full((40, 40, 3), (255, 0, 255), np.uint8)).save(tmp_path / "pink.png")
    job = replace(JOB, backgrounds=tmp_path)
    pink = 0
    for index in range(8):
        r, g, b = np.moveaxis(synthesise(job, index).image.astype(int), -1, 0)
        pink += np.count_nonzero((r > 240) & (g < 20) & (b > 240))
    assert pink > 300


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"n": 0}, "n >= 1"),
        ({"size": 16}, "32 <= size"),
    ],
)
def test_arguments_that_cannot_be_meant_are_refused(change, message):
    with pytest.raises(UsageError, match=message):
        replace(JOB, **change)


def test_an_unknown_category_is_refused_with_those_that_are_known():
    with pytest.raises(UsageError, match="no category 'toaster' .* known: .*drawer, .*laptop"):
        Procedural("toaster")


def test_the_manifest_says_what_the_dataset_is(tmp_path, small_shards):
    synth._prepare(replace(JOB, out=tmp_path))
    manifest = json.loads((tmp_path / shards.MANIFEST).read_text())
    for name in ("category", "n", "seed", "split", "size"):
        assert manifest[name] == getattr(JOB, name)
    assert manifest["shards"] == 6
