"""How the model stands up where things get hard: the settings of `r2art benchmark make`.

python benchmarks/settings.py bench --results docs/results.md

Box, category and camera are given. Tells the accuracy on models of strangers (``cad``), what hiding
(``occlusion``) and cutting off (``truncation``) cost, and errors in ArtImage's unit of length
(``artimage-scale``) beside the paper's. There all objects have one size, which a model that was
trained on them would know; so each prediction is brought to that size, not to the photo's truth.
"""

import argparse
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.progress import track

from r2art.core.prediction import Prediction
from r2art.data.benchmark.manifest import read_manifest
from r2art.data.shards import Dataset
from r2art.learn.evaluation.paper import printed
from r2art.learn.evaluation.scores import Scores, score, stack
from r2art.learn.evaluation.summary import Summary, summarise
from r2art.learn.results import write_section
from r2art.run.predictor import Predictor, load
from r2art.run.refinement.body import Body, body_of
from r2art.run.refinement.pose import pose_of, posed

SWEEPS = ("occlusion", "truncation")
OURS_OF_PAPER = "R2-Art"


@dataclass(frozen=True, kw_only=True)
class Measured:
    """One dataset of a benchmark.

    Attributes:
        setting: Of the benchmark ...
        level: ... and how much is hidden or cut off, in percent; None: it has no levels.
        category: Name.
        scores: Of every photo.
        summary: The same in short.
    """

    setting: str
    level: int | None
    category: str
    scores: Scores
    summary: Summary


def measured(bench: Path, predictor: Predictor, limit: int | None) -> Iterator[Measured]:
    """Predict every dataset of a benchmark that the model knows the category of."""
    for told in read_manifest(bench)["datasets"]:
        if told["category"] not in predictor.categories:
            continue
        dataset = Dataset.open(bench / told["folder"])
        size = dataset.manifest.get("scaled_to")
        body = body_of(predictor.category(told["category"]).prior()) if size else None
        found = []
        chosen = range(len(dataset) if limit is None else min(limit, len(dataset)))
        for i in track(chosen, told["folder"]):
            sample = dataset[i]
            asked = (sample.image, sample.camera, told["category"], sample.box.tolist())
            prediction = predictor.predict(*asked)
            if body is not None:
                prediction = brought_to(prediction, body, **size)
            found.append(score(sample, dataset.category, prediction))
        scores = stack(found)
        yield Measured(
            setting=told["setting"],
            level=told["level"],
            category=told["category"],
            scores=scores,
            summary=summarise(scores, dataset.category),
        )


def brought_to(
    prediction: Prediction, body: Body, diagonal: float, opened: float = 0.0
) -> Prediction:
    """The prediction at the scale at which the object, open so far, has a box of this diagonal."""
    center, size = (
        np.array([getattr(p, k) for p in prediction.parts]) for k in ("box_center", "box_size")
    )
    own = body.stretched(center, size)
    low, high = own.limits.T
    at = posed(own, pose_of(own, np.eye(4), low + opened * (high - low)))
    points = at.points[0].transpose(0, 2, 1).reshape(-1, 3)
    factor = diagonal / float(np.linalg.norm(np.ptp(points, axis=0)))
    return prediction.scaled(factor, "size")


def state_error(found: Measured) -> str:
    """Median, in degrees or centimetres, and as a share of the range."""
    told = []
    for kind in found.summary.kinds:
        factor, unit = (180 / np.pi, "°") if kind.kind == "revolute" else (100, "cm")
        told.append(f"{factor * kind.state.median.value:.1f} {unit}")
    share = np.median(found.scores.state / found.scores.state_range)
    return f"{', '.join(told)} ({100 * share:.0f} %)"


def cad(all_found: Sequence[Measured]) -> Iterator[str]:
    """Models of strangers."""
    yield "**Models that nobody of this project made** (medians over all parts)\n"
    yield "| category | photos | rotation | joint (of its range) | ADD, aligned | all parts right |"
    yield "| --- | ---: | ---: | ---: | ---: | ---: |"
    for found in all_found:
        summary = found.summary
        rotation = np.degrees(summary.whole.rotation.median.value)
        share = 100 * summary.whole.aligned.add_share.median.value
        right = 100 * found.scores.all_right.mean()
        yield (
            f"| {found.category} | {summary.images} | {rotation:.1f}° | {state_error(found)} "
            f"| {share:.1f} % | {right:.0f} % |"
        )


