"""Going on from a model file: the weights of an exported ONNX graph, back in a network.

The exporter folds most normalisation layers into the convolutions before them and leaves out
what only training needs. Here the folded layers become layers again, and what is missing starts
fresh.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch
from google.protobuf.message import DecodeError
from numpy.typing import NDArray
from onnx import numpy_helper
from torch import Tensor, nn

from r2art.core.errors import ModelError
from r2art.learn.pretrained import folded_identity, unfold_normalisation
from r2art.method.network import R2ArtNet
from r2art.method.outputs import FINDING

PREFIX = "network."
BIAS = ".weight_bias"
"""The exporter's name for the bias of a convolution that has swallowed a normalisation."""
HALF, BYTES, SCALE = "_half", "_bytes", "_scale"
"""Ends of the names of weights that are stored as float16; as bytes, and what these count."""
MAY_LACK = (
    *("neck.lateral.0.", "neck.at_8.", "neck.fine_lateral.", "neck.narrow.", "neck.at_4."),
    "object_logits.",
)
"""Layers that a file may lack: those of the object's mask, which older files do not have."""


def load_exported(network: R2ArtNet, path: Path, inputs: Sequence[Any]) -> None:
    """Start a network from a model file, which may know other categories.

    Args:
        network: Overwritten where the file knows its layers: trunk, neck, and the heads of
            categories that both know. The list of categories decides whether the classifier is.
        path: A file of `r2art export`.
        inputs: Crops, boxes, intrinsics and photos of a training pass, from which folded layers
            learn their statistics; it leaves what the network computes unchanged.

    Raises:
        ModelError: It is no such file, or of another network.
    """
    given = weights(path)
    state, folded = network.state_dict(), []
    names = {id(module): name for name, module in network.named_modules()}
    for conv, norm in _normalised(network, inputs):
        bias = given.pop(names[id(conv)] + BIAS, None)
        if bias is not None and f"{names[id(conv)]}.weight" in given:
            identity = folded_identity(norm, bias)
            given |= {f"{names[id(norm)]}.{key}": value for key, value in identity.items()}
            folded.append(norm)
    fitting = {k: v for k, v in given.items() if k in state and state[k].shape == v.shape}
    named = [c["name"] for c in metadata(read_model(path))["categories"]]
    fitting |= matched_answers(state, given, network.names, named)
    if odd := [k for k in state if _is_shared(k) and k not in fitting]:
        raise ModelError(
            f"{path} is of another network (first at {odd[0]}); start from a model of the same "
            "recipe, or from a run"
        )
    network.load_state_dict(state | fitting)
    for asked in _for_each_category(network, inputs):
        unfold_normalisation(network, *asked, only=folded)
    network.start_known_objects(given)


def matched_answers(
    state: Mapping[str, Tensor],
    given: Mapping[str, Tensor],
    names: Sequence[str],
    given_names: Sequence[str],
) -> dict[str, Tensor]:
    """What a classifier says of categories that another knows as well, and of none.

    Args:
        state: Of the network ...
        given: ... and of the other.
        names: Of the network's categories ...
        given_names: ... and of the other's.

    Returns:
        Of the network's parameters those that differ in shape, with what the other knows put in.
    """
    both = [name for name in names if name in given_names]
    to = torch.tensor([*(names.index(name) for name in both), len(names)])
    of = torch.tensor([*(given_names.index(name) for name in both), len(given_names)])
    return {
        key: value.index_copy(0, to, given[key][of])
        for key, value in state.items()
        if key.startswith("category_logits.") and key in given and value.shape != given[key].shape
    }


def facts(path: Path) -> dict[str, Any]:
    """What a model file says of its own making, and its SHA-256."""
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return {"model": path.name, "sha256": digest, **metadata(read_model(path))["trained"]}


def metadata(model: onnx.ModelProto) -> dict[str, Any]:
    """What a model of r2art says of itself, see docs/model.md."""
    return json.loads(next(m.value for m in model.metadata_props if m.key == "r2art"))


def with_metadata(model: onnx.ModelProto, about: dict[str, Any]) -> onnx.ModelProto:
    """The same model of r2art, which says something else of itself."""
    result = onnx.ModelProto()
    result.CopyFrom(model)
    next(m for m in result.metadata_props if m.key == "r2art").value = json.dumps(about)
    return result


def blended(model: onnx.ModelProto, path: Path) -> onnx.ModelProto:
    """A model whose weights are the means of its own and of another's that it went on from.

    Two ends of one training are often both worse than what lies between them (Wortsman et al.,
    "Model soups", 2022).

    Args:
        model: With float32 weights.
        path: The other; its categories must be the same.

    Raises:
        ModelError: It is no model file, or its weights are others.
    """
    other = weights(path)
    result = onnx.ModelProto()
    result.CopyFrom(model)
    own = [t for t in result.graph.initializer if t.name.startswith(PREFIX)]
    for tensor in own:
        before = numpy_helper.to_array(tensor)
        met = other.pop(tensor.name.removeprefix(PREFIX), None)
        if met is None or met.shape != before.shape:
            raise ModelError(
                f"{path} cannot be blended in: it has no {tensor.name} like that of the run; give "
                "the model that the run started from"
            )
        tensor.CopyFrom(numpy_helper.from_array((before + met.numpy()) / 2, tensor.name))
    if other:
        raise ModelError(f"{path} cannot be blended in: it knows more, for instance {min(other)}")
    return result


