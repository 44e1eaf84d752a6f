"""The training loop: one process or several (accelerate), resumable at any checkpoint."""

import json
import math
import time
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import torch
from accelerate import Accelerator, DistributedDataParallelKwargs
from rich.progress import Progress, TextColumn, TimeRemainingColumn
from torch import Tensor, nn
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn

from r2art.core.errors import InputError
from r2art.data.shards import Dataset
from r2art.data.surroundings import Surroundings, read_picture
from r2art.learn import augment, checkpoint
from r2art.learn.augment import Chance
from r2art.learn.memory import Photos
from r2art.learn.objective import objective
from r2art.learn.recipes import Recipe
from r2art.method.network import R2ArtNet, unfold_normalisation

LOG = "log.jsonl"
LOG_EVERY = 25
SAVE_EVERY = 250


@dataclass(frozen=True, kw_only=True)
class Training:
    """What to train on, and where to keep the run.

    Attributes:
        recipe: The run.
        data: Folders made by `r2art synth`, one or more per category.
        backbone_weights: ``.npz`` or ``.safetensors`` to start the trunk from.
        backgrounds: Folder of photos to swap in as backdrops.
        out: The run's folder; a run found there goes on where it stopped.
    """

    recipe: Recipe
    data: tuple[Path, ...]
    backbone_weights: Path | None
    backgrounds: Path | None
    out: Path


def load_trunk(network: R2ArtNet, path: Path) -> None:
    """Start the trunk from ImageNet weights; names that differ are an error, not a shrug.

    An ``.npz`` with folded normalisation (no running statistics) is recognised: its BatchNorm
    layers get the identity.
    """
    if not path.is_file():
        raise InputError(f"backbone weights {path} do not exist")
    if path.suffix == ".npz":
        with np.load(path, allow_pickle=False) as f:
            given = {k: torch.from_numpy(f[k].astype(np.float32)) for k in f.files}
    else:
        from safetensors.torch import load_file

        given = load_file(path)
    state = network.trunk.state_dict()
    folded = not any(k.endswith("running_mean") for k in given)
    missing = []
    for key, old in state.items():
        if key in given:
            state[key] = given[key].reshape(old.shape)
        elif folded and key.endswith("running_mean"):
            state[key] = torch.zeros_like(old)
        elif folded and key.endswith("running_var"):
            state[key] = torch.ones_like(old) - 1e-5
        elif folded and key.endswith("weight") and old.ndim == 1:
            state[key] = torch.ones_like(old)
        elif not key.endswith("num_batches_tracked"):
            missing.append(key)
    if missing:
        raise InputError(f"{path} lacks {len(missing)} tensors of the trunk, first {missing[0]}")
    network.trunk.load_state_dict(state)


def load_photos(folders: tuple[Path, ...]) -> dict[str, Photos]:
    """All datasets, by category; several folders of one category are joined."""
    found: dict[str, list[Photos]] = defaultdict(list)
    for folder in folders:
        photos = Photos.from_dataset(Dataset.open(folder))
        found[photos.category.name].append(photos)
    for name, several in found.items():
        if len(several) > 1:
            raise InputError(f"two datasets of {name}; render one larger one instead")
    return {name: several[0] for name, several in sorted(found.items())}


def load_backdrops(folder: Path | None, size: int = 224) -> Tensor | None:
    """(N, 3, size, size) uint8 photos to stand behind objects."""
    pictures = []
    for path in Surroundings.from_folder(folder).photos:
        photo = torch.from_numpy(read_picture(path).copy()).permute(2, 0, 1)[None].float()
        side = min(photo.shape[-2:])
        square = photo[..., :side, :side]
        pictures.append(nn.functional.interpolate(square, (size, size), mode="area")[0].byte())
    return torch.stack(pictures) if pictures else None


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


@dataclass(frozen=True)
class Batches:
    """Makes the batch of any step from that step's number."""

    recipe: Recipe
    photos: dict[str, Photos]
    backdrops: Tensor | None
    device: torch.device
    rank: int

    def __call__(self, step: int) -> tuple[str, augment.Crops, augment.Views, Tensor]:
        """Category, its crops, whole photos of all categories, and what those show."""
        key = np.random.SeedSequence((self.recipe.seed, step, self.rank))
        chance = Chance(int(key.generate_state(1, np.uint64)[0] >> 1), self.device)
        names = list(self.photos)
        name = names[step % len(names)]
        size, source = self.recipe.input_size, self.photos[name]
        index = chance.choice(len(source), self.recipe.crops)
        crops = augment.crops(source, index, size, chance, self.backdrops)
        parts, category = [], []
        for c, photos in enumerate(self.photos.values()):
            n = (self.recipe.photos + (c + step) % len(names)) // len(names)
            chosen = chance.choice(len(photos), n)
            parts.append(augment.views(photos, chosen, size, chance, self.backdrops))
            category += [c] * n
        views = augment.Views(
            image=torch.cat([v.image for v in parts]),
            seen=torch.cat([v.seen for v in parts]),
            box=torch.cat([v.box for v in parts]),
        )
        return name, crops, views, torch.tensor(category, device=self.device)


