"""The runs of benchmarks/ablation.py as tables, differences and pictures."""

import argparse
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import ablation_pull as pull
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from r2art.data.shards import Dataset
from r2art.learn.silhouette_sheet import CAPTION, COLUMNS, TILE
from r2art.learn.stages import COLOURS, history, read_stages

if TYPE_CHECKING:
    from ablation import Errors

ROWS = {
    "ablation_I": "I: no cascade",
    "ablation_II": "II: area",
    "ablation_III": "III: area, alignment",
    "ablation_IV": "IV: area, alignment, pixel",
    "pixel_only": "pixel only",
    "part_centric": "IV, part-centric",
    "box_steers_all": "IV, boxes steer all",
}
DEFAULT = [row for row in ROWS if row != "box_steers_all"]
PAPER = {
    "ablation_I": (180.5, 51.2),
    "ablation_II": (148.2, 57.4),
    "ablation_III": (120.5, 67.2),
    "ablation_IV": (105.6, 69.9),
}
"""ADD (mm) and AUC (%) of Table 2."""
PAIRS = (
    ("ablation_II", "ablation_I"),
    ("ablation_III", "ablation_II"),
    ("ablation_IV", "ablation_III"),
    ("ablation_IV", "ablation_I"),
    ("ablation_IV", "pixel_only"),
    ("box_steers_all", "ablation_IV"),
    ("part_centric", "ablation_IV"),
)
REACH = 0.1
"""Metres up to which the AUC integrates."""
HIDDEN = 0.5
"""A part of which less than this share is visible counts as occluded."""
RESAMPLES = 10_000
STATES = (0.0, 0.1, 0.3, 0.5, 1.01)
"""Edges between which joint states are counted, as shares of their range."""
SHEET_WIDTH = 720
Found = dict[str, list["Errors"]]


def auc(add: NDArray[np.floating]) -> float:
    """Area (%) under the recall curve of ADD up to `REACH`."""
    return 100 * float(np.clip(1 - add / REACH, 0, None).mean())


def spread(values: list[float]) -> str:
    """Mean ± standard deviation."""
    by_chance = f" ± {np.std(values, ddof=1):.1f}" if len(values) > 1 else ""
    return f"{np.mean(values):.1f}{by_chance}"


def tables(found: Found, guess: "Errors") -> Iterator[str]:
    """Markdown: Table 2, differences, what the estimates look like."""
    yield from accuracy(found, guess)
    yield ""
    yield from differences(found)
    yield ""
    yield from quantities(found, guess)


def accuracy(found: Found, guess: "Errors") -> Iterator[str]:
    yield "| cascade | ADD, mm | AUC, % | aligned: ADD, mm | AUC, % | paper: ADD, mm | AUC, % |"
    yield "| --- | ---: | ---: | ---: | ---: | ---: | ---: |"
    for row, runs in {"": [guess], **found}.items():
        cells = [
            spread([1000 * float(r.add.mean()) for r in runs]),
            spread([auc(r.add) for r in runs]),
            spread([1000 * float(r.aligned.mean()) for r in runs]),
            spread([auc(r.aligned) for r in runs]),
            *(f"{v}" for v in PAPER.get(row, ("–", "–"))),
        ]
        yield f"| {ROWS.get(row, 'always the mean')} | {' | '.join(cells)} |"


def differences(found: Found) -> Iterator[str]:
    """Markdown: row against row, on all parts, the visible and the occluded ones."""
    yield "| aligned ADD, mm | all parts | by seed | visible parts | occluded parts |"
    yield "| --- | ---: | ---: | ---: | ---: |"
    for one, other in PAIRS:
        if not {one, other} <= found.keys():
            continue
        seen = found[one][0].visible >= HIDDEN
        pairs = list(zip(found[one], found[other], strict=True))
        gap = 1000 * np.stack([a.aligned - b.aligned for a, b in pairs])
        seeds = ", ".join(f"{g.mean():+.1f}" for g in gap)
        everywhere, visible, hidden = (
            interval(gap.mean(0), where) for where in (np.full_like(seen, True), seen, ~seen)
        )
        yield f"| {ROWS[one]} − {ROWS[other]} | {everywhere} | {seeds} | {visible} | {hidden} |"


def interval(gap: NDArray[np.floating], where: NDArray[np.bool_]) -> str:
    """Mean of (N, P) where asked for, with its 95 % interval over photos that are drawn anew."""
    total, count = (gap * where).sum(1), where.sum(1)
    drawn = np.random.default_rng(0).integers(len(gap), size=(RESAMPLES, len(gap)))
    low, high = np.percentile(total[drawn].sum(1) / count[drawn].sum(1), (2.5, 97.5))
    return f"{total.sum() / count.sum():+.1f} [{low:+.1f}, {high:+.1f}]"


