"""Starting the trunk from ImageNet weights, whole or with the normalisation folded in."""

import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors import SafetensorError
from safetensors.torch import load_file
from torch import Tensor, nn

from r2art.core.errors import InputError

FOLDED_EPS = 1e-5
"""Of the BatchNorm layers, so that a layer of variance 1 - eps is the identity."""


def load_trunk(trunk: nn.Module, path: Path) -> None:
    """Start a trunk from a file of weights; names that differ are an error, not a shrug.

    A file with folded normalisation (no running statistics) is recognised: its BatchNorm
    layers get the identity.

    Args:
        trunk: Its parameters and statistics are overwritten.
        path: An ``.npz`` or ``.safetensors`` file.

    Raises:
        InputError: It is missing, unreadable, or of another backbone.
    """
    given = _read(path)
    folded = not any(key.endswith("running_mean") for key in given)
    start = {k: _start(k, old, given, folded) for k, old in trunk.state_dict().items()}
    if odd := [k for k, v in start.items() if v is None]:
        raise InputError(
            f"{path} lacks {len(odd)} tensors of the trunk or has them in another size, first "
            f"{odd[0]}; give weights of the recipe's backbone"
        )
    trunk.load_state_dict(start)


def _read(path: Path) -> dict[str, Tensor]:
    if not path.is_file():
        raise InputError(f"backbone weights {path} do not exist; give an .npz or .safetensors file")
    try:
        if path.suffix != ".npz":
            return load_file(path)
        with path.open("rb") as f, np.load(f, allow_pickle=False) as arrays:
            return {k: torch.from_numpy(v.astype(np.float32)) for k, v in arrays.items()}
    except (OSError, ValueError, zipfile.BadZipFile, SafetensorError) as error:
        raise InputError(f"{path} is no .npz or .safetensors file of weights: {error}") from error


def _start(key: str, old: Tensor, given: dict[str, Tensor], folded: bool) -> Tensor | None:
    """What a tensor starts from; None where the file does not tell."""
    if key in given:
        return given[key].reshape(old.shape) if given[key].numel() == old.numel() else None
    if key.endswith("num_batches_tracked"):
        return old
    if folded and key.endswith("running_mean"):
        return torch.zeros_like(old)
    if folded and key.endswith("running_var"):
        return torch.ones_like(old) - FOLDED_EPS
    if folded and key.endswith("weight") and old.ndim == 1:
        return torch.ones_like(old)
    return None


def folded_identity(layer: nn.BatchNorm2d, bias: Tensor) -> dict[str, Tensor]:
    """State of a BatchNorm layer that only adds ``bias``, for it is folded into what is before."""
    one = torch.ones(layer.num_features)
    variance = one - layer.eps
    return {"weight": one, "bias": bias, "running_mean": 0 * one, "running_var": variance}


def unfold_normalisation(
    module: nn.Module, *inputs: Any, only: Iterable[nn.BatchNorm2d] | None = None
) -> None:
    """Give folded BatchNorm layers statistics again without changing what they compute.

    Pre-trained weights whose normalisation was folded into the convolutions train badly: batch
    statistics would rescale every layer. Here each layer gets the mean and variance it sees when
    the module is given ``inputs``, and the scale and bias that undo them.

    Args:
        module: Holds the layers.
        inputs: What it is called with, once, in evaluation mode.
        only: The folded layers; default: all.
    """
    layers = only
    if layers is None:
        layers = [m for m in module.modules() if isinstance(m, nn.BatchNorm2d)]
    hooks = [m.register_forward_pre_hook(_adopt_statistics) for m in layers]
    was_training = module.training
    with torch.no_grad():
        module.eval()(*inputs)
    module.train(was_training)
    for hook in hooks:
        hook.remove()


def _adopt_statistics(layer: nn.Module, inputs: tuple[Tensor, ...]) -> None:
    assert isinstance(layer, nn.BatchNorm2d)
    assert layer.running_mean is not None
    assert layer.running_var is not None
    x = inputs[0]
    mean, var = x.mean(dim=(0, 2, 3)), x.var(dim=(0, 2, 3)) + 1e-4
    gain = layer.weight / (layer.running_var + layer.eps).sqrt()
    layer.bias.copy_(layer.bias + gain * (mean - layer.running_mean))
    layer.weight.copy_(gain * (var + layer.eps).sqrt())
    layer.running_mean.copy_(mean)
    layer.running_var.copy_(var)
