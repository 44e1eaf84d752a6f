"""The training loop: one process or several (accelerate), resumable at any checkpoint."""

import math
import time
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import torch
from accelerate import Accelerator, DistributedDataParallelKwargs
from rich.console import Console
from rich.progress import Progress, TextColumn, TimeRemainingColumn
from torch import Tensor, nn
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn

from r2art.core.category import Category
from r2art.core.errors import UsageError
from r2art.data.shards import Dataset, write_atomically
from r2art.learn import checkpoint, exported
from r2art.learn.allocator import keep_freed_memory
from r2art.learn.batches import Ahead, Batches, load_backdrops, load_photos, placed
from r2art.learn.graphed import GraphedSteps, is_alike
from r2art.learn.hub import start_backbones
from r2art.learn.journal import Journal, forget_after, plot_losses
from r2art.learn.offline import OfflineFeatures
from r2art.learn.pretrained import load_trunk, unfold_normalisation
from r2art.learn.recipes import Recipe
from r2art.learn.shared_norm import share_statistics
from r2art.learn.silhouette_sheet import silhouette_sheet
from r2art.learn.stages import StageLog, forget_stages_after, plot_stages
from r2art.learn.step import Done, Steps
from r2art.method.network import R2ArtNet
from r2art.method.outputs import FINDING, Network
from r2art.method.paper_network import PaperNet
from r2art.method.shape import Prior

LOG_EVERY = 25
SAVE_EVERY = 250


@dataclass(frozen=True, kw_only=True)
class Training:
    """What to train on, and where to keep the run.

    Attributes:
        recipe: The run.
        data: Folders made by `r2art synth`, one per category.
        backbone_weights: ``.npz`` or ``.safetensors`` to start the trunk from; of the paper's
            network see `r2art.learn.hub.start_backbones`.
        init: Folder of a trained run, or model file, to start from; it may know other categories.
        backgrounds: Folder of photos to swap in as backdrops.
        out: The run's folder; a run found there goes on where it stopped.
        minutes: When to end, if the recipe's steps are not done before; the learning rate falls
            in time.
        precision: Of the network's passes: "bf16" for mixed precision, "no" for float32; None:
            mixed on a GPU that has it.
        compiled: Whether the small network's trunk and neck are compiled, which takes minutes
            and a C++ compiler, and shortens the steps on a CPU.
    """

    recipe: Recipe
    data: tuple[Path, ...]
    backbone_weights: Path | None = None
    init: Path | None = None
    backgrounds: Path | None = None
    out: Path
    minutes: float | None = None
    precision: Literal["no", "bf16"] | None = None
    compiled: bool = False


PRETRAINED = ("trunk.", "known_objects.trunk.", "depth.", "joint.")
"""Where the backbones are in the networks."""


def make_optimizer(network: Network, recipe: Recipe) -> torch.optim.Optimizer:
    """AdamW; backbones and dense heads at rates of their own, no decay on biases and norms."""
    groups: dict[tuple[float, bool], list[nn.Parameter]] = defaultdict(list)
    for name, parameter in network.named_parameters():
        if parameter.requires_grad:
            groups[_rate(name, recipe), parameter.ndim > 1].append(parameter)
    on_gpu = any(p.is_cuda for p in network.parameters())
    options: dict[str, Any] = {"fused": True, "capturable": True} if on_gpu else {}

    def start(value: float) -> float | Tensor:  # a graph reads it where it is
        return torch.tensor(value, device="cuda") if on_gpu else value

    return torch.optim.AdamW(
        [
            {
                "params": parameters,
                "lr": start(rate),
                "peak_lr": rate,
                "weight_decay": recipe.weight_decay if decays else 0.0,
            }
            for (rate, decays), parameters in sorted(groups.items())
        ],
        **options,
    )


def _rate(name: str, recipe: Recipe) -> float:
    """At which a parameter learns, at its peak."""
    if name.startswith(PRETRAINED) or (recipe.taught != "all" and name.startswith(FINDING)):
        return recipe.trunk_learning_rate
    is_dense = name.startswith("decoder.") or ".surface." in name
    return recipe.dense_learning_rate if is_dense else recipe.learning_rate


def make_network(
    job: Training, categories: tuple[Category, ...], batches: Batches, device: torch.device
) -> Network:
    """The network at the start of a run, with what the job has for it to start from."""
    recipe = job.recipe
    network = recipe.make(categories)
    if (job.out / checkpoint.STATE).exists():
        pass
    elif job.init is not None:
        _start_from(network, job.init, batches)
    elif isinstance(network, PaperNet):
        names = (recipe.backbone, recipe.depth_backbone, recipe.joint_backbone)
        start_backbones(network, names, job.backbone_weights, recipe.pretrained)
    elif job.backbone_weights is not None:
        assert isinstance(network, R2ArtNet)
        load_trunk(network.trunk, job.backbone_weights)
        crop, _, _, photo = batches(0).inputs()
        unfold_normalisation(network.trunk, torch.cat([crop, photo]).cpu())
        network.start_known_objects()
    return network.to(device).to(memory_format=torch.channels_last)


def _start_from(network: Network, init: Path, batches: Batches) -> None:
    """Take over what a run, or a model file, has learned."""
    if init.is_dir():
        trained, _ = checkpoint.load_network(init)
        checkpoint.adopt(network, trained)
    elif not isinstance(network, R2ArtNet):
        raise UsageError(f"only the small network starts from a model file like {init}; give a run")
    else:
        exported.load_exported(network, init, [t.cpu() for t in batches(0).inputs()])


