"""Runs: stopped or not they end the same, they learn, and nothing bad gets into a checkpoint."""

import json
import math
from dataclasses import asdict, fields, replace
from itertools import pairwise
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file
from torch.optim.swa_utils import AveragedModel

from r2art.core.category import Category
from r2art.core.errors import InputError, ModelError
from r2art.data import shards
from r2art.data.shards import Dataset
from r2art.learn import checkpoint
from r2art.learn import train as train_module
from r2art.learn.batches import Batches, load_photos
from r2art.learn.journal import CURVES, Journal, read_log
from r2art.learn.memory import Photos
from r2art.learn.objective import Weights
from r2art.learn.recipes import RECIPES, Recipe, recipe_of
from r2art.learn.stages import LOG as STAGES
from r2art.learn.step import learning_rate_share
from r2art.learn.train import Training, make_optimizer, train
from r2art.method.network import R2ArtNet

SMALL = {
    "backbone": "mobilenetv2_050",
    "backbone_options": {"pad_type": "same"},
    "input_size": 64,
    "width": 32,
}
SHORT = Recipe(
    **SMALL,
    steps=5,
    crops=3,
    photos=3,
    warm_up=2,
    ema=0.8,
    cascade_from=2,
    cascade_pixels=24,
)


@pytest.fixture
def often(monkeypatch):
    """Log every step, save every third."""
    monkeypatch.setattr(train_module, "LOG_EVERY", 1)
    monkeypatch.setattr(train_module, "SAVE_EVERY", 3)


@pytest.fixture
def job(datasets, tmp_path) -> Training:
    return Training(
        recipe=SHORT,
        data=tuple(datasets.values()),
        backbone_weights=None,
        backgrounds=None,
        out=tmp_path / "run",
    )


def test_a_run_starts_from_another_that_knew_fewer_categories(job, datasets, tmp_path):
    first = replace(job, data=(datasets["laptop"],), out=tmp_path / "laptops")
    train(first)
    trained, _ = checkpoint.load_network(first.out)
    rates = ("learning_rate", "trunk_learning_rate", "dense_learning_rate")
    still = replace(SHORT, steps=1, **dict.fromkeys(rates, 0.0))
    gone_on = replace(job, init=first.out, recipe=still)
    train(gone_on)
    network, about = checkpoint.load_network(gone_on.out)
    assert about["init"]["categories"] == ["laptop"]
    old, new = dict(trained.named_parameters()), dict(network.named_parameters())
    assert {k.split(".")[1] for k in new if k.startswith("heads.")} == {"drawer", "laptop"}
    for key, value in old.items():
        if not key.startswith("category_logits."):
            torch.testing.assert_close(new[key], value, msg=key)


def test_a_run_of_another_network_is_no_start(job, datasets, tmp_path):
    first = replace(job, data=(datasets["laptop"],), out=tmp_path / "laptops")
    train(replace(first, recipe=replace(SHORT, steps=1)))
    wider = replace(job, init=first.out, recipe=replace(SHORT, width=48))
    with pytest.raises(InputError, match="another network"):
        train(wider)
    with pytest.raises(ModelError, match="holds no trained run"):
        train(replace(job, init=tmp_path))


def log_of(folder: Path) -> list[dict]:
    return [{k: v for k, v in e.items() if k != "seconds"} for e in read_log(folder)]


def _stopped_at_4(write):
    """Stops a run one step after its last checkpoint."""

    def stopped(self, step):
        write(self, step)
        if step == 4:
            raise KeyboardInterrupt

    return stopped


def test_a_run_that_was_stopped_ends_as_one_that_was_not(job, often, monkeypatch, tmp_path):
    whole = replace(job, out=tmp_path / "whole")
    train(whole)
    write = Journal.write
    monkeypatch.setattr(Journal, "write", _stopped_at_4(write))
    with pytest.raises(KeyboardInterrupt):
        train(job)
    assert [e["step"] for e in log_of(job.out)] == [1, 2, 3, 4]
    assert int(load_file(job.out / checkpoint.STATE)["step"]) == 3
    monkeypatch.setattr(Journal, "write", write)
    train(job)

    assert [e["step"] for e in log_of(job.out)] == [1, 2, 3, 4, 5]
    for entry, expected in zip(log_of(job.out), log_of(whole.out), strict=True):
        assert entry == pytest.approx(expected, abs=2e-5)
    ended, expected = (load_file(out / checkpoint.STATE) for out in (job.out, whole.out))
    assert ended.keys() == expected.keys()
    for key, value in expected.items():
        torch.testing.assert_close(ended[key], value, rtol=1e-6, atol=1e-6)
    again = (job.out / checkpoint.STATE).stat().st_mtime_ns
    train(job)  # it is done
    assert (job.out / checkpoint.STATE).stat().st_mtime_ns == again


