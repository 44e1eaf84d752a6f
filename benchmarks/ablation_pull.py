"""Where the cascade pulls a network that has not met it: its gradient against the other losses'."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from r2art.data.shards import Dataset
from r2art.learn import checkpoint
from r2art.learn.augment import crops
from r2art.learn.chance import Chance
from r2art.learn.memory import Photos
from r2art.learn.objective import CascadeOptions, Weights, crop_losses
from r2art.method.outputs import CropOutput

STAGES = {
    "area": (1,),
    "area, alignment": (1, 2),
    "area, alignment, pixel": (1, 2, 3),
    "pixel only": (3,),
}


def pulls(run: Path, data: Path, weights: Weights, n: int = 128) -> dict[str, list[float]]:
    """By the cascade's stages: its gradient's length, as a share, and two cosines.

    Args:
        run: A trained network.
        data: Of whose first ``n`` photos the losses are.
        weights: Of the losses.

    Returns:
        Length over that of all other losses together, cosine with these, and with the
        reprojection loss alone.
    """
    network, _ = checkpoint.load_network(run)
    dataset, name = Dataset.open(data), network.names[0]
    photos, chance = Photos.from_dataset(dataset), Chance(0, torch.device("cpu"))
    some = crops(
        photos, torch.arange(min(n, len(photos))), network.input_size, chance, None, augment=False
    )
    _, seen = network.features(some.image)
    raw = network.estimate_raw(name, seen, some.box, some.K)
    output = CropOutput(raw=raw, part_logits=None, object_logits=None)
    learned = [p for p in network.parameters() if p.requires_grad]

    def gradient(loss: Tensor) -> Tensor:
        found = torch.autograd.grad(
            loss, learned, retain_graph=True, allow_unused=True, materialize_grads=True
        )
        return torch.cat([g.flatten() for g in found])

    pulled: dict[str, list[float]] = {}
    for key, stages in STAGES.items():
        options = CascadeOptions(stages=stages)
        terms, _ = crop_losses(network.priors[name], output, some, 56, options)
        reprojection = gradient(terms["reprojection"])
        terms = {k: getattr(weights, k) * v for k, v in terms.items() if hasattr(weights, k)}
        del terms["confidence"]  # it moves nothing but itself
        ours = gradient(terms.pop("cascade"))
        others = gradient(torch.stack(list(terms.values())).sum())
        pulled[key] = [
            float(ours.norm() / others.norm()),
            float(torch.cosine_similarity(ours, others, dim=0)),
            float(torch.cosine_similarity(ours, reprojection, dim=0)),
        ]
    return pulled


def table(found: list[dict[str, list[float]]]) -> Iterator[str]:
    """Markdown: means over runs."""
    yield "| cascade | length, % of the others' | cosine with the others | with reprojection |"
    yield "| --- | ---: | ---: | ---: |"
    for key in STAGES:
        length, cosine, to_reprojection = np.mean([f[key] for f in found], axis=0)
        yield f"| {key} | {100 * length:.0f} | {cosine:+.2f} | {to_reprojection:+.2f} |"
