"""Pre-trained weights: what is loaded computes what it did where it comes from."""

import numpy as np
import pytest
import torch
from safetensors.torch import save_file

from r2art.core.errors import InputError
from r2art.learn.pretrained import load_trunk, unfold_normalisation
from r2art.method.network import make_trunk

BACKBONE = "mobilenetv2_050"


def fresh_trunk(seed: int = 0) -> torch.nn.Module:
    torch.manual_seed(seed)
    return make_trunk(BACKBONE, {"pad_type": "same"})[0].eval()


def used_trunk() -> torch.nn.Module:
    """A trunk whose normalisation has statistics, scales and shifts of its own."""
    trunk = fresh_trunk(1)
    with torch.no_grad():
        for layer in trunk.modules():
            if isinstance(layer, torch.nn.BatchNorm2d):
                layer.weight.uniform_(0.5, 1.5)
                layer.bias.uniform_(-0.5, 0.5)
                layer.running_mean.uniform_(-0.5, 0.5)
                layer.running_var.uniform_(0.5, 1.5)
    return trunk


@pytest.fixture
def images() -> torch.Tensor:
    return torch.rand(6, 3, 64, 64, generator=torch.Generator().manual_seed(0)) * 2 - 1


def assert_same_function(a: torch.nn.Module, b: torch.nn.Module, images: torch.Tensor) -> None:
    with torch.no_grad():
        for x, y in zip(a(images), b(images), strict=True):
            torch.testing.assert_close(x, y, rtol=0, atol=float(2e-4 * y.abs().max()))


def test_whole_weights_give_the_trunk_they_come_from(tmp_path, images):
    source, trunk = used_trunk(), fresh_trunk(2)
    save_file(source.state_dict(), tmp_path / "whole.safetensors")
    load_trunk(trunk, tmp_path / "whole.safetensors")
    assert_same_function(trunk, source, images)


def test_folded_weights_give_the_trunk_they_come_from(tmp_path, images):
    """Fold every normalisation into the convolution before it, as exporters do."""
    source, trunk = used_trunk(), fresh_trunk(2)
    modules = dict(source.named_modules())
    folded = {}
    for name, conv in modules.items():
        if not isinstance(conv, torch.nn.Conv2d):
            continue
        norm_name = name.replace("conv_stem", "bn1").replace("conv_pwl", "bn3")
        if norm_name == name:
            block_is_first = ".0.0." in f".{name}." and name.startswith("blocks.0")
            pairs = {"conv_dw": "bn1" if block_is_first else "bn2", "conv_pw": "bn1"}
            pairs["conv_pw"] = "bn2" if block_is_first else "bn1"
            last = name.rsplit(".", 1)[-1]
            norm_name = name.replace(last, pairs[last])
        norm = modules[norm_name]
        gain = norm.weight / (norm.running_var + norm.eps).sqrt()
        folded[f"{name}.weight"] = conv.weight * gain[:, None, None, None]
        folded[f"{norm_name}.bias"] = norm.bias - gain * norm.running_mean
    np.savez(tmp_path / "folded.npz", **{k: v.detach().numpy() for k, v in folded.items()})
    load_trunk(trunk, tmp_path / "folded.npz")
    assert_same_function(trunk, source, images)


def test_unfolding_leaves_what_the_trunk_computes(images):
    trunk, same = used_trunk(), used_trunk()
    unfold_normalisation(trunk, images)
    assert_same_function(trunk, same, images)
    assert_same_function(trunk, same, torch.rand(2, 3, 96, 96))
    assert not trunk.training


def test_unfolded_layers_know_the_statistics_of_what_they_see(images):
    trunk = used_trunk()
    unfold_normalisation(trunk, images)
    checked = []

    def check(layer, inputs):
        mean, var = inputs[0].mean(dim=(0, 2, 3)), inputs[0].var(dim=(0, 2, 3))
        torch.testing.assert_close(layer.running_mean, mean, rtol=1e-3, atol=1e-3)
        torch.testing.assert_close(layer.running_var, var + 1e-4, rtol=1e-3, atol=1e-3)
        checked.append(layer)

    for layer in trunk.modules():
        if isinstance(layer, torch.nn.BatchNorm2d):
            layer.register_forward_pre_hook(check)
    trunk(images)
    assert len(checked) > 30


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("none.npz", None, "do not exist"),
        ("torn.npz", b"PK\x03\x04 torn", "no .npz or .safetensors file of weights"),
        ("torn.safetensors", b"\xff" * 64, "no .npz or .safetensors file of weights"),
    ],
)
def test_unreadable_weights_are_refused(tmp_path, name, content, message):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=message):
        load_trunk(fresh_trunk(), tmp_path / name)


def test_weights_of_another_backbone_are_refused_and_change_nothing(tmp_path):
    trunk = fresh_trunk()
    state = {k: v.clone() for k, v in trunk.state_dict().items()}
    lacking = {k: v for k, v in state.items() if not k.startswith("blocks.3")}
    wrong_size = {**state, "conv_stem.weight": torch.zeros(3, 3)}
    for i, bad in enumerate((lacking, wrong_size)):
        path = tmp_path / f"{i}.safetensors"
        save_file(bad, path)
        with pytest.raises(InputError, match=r"lacks \d+ tensors of the trunk"):
            load_trunk(trunk, path)
    for key, value in trunk.state_dict().items():
        assert torch.equal(value, state[key])
