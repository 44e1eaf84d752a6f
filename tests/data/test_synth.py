"""Datasets are functions of their arguments, whatever happens to the process that makes them."""

import json
import os
import re
import shutil
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
from r2art.data import filling, objects, prior, shards, synth
from r2art.data.filling import Share
from r2art.data.hashes import SUMS
from r2art.data.objects import SPLITS, Procedural, instance_seed
from r2art.data.scenes.surroundings import read_picture
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
    monkeypatch.setattr(prior, "_VIEWS", PRIOR_OF)


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def encoded(job: Synth, index: int) -> dict:
    return shards.to_row(index, synthesise(job, index))


def prepare(job: Synth) -> None:
    filling.prepare(job.out, synth._manifest(job), job.objects.prior)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The files of a run that nothing disturbed."""
    job = replace(JOB, out=tmp_path_factory.mktemp("whole"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(synth, "SHARD_SIZE", PER_SHARD)
        patch.setattr(objects, "PRIOR_INSTANCES", PRIOR_OF)
        patch.setattr(prior, "_VIEWS", PRIOR_OF)
        synth.synth(job)
    return contents(job.out)


RUN = f"""
import os, signal, sys
from pathlib import Path
from r2art.data import objects, prior, synth

synth.SHARD_SIZE, objects.PRIOR_INSTANCES, prior._VIEWS = {PER_SHARD}, {PRIOR_OF}, {PRIOR_OF}

def run(workers):
    synth.synth(synth.Synth(
        objects=objects.Procedural("laptop"), n={JOB.n}, seed={JOB.seed}, split={JOB.split!r},
        size={JOB.size}, backgrounds=None, out=Path(sys.argv[1]), workers=workers,
    ))
"""


def test_a_run_killed_among_its_workers_goes_on_where_it_was(tmp_path, small_shards, whole, capfd):
    job, script = replace(JOB, out=tmp_path / "killed"), tmp_path / "run.py"
    script.write_text(RUN + "if __name__ == '__main__': run(2)")
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
    synth.synth(job)
    assert contents(job.out) == whole

    before = {path: path.stat().st_mtime_ns for path in job.out.iterdir()}
    synth.synth(job)  # nothing is missing: nothing is touched
    assert before == {path: path.stat().st_mtime_ns for path in job.out.iterdir()}
    assert len(shards.Dataset.open(job.out)) == JOB.n
    assert capfd.readouterr().out == ""  # progress belongs on stderr


KILLS = """
def die_at(moment, torn):
    # Be killed before a file gets its content to disk, or its name.
    calls = iter(range(1000))
    def deadly(real):
        def call(*args):
            if next(calls) == moment:
                if torn:
                    os.ftruncate(*args, 100)
                os.kill(os.getpid(), signal.SIGKILL)
            return real(*args)
        return call
    os.fsync, os.replace = deadly(os.fsync), deadly(os.replace)

MOMENTS = [(0, 1), (0, 0), (1, 0), (2, 0), (3, 0), (2, 1), (5, 0), (7, 0)]
for moment, torn in MOMENTS:
    if (child := os.fork()) == 0:
        die_at(moment, torn)
        run(1)
        os._exit(0)
    assert os.WTERMSIG(os.waitpid(child, 0)[1]) == signal.SIGKILL
    print(*sorted(p.name for p in Path(sys.argv[1]).iterdir()), flush=True)
