"""A run's state on disk: safetensors for tensors, JSON for the rest; never pickle."""

import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch
from safetensors.torch import load_file, save_file
from torch import Tensor, nn

from r2art.core.category import Category
from r2art.core.errors import ModelError
from r2art.learn.recipes import Recipe
from r2art.method.network import R2ArtNet

STATE = "state.safetensors"
RUN = "run.json"


def save(
    folder: Path,
    step: int,
    recipe: Recipe,
    categories: tuple[Category, ...],
    model: nn.Module,
    average: nn.Module,
    optimizer: torch.optim.Optimizer,
    facts: dict[str, Any],
) -> None:
    """Write a checkpoint whole or not at all; it replaces the one before."""
    tensors = {f"model.{k}": v for k, v in model.state_dict().items()}
    tensors |= {f"average.{k}": v for k, v in average.state_dict().items()}
    for i, state in optimizer.state_dict()["state"].items():
        tensors |= {f"optimizer.{i}.{k}": torch.as_tensor(v) for k, v in state.items()}
    tensors["step"] = torch.tensor(step)
    tensors = {k: v.detach().cpu().contiguous().clone() for k, v in tensors.items()}
    for category in categories:
        with (folder / f"{category.name}.npz").open("wb") as f:
            category.save(f)
    run = {"recipe": asdict(recipe), "categories": [c.name for c in categories], **facts}
    (folder / RUN).write_text(json.dumps(run, indent=1))
    save_file(tensors, folder / (STATE + ".part"))
    os.replace(folder / (STATE + ".part"), folder / STATE)


def resume(
    folder: Path, model: nn.Module, average: nn.Module, optimizer: torch.optim.Optimizer
) -> int:
    """Load a checkpoint, if there is one, and return the steps it has done."""
    if not (folder / STATE).exists():
        return 0
    tensors = load_file(folder / STATE)
    model.load_state_dict(_under(tensors, "model."))
    average.load_state_dict(_under(tensors, "average."))
    states: dict[int, dict[str, Tensor]] = {}
    for key, value in _under(tensors, "optimizer.").items():
        i, _, name = key.partition(".")
        states.setdefault(int(i), {})[name] = value
    groups = optimizer.state_dict()["param_groups"]
    optimizer.load_state_dict({"state": states, "param_groups": groups})
    return int(tensors["step"])


def load_network(folder: Path) -> tuple[R2ArtNet, dict[str, Any]]:
    """The averaged network of a run, ready for evaluation, and the run's facts."""
    if not (folder / STATE).exists():
        raise ModelError(f"{folder} holds no trained run; train one with `r2art train`")
    run = json.loads((folder / RUN).read_text())
    categories = tuple(Category.load(folder / f"{name}.npz") for name in run["categories"])
    recipe = run["recipe"]
    network = R2ArtNet(
        categories,
        recipe["backbone"],
        recipe["input_size"],
        recipe["width"],
        recipe["backbone_options"],
    )
    average = _under(load_file(folder / STATE), "average.module.")
    network.load_state_dict(average)
    return network.eval(), run


def _under(tensors: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {k[len(prefix) :]: v for k, v in tensors.items() if k.startswith(prefix)}