def sweep(setting: str, all_found: Sequence[Measured]) -> Iterator[str]:
    """AUC at every level."""
    levels = sorted({found.level or 0 for found in all_found})
    by_category: dict[str, dict[int, float]] = defaultdict(dict)
    for found in all_found:
        auc = found.summary.whole.aligned.auc_diameter.value
        by_category[found.category][found.level or 0] = 100 * auc
    rows = {**by_category}
    rows["mean"] = {
        level: float(np.mean([of[level] for of in by_category.values()])) for level in levels
    }
    photos = all_found[0].summary.images
    what = "hidden" if setting == "occlusion" else "outside"
    yield f"**{setting.capitalize()}**: AUC of ADD to 10 % of ⌀, scale aligned, in %; {photos}"
    yield "photos of every category at every level, of the same objects\n"
    yield f"| {what} | " + " | ".join(f"{level} %" for level in levels) + " | kept at 30 % |"
    yield "| --- |" + " ---: |" * (len(levels) + 1)
    for name, of in rows.items():
        figures = " | ".join(f"{of[level]:.1f}" for level in levels)
        kept = f"{100 * of[30] / of[0]:.0f} %" if 30 in of else "–"
        yield f"| {name} | {figures} | {kept} |"


def artimage(all_found: Sequence[Measured]) -> Iterator[str]:
    """Errors in ArtImage's unit beside the paper's on ArtImage."""
    yield "**ArtImage's scale**, per part, the root first; means. The paper's figures are on"
    yield "ArtImage (or ReArtMix), ours on our own objects brought to that size: the unit is the"
    yield "same, the photos are not. *One size*: each prediction scaled to the one size of all"
    yield "objects; *aligned*: to the photo's truth\n"
    yield "| category | method | ADD mm | AUC to 100 mm % | 3D IoU % |"
    yield "| --- | --- | ---: | ---: | ---: |"
    for found in all_found:
        for table, row in of_paper(found.category, len(found.summary.parts)):
            figures = (listed(row.get(name, [])) or "–" for name in ("add", "auc", "iou"))
            yield f"| {found.category} | paper, {table} | {' | '.join(figures)} |"
        for name in ("plain", "aligned"):
            poses = [getattr(part, name) for part in found.summary.parts]
            figures = (
                listed([1000 * p.add.mean.value for p in poses]),
                listed([100 * p.auc_100mm.value for p in poses]),
                listed([100 * p.overlap.mean.value for p in poses]),
            )
            method = "one size" if name == "plain" else "scale aligned"
            yield f"| {found.category} | r2art, {method} | {' | '.join(figures)} |"


def of_paper(category: str, parts: int) -> Iterator[tuple[str, dict[str, list[float]]]]:
    """The paper's own rows on a category, and the dataset they are of."""
    for table in printed():
        for entry in table["categories"]:
            if (entry["category"], entry["parts"]) == (category, parts):
                rows = (r for r in entry["rows"] if r["method"] == OURS_OF_PAPER)
                yield from ((table["dataset"], row) for row in rows)


def listed(values: Sequence[float]) -> str:
    """Figures side by side."""
    return ", ".join(f"{v:.1f}" for v in values)


def page(found: Sequence[Measured], command: str, model: str) -> str:
    """All tables, as Markdown."""
    by_setting: dict[str, list[Measured]] = defaultdict(list)
    for one in found:
        by_setting[one.setting].append(one)
    lines = [
        "## In the settings of the benchmark\n",
        f"Box, category and camera given; `{model}`. Written by `{command}` on the test sets of "
        "`r2art benchmark make` ([benchmark.md](benchmark.md)).\n",
    ]
    for setting, some in by_setting.items():
        if setting in SWEEPS:
            lines += [*sweep(setting, some), ""]
        elif setting in ("cad", "artimage-scale"):
            lines += [*(cad if setting == "cad" else artimage)(some), ""]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bench", type=Path, nargs="+", help="of r2art benchmark make")
    parser.add_argument("--model", type=Path, help="default: the shipped one")
    parser.add_argument("--limit", type=int, help="so many photos of each dataset")
    parser.add_argument("--results", type=Path, help="Markdown file with the section to rewrite")
    a = parser.parse_args()
    predictor = load(a.model)
    found = [one for bench in a.bench for one in measured(bench, predictor, a.limit)]
    folders = " ".join(path.name for path in a.bench)
    name = "r2art.onnx" if a.model is None else a.model.name
    text = page(found, f"python benchmarks/settings.py {folders}", name)
    print(text)
    if a.results is not None:
        write_section(a.results, "settings", text)


if __name__ == "__main__":
    main()