def test_kept_features_leave_the_trunk_and_a_stopped_run_ends_the_same(job, often, monkeypatch):
    """Its features are computed anew when it goes on, and come out as they were."""
    recipe = replace(SHORT, offline_features=True, photos=1)
    whole = replace(job, recipe=recipe, out=job.out.parent / "whole", precision="no")
    train(whole)
    torch.manual_seed(recipe.seed)
    start = recipe.make(tuple(p.category for p in load_photos(job.data).values())).state_dict()
    expected = load_file(whole.out / checkpoint.STATE)
    for key, value in start.items():
        for state in ("model.", "average.module."):
            same = torch.equal(expected[state + key], value)
            if key.startswith("trunk."):
                assert same, state + key
            elif key.startswith("neck.") and value.ndim > 1:
                assert not same, state + key
    monkeypatch.setattr(Journal, "write", _stopped_at_4(Journal.write))
    with pytest.raises(KeyboardInterrupt):
        train(replace(whole, out=job.out))
    monkeypatch.undo()
    train(replace(whole, out=job.out))
    ended = load_file(job.out / checkpoint.STATE)
    assert ended.keys() == expected.keys()
    for key, value in expected.items():
        torch.testing.assert_close(ended[key], value, rtol=1e-6, atol=1e-6, msg=key)


def test_a_loss_that_does_not_count_teaches_nothing(job, often):
    weights = Weights(part_mask=0.0, object_mask=0.0, photo_mask=0.0)
    recipe = replace(SHORT, steps=1, weights=weights)
    train(replace(job, recipe=recipe, precision="no"))
    (entry,) = log_of(job.out)
    assert entry["part_mask"] > 0  # it is known all the same
    torch.manual_seed(recipe.seed)
    before = recipe.make(tuple(p.category for p in load_photos(job.data).values()))
    after = load_file(job.out / checkpoint.STATE)
    changed = {
        name
        for name, p in before.named_parameters()
        if p.ndim > 1 and not torch.equal(after[f"model.{name}"], p)
    }
    assert any(name.startswith("neck.") for name in changed)
    assert not any(name.startswith("object_logits.") for name in changed)


def test_of_others_no_features_are_kept():
    with pytest.raises(ValueError, match="0, not 2"):
        replace(SHORT, offline_features=True, others=2)


@pytest.mark.parametrize("groups", [1, 2])
def test_a_step_teaches_the_categories_of_its_batch(job, often, groups):
    """And the log of stages has a line of each."""
    recipe = replace(SHORT, steps=1, groups=groups, cascade_from=0)
    train(replace(job, recipe=recipe, precision="no"))
    lines = [json.loads(line) for line in (job.out / STAGES).read_text().splitlines()]
    for entry in lines:
        assert entry["step"] == 1
        assert len(entry["samples"]) == len(entry["stages"]) == SHORT.crops
    (entry,) = log_of(job.out)
    of_known = {"keypoint", "keypoint_map"}
    assert {f.name for f in fields(Weights)} - of_known <= set(entry)
    torch.manual_seed(recipe.seed)
    before = recipe.make(tuple(p.category for p in load_photos(job.data).values())).state_dict()
    after = load_file(job.out / checkpoint.STATE)
    changed = {k for k, v in before.items() if not torch.equal(after[f"model.{k}"], v)}
    taught = {k.split(".")[1] for k in changed if k.startswith("heads.")}
    assert taught == {entry["category"] for entry in lines}
    assert len(taught) == len(lines) == groups


