"""The paper's Table 2 on rendered drawers, and joint-centric against part-centric.

python benchmarks/ablation.py --train data/drawer-train --test data/drawer-test --out ablation \\
    --backbone-weights mobilenetv2.npz --results docs/results.md

Trains every row with every seed on the same budget, one after the other, and measures each on the
test photos with the box given. What is done is kept: stopped, it goes on where it was, and more
seeds or rows can be added later. `--results` writes the tables as a section of that page,
`--figure` a picture of all runs.
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from matplotlib.figure import Figure
from numpy.typing import NDArray

from r2art.data.shards import Dataset, from_row, write_atomically
from r2art.learn import checkpoint
from r2art.learn.augment import crops
from r2art.learn.chance import Chance
from r2art.learn.memory import Photos
from r2art.learn.objective import true_shape
from r2art.learn.recipes import RECIPES, Recipe
from r2art.learn.results import write_section
from r2art.learn.stages import history, read_stages
from r2art.learn.train import Training, train
from r2art.method import se3
from r2art.method.estimate import estimate

ROWS = {
    "ablation_I": "I: no cascade",
    "ablation_II": "II: area",
    "ablation_III": "III: area, alignment",
    "ablation_IV": "IV: area, alignment, pixel",
    "pixel_only": "pixel only",
    "box_steers_all": "IV, boxes steer all",
    "part_centric": "IV, part-centric",
}
PAPER = {
    "ablation_I": (180.5, 51.2),
    "ablation_II": (148.2, 57.4),
    "ablation_III": (120.5, 67.2),
    "ablation_IV": (105.6, 69.9),
}
"""ADD (mm) and AUC (%) of Table 2."""
REACH = 0.1
"""Metres up to which the AUC integrates."""
HIDDEN = 0.5
"""A part of which less than this share is visible counts as occluded."""


@dataclass(frozen=True)
class Errors:
    """(N, P) ADD (m), plain and with the best common factor on a photo's translations; visible."""

    add: NDArray[np.floating]
    aligned: NDArray[np.floating]
    visible: NDArray[np.floating]

    def means(self) -> dict[str, float]:
        """What the tables show, in mm and percent."""
        seen, hidden = self.visible >= HIDDEN, self.visible < HIDDEN
        return {
            "ADD": 1000 * float(self.add.mean()),
            "AUC": auc(self.add),
            "ADD aligned": 1000 * float(self.aligned.mean()),
            "AUC aligned": auc(self.aligned),
            "visible parts": 1000 * float(self.aligned[seen].mean()),
            "occluded parts": 1000 * float(self.aligned[hidden].mean()) if hidden.any() else np.nan,
            "share occluded": 100 * float(hidden.mean()),
        }


def auc(add: NDArray[np.floating]) -> float:
    """Area (%) under the recall curve of ADD up to `REACH`."""
    return 100 * float(np.clip(1 - add / REACH, 0, None).mean())


@torch.no_grad()
def measure(run: Path, data: Path, batch: int = 64) -> Errors:
    """Errors of a run's averaged network on a dataset, box and category given."""
    network, _ = checkpoint.load_network(run)
    dataset = Dataset.open(data)
    photos, name = Photos.from_dataset(dataset), dataset.category.name
    prior, chance = network.priors[name], Chance(0, torch.device("cpu"))
    add, aligned = [], []
    for index in torch.arange(len(photos)).split(batch):
        true = crops(photos, index, network.input_size, chance, None, augment=False)
        _, seen = network.features(true.image)
        raw = network.estimate_raw(name, seen, true.box, true.K)
        found = estimate(prior, raw, true.box, true.K)
        points = true_shape(prior, true).points
        target = se3.transform(true.cam_T_part, points)
        turned = points @ found.cam_T_part[..., :3, :3].mT
        t = found.cam_T_part[..., None, :3, 3]
        scale = (t * (target - turned)).sum((1, 2, 3)) / t.expand_as(target).square().sum((1, 2, 3))
        for factor, into in ((torch.ones_like(scale), add), (scale, aligned)):
            error = turned + factor[:, None, None, None] * t - target
            into.append(torch.linalg.vector_norm(error, dim=-1).mean(-1).numpy())
    visible = np.stack([from_row(row).visible for row in dataset.rows()])
    return Errors(np.concatenate(add), np.concatenate(aligned), visible)


