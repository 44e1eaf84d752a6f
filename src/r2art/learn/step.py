"""One step of training: a batch, its losses, and what the optimiser makes of them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import torch
from accelerate import Accelerator
from jaxtyping import Float, Int
from torch import Tensor, nn

from r2art.learn.augment import Crops
from r2art.learn.batches import Ahead, Batch, Batches
from r2art.learn.objective import objective
from r2art.learn.offline import OfflineFeatures
from r2art.learn.recipes import Recipe
from r2art.method.outputs import RawEstimate
from r2art.method.shape import Prior


@dataclass(frozen=True, kw_only=True)
class Done:
    """What a step has done.

    Attributes:
        crops: Of this process, by category.
        raw: What the network said of them, likewise.
        stages: The cascade's stage of each, likewise; empty without the cascade.
        terms: Every loss, and their total: means over all processes.
    """

    crops: Mapping[str, Crops]
    raw: Mapping[str, RawEstimate]
    stages: Mapping[str, Int[Tensor, " B"]]
    terms: dict[str, float]


def learning_rate_share(step: int, recipe: Recipe, time_share: float = 0.0) -> float:
    """Share of the peak learning rate: linear warm-up, then cosine to 1 %.

    Args:
        step: Steps done.
        recipe: Says how many there are to be.
        time_share: Share of the time that is spent, where that may end training before.
    """
    if step < recipe.warm_up:
        return (step + 1) / recipe.warm_up
    done = max(time_share, (step - recipe.warm_up) / max(1, recipe.steps - recipe.warm_up))
    return 0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * min(done, 1.0)))


@dataclass(frozen=True, kw_only=True)
class Passed:
    """What a pass and its gradient gave, all on the device.

    Attributes:
        numbers: The gradient's norm before it was clipped, the total loss, and every term.
        names: Of the terms.
        raw: See `Done` ...
        stages: ... likewise.
    """

    numbers: Float[Tensor, " N"]
    names: tuple[str, ...]
    raw: Mapping[str, RawEstimate]
    stages: Mapping[str, Int[Tensor, " B"]]


@dataclass(frozen=True)
class Steps:
    """Takes the steps of a run.

    Attributes:
        batches: Makes their batches.
        model: The network, as `accelerator` has prepared it.
        optimizer: Likewise.
        accelerator: Of this process.
        offline: Frozen features, where the recipe keeps them.
        priors: By category, on the device.
    """

    batches: Batches | Ahead
    model: nn.Module
    optimizer: Any
    accelerator: Accelerator
    offline: OfflineFeatures | None
    priors: Mapping[str, Prior]

    def __call__(self, step: int, time_share: float = 0.0) -> Done | None:
        """Take one step; for the arguments see `learning_rate_share`.

        Returns:
            None if the gradient was not finite. Then nothing has changed, not even the
            statistics of the normalisation.
        """
        self.set_rates(step, time_share)
        batch = self.batches(step)
        self.model.train()
        buffers = [b.clone() for b in self.model.buffers()]
        passed = self.passed(batch, self.pixels(step))
        norm, *means = self.read(passed.numbers)
        if not math.isfinite(norm):
            for buffer, old in zip(self.model.buffers(), buffers, strict=True):
                buffer.copy_(old)
            return None
        self.optimizer.step()
        return done(batch, passed, means)

    def set_rates(self, step: int, time_share: float) -> None:
        """Give the optimiser the learning rates of a step."""
        share = learning_rate_share(step, self.batches.recipe, time_share)
        for group in self.optimizer.param_groups:
            if isinstance(group["lr"], Tensor):
                group["lr"].fill_(group["peak_lr"] * share)
            else:
                group["lr"] = group["peak_lr"] * share

    def pixels(self, step: int) -> int | None:
        """Side of the cascade's silhouettes at a step; None before it has joined."""
        recipe = self.batches.recipe
        joined = recipe.cascade_from is not None and step >= recipe.cascade_from
        return recipe.cascade_pixels if joined else None

    def passed(self, batch: Batch, pixels: int | None) -> Passed:
        """Pass a batch through the network and its loss, and leave the clipped gradient."""
        recipe, accelerator = self.batches.recipe, self.accelerator
        with accelerator.autocast():
            image, *others = batch.inputs()
            image = image.contiguous(memory_format=torch.channels_last)
            output = self.model(batch.names, image, *others, **self._features(batch))
        loss, terms, stages = objective(
            self.priors,
            output,
            batch.crops,
            batch.views,
            batch.category,
            recipe.weights,
            pixels,
            recipe.cascade,
        )
        self.optimizer.zero_grad()
        accelerator.backward(loss)
        norm = accelerator.clip_grad_norm_(self.model.parameters(), recipe.gradient_norm)
        assert norm is not None
        numbers = [v.detach().float() for v in (norm, loss, *terms.values())]
        return Passed(
            numbers=torch.stack(numbers),
            names=tuple(terms),
            raw={name: c.raw for name, c in output.crops.items() if c.raw is not None},
            stages=stages,
        )

    def read(self, numbers: Tensor) -> list[float]:
        """Means over all processes; the one place of a step that waits for a GPU."""
        if self.accelerator.num_processes > 1:
            return cast(Tensor, self.accelerator.reduce(numbers, "mean")).tolist()
        return numbers.tolist()

    def _features(self, batch: Batch) -> dict[str, Tensor]:
        if self.offline is None:
            return {}
        names = list(self.batches.photos)
        shown = [names[c] for c in batch.category.tolist()]
        return {"offline": self.offline(batch.crops, shown, batch.views)}


def done(batch: Batch, passed: Passed, means: list[float]) -> Done:
    """The outcome of a step whose total loss and terms have these means."""
    terms = dict(zip(("total", *passed.names), means, strict=True))
    return Done(crops=batch.crops, raw=passed.raw, stages=passed.stages, terms=terms)
