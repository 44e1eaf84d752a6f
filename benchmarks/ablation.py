"""The paper's Table 2 on rendered drawers, and joint-centric against part-centric.

r2art synth drawer -n 4000 --seed 1 --split train --backgrounds DIR --out data/drawer-train
r2art synth drawer -n 500 --seed 0 --split test --backgrounds DIR --out data/drawer-test
python benchmarks/ablation.py --train data/drawer-train --test data/drawer-test --out ablation \\
    --backbone-weights mobilenetv2.npz --results docs/results.md --figure docs/images/ablation.png

Trains every row with every seed on the same budget, one after the other, and measures each on the
test photos with the box given. The trunk is frozen and its features kept, so that all of it takes
an hour of one CPU core. What is done is kept: stopped, it goes on where it was, and more seeds or
rows can be added later. `--results` writes the tables as a section of that page, `--figure` a
picture of all runs, and beside it one of silhouettes.
"""

import argparse
import os
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path

import ablation_pull as pull
import ablation_report as report
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from r2art.data.shards import Dataset, from_row
from r2art.learn import checkpoint
from r2art.learn.augment import Crops, crops
from r2art.learn.chance import Chance
from r2art.learn.memory import Photos
from r2art.learn.objective import WHOLE_CASCADE, Weights, renderings, true_shape
from r2art.learn.recipes import RECIPES, Recipe
from r2art.learn.results import write_section
from r2art.learn.train import Training, train
from r2art.method import cascade, se3
from r2art.method.depth import translation_targets, viewing_ray
from r2art.method.estimate import Estimate, estimate, share_from_state
from r2art.method.outputs import RawEstimate
from r2art.method.rotation import egocentric_to_allocentric
from r2art.method.shape import Prior, deformation_of

