"""One step of training: a batch, its losses, and what the optimiser makes of them."""

import math
from dataclasses import dataclass
from typing import Any

import torch
from accelerate import Accelerator
from jaxtyping import Int
from torch import Tensor, nn

from r2art.learn.augment import Crops
from r2art.learn.batches import Batches
from r2art.learn.objective import objective
from r2art.learn.offline import OfflineFeatures
from r2art.learn.recipes import Recipe
from r2art.method.outputs import RawEstimate


@dataclass(frozen=True, kw_only=True)
class Done:
    """What a step has done.

    Attributes:
        name: The crops' category.
        crops: Of this process.
        raw: What the network said of them.
        stage: The cascade's stage of each; None without the cascade.
        terms: Every loss, and their total: means over all processes.
    """

    name: str
    crops: Crops
    raw: RawEstimate
    stage: Int[Tensor, " B"] | None
    terms: dict[str, Tensor]


def learning_rate_share(step: int, recipe: Recipe) -> float:
    """Share of the peak learning rate: linear warm-up, then cosine to 1 %."""
    if step < recipe.warm_up:
        return (step + 1) / recipe.warm_up
    done = (step - recipe.warm_up) / max(1, recipe.steps - recipe.warm_up)
    return 0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * min(done, 1.0)))


@dataclass(frozen=True)
class Steps:
    """Takes the steps of a run.

    Attributes:
        batches: Makes their batches.
        model: The network, as `accelerator` has prepared it.
        optimizer: Likewise.
        accelerator: Of this process.
        offline: Frozen features, where the recipe keeps them.
    """

    batches: Batches
    model: nn.Module
    optimizer: Any
    accelerator: Accelerator
    offline: OfflineFeatures | None

    def __call__(self, step: int) -> Done | None:
        """Take one step.

        Returns:
            None if the gradient was not finite. Then nothing has changed, not even the
            statistics of the normalisation.
        """
        recipe, model, accelerator = self.batches.recipe, self.model, self.accelerator
        for group in self.optimizer.param_groups:
            group["lr"] = group["peak_lr"] * learning_rate_share(step, recipe)
        name, crops, views, category = self.batches(step)
        model.train()
        buffers = [b.clone() for b in model.buffers()]
        image = crops.image.contiguous(memory_format=torch.channels_last)
        with accelerator.autocast():
            known = self._features(name, crops, views, category)
            output = model(name, image, crops.box, crops.K, views.image, **known)
        prior = accelerator.unwrap_model(model).priors[name].to(crops.image.device)
        joined = recipe.cascade_from is not None and step >= recipe.cascade_from
        pixels = recipe.cascade_pixels if joined else None
        loss, terms, stage = objective(
            prior, output, crops, views, category, recipe.weights, pixels, recipe.cascade
        )
        self.optimizer.zero_grad()
        accelerator.backward(loss)
        norm = accelerator.clip_grad_norm_(model.parameters(), recipe.gradient_norm)
        if norm is not None and not torch.isfinite(norm):
            for buffer, old in zip(model.buffers(), buffers, strict=True):
                buffer.copy_(old)
            return None
        self.optimizer.step()
        terms = self._mean({"total": loss, **terms})
        return Done(name=name, crops=crops, raw=output.raw, stage=stage, terms=terms)

    def _features(self, name: str, crops: Crops, views: Any, category: Tensor) -> dict[str, Tensor]:
        if self.offline is None:
            return {}
        names = list(self.batches.photos)
        shown = [names[c] for c in category.tolist()]
        return {"offline": self.offline(name, crops, shown, views)}

    def _mean(self, terms: dict[str, Tensor]) -> dict[str, Tensor]:
        """Over all processes."""
        terms = {k: v.detach() for k, v in terms.items()}
        if self.accelerator.num_processes == 1:
            return terms
        together = torch.stack([v.to(self.accelerator.device).float() for v in terms.values()])
        return dict(zip(terms, self.accelerator.reduce(together, "mean"), strict=True))