def test_a_run_learns(run):
    entries = read_log(run)
    assert [e["step"] for e in entries] == [5, 10, 15, 20, 25, 30]
    for name, share in [("total", 0.88), ("shape", 0.95), ("confidence", 0.85)]:
        after = (entries[3][name] + entries[4][name]) / 2  # before the cascade joins the total
        assert after < share * entries[0][name], name
    assert ["cascade" in e for e in entries] == 5 * [False] + [True]
    assert (run / CURVES).stat().st_size > 10_000


def test_a_run_leaves_a_network_and_what_it_was_trained_on(run, datasets):
    network, facts = checkpoint.load_network(run)
    assert network.names == ("drawer", "laptop")
    assert not network.training
    assert facts["skipped_steps"] == 0
    assert facts["recipe"]["steps"] == 30
    named = {manifest["category"]: manifest for manifest in facts["data"]}
    assert named == {name: Dataset.open(path).manifest for name, path in datasets.items()}
    assert not list(run.glob("*.part"))


def test_the_exported_weights_are_the_average(run):
    tensors = load_file(run / checkpoint.STATE)
    network, _ = checkpoint.load_network(run)
    for key, value in network.state_dict().items():
        assert torch.equal(value, tensors[f"average.module.{key}"])
    assert not torch.equal(
        tensors["average.module.found_box.0.weight"], tensors["model.found_box.0.weight"]
    )


def copy_of_run(run: Path, tmp_path: Path) -> Path:
    folder = tmp_path / "copy"
    folder.mkdir()
    for path in run.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    return folder


def loaded_run(folder: Path) -> checkpoint.Run:
    about = json.loads((folder / checkpoint.RUN).read_text())
    recipe = recipe_of(about["recipe"])
    average, _ = checkpoint.load_network(folder)
    priors = tuple(Category.load(folder / f"{name}.npz") for name in about["categories"])
    network = R2ArtNet(priors, **SMALL)
    wrapped = AveragedModel(average, use_buffers=True)
    return checkpoint.Run(
        recipe=recipe,
        categories=priors,
        network=network,
        average=wrapped,
        optimizer=make_optimizer(network, recipe),
    )


def test_a_failed_save_leaves_the_checkpoint_before(run, tmp_path, monkeypatch):
    folder = copy_of_run(run, tmp_path)
    state = loaded_run(folder)
    before = (folder / checkpoint.STATE).read_bytes()

    def full_disk(tensors, path):
        Path(path).write_bytes(b"half of it")
        raise OSError("no space left on device")

    monkeypatch.setattr(checkpoint, "save_file", full_disk)
    with pytest.raises(OSError, match="no space"):
        checkpoint.save(folder, 99, state, {"data": []})
    assert (folder / checkpoint.STATE).read_bytes() == before
    assert checkpoint.resume(folder, state)[0] == 30


def test_saving_what_was_resumed_changes_nothing(run, tmp_path):
    folder = copy_of_run(run, tmp_path)
    state = loaded_run(folder)
    step, facts = checkpoint.resume(folder, state)
    before = load_file(folder / checkpoint.STATE)
    checkpoint.save(folder, step, state, {k: facts[k] for k in ("data", "skipped_steps")})
    after = load_file(folder / checkpoint.STATE)
    assert before.keys() == after.keys()
    assert all(torch.equal(before[k], after[k]) for k in before)
    assert any(k.startswith("optimizer.") for k in before)


def test_a_folder_with_another_network_is_refused(run, tmp_path, job):
    folder = copy_of_run(run, tmp_path)
    with pytest.raises(InputError, match=r"another run \(differs in width\); choose another --out"):
        train(replace(job, recipe=replace(SHORT, width=48), out=folder))
    with pytest.raises(InputError, match=r"another run \(differs in categories\)"):
        train(replace(job, data=job.data[:1], out=folder))


def test_a_folder_without_a_run_is_refused_with_the_remedy(tmp_path):
    with pytest.raises(ModelError, match="holds no trained run; train one with `r2art train`"):
        checkpoint.load_network(tmp_path)


