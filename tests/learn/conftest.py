"""A few photos of every category, rendered small."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from r2art.data import shards
from r2art.data.categories import make_instance, staging
from r2art.data.objects import Procedural
from r2art.data.prior import category_prior
from r2art.data.shards import Dataset
from r2art.data.synth import Synth, synthesise
from r2art.learn import train as train_module
from r2art.learn.export import export
from r2art.learn.memory import Photos
from r2art.learn.recipes import Recipe
from r2art.learn.train import Training, train

torch.set_num_threads(1)

SIZE = 64
COUNT = {"laptop": 16, "drawer": 8}


@pytest.fixture(scope="session")
def datasets(tmp_path_factory) -> dict[str, Path]:
    """A folder per category, as `r2art synth` would have filled it."""
    folders = {}
    for name, n in COUNT.items():
        folder = tmp_path_factory.mktemp(name)
        job = Synth(
            objects=Procedural(name),
            n=n,
            seed=0,
            split="train",
            size=SIZE,
            backgrounds=None,
            out=folder,
        )
        category_prior([make_instance(name, seed) for seed in range(6)], staging(name)).save(
            folder / shards.PRIOR
        )
        rows = [shards.to_row(i, synthesise(job, i)) for i in range(n)]
        shards.write_shard(shards.shard_path(folder, 0), rows)
        manifest = {"format": shards.FORMAT, "category": name, "n": n, "shards": 1}
        (folder / shards.MANIFEST).write_text(json.dumps(manifest))
        folders[name] = folder
    return folders


@pytest.fixture(scope="session")
def photos(datasets) -> dict[str, Photos]:
    return {name: Photos.from_dataset(Dataset.open(path)) for name, path in datasets.items()}


def small_recipe(**changes) -> Recipe:
    """A network and batches so small that a step takes a tenth of a second."""
    small = Recipe(
        backbone="mobilenetv2_050",
        backbone_options={"pad_type": "same"},
        input_size=SIZE,
        width=32,
        crops=6,
        photos=4,
        warm_up=2,
        ema=0.8,
        cascade_pixels=32,
    )
    return replace(small, **changes)


@pytest.fixture(scope="session")
def small():
    """Makes that recipe."""
    return small_recipe


@pytest.fixture(scope="session")
def run(datasets, tmp_path_factory) -> Path:
    """A run on all photos, long enough to learn something."""
    out = tmp_path_factory.mktemp("run")
    job = Training(
        recipe=small_recipe(steps=30, cascade_from=25, seed=1),
        data=tuple(datasets.values()),
        backbone_weights=None,
        backgrounds=None,
        out=out,
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(train_module, "LOG_EVERY", 5)
        train(job)
    return out


@pytest.fixture(scope="session")
def model_file(run, tmp_path_factory) -> Path:
    """The model file of that run."""
    path = tmp_path_factory.mktemp("model") / "small.onnx"
    export(run, path)
    return path