def quantities(found: Found, guess: "Errors") -> Iterator[str]:
    """Markdown: what the estimates' errors are made of."""
    yield (
        "| cascade | visible parts: aligned ADD, mm | occluded | root's rotation, ° | "
        "joint state, mm | depth, % | IoU of the silhouette, % | of the parts' | in stage III, % |"
    )
    yield f"| --- |{' ---: |' * 8}"
    for row, runs in {"": [guess], **found}.items():
        seen = guess.visible >= HIDDEN
        columns = [
            [1000 * r.aligned[seen].mean() for r in runs],
            [1000 * r.aligned[~seen].mean() for r in runs],
            [float(np.median(r.rotation)) for r in runs],
            [1000 * float(np.median(np.abs(r.joint))) for r in runs],
            [100 * float(np.median(r.depth)) for r in runs],
            [100 * float(r.overlap.mean()) for r in runs],
            [100 * float(r.part_overlap.mean()) for r in runs],
            [100 * float((r.stage == 3).mean()) for r in runs],
        ]
        yield f"| {ROWS.get(row, 'always the mean')} | {' | '.join(map(spread, columns))} |"


def by_state(found: Found, test: Dataset) -> Iterator[str]:
    """Markdown: joint-centric against part-centric, by how far a joint is from its lower limit."""
    pair = [found.get(row, []) for row in ("ablation_IV", "part_centric")]
    if not all(pair):
        return
    low, high = np.array([j.limits for j in test.category.joints]).T
    share = (np.stack([row["joint_state"] for row in test.rows()]) - low) / (high - low)
    visible = pair[0][0].visible[:, 1:]
    aligned = [1000 * np.mean([r.aligned[:, 1:] for r in runs], axis=0) for runs in pair]
    off = [1000 * np.stack([r.joint for r in runs]) for runs in pair]
    yield (
        "| joint, % of its range | number | its part visible, % | aligned ADD, mm: joint-centric "
        "| part-centric | state, mm: joint-centric | part-centric |"
    )
    yield f"| --- |{' ---: |' * 6}"
    for least, most in pairwise(STATES):
        there = (share >= least) & (share < most)
        figures = [
            f"{there.sum()}",
            f"{100 * visible[there].mean():.0f}",
            *(f"{v[there].mean():.1f}" for v in aligned),
            *(
                f"{np.median(np.abs(v).mean(0)[there]):.1f} ({v.mean(0)[there].mean():+.1f})"
                for v in off
            ),
        ]
        yield f"| {100 * least:.0f} to {min(100 * most, 100):.0f} | {' | '.join(figures)} |"


def weights(a: argparse.Namespace) -> list[str]:
    """Those of the losses that are not the usual ones."""
    return [f"{loss}={value:g}" for loss, value in a.weights]


def section(
    found: Found, guess: "Errors", pulled: list[dict[str, list[float]]], a: argparse.Namespace
) -> str:
    """The section of the results page."""
    train_on, test_on = (Dataset.open(folder) for folder in (a.train, a.test))
    category, hidden = train_on.category.name, 100 * float((guess.visible < HIDDEN).mean())
    start = a.backbone_weights.name if a.backbone_weights else "random weights"
    more = "" if a.rows == DEFAULT else f" --rows {' '.join(a.rows)}"
    more += f" --backbone-weights {start}" if a.backbone_weights else ""
    more += f" --weights {' '.join(weights(a))}" if a.weights else ""
    other = f", {', '.join(weights(a))}" if a.weights else ""
    command = (
        f"python benchmarks/ablation.py --train {a.train} --test {a.test} --steps {a.steps} "
        f"--crops {a.crops} --learning-rate {a.learning_rate:g} --backbone {a.backbone} "
        f"--input-size {a.input_size} --seeds {a.seeds}{more} --out DIR"
    )
    made = " and ".join(
        f"`r2art synth {category} -n {len(d)} --seed {d.manifest['seed']} "
        f"--split {d.manifest['split']} --backgrounds DIR`"
        for d in (train_on, test_on)
    )
    return "\n".join(
        [
            f"## Ablation of the cascade: {category}{other}",
            "",
            f"Trained on {len(train_on)} photos, measured on {len(test_on)} of other objects with "
            f"the box given ({made}). {a.seeds} seeds, mean ± standard deviation; {a.steps} steps "
            f"of {a.crops} crops of {a.input_size} px without augmentation; the trunk "
            f"(`{a.backbone}`, {start}) frozen, the neck and the pose heads learn. By "
            f"`{command}`. What to make of it: [ablation.md](ablation.md).",
            "",
            *accuracy(found, guess),
            "",
            "AUC to 100 mm. *Aligned*: after the best common factor on the translations of each "
            "photo. *Always the mean*: the mean of all training labels, whatever the photo shows. "
            "The paper's figures are for its own data and network: only the order of the rows "
            "compares.",
            "",
            *differences(found),
            "",
            "Differences of the same seed's runs on the same photos, mean over the seeds, with "
            "the 95 % bootstrap interval over test photos. A part is *occluded* if less than half "
            f"of its silhouette is visible: {hidden:.0f} % of all parts.",
            "",
            *quantities(found, guess),
            "",
            "Rotation, joint state (of all joints) and depth: median, then mean over the seeds. "
            "Silhouettes: soft ones of 56 px, mean over the photos. *In stage III*: test photos "
            "whose box has the right area (within 10 %) and place (IoU 0.9).",
            *state_lines(found, test_on),
            *pull_lines(pulled),
        ]
    )