def with_finding_of(model: onnx.ModelProto, path: Path) -> onnx.ModelProto:
    """A model file as it is, but for what finds objects and names their category.

    All it says of poses stays as it is to the bit, and so does its calibration.

    Args:
        model: Of a run that has gone on from that file, as it would be written.
        path: The file; its categories must be the same.

    Raises:
        ModelError: It is no model file, or of other categories, or another network.
    """
    result = read_model(path)
    about, new = metadata(result), metadata(model)
    names, others = ([c["name"] for c in a["categories"]] for a in (about, new))
    given = {t.name: t for t in model.graph.initializer}
    own = tuple(PREFIX + name for name in FINDING)
    replaced = [t for t in result.graph.initializer if t.name.startswith(own)]
    odd = [t.name for t in replaced if t.name not in given or given[t.name].dims != t.dims]
    if names != others or odd or not replaced:
        raise ModelError(
            f"{path} is another network, or knows other categories than the run; give the model "
            "that the run started from"
        )
    for tensor in replaced:
        tensor.CopyFrom(given[tensor.name])
    about["trained"] = {**about["trained"], "finding": new["trained"]}
    return with_metadata(result, about)


def _is_shared(key: str) -> bool:
    own = ("heads.", "category_logits.", "decoder.", "known_objects.", *MAY_LACK)
    return not key.startswith(own) and not key.endswith("num_batches_tracked")


def read_model(path: Path) -> onnx.ModelProto:
    """A file of `r2art export`.

    Raises:
        ModelError: It is none.
    """
    try:
        model = onnx.load(path)
    except (OSError, DecodeError, ValueError) as error:
        raise ModelError(f"cannot read {path} as a model ({error}); choose another") from error
    if not any(m.key == "r2art" for m in model.metadata_props):
        raise ModelError(f"{path} is not a model of r2art; make one with `r2art export`")
    return model


def weights(path: Path) -> dict[str, Tensor]:
    """The weights of a file of `r2art export` by their names in the network, as float32.

    Raises:
        ModelError: It is none.
    """
    arrays = {
        t.name.removeprefix(PREFIX): numpy_helper.to_array(t)
        for t in read_model(path).graph.initializer
        if t.name.startswith(PREFIX)
    }
    found: dict[str, Tensor] = {}
    for name, array in arrays.items():
        if name.endswith(SCALE):
            continue
        value = array.astype(np.float32)
        if name.endswith(BYTES):
            value = value * arrays[name.removesuffix(BYTES) + SCALE]
        found[name.removesuffix(HALF).removesuffix(BYTES)] = torch.from_numpy(value)
    return found


def as_bytes(value: NDArray[np.floating]) -> tuple[NDArray[np.int8], NDArray[np.float32]]:
    """Whole numbers from -127 to 127, and what one of them counts in each row: (R, 1, ...)."""
    rest = tuple(range(1, value.ndim))
    largest = np.abs(value).max(axis=rest, keepdims=True)
    scale = np.maximum(largest, 1e-12).astype(np.float32) / np.float32(127)
    return np.round(value / scale).astype(np.int8), scale


def _for_each_category(network: R2ArtNet, inputs: Sequence[Any]) -> list[tuple[Any, ...]]:
    """The same pass through the heads of every category."""
    return [((name,), *inputs) for name in network.names]


def _normalised(network: R2ArtNet, inputs: Sequence[Any]) -> list[tuple[nn.Conv2d, nn.BatchNorm2d]]:
    """Every convolution whose output goes straight into a normalisation, with that layer."""
    made: dict[int, tuple[nn.Conv2d, Tensor]] = {}  # holds the tensors, so that ids stay unique
    pairs: list[tuple[nn.Conv2d, nn.BatchNorm2d]] = []

    def remember(conv: nn.Conv2d, _: Any, output: Tensor) -> None:
        made[id(output)] = (conv, output)

    def match(norm: nn.BatchNorm2d, arguments: tuple[Tensor, ...]) -> None:
        if id(arguments[0]) in made and all(norm is not known for _, known in pairs):
            pairs.append((made[id(arguments[0])][0], norm))

    hooks = []
    for module in network.modules():
        if isinstance(module, nn.Conv2d):
            hooks.append(module.register_forward_hook(remember))
        elif isinstance(module, nn.BatchNorm2d):
            hooks.append(module.register_forward_pre_hook(match))
    was_training = network.training
    with torch.no_grad():
        for asked in _for_each_category(network, inputs):
            network.eval()(*asked)
    network.train(was_training)
    for hook in hooks:
        hook.remove()
    return pairs