CPU = torch.device("cpu")
POSE_ONLY = Weights(part_mask=0.0, object_mask=0.0, photo_mask=0.0, found_box=0.0, category=0.0)
"""Box and category are given, and the dense heads cost as much as all the rest."""


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Of N test photos of P parts.

    Attributes:
        add: ADD (m).
        aligned: ADD after the best common factor on the translations of a photo.
        visible: Share of each part's silhouette that nothing hides.
        rotation: Of the root (°).
        joint: Of the joint states (rad, m), positive where they are too large.
        depth: Of the root, as a share.
        overlap: IoU of the soft silhouettes of the whole object, and ...
        part_overlap: ... of every part.
        stage: In which stage of the cascade the estimate would be.
    """

    add: NDArray[np.floating]
    aligned: NDArray[np.floating]
    visible: NDArray[np.floating]
    rotation: NDArray[np.floating]
    joint: NDArray[np.floating]
    depth: NDArray[np.floating]
    overlap: NDArray[np.floating]
    part_overlap: NDArray[np.floating]
    stage: NDArray[np.integer]


@torch.no_grad()
def measure(say: Callable[[Crops], RawEstimate], size: int, data: Path, batch: int = 64) -> Errors:
    """Errors on a dataset of what ``say`` says of its crops of ``size`` px."""
    dataset = Dataset.open(data)
    photos, prior = Photos.from_dataset(dataset), Prior.from_category(dataset.category)
    rows: list[dict[str, Tensor]] = []
    for index in torch.arange(len(photos)).split(batch):
        true = crops(photos, index, size, Chance(0, CPU), None, augment=False)
        rows.append(errors_of(prior, estimate(prior, say(true), true.box, true.K), true))
    found = {k: torch.cat([row[k] for row in rows]).numpy() for k in rows[0]}
    visible = np.stack([from_row(row).visible for row in dataset.rows()])
    return Errors(visible=visible, **found)


def errors_of(prior: Prior, found: Estimate, true: Crops, pixels: int = 56) -> dict[str, Tensor]:
    shape = true_shape(prior, true)
    target = se3.transform(true.cam_T_part, shape.points)
    turned = shape.points @ found.cam_T_part[..., :3, :3].mT
    t = found.cam_T_part[..., None, :3, 3]
    scale = (t * (target - turned)).sum((1, 2, 3)) / t.expand_as(target).square().sum((1, 2, 3))
    add, aligned = (
        torch.linalg.vector_norm(turned + f[:, None, None, None] * t - target, dim=-1).mean(-1)
        for f in (torch.ones_like(scale), scale)
    )
    between = found.cam_T_part[:, 0, :3, :3].mT @ true.cam_T_part[:, 0, :3, :3]
    cosine = (between.diagonal(dim1=1, dim2=2).sum(1) - 1) / 2
    z, true_z = found.cam_T_part[:, 0, 2, 3], true.cam_T_part[:, 0, 2, 3]
    drawn, truth = renderings(found, true, shape, pixels, WHOLE_CASCADE)
    return {
        "add": add,
        "aligned": aligned,
        "rotation": torch.rad2deg(cosine.clamp(-1, 1).acos()),
        "joint": found.joint_state - true.joint_state,
        "depth": (z / true_z - 1).abs(),
        "overlap": overlap(drawn.union, truth.union),
        "part_overlap": overlap(drawn.parts, truth.parts),
        "stage": cascade.stage(drawn.box, truth.box),
    }


def overlap(a: Tensor, b: Tensor) -> Tensor:
    """IoU of soft masks; 1 where both are empty."""
    both, either = torch.minimum(a, b).sum((-2, -1)), torch.maximum(a, b).sum((-2, -1))
    return torch.where(either > 0, both / either.clamp_min(1e-6), 1.0)


def mean_pose(data: Path) -> Callable[[Crops], RawEstimate]:
    """Says of every crop the mean of what is true of a dataset."""
    true = Photos.from_dataset(Dataset.open(data))
    prior = Prior.from_category(true.category)
    root = true.cam_T_part[:, 0]
    facing = egocentric_to_allocentric(root[:, :3, :3], viewing_ray(true.box, true.K))
    phi, log_lambda = translation_targets(root[:, :3, 3], true.box, true.K, prior.frontal_area)
    shape = deformation_of(prior, true.box_center, true.box_size)
    means = {
        "up": facing[..., 1],
        "right": facing[..., 0],
        "phi": phi,
        "log_lambda": log_lambda,
        "joint_share": share_from_state(true.joint_state, prior.kinematics.limits),
        "log_scale": shape.log_scale,
        "center_shift": shape.center_shift,
        "confidence_logit": torch.zeros(true.box_size.shape[:2]),
    }
    means = {k: v.mean(0) for k, v in means.items()}
    return lambda crops: RawEstimate(
        **{k: v.expand(len(crops.box), *v.shape) for k, v in means.items()}
    )


def recipe_for(row: str, seed: int, a: argparse.Namespace) -> Recipe:
    """A row's recipe on the benchmark's budget."""
    steps = a.steps
    return replace(
        RECIPES[row](steps),
        offline_features=True,
        backbone=a.backbone,
        input_size=a.input_size,
        crops=a.crops,
        photos=1,  # the least; nothing is learned from it
        others=0,
        learning_rate=a.learning_rate,
        weights=replace(POSE_ONLY, **dict(a.weights)),
        seed=seed,
        warm_up=min(200, steps // 4),
        pictures_at=(steps // 4 + 1, steps // 2, steps),
    )


def kept(file: Path, make: Callable[[], Errors]) -> Errors:
    """Errors as a file has them; where there is none, they are made."""
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        part = file.with_name("part.npz")
        np.savez_compressed(part, **asdict(make()))
        os.replace(part, file)
    with np.load(file, allow_pickle=False) as arrays:
        return Errors(**arrays)


def errors_of_run(row: str, seed: int, a: argparse.Namespace) -> Errors:
    """Train and measure one run, or read what it gave."""
    run = a.out / f"{row}-{seed}"

    def make() -> Errors:
        job = Training(
            recipe=recipe_for(row, seed, a),
            data=(a.train,),
            backbone_weights=a.backbone_weights,
            out=run,
            precision="no",  # the same on every device
        )
        train(job)
        network, _ = checkpoint.load_network(run)

        def say(true: Crops) -> RawEstimate:
            _, seen = network.features(true.image)
            return network.estimate_raw(network.names[0], seen, true.box, true.K)

        return measure(say, network.input_size, a.test)

    return kept(run / "errors.npz", make)


def weight(given: str) -> tuple[str, float]:
    """A loss and its weight, of ``loss=weight``."""
    name, _, value = given.partition("=")
    if name not in {f.name for f in fields(Weights)}:
        raise argparse.ArgumentTypeError(f"there is no loss {name}")
    return name, float(value)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--train", type=Path, required=True, help="a dataset of `r2art synth`")
    parser.add_argument("--test", type=Path, required=True, help="another, of other objects")
    parser.add_argument("--out", type=Path, required=True, help="folder of all runs")
    parser.add_argument("--rows", nargs="+", default=report.DEFAULT, choices=list(report.ROWS))
    parser.add_argument(
        "--weights", type=weight, nargs="+", default=[], metavar="LOSS=WEIGHT", help="other weights"
    )
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--steps", type=int, default=1500)
    parser.add_argument("--crops", type=int, default=32)
    parser.add_argument("--backbone", default="mobilenetv2_100")
    parser.add_argument("--input-size", type=int, default=128)
    parser.add_argument("--learning-rate", type=float, default=2e-3)
    parser.add_argument("--backbone-weights", type=Path)
    parser.add_argument("--results", type=Path)
    parser.add_argument("--figure", type=Path)
    a = parser.parse_args()
    guess = kept(a.out / "mean.npz", lambda: measure(mean_pose(a.train), 32, a.test))
    found: dict[str, list[Errors]] = {row: [] for row in a.rows}
    for seed in range(a.seeds):  # all rows of a seed first: early figures compare, too
        for row in a.rows:
            found[row].append(errors_of_run(row, seed, a))
    print("\n".join(report.tables(found, guess)))
    pulled: list[dict[str, list[float]]] = []
    if "ablation_I" in a.rows:
        weights = recipe_for("ablation_I", 0, a).weights
        runs = [a.out / f"ablation_I-{seed}" for seed in range(a.seeds)]
        pulled = [pull.pulls(run, a.test, weights) for run in runs]
        print("\n".join(["", *pull.table(pulled)]))
    if a.results:
        write_section(
            a.results,
            "-".join(["ablation", *report.weights(a)]),
            report.section(found, guess, pulled, a),
        )
    if a.figure:
        report.draw(found, guess, a)


if __name__ == "__main__":
    main()
