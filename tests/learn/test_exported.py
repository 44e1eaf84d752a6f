"""Training goes on from a model file as it does from the run that the file was made of."""

from dataclasses import replace

import numpy as np
import onnx
import pytest
import torch
from onnx import numpy_helper

from r2art.core.errors import ModelError, UsageError
from r2art.learn import checkpoint, exported
from r2art.learn.batches import Batches
from r2art.learn.export import FIELDS, Graph, export
from r2art.learn.recipes import recipe_of
from r2art.method.outputs import Network


@pytest.fixture(scope="module")
def recipe(run):
    return recipe_of(checkpoint.facts(run)["recipe"])


@pytest.fixture
def fresh(photos, recipe):
    """Makes a network of the recipe, for these categories."""

    def make(names=("drawer", "laptop"), **changes) -> Network:
        return replace(recipe, **changes).make(tuple(photos[name].category for name in names))

    return make


@pytest.fixture(scope="module")
def inputs(photos, recipe):
    return Batches(recipe, photos, None, torch.device("cpu"), 0)(0).inputs()


def said(network: Network, name: str, inputs) -> list[torch.Tensor]:
    image, box, K, _ = inputs
    pixels = ((image[:1] + 1) * 127.5).permute(0, 2, 3, 1).round().to(torch.uint8)
    with torch.no_grad():
        answers = Graph(network.eval(), network.names)(pixels, K[:1], box[:1])
    start = 2 + network.names.index(name) * len(FIELDS)
    return [answers[0], *answers[start : start + len(FIELDS)]]


def masks(network: Network, inputs) -> torch.Tensor:
    with torch.no_grad():
        dense, _ = network.eval().features(inputs[0])
        found = network.object_mask(dense)
    assert found is not None
    return found


def test_the_network_computes_what_the_run_does(fresh, run, model_file, inputs):
    network = fresh()
    exported.load_exported(network, model_file, inputs)
    trained, _ = checkpoint.load_network(run)
    for name in network.names:
        for ours, theirs in zip(
            said(network, name, inputs), said(trained, name, inputs), strict=True
        ):
            torch.testing.assert_close(ours, theirs, rtol=5e-3, atol=5e-3)
    of_object = masks(network, inputs), masks(trained, inputs)
    torch.testing.assert_close(*of_object, rtol=0, atol=0.04)
    alike = torch.corrcoef(torch.stack([m.flatten() for m in of_object]))[0, 1]
    assert alike > 0.95


def test_its_normalisation_is_alive_again(fresh, model_file, inputs):
    """Batch statistics, as in training, change little: the layers know what they will see."""
    network = fresh()
    exported.load_exported(network, model_file, inputs)
    images = torch.cat([inputs[0], inputs[3]])
    with torch.no_grad():
        _, evaluated = network.eval().features(images)
        _, trained = network.train().features(images)
    torch.testing.assert_close(trained.p16, evaluated.p16, rtol=0.02, atol=0.02)
    assert evaluated.p16.std() > 0.1


def test_a_category_that_the_file_does_not_know_gets_fresh_heads(fresh, model_file, inputs):
    network = fresh(("laptop",))
    before = {k: v.clone() for k, v in network.state_dict().items()}
    exported.load_exported(network, model_file, inputs)
    after = network.state_dict()
    changed = {k for k, v in after.items() if not torch.equal(v, before[k])}
    assert "heads.laptop.joint.0.weight" in changed
    assert "trunk.conv_stem.weight" in changed
    theirs = exported.weights(model_file)["category_logits.2.weight"]
    of_both = theirs[[1, 2]]  # of drawer, laptop, none
    torch.testing.assert_close(after["category_logits.2.weight"], of_both)


def test_a_file_without_the_objects_mask_leaves_that_head_fresh(
    fresh, model_file, inputs, tmp_path
):
    """As files of before there was one."""
    model = onnx.load(model_file)
    kept = [t for t in model.graph.initializer if "object_logits." not in t.name]
    assert len(kept) < len(model.graph.initializer)
    del model.graph.initializer[:]
    model.graph.initializer.extend(kept)
    onnx.save(model, tmp_path / "older.onnx")
    network = fresh()
    before = {k: v.clone() for k, v in network.object_logits.state_dict().items()}
    stem = network.trunk.conv_stem.weight.clone()
    exported.load_exported(network, tmp_path / "older.onnx", inputs)
    for key, value in network.object_logits.named_parameters():
        assert torch.equal(value, before[key])
    assert not torch.equal(network.trunk.conv_stem.weight, stem)


def test_the_facts_name_the_file_and_its_making(model_file):
    facts = exported.facts(model_file)
    assert facts["model"] == model_file.name
    assert len(facts["sha256"]) == 64
    assert facts["recipe"]["steps"] == 30


def test_what_is_no_model_is_refused_in_one_line(fresh, tmp_path, model_file, inputs):
    torn = tmp_path / "torn.onnx"
    torn.write_bytes(model_file.read_bytes()[:5000])
    foreign = tmp_path / "foreign.onnx"
    model = onnx.load(model_file)
    del model.metadata_props[:]
    onnx.save(model, foreign)
    for path, message in (
        (torn, "as a model"),
        (foreign, "not a model of r2art"),
        (tmp_path / "none.onnx", "cannot read"),
    ):
        with pytest.raises(ModelError, match=message):
            exported.load_exported(fresh(), path, inputs)


def test_another_network_is_refused_and_changes_nothing(fresh, model_file, inputs):
    other = fresh(width=48)
    before = {k: v.clone() for k, v in other.state_dict().items()}
    with pytest.raises(ModelError, match="of another network"):
        exported.load_exported(other, model_file, inputs)
    for key, value in other.state_dict().items():
        np.testing.assert_array_equal(value, before[key])


@pytest.fixture
def changed(model_file, tmp_path):
    """The model file with other weights, which it makes of those given."""

    def make(change):
        model = onnx.load(model_file)
        for tensor in model.graph.initializer:
            if tensor.name.startswith(exported.PREFIX):
                array = change(numpy_helper.to_array(tensor)).astype(np.float16)
                tensor.CopyFrom(numpy_helper.from_array(array, tensor.name))
        path = tmp_path / "changed.onnx"
        onnx.save(model, path)
        return path

    return make


def test_a_blend_lies_halfway(run, model_file, changed, tmp_path):
    export(run, tmp_path / "blend.onnx", blend=changed(lambda w: 3 * w))
    own, blend = exported.weights(model_file), exported.weights(tmp_path / "blend.onnx")
    assert own.keys() == blend.keys()
    for name, weight in own.items():
        torch.testing.assert_close(blend[name], 2 * weight, rtol=2e-3, atol=1e-4, msg=name)
    told = exported.facts(tmp_path / "blend.onnx")["blend"]
    assert told["model"] == "changed.onnx"


def test_only_a_model_of_the_same_network_is_blended_in(run, model_file, changed, tmp_path):
    out = tmp_path / "blend.onnx"
    with pytest.raises(ModelError, match="the model that the run started from"):
        export(run, out, blend=changed(lambda w: w.ravel()))
    with pytest.raises(ModelError, match="cannot be blended in"):
        export(run, out, ["laptop"], blend=model_file)
    with pytest.raises(UsageError, match="goes together with a run"):
        export(model_file, out, blend=model_file)
    assert not out.exists()