def recipe_for(row: str, seed: int, a: argparse.Namespace) -> Recipe:
    """A row's recipe on the benchmark's budget."""
    steps = a.steps
    return replace(
        RECIPES[row](steps),
        backbone=a.backbone,
        input_size=a.input_size,
        crops=a.crops,
        photos=1,  # the box is given: whole photos need no learning
        others=0,
        seed=seed,
        warm_up=min(200, steps // 4),
        pictures_at=(steps // 4 + 1, steps // 2, steps),
    )


def results_of(row: str, seed: int, a: argparse.Namespace) -> dict[str, float]:
    """Train and measure one run, or read what it gave."""
    run = a.out / f"{row}-{seed}"
    done = run / "ablation.json"
    if not done.exists():
        job = Training(
            recipe=recipe_for(row, seed, a),
            data=(a.train,),
            backbone_weights=a.backbone_weights,
            backgrounds=a.backgrounds,
            out=run,
        )
        train(job)
        write_atomically(done, json.dumps(measure(run, a.test).means(), indent=1).encode())
    return json.loads(done.read_text())


def cell(runs: list[dict[str, float]], key: str) -> str:
    values = [r[key] for r in runs]
    spread = f" ± {np.std(values, ddof=1):.1f}" if len(values) > 1 else ""
    return f"{np.mean(values):.1f}{spread}"


def table(found: dict[str, list[dict[str, float]]]) -> Iterator[str]:
    """Markdown: Table 2, and below it joints against parts."""
    yield "| cascade | ADD, mm | AUC, % | aligned: ADD, mm | AUC, % | paper: ADD, mm | AUC, % |"
    yield "| --- | ---: | ---: | ---: | ---: | ---: | ---: |"
    for row, runs in found.items():
        ours = [cell(runs, k) for k in ("ADD", "AUC", "ADD aligned", "AUC aligned")]
        theirs = [f"{v}" for v in PAPER.get(row, ("–", "–"))]
        yield f"| {ROWS[row]} | {' | '.join(ours + theirs)} |"
    pair = {"ablation_IV": "joint-centric", "part_centric": "part-centric"}
    if pair.keys() <= found.keys():
        yield ""
        yield "| aligned ADD, mm | all parts | visible parts | occluded parts |"
        yield "| --- | ---: | ---: | ---: |"
        for row, name in pair.items():
            keys = ("ADD aligned", "visible parts", "occluded parts")
            yield f"| {name} | {' | '.join(cell(found[row], k) for k in keys)} |"


def section(found: dict[str, list[dict[str, float]]], a: argparse.Namespace) -> str:
    """The section of the results page."""
    train_on, test_on = (Dataset.open(folder) for folder in (a.train, a.test))
    weights = a.backbone_weights.name if a.backbone_weights else "random weights"
    share = next(iter(found.values()))[0]["share occluded"]
    command = (
        f"python benchmarks/ablation.py --train {a.train} --test {a.test} --steps {a.steps} "
        f"--crops {a.crops} --backbone {a.backbone} --input-size {a.input_size} "
        f"--seeds {a.seeds} --out DIR"
    )
    return "\n".join(
        [
            f"## Ablation of the cascade: {train_on.category.name}",
            "",
            f"Trained on {len(train_on)} photos, measured on {len(test_on)} of the "
            f"{test_on.manifest.get('split', 'other')} split with the box given; {a.seeds} seeds "
            f"(mean ± standard deviation), {a.steps} steps of {a.crops} crops of {a.input_size} "
            f"px, `{a.backbone}` from {weights}. By `{command}`.",
            "",
            *table(found),
            "",
            "AUC to 100 mm. *Aligned*: after the best common factor on the translations of each "
            f"photo. A part is *occluded* if less than half of it is visible: {share:.0f} % of "
            "all parts. The paper's figures are for its own data and network: only the order of "
            "the rows compares.",
        ]
    )


def draw(found: dict[str, list[dict[str, float]]], a: argparse.Namespace) -> None:
    """A dot per run, and how many samples were in stage III over the steps."""
    figure = Figure(figsize=(11, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    for k, (row, runs) in enumerate(found.items()):
        left.plot([r["ADD aligned"] for r in runs], [k] * len(runs), "o", color=f"C{k}")
        curves = []
        for seed in range(len(runs)):
            for rows in read_stages(a.out / f"{row}-{seed}").values():
                curves.append((history(rows, np.unique(rows[:, 1]), 60) == 3).mean(0))
                span = (rows[0, 0], rows[-1, 0])
        if curves:
            right.plot(np.linspace(*span, 60), np.mean(curves, axis=0), color=f"C{k}", label=row)
    left.set(yticks=range(len(found)), xlabel="aligned ADD, mm", title="every run")
    left.set_yticklabels([ROWS[row] for row in found])
    left.invert_yaxis()
    right.set(xlabel="step", ylabel="share of samples", title="in stage III", ylim=(0, 1))
    right.legend(fontsize=7)
    figure.savefig(a.figure, dpi=90)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--train", type=Path, required=True, help="a dataset of `r2art synth`")
    parser.add_argument("--test", type=Path, required=True, help="another, of other objects")
    parser.add_argument("--out", type=Path, required=True, help="folder of all runs")
    parser.add_argument("--rows", nargs="+", default=list(ROWS), choices=list(ROWS))
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--steps", type=int, default=3000)
    parser.add_argument("--crops", type=int, default=32)
    parser.add_argument("--backbone", default="mobilenetv2_100")
    parser.add_argument("--input-size", type=int, default=96)
    parser.add_argument("--backbone-weights", type=Path)
    parser.add_argument("--backgrounds", type=Path)
    parser.add_argument("--results", type=Path)
    parser.add_argument("--figure", type=Path)
    a = parser.parse_args()
    found: dict[str, list[dict[str, float]]] = {row: [] for row in a.rows}
    for seed in range(a.seeds):  # all rows of a seed first: early figures compare, too
        for row in a.rows:
            found[row].append(results_of(row, seed, a))
    print("\n".join(table(found)))
    if a.results:
        write_section(a.results, "ablation", section(found, a))
    if a.figure:
        draw(found, a)


if __name__ == "__main__":
    main()
