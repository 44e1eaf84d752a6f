"""What is written is read again, whole, and nothing else is taken for a dataset."""

import json
import subprocess
import sys
from dataclasses import fields, replace

import numpy as np
import pytest

from r2art.core.camera import Camera
from r2art.core.errors import InputError
from r2art.data import shards
from r2art.data.categories import make_instance, staging
from r2art.data.prior import category_prior
from r2art.data.sample import Sample
from r2art.data.shards import Dataset
from r2art.data.source import Fault, Source


def some_sample(seed: int = 0) -> Sample:
    """Of a smooth picture (JPEG is made for those) and labels of every shape."""
    rng = np.random.default_rng(seed)
    u, v = np.meshgrid(np.linspace(0, 255, 48), np.linspace(0, 255, 40))
    return Sample(
        image=np.stack([u, v, 255 - u], axis=-1).astype(np.uint8),
        mask=rng.choice(np.array([0, 1, 2, 255], np.uint8), (40, 48)),
        depth=rng.uniform(0, 5, (40, 48)).astype(np.float32),
        camera=Camera(50.5, 51.25, 20.125, 24.5, 48, 40),
        box=rng.normal(size=4),
        cam_T_part=rng.normal(size=(2, 4, 4)),
        joint_state=rng.random(1),
        box_center=rng.normal(size=(2, 3)),
        box_size=rng.random((2, 3)),
        axis=rng.normal(size=(1, 3)),
        pivot=rng.normal(size=(1, 3)),
        visible=rng.random(2),
        amodal=rng.integers(0, 4, (40, 48), np.uint16),
    )


@pytest.fixture
def dataset(tmp_path):
    """Two shards of two and one samples, with manifest and prior."""
    category_prior([make_instance("laptop", seed) for seed in range(2)], staging("laptop")).save(
        tmp_path / shards.PRIOR
    )
    manifest = {"format": shards.FORMAT, "n": 3, "shards": 2, "shard_size": 2}
    (tmp_path / shards.MANIFEST).write_text(json.dumps(manifest))
    for number, block in enumerate(([0, 1], [2])):
        rows = [shards.to_row(i, some_sample(i)) for i in block]
        shards.write_shard(shards.shard_path(tmp_path, number), rows)
    return tmp_path


def assert_same(actual: Sample, expected: Sample) -> None:
    assert actual.camera == expected.camera
    for field in fields(Sample):
        name = field.name
        first, second = getattr(actual, name), getattr(expected, name)
        if name == "image":
            assert np.abs(first.astype(int) - second).mean() < 2
        elif name == "depth":
            np.testing.assert_allclose(first, second, atol=shards.DEPTH_UNIT / 2 + 1e-6)
        elif name != "camera":
            np.testing.assert_array_equal(first, second)


def test_a_dataset_gives_back_every_sample_in_order(dataset):
    opened = Dataset.open(dataset)
    rows = list(opened.rows())
    assert len(opened) == len(rows) == 3
    assert [row["index"] for row in rows] == [0, 1, 2]
    for i, row in enumerate(rows):
        assert_same(shards.from_row(row), some_sample(i))
    assert opened.category.name == "laptop"


def test_samples_are_found_in_any_order(dataset):
    opened: Source = Dataset.open(dataset)
    for i in (2, 0, 1, 2):
        assert_same(opened[i], some_sample(i))
    assert opened.file(0) == f"{dataset}/shard-00000.parquet row 0"
    assert opened.file(2) == f"{dataset}/shard-00001.parquet row 0"
    for outside in (3, -1):
        with pytest.raises(IndexError, match="0 to 2"):
            opened[outside]


def test_one_sample_is_read_without_the_other_shards(dataset):
    shards.shard_path(dataset, 0).write_bytes(b"torn")
    opened = Dataset.open(dataset)
    assert_same(opened[2], some_sample(2))
    with pytest.raises(Fault, match=r"shard-00000\.parquet: is no readable Parquet file"):
        opened[0]


def test_a_dataset_from_before_shard_sizes_were_told_is_still_read(tmp_path, dataset):
    manifest = json.loads((dataset / shards.MANIFEST).read_text())
    del manifest["shard_size"]
    manifest |= {"backgrounds": True, "n": 251}
    (dataset / shards.MANIFEST).write_text(json.dumps(manifest))
    row = shards.to_row(250, some_sample(250))
    del row["amodal"]
    shards.write_shard(shards.shard_path(dataset, 1), [row])
    opened = Dataset.open(dataset)
    assert_same(opened[250], replace(some_sample(250), amodal=None))


def test_depth_beyond_what_16_bits_hold_is_told_as_unknown_not_as_another(tmp_path):
    sample = some_sample()
    farthest = shards.DEPTH_STEPS * shards.DEPTH_UNIT
    sample.depth[0, :3] = farthest, farthest + shards.DEPTH_UNIT, 90.0
    read = shards.from_row(shards.to_row(0, sample))
    np.testing.assert_allclose(read.depth[0, :3], [farthest, 0, 0], rtol=1e-6)


def test_other_libraries_read_the_shards(dataset, tmp_path, monkeypatch):
    """The two lines of docs/datasets.md."""
    datasets = pytest.importorskip("datasets", reason="the library datasets is not installed")
    monkeypatch.setenv("HF_DATASETS_OFFLINE", "1")
    files = f"{dataset}/*.parquet"
    photos = datasets.load_dataset("parquet", data_files=files, split="train", cache_dir=tmp_path)
    photos = photos.cast_column("image", datasets.Image())
    assert photos["index"][:] == [0, 1, 2]
    for i, photo in enumerate(photos):
        sample = some_sample(i)
        assert photo["image"].size == (sample.camera.width, sample.camera.height)
        poses = np.reshape(photo["cam_T_part"], (-1, 4, 4))
        np.testing.assert_array_equal(poses, sample.cam_T_part)


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "file"
    shards.write_atomically(path, b"old")
    script = (
        "import resource, sys; from pathlib import Path; from r2art.data import shards; "
        "resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096)); "  # as if the disk were full
        "shards.write_atomically(Path(sys.argv[1]), bytes(10_000))"
    )
    done = subprocess.run([sys.executable, "-c", script, path], capture_output=True, text=True)
    assert "InputError: cannot write" in done.stderr
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_what_cannot_be_replaced_is_told(tmp_path):
    (tmp_path / "file").mkdir()
    with pytest.raises(InputError, match=r"cannot write .*file: Is a directory"):
        shards.write_atomically(tmp_path / "file", b"new")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_a_folder_that_is_no_dataset_is_refused_with_the_remedy(tmp_path):
    with pytest.raises(InputError, match=r"holds no manifest\.json; make one with `r2art synth`"):
        Dataset.open(tmp_path)
    with pytest.raises(InputError, match=r"holds no manifest\.json"):
        Dataset.open(tmp_path / "nowhere")
    (tmp_path / shards.MANIFEST).write_text('{"name": "a web page"}')
    with pytest.raises(InputError, match="not of a dataset in format"):
        Dataset.open(tmp_path)
    (tmp_path / shards.MANIFEST).write_text('{"name": ')
    with pytest.raises(InputError, match="is not JSON"):
        Dataset.open(tmp_path)


def test_an_unfinished_dataset_is_refused_with_the_remedy(dataset):
    shards.shard_path(dataset, 1).unlink()
    with pytest.raises(InputError, match=r"holds 1 of 2 shards; run the same `r2art synth`"):
        Dataset.open(dataset)