def train(job: Training) -> None:
    """Train, or go on training; leaves checkpoint, log and loss curves in ``job.out``."""
    recipe = job.recipe
    accelerator = Accelerator(
        mixed_precision="bf16" if torch.cuda.is_available() else "no",
        kwargs_handlers=[DistributedDataParallelKwargs(find_unused_parameters=True)],
    )
    device = accelerator.device
    torch.manual_seed(recipe.seed)
    photos = load_photos(job.data)
    backdrops = load_backdrops(job.backgrounds)
    categories = tuple(p.category for p in photos.values())
    network = R2ArtNet(
        categories, recipe.backbone, recipe.input_size, recipe.width, recipe.backbone_options
    )
    batches = Batches(recipe, photos, backdrops, device, accelerator.process_index)
    job.out.mkdir(parents=True, exist_ok=True)
    if job.backbone_weights is not None and not (job.out / checkpoint.STATE).exists():
        load_trunk(network, job.backbone_weights)
        _, crops, views, _ = batches(0)
        unfold_normalisation(network.trunk, torch.cat([crops.image, views.image]).cpu())
    network.to(device=device, memory_format=torch.channels_last)  # type: ignore[call-overload]
    average = AveragedModel(
        network, multi_avg_fn=get_ema_multi_avg_fn(recipe.ema), use_buffers=True
    )
    optimizer = make_optimizer(network, recipe)
    start = checkpoint.resume(job.out, network, average, optimizer)
    model, optimizer = accelerator.prepare(network, optimizer)
    facts = {"data": [_facts(folder) for folder in job.data], "skipped_steps": 0}

    with _progress(accelerator) as progress:
        task = progress.add_task("training", total=recipe.steps, completed=start, loss="")
        sums: dict[str, float] = defaultdict(float)
        since = time.perf_counter()
        for step in range(start, recipe.steps):
            terms = _step(step, recipe, batches, model, optimizer, accelerator)
            if terms is None:
                facts["skipped_steps"] += 1
            else:
                average.update_parameters(network)
                for key, value in terms.items():
                    sums[key] += float(value) / LOG_EVERY
            progress.update(task, advance=1, loss=f"{sums['total']:.3f}")
            if accelerator.is_main_process and (step + 1) % LOG_EVERY == 0:
                seconds = time.perf_counter() - since
                _log(job.out, {"step": step + 1, "seconds": seconds, **sums})
                sums, since = defaultdict(float), time.perf_counter()
            done = step + 1
            if accelerator.is_main_process and (done % SAVE_EVERY == 0 or done == recipe.steps):
                checkpoint.save(
                    job.out, done, recipe, categories, network, average, optimizer, facts
                )
                plot_losses(job.out)


def _step(
    step: int,
    recipe: Recipe,
    batches: Batches,
    model: nn.Module,
    optimizer: Any,
    accelerator: Accelerator,
) -> dict[str, Tensor] | None:
    """One optimiser step; None if the gradient was not finite and the step was skipped."""
    for group in optimizer.param_groups:
        group["lr"] = group["peak_lr"] * learning_rate_share(step, recipe)
    name, crops, views, category = batches(step)
    model.train()
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
        return None
    optimizer.step()
    return {"total": loss.detach(), **{k: v.detach() for k, v in terms.items()}}


def _progress(accelerator: Accelerator) -> Progress:
    from rich.console import Console

    columns = [*Progress.get_default_columns()[:3], TimeRemainingColumn()]
    text = TextColumn("{task.completed}/{task.total}  loss {task.fields[loss]}")
    console = Console(stderr=True)
    return Progress(*columns, text, console=console, disable=not accelerator.is_main_process)


def _facts(folder: Path) -> dict[str, Any]:
    return Dataset.open(folder).manifest


def _log(folder: Path, entry: dict[str, float]) -> None:
    rounded = {k: round(v, 5) if isinstance(v, float) else v for k, v in entry.items()}
    with (folder / LOG).open("a") as f:
        f.write(json.dumps(rounded) + "\n")


def plot_losses(folder: Path) -> None:
    """Draw every logged term over the steps to ``losses.png``."""
    if not (folder / LOG).exists():
        return
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    entries = [json.loads(line) for line in (folder / LOG).read_text().splitlines()]
    names = sorted({k for e in entries for k in e} - {"step", "seconds"})
    columns = 4
    rows = -(-len(names) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(4 * columns, 2.6 * rows), squeeze=False)
    for axis, name in zip(axes.ravel(), names, strict=False):
        pairs = [(e["step"], e[name]) for e in entries if name in e]
        axis.plot(*zip(*pairs, strict=True), linewidth=1)
        axis.set_title(name, fontsize=9)
        if not name.startswith("stage"):
            axis.set_yscale("log")
    for axis in axes.ravel()[len(names) :]:
        axis.axis("off")
    figure.tight_layout()
    figure.savefig(folder / "losses.png", dpi=80)
    plt.close(figure)