def _facts_of(init: Path) -> dict[str, Any]:
    return checkpoint.facts(init) if init.is_dir() else exported.facts(init)


def train(job: Training) -> None:
    """Train, or go on training; leaves checkpoint, log and loss curves in ``job.out``."""
    keep_freed_memory()
    accelerator = Accelerator(
        cpu=not torch.accelerator.is_available(),  # else several processes would not meet
        mixed_precision=job.precision or ("bf16" if torch.cuda.is_available() else "no"),
        kwargs_handlers=[DistributedDataParallelKwargs(find_unused_parameters=True)],
    )
    device, is_main = accelerator.device, accelerator.is_main_process
    photos = placed(load_photos(job.data), device)
    recipe = job.recipe.for_photos(
        sum(map(len, photos.values())), len(photos), accelerator.num_processes
    )
    if job.minutes is not None and accelerator.num_processes > 1:
        raise UsageError("several processes cannot agree on a time to end; give --steps")
    if odd := sorted(recipe.turns.keys() - photos.keys()):
        raise UsageError(f"turns are given to {', '.join(odd)}, of which there is no data")
    torch.manual_seed(recipe.seed)
    backdrops = load_backdrops(job.backgrounds)
    backdrops = backdrops if backdrops is None else backdrops.to(device)
    batches = Batches(recipe, photos, backdrops, device, accelerator.process_index)
    categories = tuple(p.category for p in photos.values())
    network = make_network(job, categories, batches, device)
    if accelerator.num_processes > 1:
        share_statistics(network)
    average = AveragedModel(network, multi_avg_fn=running_average(recipe.ema), use_buffers=True)
    optimizer = make_optimizer(network, recipe)
    run = checkpoint.Run(
        recipe=recipe,
        categories=categories,
        network=network,
        average=average,
        optimizer=optimizer,
    )
    start, before = checkpoint.resume(job.out, run)
    facts = {
        "data": [Dataset.open(folder).manifest for folder in job.data],
        "init": _facts_of(job.init) if job.init else None,
        "skipped_steps": before.get("skipped_steps", 0),
        "seconds": before.get("seconds", 0.0),
    }
    if is_main:
        job.out.mkdir(parents=True, exist_ok=True)
        forget_after(job.out, start)
        forget_stages_after(job.out, start)
    offline = OfflineFeatures(network) if recipe.offline_features else None
    if job.compiled and isinstance(network, R2ArtNet):
        network.trunk.compile()
        network.neck.compile()
    model, optimizer = accelerator.prepare(network, optimizer)
    priors = {name: prior.to(device) for name, prior in network.priors.items()}
    source = Ahead(batches) if device.type == "cuda" else batches
    take_step = Steps(source, model, optimizer, accelerator, offline, priors)
    if is_alike(take_step):
        take_step = GraphedSteps(take_step)
    journal, stages = Journal(job.out), StageLog(job.out)

    begun = time.monotonic() - facts["seconds"]
    with _progress(is_main) as progress:
        task = progress.add_task("training", total=recipe.steps, completed=start, loss=math.nan)
        for step in range(start + 1, recipe.steps + 1):
            facts["seconds"] = time.monotonic() - begun
            spent = facts["seconds"] / (60 * job.minutes) if job.minutes else 0.0
            done = take_step(step - 1, spent)
            is_last = step == recipe.steps or spent >= 1
            if done is None:
                facts["skipped_steps"] += 1
            else:
                average.update_parameters(network)
                journal.add(done.terms)
                for name, stage in done.stages.items():
                    stages.add(step, name, done.crops[name].index, stage)
            progress.update(task, advance=1, loss=journal.means().get("total", math.nan))
            if is_main and done is not None and step in recipe.pictures_at:
                _draw(job.out, step, priors, done)
            if is_main and step % LOG_EVERY == 0:
                journal.write(step)
                stages.write()
            if is_main and (step % SAVE_EVERY == 0 or is_last):
                stages.write()
                checkpoint.save(job.out, step, run, facts)
                plot_losses(job.out)
                plot_stages(job.out)
            if is_last:
                break


def running_average(decay: float) -> Callable[[Any, Any, Any], None]:
    """How `AveragedModel` averages: over a tenth of the steps so far until ``decay`` is more.

    What a fresh network says in its first steps would else weigh on it for thousands.
    """

    def update(averaged: Any, current: Any, count: Any) -> None:
        n = int(count)
        get_ema_multi_avg_fn(min(decay, (1 + n) / (10 + n)))(averaged, current, count)

    return update


def _draw(folder: Path, step: int, priors: Mapping[str, Prior], done: Done) -> None:
    """The silhouettes of the first crops of a step's first category."""
    name, crops = next(iter(done.crops.items()))
    sheet = silhouette_sheet(priors[name], done.raw[name], crops)
    write_atomically(folder / f"silhouettes-{step:06d}.png", sheet)


def _progress(is_main: bool) -> Progress:
    columns = [*Progress.get_default_columns()[:3], TimeRemainingColumn()]
    text = TextColumn("{task.completed}/{task.total}  loss {task.fields[loss]:.3f}")
    return Progress(*columns, text, console=Console(stderr=True), disable=not is_main)