def state_lines(found: Found, test: Dataset) -> list[str]:
    table = list(by_state(found, test))
    after = (
        "ADD of the part that the joint moves. State: median over joints of the absolute error, a "
        "mean over the seeds; in brackets the mean error, negative where states are too small."
    )
    return ["", *table, "", after] if table else []


def pull_lines(pulled: list[dict[str, list[float]]]) -> list[str]:
    """What would pull the networks of row I, which have not met the cascade."""
    if not pulled:
        return []
    return [
        "",
        *pull.table(pulled),
        "",
        "The gradient that the cascade would have in the networks of row I, against that of the "
        "other losses, on the first 128 test photos: mean over the seeds.",
    ]


def draw(found: Found, guess: "Errors", a: argparse.Namespace) -> None:
    """Every run, the stages over the steps and the error over the visible share; silhouettes."""
    figure = Figure(figsize=(12, 7.5), layout="constrained")
    (runs, share), (whole, seen) = figure.subplots(2, 2)
    draw_runs(runs, found)
    draw_stages(share, whole, found, a.out)
    draw_visible(seen, found, guess)
    figure.savefig(a.figure, dpi=90)
    sheet = silhouettes(a)
    sheet.thumbnail((SHEET_WIDTH, sheet.height))
    sheet.save(a.figure.with_name(f"{a.figure.stem}_silhouettes.jpg"), quality=80)


def draw_runs(panel: Axes, found: Found) -> None:
    for k, runs in enumerate(found.values()):
        add = [1000 * r.aligned.mean() for r in runs]
        panel.plot(add, [k] * len(runs), "o", color=f"C{k}")
    panel.set(yticks=range(len(found)), xlabel="aligned ADD, mm", title="every run")
    panel.set_yticklabels([ROWS[row] for row in found])
    panel.invert_yaxis()
    panel.grid(axis="x", alpha=0.3)


def draw_stages(share: Axes, whole: Axes, found: Found, out: Path) -> None:
    """Mean share of the training crops in stage III, by row; of row IV all stages."""
    for k, (row, runs) in enumerate(found.items()):
        tables = [
            history(rows, np.unique(rows[:, 1]), 60)
            for seed in range(len(runs))
            for rows in read_stages(out / f"{row}-{seed}").values()
        ]
        if not tables:
            continue
        first, *_, last = read_stages(out / f"{row}-0").popitem()[1][:, 0]
        steps = np.linspace(first, last, 60)
        met = [np.mean([(t == s).sum(0) / (t > 0).sum(0) for t in tables], 0) for s in (1, 2, 3)]
        share.plot(steps, met[2], color=f"C{k}", label=ROWS[row])
        if row == "ablation_IV":
            labels = ("stage I", "stage II", "stage III")
            whole.stackplot(steps, met, colors=COLOURS[1:], labels=labels)
            whole.set(xlim=(first, last), ylim=(0, 1), title=f"training crops, {ROWS[row]}")
            whole.set(xlabel="step", ylabel="share")
            whole.legend(loc="lower right", fontsize=8)
    share.set(xlabel="step", ylabel="share", ylim=(0, 1), title="training crops in stage III")
    share.legend(fontsize=7)


def draw_visible(panel: Axes, found: Found, guess: "Errors") -> None:
    """Aligned ADD of parts by how much of them is visible."""
    edges = np.linspace(0, 1, 6)
    which = np.clip(np.digitize(guess.visible, edges) - 1, 0, 4)
    for k, (row, runs) in enumerate(found.items()):
        if row in ("ablation_I", "ablation_IV", "part_centric"):
            add = 1000 * np.mean([r.aligned for r in runs], axis=0)
            binned = [add[which == b].mean() if (which == b).any() else np.nan for b in range(5)]
            panel.plot((edges[:-1] + edges[1:]) / 2, binned, "o-", color=f"C{k}", label=ROWS[row])
    panel.set(xlabel="visible share of a part", ylabel="aligned ADD, mm", title="test parts")
    panel.set_ylim(bottom=0)
    panel.legend(fontsize=8)


def silhouettes(a: argparse.Namespace) -> Image.Image:
    """Of the first seed: four crops when the cascade joins and at the end, a line per row."""
    rows = [r for r in ("ablation_I", "ablation_IV", "part_centric") if r in a.rows] or a.rows
    first, *_, last = sorted(f.name for f in (a.out / f"{rows[0]}-0").glob("silhouettes-*.png"))
    shown = [(file, row) for file in (first, last) for row in rows]
    height = TILE + CAPTION
    sheet = Image.new("RGB", (COLUMNS * TILE, len(shown) * (height + CAPTION)), "white")
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(15)
    for k, (file, row) in enumerate(shown):
        top, step = k * (height + CAPTION), int(Path(file).stem.rpartition("-")[2])
        pen.text((4, top + 3), f"step {step}: {ROWS[row]}", "black", font)
        with Image.open(a.out / f"{row}-0" / file) as picture:
            sheet.paste(picture.crop((0, 0, COLUMNS * TILE, height)), (0, top + CAPTION))
    return sheet
