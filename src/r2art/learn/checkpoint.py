"""A run's state on disk: safetensors for tensors, JSON for the rest; never pickle."""

import io
import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch
from safetensors.torch import load_file, save_file
from torch import Tensor, nn

from r2art.core.category import Category
from r2art.core.errors import InputError, ModelError
from r2art.data.shards import write_atomically
from r2art.learn.exported import matched_answers
from r2art.learn.recipes import NETWORK_FIELDS, Recipe, recipe_of
from r2art.method.network import R2ArtNet
from r2art.method.outputs import Network

STATE = "state.safetensors"
RUN = "run.json"


@dataclass(frozen=True, kw_only=True)
class Run:
    """What a checkpoint holds, besides the number of steps done.

    Attributes:
        recipe: How it is trained.
        categories: What the network can estimate.
        network: As the optimiser sees it.
        average: Its running average, which is what is exported.
        optimizer: With the state of every parameter.
    """

    recipe: Recipe
    categories: tuple[Category, ...]
    network: nn.Module
    average: nn.Module
    optimizer: torch.optim.Optimizer


def save(folder: Path, step: int, run: Run, more: dict[str, Any]) -> None:
    """Write a checkpoint whole or not at all; it replaces the one before.

    Args:
        folder: The run's.
        step: Steps done.
        run: Its state.
        more: More facts to keep in ``run.json``.
    """
    tensors = {f"model.{k}": v for k, v in run.network.state_dict().items()}
    tensors |= {f"average.{k}": v for k, v in run.average.state_dict().items()}
    for i, state in run.optimizer.state_dict()["state"].items():
        tensors |= {f"optimizer.{i}.{k}": torch.as_tensor(v) for k, v in state.items()}
    tensors["step"] = torch.tensor(step)
    tensors = {k: v.detach().cpu().contiguous().clone() for k, v in tensors.items()}
    for category in run.categories:
        prior = io.BytesIO()
        category.save(prior)
        write_atomically(folder / f"{category.name}.npz", prior.getvalue())
    names = [c.name for c in run.categories]
    about = {"recipe": asdict(run.recipe), "categories": names, **more}
    write_atomically(folder / RUN, json.dumps(about, indent=1).encode())
    save_file(tensors, folder / (STATE + ".part"))
    os.replace(folder / (STATE + ".part"), folder / STATE)


def resume(folder: Path, run: Run) -> tuple[int, dict[str, Any]]:
    """Load a checkpoint into a run, if there is one.

    Returns:
        The steps it has done, and what `save` was given as facts (and more).

    Raises:
        InputError: The folder holds a run of another network.
    """
    if not (folder / STATE).exists():
        return 0, {}
    about = facts(folder)
    _refuse_another_network(folder, run, about)
    tensors = load_file(folder / STATE)
    run.network.load_state_dict(_under(tensors, "model."))
    run.average.load_state_dict(_under(tensors, "average."))
    states: dict[int, dict[str, Tensor]] = {}
    for key, value in _under(tensors, "optimizer.").items():
        i, _, name = key.partition(".")
        states.setdefault(int(i), {})[name] = value
    groups = run.optimizer.state_dict()["param_groups"]
    run.optimizer.load_state_dict({"state": states, "param_groups": groups})
    return int(tensors["step"]), about


def _refuse_another_network(folder: Path, run: Run, about: dict[str, Any]) -> None:
    before = recipe_of(about["recipe"])
    odd = [k for k in NETWORK_FIELDS if getattr(before, k) != getattr(run.recipe, k)]
    if about["categories"] != [c.name for c in run.categories]:
        odd.append("categories")
    if odd:
        raise InputError(
            f"{folder} already holds another run (differs in {', '.join(odd)}); "
            "choose another --out"
        )


def load_network(folder: Path) -> tuple[Network, dict[str, Any]]:
    """The averaged network of a run, ready for evaluation, and the run's facts."""
    if not (folder / STATE).exists():
        raise ModelError(f"{folder} holds no trained run; train one with `r2art train`")
    about = facts(folder)
    categories = tuple(Category.load(folder / f"{name}.npz") for name in about["categories"])
    network = recipe_of(about["recipe"]).make(categories)
    average = _under(load_file(folder / STATE), "average.module.")
    network.load_state_dict(average)
    return network.eval(), about


def adopt(network: Network, trained: Network) -> None:
    """Start a network from a trained one, which may know other categories.

    Heads of categories that both know are taken over, and what the classifier says of them.

    Raises:
        InputError: Their trunks, necks or input sizes differ.
    """
    theirs, ours = trained.state_dict(), network.state_dict()
    fitting = {k: v for k, v in theirs.items() if k in ours and ours[k].shape == v.shape}
    own = ("heads.", "category_logits.", "known_objects.")
    shared = [k for k in ours if not k.startswith(own)]
    if odd := [k for k in shared if k not in fitting]:
        raise InputError(
            f"the run to start from is another network (first at {odd[0]}); "
            "start from a run of the same recipe"
        )
    fitting |= matched_answers(ours, theirs, network.names, trained.names)
    network.load_state_dict(ours | fitting)
    if isinstance(network, R2ArtNet):
        network.start_known_objects(theirs)


def facts(folder: Path) -> dict[str, Any]:
    """What ``run.json`` of a run says."""
    return json.loads((folder / RUN).read_text())


def _under(tensors: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {k[len(prefix) :]: v for k, v in tensors.items() if k.startswith(prefix)}
