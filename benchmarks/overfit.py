"""Whether a network can learn eight photos by heart: no less than it must.

python benchmarks/overfit.py --recipe paper --category drawer --steps 1500 --out overfit

Renders eight photos, trains on them alone (from random numbers unless --backbone-weights is given,
without augmentation), and prints the ADD on them as a share of the object's diagonal. A run that
was stopped goes on. `--results docs/results.md` writes the figure down.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import torch

from r2art.data.objects import Procedural
from r2art.data.shards import Dataset
from r2art.data.synth import Synth, synth
from r2art.learn import checkpoint
from r2art.learn.augment import crops
from r2art.learn.chance import Chance
from r2art.learn.memory import Photos
from r2art.learn.objective import true_shape
from r2art.learn.recipes import RECIPES, Recipe
from r2art.learn.results import write_section
from r2art.learn.train import Training, train
from r2art.method import se3
from r2art.method.estimate import estimate

PHOTOS = 8


def by_heart(recipe: Recipe) -> Recipe:
    """The recipe for eight photos: fast, no decay, no augmentation, a short running average."""
    return replace(
        recipe,
        pretrained=False,
        offline_features=True,
        crops=PHOTOS,
        photos=1,
        learning_rate=1e-3,
        trunk_learning_rate=1e-3,
        warm_up=min(50, recipe.steps // 4),
        weight_decay=0.0,
        ema=0.98,
        cascade_from=recipe.steps // 2,
    )


@torch.no_grad()
def add_share(run: Path, data: Path) -> torch.Tensor:
    """(photos, parts) ADD of the run's averaged network over the diagonal of the object at rest."""
    network, _ = checkpoint.load_network(run)
    photos = Photos.from_dataset(Dataset.open(data))
    name, prior = photos.category.name, network.priors[photos.category.name]
    everything, chance = torch.arange(len(photos)), Chance(0, torch.device("cpu"))
    true = crops(photos, everything, network.input_size, chance, None, augment=False)
    _, seen = network.features(true.image)
    found = estimate(prior, network.estimate_raw(name, seen, true.box, true.K), true.box, true.K)
    shape = true_shape(prior, true)
    error = se3.transform(found.cam_T_part, shape.points)
    error = error - se3.transform(true.cam_T_part, shape.points)
    lower = (shape.box_center - shape.box_size / 2).amin(1)
    upper = (shape.box_center + shape.box_size / 2).amax(1)
    diagonal = torch.linalg.vector_norm(upper - lower, dim=-1)
    return torch.linalg.vector_norm(error, dim=-1).mean(-1) / diagonal[:, None]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--recipe", default="paper", choices=sorted(RECIPES))
    parser.add_argument("--category", default="drawer")
    parser.add_argument("--steps", type=int, default=1500)
    parser.add_argument("--backbone-weights", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--results", type=Path)
    a = parser.parse_args()
    data, run = a.out / "data", a.out / "run"
    objects = Procedural(a.category)
    synth(
        Synth(
            objects=objects,
            n=PHOTOS,
            seed=0,
            split="train",
            size=224,
            backgrounds=None,
            out=data,
            workers=1,
        )
    )
    recipe = by_heart(RECIPES[a.recipe](a.steps))
    job = Training(
        recipe=recipe,
        data=(data,),
        backbone_weights=a.backbone_weights,
        out=run,
        precision="no",  # half precision cannot tell half a per cent
    )
    train(job)
    share = 100 * add_share(run, data)
    weights = a.backbone_weights.name if a.backbone_weights else "random weights"
    text = (
        f"ADD on the {PHOTOS} photos it was trained on: {share.mean():.2f} % of the diagonal in "
        f"the mean, {share.max():.2f} % for the worst part; recipe `{a.recipe}`, {a.category}, "
        f"{a.steps} steps, {weights}."
    )
    print(text)
    if a.results:
        command = (
            f"python benchmarks/overfit.py --recipe {a.recipe} --category {a.category} "
            f"--steps {a.steps} --out DIR --results {a.results}"
        )
        page = f"## Learning eight photos by heart\n\n{text}\nMeasured by `{command}`.\n"
        write_section(a.results, f"overfit-{a.recipe}", page)


if __name__ == "__main__":
    main()