"""


def test_a_run_killed_at_any_moment_of_writing_leaves_nothing_broken(tmp_path, small_shards, whole):
    job, script = replace(JOB, out=tmp_path / "killed"), tmp_path / "run.py"
    script.write_text(RUN + KILLS)
    done = subprocess.run([sys.executable, script, job.out], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    left = [line.split() for line in done.stdout.splitlines()]
    assert len(left) == 8
    kept = [[name for name in names if not name.endswith(".part")] for names in left]
    assert kept[0] == []  # killed before anything was there, ...
    assert any(".parquet." in name for name in left[5])  # ... while writing a shard, ...
    assert sorted(kept[-1]) == sorted(set(whole) - {SUMS})  # ... and when all was there but this
    for names in kept:
        assert all(whole[name] == (job.out / name).read_bytes() for name in names)
    synth.synth(job)
    assert contents(job.out) == whole


def test_shares_made_apart_are_the_same_files(tmp_path, small_shards, whole):
    for number in (3, 1, 2):
        synth.synth(replace(JOB, out=tmp_path / str(number), share=Share(number, 3)))
        made = contents(tmp_path / str(number))
        assert sum(name.startswith("shard") for name in made) == 2
        assert made.items() <= whole.items()
        assert SUMS not in made
        shutil.copytree(tmp_path / str(number), tmp_path / "all", dirs_exist_ok=True)
    filling.write_hashes(tmp_path / "all")
    assert contents(tmp_path / "all") == whole

    together = replace(JOB, out=tmp_path / "together")
    for number in (1, 2):
        synth.synth(replace(together, share=Share(number, 2)))
    assert contents(together.out) == whole


def test_workers_change_no_byte(tmp_path, small_shards, whole):
    synth.synth(replace(JOB, out=tmp_path, workers=4))
    assert contents(tmp_path) == whole


@pytest.mark.parametrize("text", ["0/3", "4/3", "1/0", "1", "1/", "a/b", "-1/2", "1/2/3", "½/1"])
def test_shares_that_cannot_be_meant_are_refused(text):
    with pytest.raises(UsageError, match="I/N"):
        Share.parse(text)


def test_a_full_disk_gives_one_line_and_leaves_nothing_broken(tmp_path):
    script = (
        "import resource, sys; from r2art.data import objects, prior; from r2art.cli import main; "
        "objects.PRIOR_INSTANCES = prior._VIEWS = 2; limit = int(sys.argv.pop()); "
        "resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)); sys.exit(main())"
    )
    arguments = ["synth", "laptop", "-n", "4", "--size", "160", "--workers", "1"]

    def run(limit: int) -> subprocess.CompletedProcess:
        command = [sys.executable, "-c", script, *arguments, "--out", tmp_path, limit]
        return subprocess.run([*map(str, command)], capture_output=True, text=True)

    room = 48_000  # for the prior, but not for a shard
    done = run(room)
    assert done.returncode == 3
    assert re.search(
        r"^error: cannot write .*shard-00000\.parquet: File too large; make room", done.stderr, re.M
    )
    assert "Traceback" not in done.stderr
    assert sorted(contents(tmp_path)) == [shards.PRIOR, shards.MANIFEST]
    assert all(len(content) < room for content in contents(tmp_path).values())
    assert run(10**9).returncode == 0
    opened = shards.Dataset.open(tmp_path)
    assert len([opened[i] for i in range(4)]) == 4


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
    prepare(job)
    before = contents(tmp_path)
    for other, odd in [
        (replace(job, seed=6), "seed"),
        (replace(job, split="test"), "split"),
        (replace(job, n=23), "n"),
        (replace(job, n=25), "n, shards"),
        (replace(job, size=48), "size"),
        (replace(job, objects=Procedural("drawer")), "category"),
    ]:
        with pytest.raises(InputError, match=rf"another dataset \(differs in {odd}\)"):
            synth.synth(other)
    assert contents(tmp_path) == before
    prepare(replace(job, workers=3, share=Share(2, 5)))  # these decide nothing


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


def test_two_folders_of_backgrounds_do_not_mix(tmp_path, small_shards):
    pictures = {"a": (9, 9, 9), "b": (9, 9, 9), "c": (8, 9, 9)}
    for name, color in pictures.items():
        (tmp_path / name / "textures").mkdir(parents=True)
        Image.new("RGB", (8, 8), color).save(tmp_path / name / "textures" / "x.png")
    prepare(replace(JOB, out=tmp_path / "out", backgrounds=tmp_path / "a"))
    prepare(replace(JOB, out=tmp_path / "out", backgrounds=tmp_path / "b"))  # the same elsewhere
    (tmp_path / "b" / "textures").rename(tmp_path / "b" / "photos")
    for other in (tmp_path / "b", tmp_path / "c", None):
        with pytest.raises(InputError, match=r"another dataset \(differs in backgrounds\)"):
            synth.synth(replace(JOB, out=tmp_path / "out", backgrounds=other))


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
    with pytest.raises(UsageError, match=r"no category 'toaster' .* known: .*drawer, .*laptop"):
        Procedural("toaster")


def test_the_manifest_says_what_the_dataset_is(tmp_path, small_shards):
    prepare(replace(JOB, out=tmp_path))
    manifest = json.loads((tmp_path / shards.MANIFEST).read_text())
    assert manifest["category"] == JOB.objects.name
    for name in ("n", "seed", "split", "size"):
        assert manifest[name] == getattr(JOB, name)
    assert manifest["shards"] == 6