@pytest.mark.filterwarnings("ignore:invalid value encountered:RuntimeWarning")
def test_a_step_without_a_finite_gradient_is_skipped_and_counted(datasets, tmp_path, often):
    """A broken label in the data: the steps that meet it leave no trace, statistics included."""
    photos = Photos.from_dataset(Dataset.open(datasets["drawer"]))
    recipe = replace(SHORT, crops=2, photos=1, steps=5)
    batches = Batches(recipe, {"drawer": photos}, None, torch.device("cpu"), 0)
    crops = [batches(step).crops["drawer"] for step in range(5)]
    met = [size for c in crops for size in set(c.box_size[:, 0, 0].tolist())]
    often_met = max(met, key=met.count)
    broken = int((photos.box_size[:, 0, 0] == often_met).nonzero()[0, 0])

    folder = tmp_path / "broken"
    folder.mkdir()
    for path in datasets["drawer"].iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    rows = list(Dataset.open(folder).rows())
    rows[broken]["box"] = [math.nan] * 4
    shards.write_shard(shards.shard_path(folder, 0), rows)
    job = Training(
        recipe=recipe, data=(folder,), backbone_weights=None, backgrounds=None, out=tmp_path / "run"
    )
    train(job)
    skipped = [e["step"] for e in log_of(job.out) if "total" not in e]
    assert 1 <= len(skipped) < 5
    assert json.loads((job.out / checkpoint.RUN).read_text())["skipped_steps"] == len(skipped)
    for key, value in load_file(job.out / checkpoint.STATE).items():
        assert torch.isfinite(value).all(), key
    assert all(math.isfinite(v) for e in log_of(job.out) for v in e.values())

    train(replace(job, recipe=replace(recipe, steps=6)))  # the count goes on
    assert json.loads((job.out / checkpoint.RUN).read_text())["skipped_steps"] >= len(skipped)


def test_the_learning_rate_warms_up_and_falls_to_a_hundredth():
    recipe = Recipe(steps=1000, warm_up=100)
    shares = [learning_rate_share(step, recipe) for step in range(1000)]
    assert shares[0] == pytest.approx(0.01)
    assert max(shares) == pytest.approx(shares[100]) == pytest.approx(1)
    assert all(b > a for a, b in pairwise(shares[:100]))
    assert all(b < a for a, b in pairwise(shares[100:]))
    assert shares[-1] == pytest.approx(0.01, abs=1e-4)


def test_every_parameter_is_optimised_once_and_decays_if_it_is_a_weight(photos):
    network = R2ArtNet(tuple(p.category for p in photos.values()), **SMALL)
    rates = {"learning_rate": 1.0, "trunk_learning_rate": 0.1, "dense_learning_rate": 2.0}
    recipe = replace(SHORT, **rates, weight_decay=0.5)
    names = {id(p): name for name, p in network.named_parameters()}
    seen = []
    for group in make_optimizer(network, recipe).param_groups:
        for parameter in group["params"]:
            name = names[id(parameter)]
            seen.append(name)
            dense = name.startswith("decoder.") or ".surface." in name
            expected = 2.0 if dense else 0.1 if name.startswith("trunk.") else 1.0
            assert group["peak_lr"] == expected, name
            assert group["weight_decay"] == (0.5 if parameter.ndim > 1 else 0.0)
    assert sorted(seen) == sorted(names.values())


@pytest.mark.parametrize("name", sorted(RECIPES))
def test_every_recipe_builds_a_network_and_takes_its_number_of_steps(name, photos):
    recipe = RECIPES[name](7)
    assert recipe.steps == recipe.for_photos(1000).steps == 7
    assert recipe.cascade_from is None or recipe.cascade_from < 7
    network = recipe.make(tuple(p.category for p in photos.values()))
    assert network.input_size == recipe.input_size
    assert recipe_of(json.loads(json.dumps(asdict(recipe)))) == recipe


def test_the_papers_recipe_goes_200_times_through_the_data():
    recipe = RECIPES["paper"]().for_photos(1000, processes=2)
    assert recipe.steps * 2 * recipe.crops == pytest.approx(200 * 1000, abs=64)
    mixed = replace(RECIPES["paper"](), groups=2).for_photos(1000, categories=2, processes=2)
    assert mixed.steps == pytest.approx(recipe.steps / 2, abs=1)


def test_a_run_older_than_an_option_has_its_default():
    old = {"backbone": "resnet18", "steps": 9, "weights": {"depth": 3.0}, "forgotten": 1}
    recipe = recipe_of(old)
    assert recipe == Recipe(backbone="resnet18", steps=9, weights=replace(Weights(), depth=3.0))
