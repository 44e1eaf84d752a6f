"""The paper's network through the whole house: train, export, predict, evaluate; go on; cache."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from r2art.cli import main
from r2art.core.errors import InputError
from r2art.data import shards
from r2art.data.shards import Dataset
from r2art.learn import checkpoint, hub
from r2art.learn.batches import Batches
from r2art.learn.export import export
from r2art.learn.hub import hub_file, load_backbone, start_backbones
from r2art.learn.journal import read_log
from r2art.learn.offline import OfflineFeatures
from r2art.learn.recipes import paper
from r2art.learn.train import Training, train
from r2art.method.backbones import FeatureMap, Vector
from r2art.method.paper_network import PaperNet
from r2art.run.predictor import load

LIGHT = replace(
    paper(3),
    backbone="resnet10t",
    depth_backbone="mobilenetv2_050",
    joint_backbone="resnet10t",
    pretrained=False,
    input_size=64,
    width=32,
    crops=3,
    photos=2,
    cascade_pixels=32,
    warm_up=1,
)


@pytest.fixture(scope="module")
def light_run(datasets, tmp_path_factory):
    out = tmp_path_factory.mktemp("paper")
    train(Training(recipe=LIGHT, data=(datasets["laptop"],), out=out))
    return out


def round_trip(run: Path, data: Path, tmp_path: Path) -> None:
    """Export a run, predict a photo with the file, and evaluate it."""
    model = tmp_path / "paper.onnx"
    export(run, model)
    sample = shards.from_row(next(iter(Dataset.open(data).rows())))
    predictor = load(model)
    assert not predictor.model.segments  # it has no dense head
    prediction = predictor.predict(sample.image, sample.camera)  # box and category found
    assert prediction.refinement is None
    assert all(np.isfinite(part.cam_T_part).all() for part in prediction.parts)
    out = tmp_path / "report"
    flags = ["--data", str(data), "--model", str(model), "--out", str(out), "--limit", "2"]
    assert main(["eval", *flags]) == 0
    assert (out / "report.json").exists()


def test_the_papers_network_trains_exports_predicts_and_is_measured(light_run, datasets, tmp_path):
    network, facts = checkpoint.load_network(light_run)
    assert isinstance(network, PaperNet)
    assert facts["skipped_steps"] == 0
    round_trip(light_run, datasets["laptop"], tmp_path)


@pytest.mark.slow
def test_so_it_does_with_the_backbones_it_names(datasets, tmp_path):
    recipe = replace(paper(2), pretrained=False, crops=2, photos=1)
    out = tmp_path / "run"
    train(Training(recipe=recipe, data=(datasets["drawer"],), out=out))
    assert recipe.backbone == "vit_small_patch14_dinov2"
    round_trip(out, datasets["drawer"], tmp_path)


def test_a_stopped_run_of_it_goes_on_the_same(light_run, datasets, tmp_path, monkeypatch):
    """Although its features are computed anew; and frozen weights are as they were."""
    monkeypatch.setattr("r2art.learn.train.SAVE_EVERY", 1)
    job = Training(recipe=LIGHT, data=(datasets["laptop"],), out=tmp_path / "run")
    save = checkpoint.save

    def stopped(folder, step, run, more):
        save(folder, step, run, more)
        if step == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(checkpoint, "save", stopped)
    with pytest.raises(KeyboardInterrupt):
        train(job)
    monkeypatch.setattr(checkpoint, "save", save)
    train(job)
    ended, expected = (load_file(f / checkpoint.STATE) for f in (job.out, light_run))
    for key, value in expected.items():
        torch.testing.assert_close(ended[key], value, rtol=1e-5, atol=1e-6, msg=key)
    assert not any(k.startswith("optimizer.") and v.numel() == 0 for k, v in ended.items())
    for entry in read_log(job.out):
        assert {"part_mask", "object_mask", "photo_mask"}.isdisjoint(entry)


@pytest.fixture(params=[1, 2], ids=["one", "mixed"])
def batches(request, photos) -> Batches:
    recipe = replace(LIGHT, groups=request.param)
    return Batches(recipe, photos, None, torch.device("cpu"), 0)


def test_offline_features_are_computed_once_per_photo(batches, monkeypatch):
    network = LIGHT.make(tuple(p.category for p in batches.photos.values()))
    assert isinstance(network, PaperNet)
    computed = []
    offline = network.offline
    monkeypatch.setattr(network, "offline", lambda x: computed.append(len(x)) or offline(x))
    features, names = OfflineFeatures(network), list(batches.photos)
    seen = 0
    for step in (0, 1, 2, 0, 1, 2):
        batch = batches(step)
        asked = (batch.crops, [names[c] for c in batch.category.tolist()], batch.views)
        got = features(*asked)
        crop, _, _, photo = batch.inputs()
        image = torch.cat([crop, photo])
        torch.testing.assert_close(got, offline(image), rtol=2e-3, atol=2e-3)
        seen += len(image)
    assert 0 < sum(computed) <= seen / 2
    assert torch.equal(features(*asked), got)


def test_features_that_are_kept_are_of_crops_that_do_not_vary(batches):
    """The same photo is the same crop whenever it comes; with augmentation it is not."""
    fresh = replace(batches, recipe=replace(batches.recipe, offline_features=False))
    for made, same in ((batches, True), (fresh, False)):
        met: dict[tuple[str, int], torch.Tensor] = {}
        compared = 0
        for step in range(12):
            for name, crops in made(step).crops.items():
                for i, image in zip(crops.index.tolist(), crops.image, strict=True):
                    if (name, i) in met:
                        assert torch.equal(met[name, i], image) == same
                        compared += 1
                    met[name, i] = image
        assert compared > 5


def saved(module: torch.nn.Module, path):
    save_file({k: v.contiguous() for k, v in module.state_dict().items()}, path)
    return path


def test_weights_of_another_image_size_are_fitted(tmp_path):
    """A timm file is for 224²; the positions are resampled, all else is taken as it is."""
    file = saved(FeatureMap("vit_tiny_patch16_224", 224).body, tmp_path / "vit.safetensors")
    small = FeatureMap("vit_tiny_patch16_224", 64)
    load_backbone(small, "vit_tiny_patch16_224", file)
    given = load_file(file)
    for key, value in small.body.state_dict().items():
        if key == "pos_embed":
            assert value.shape[1] == 1 + 4 * 4
            torch.testing.assert_close(value[:, :1], given[key][:, :1])
        else:
            assert torch.equal(value, given[key])


def test_a_file_starts_the_frozen_backbone_and_a_folder_the_others_too(photos, tmp_path):
    category = photos["laptop"].category
    recipe = replace(LIGHT, backbone="vit_tiny_patch16_224")
    names = (recipe.backbone, recipe.depth_backbone, recipe.joint_backbone)
    frozen = saved(FeatureMap(names[0], 224).body, tmp_path / f"{names[0]}.safetensors")
    joint = saved(Vector(names[2], 64).body, tmp_path / f"{names[2]}.safetensors")
    for weights, starts_joint in ((frozen, False), (tmp_path, True)):
        network = recipe.make((category,))
        assert isinstance(network, PaperNet)
        before = network.depth.body.conv_stem.weight.clone()
        start_backbones(network, names, weights, pretrained=True)
        token = load_file(frozen)["cls_token"]
        assert torch.equal(network.frozen.body.cls_token, token)
        kernel = network.joint.body.layer1[0].conv1.weight
        same = torch.equal(kernel, load_file(joint)["layer1.0.conv1.weight"])
        assert same == starts_joint
        assert torch.equal(network.depth.body.conv_stem.weight, before)
    with pytest.raises(InputError, match="do not exist"):
        start_backbones(network, names, tmp_path / "none.safetensors", pretrained=True)


REMEDIES = r"connect once to huggingface.co, or give --backbone-weights FILE"


@pytest.mark.parametrize("offline", [True, False])
def test_without_weights_and_hub_it_is_said_at_once_with_both_remedies(
    offline, datasets, tmp_path, monkeypatch
):
    monkeypatch.setattr(hub.constants, "HF_HUB_OFFLINE", offline)
    monkeypatch.setattr(hub.constants, "HF_HUB_CACHE", str(tmp_path))
    monkeypatch.setattr(hub.constants, "ENDPOINT", "http://127.0.0.1:9")  # nobody listens there
    monkeypatch.setattr(hub, "try_to_load_from_cache", lambda *_: None)
    with pytest.raises(InputError, match=REMEDIES) as error:
        hub_file("vit_small_patch14_dinov2")
    assert "\n" not in str(error.value)
    assert "vit_small_patch14_dinov2" in str(error.value)
    job = Training(recipe=replace(LIGHT, pretrained=True), data=(datasets["laptop"],), out=tmp_path)
    with pytest.raises(InputError, match=REMEDIES):
        train(job)


def test_a_model_that_the_hub_does_not_have_needs_a_file():
    with pytest.raises(InputError, match=r"no weights of vit_tiny_.*; give --backbone-weights"):
        hub_file("vit_tiny_patch16_18x2_224")
