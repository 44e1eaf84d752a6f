"""The training loop: one process or several (accelerate), resumable at any checkpoint."""

import math
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from accelerate import Accelerator, DistributedDataParallelKwargs
from rich.console import Console
from rich.progress import Progress, TextColumn, TimeRemainingColumn
from torch import Tensor, nn
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn

from r2art.core.category import Category
from r2art.data.shards import Dataset
from r2art.learn import checkpoint
from r2art.learn.allocator import keep_freed_memory
from r2art.learn.batches import Batches, load_backdrops, load_photos
from r2art.learn.journal import Journal, forget_after, plot_losses
from r2art.learn.objective import objective
from r2art.learn.pretrained import load_trunk, unfold_normalisation
from r2art.learn.recipes import Recipe
from r2art.method.network import R2ArtNet

LOG_EVERY = 25
SAVE_EVERY = 250


@dataclass(frozen=True, kw_only=True)
class Training:
    """What to train on, and where to keep the run.

    Attributes:
        recipe: The run.
        data: Folders made by `r2art synth`, one per category.
        backbone_weights: ``.npz`` or ``.safetensors`` to start the trunk from.
        init: Folder of a trained run to start from; it may know other categories.
        backgrounds: Folder of photos to swap in as backdrops.
        out: The run's folder; a run found there goes on where it stopped.
    """

    recipe: Recipe
    data: tuple[Path, ...]
    backbone_weights: Path | None = None
    init: Path | None = None
    backgrounds: Path | None = None
    out: Path


def learning_rate_share(step: int, recipe: Recipe) -> float:
    """Share of the peak learning rate: linear warm-up, then cosine to 1 %."""
    if step < recipe.warm_up:
        return (step + 1) / recipe.warm_up
    done = (step - recipe.warm_up) / max(1, recipe.steps - recipe.warm_up)
    return 0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * min(done, 1.0)))


def make_optimizer(network: R2ArtNet, recipe: Recipe) -> torch.optim.Optimizer:
    """AdamW; the trunk slower than the rest, no decay on biases and norms."""
    groups: dict[tuple[bool, bool], list[nn.Parameter]] = defaultdict(list)
    for name, parameter in network.named_parameters():
        groups[name.startswith("trunk."), parameter.ndim > 1].append(parameter)
    rate = {True: recipe.trunk_learning_rate, False: recipe.learning_rate}
    return torch.optim.AdamW(
        [
            {
                "params": parameters,
                "lr": rate[in_trunk],
                "peak_lr": rate[in_trunk],
                "weight_decay": recipe.weight_decay if decays else 0.0,
            }
            for (in_trunk, decays), parameters in sorted(groups.items())
        ]
    )


def make_network(
    job: Training, categories: tuple[Category, ...], batches: Batches, device: torch.device
) -> R2ArtNet:
    """The network at the start of a run; its trunk pre-trained if the job has weights for it."""
    recipe = job.recipe
    network = R2ArtNet(
        categories, recipe.backbone, recipe.input_size, recipe.width, recipe.backbone_options
    )
    if (job.out / checkpoint.STATE).exists():
        pass
    elif job.init is not None:
        trained, _ = checkpoint.load_network(job.init)
        checkpoint.adopt(network, trained)
    elif job.backbone_weights is not None:
        load_trunk(network.trunk, job.backbone_weights)
        _, crops, views, _ = batches(0)
        unfold_normalisation(network.trunk, torch.cat([crops.image, views.image]).cpu())
    return network.to(device).to(memory_format=torch.channels_last)


def train(job: Training) -> None:
    """Train, or go on training; leaves checkpoint, log and loss curves in ``job.out``."""
    recipe = job.recipe
    keep_freed_memory()
    accelerator = Accelerator(
        mixed_precision="bf16" if torch.cuda.is_available() else "no",
        kwargs_handlers=[DistributedDataParallelKwargs(find_unused_parameters=True)],
    )
    device, is_main = accelerator.device, accelerator.is_main_process
    torch.manual_seed(recipe.seed)
    photos = load_photos(job.data)
    backdrops = load_backdrops(job.backgrounds)
    batches = Batches(recipe, photos, backdrops, device, accelerator.process_index)
    categories = tuple(p.category for p in photos.values())
    network = make_network(job, categories, batches, device)
    average = AveragedModel(
        network, multi_avg_fn=get_ema_multi_avg_fn(recipe.ema), use_buffers=True
    )
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
        "init": checkpoint.facts(job.init) if job.init else None,
        "skipped_steps": before.get("skipped_steps", 0),
    }
    if is_main:
        job.out.mkdir(parents=True, exist_ok=True)
        forget_after(job.out, start)
    model, optimizer = accelerator.prepare(network, optimizer)
    journal = Journal(job.out)

    with _progress(is_main) as progress:
        task = progress.add_task("training", total=recipe.steps, completed=start, loss=math.nan)
        for done in range(start + 1, recipe.steps + 1):
            terms = _step(done - 1, batches, model, optimizer, accelerator)
            if terms is None:
                facts["skipped_steps"] += 1
            else:
                average.update_parameters(network)
                journal.add(terms)
            progress.update(task, advance=1, loss=journal.means().get("total", math.nan))
            if is_main and done % LOG_EVERY == 0:
                journal.write(done)
            if is_main and (done % SAVE_EVERY == 0 or done == recipe.steps):
                checkpoint.save(job.out, done, run, facts)
                plot_losses(job.out)


def _step(
    step: int, batches: Batches, model: nn.Module, optimizer: Any, accelerator: Accelerator
) -> dict[str, Tensor] | None:
    """One optimiser step.

    Returns:
        Its losses; None if the gradient was not finite. Then nothing has changed, not even the
        statistics of the normalisation.
    """
    recipe = batches.recipe
    for group in optimizer.param_groups:
        group["lr"] = group["peak_lr"] * learning_rate_share(step, recipe)
    name, crops, views, category = batches(step)
    model.train()
    buffers = [b.clone() for b in model.buffers()]
    image = crops.image.contiguous(memory_format=torch.channels_last)
    with accelerator.autocast():
        output = model(name, image, crops.box, crops.K, views.image)
    prior = accelerator.unwrap_model(model).priors[name].to(crops.image.device)
    joined = recipe.cascade_from is not None and step >= recipe.cascade_from
    pixels = recipe.cascade_pixels if joined else None
    loss, terms = objective(prior, output, crops, views, category, recipe.weights, pixels)
    optimizer.zero_grad()
    accelerator.backward(loss)
    norm = accelerator.clip_grad_norm_(model.parameters(), recipe.gradient_norm)
    if norm is not None and not torch.isfinite(norm):
        for buffer, old in zip(model.buffers(), buffers, strict=True):
            buffer.copy_(old)
        return None
    optimizer.step()
    return {"total": loss.detach(), **{k: v.detach() for k, v in terms.items()}}


def _progress(is_main: bool) -> Progress:
    columns = [*Progress.get_default_columns()[:3], TimeRemainingColumn()]
    text = TextColumn("{task.completed}/{task.total}  loss {task.fields[loss]:.3f}")
    return Progress(*columns, text, console=Console(stderr=True), disable=not is_main)
