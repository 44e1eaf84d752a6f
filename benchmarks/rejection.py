"""How well the model knows what it does not know: photos of other things, and of its objects.

python benchmarks/rejection.py --backgrounds DIR --data data/laptop-val --data data/drawer-val

Other things are every fifth photo of the folder, which training with the same folder
(`r2art train --backgrounds`) never shows as such, though it may stand behind objects; and noise.
Prints, as Markdown, how many are rejected, and how many photos of objects are lost by it, at the
model's own threshold and at the one that loses a twentieth.
"""

import argparse
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.progress import track

from r2art.core.camera import Camera
from r2art.core.image import ImageLike, read_image
from r2art.data.scenes.surroundings import Surroundings
from r2art.data.shards import Dataset, from_row
from r2art.learn.batches import OTHERS_HELD_OUT
from r2art.learn.results import write_section
from r2art.run.looks import all_scores
from r2art.run.predictor import NOTHING_KNOWN, Predictor, load

NOISES = 100


def doubts(predictor: Predictor, pictures: Iterable[ImageLike], what: str) -> NDArray[np.floating]:
    """(N,) probability that each picture shows nothing known."""
    found = []
    for picture in track(list(pictures), what):
        photo = read_image(picture)
        camera = Camera.from_fov(1.0, photo.width, photo.height)
        scores = all_scores(predictor.model, photo, camera)
        found.append(scores[len(predictor.categories) :].sum())
    return np.array(found)


def noise(n: int) -> list[NDArray[np.uint8]]:
    """Pictures of noise of several grains."""
    rng = np.random.default_rng(0)
    grains = rng.choice([1, 2, 4, 8, 16], n)
    return [
        rng.integers(0, 256, (240 // g, 320 // g, 3), np.uint8).repeat(g, 0).repeat(g, 1)
        for g in grains
    ]


def table(good: dict[str, NDArray], other: dict[str, NDArray]) -> Iterable[str]:
    """Markdown rows."""
    everything = np.concatenate(list(good.values()))
    at_loss = float(np.quantile(everything, 0.95))
    yield f"| photos of | number | rejected | rejected where 5 % are lost (above {at_loss:.3f}) |"
    yield "| --- | ---: | ---: | ---: |"
    for name, found in (*other.items(), ("**all objects**", everything), *good.items()):
        own, lost = (100 * np.mean(found > t) for t in (NOTHING_KNOWN, at_loss))
        yield f"| {name} | {len(found)} | {own:.1f} % | {lost:.1f} % |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--backgrounds", type=Path, required=True, help="folder of photos")
    parser.add_argument("--data", type=Path, action="append", required=True, help="of r2art synth")
    parser.add_argument("--model", type=Path)
    parser.add_argument("--results", type=Path)
    a = parser.parse_args()
    predictor = load(a.model)
    photos = Surroundings.from_folder(a.backgrounds).photos[::OTHERS_HELD_OUT]
    other = {
        "other things": doubts(predictor, photos, "other things"),
        "noise": doubts(predictor, noise(NOISES), "noise"),
    }
    good = {}
    for folder in a.data:
        dataset = Dataset.open(folder)
        pictures = (from_row(row).image for row in dataset.rows())
        good[dataset.category.name] = doubts(predictor, pictures, dataset.category.name)
    rows = "\n".join(table(good, other))
    print(rows)
    if a.results:
        text = (
            "## Photos of other things\n\nBy `python benchmarks/rejection.py`: photos that "
            "training never showed as other things (every fifth of the backgrounds), noise, and "
            f"photos of unseen objects.\n\n{rows}\n"
        )
        write_section(a.results, "rejection", text)


if __name__ == "__main__":
    main()
