"""What choosing among guessed cameras gains over one fixed guess, on rendered photos.

python benchmarks/guess_camera.py data/laptop-val data/drawer-val

The camera is withheld; box and category are found by the model as for a user's photo. Prints, as
Markdown, the median rotation error of the root part by the true field of view.
"""

import argparse
from pathlib import Path

import numpy as np
from rich.progress import track

import r2art
from r2art.core.camera import Camera
from r2art.data.shards import Dataset, from_row
from r2art.learn.evaluation.metrics import rotation_error
from r2art.run.guess import GUESSED_FOVS

BANDS = ((25, 40), (40, 65), (65, 90), (25, 90))


def errors(folder: Path) -> np.ndarray:
    """(N, 3): true field of view, error of the fixed guess, error of the chosen one, in degrees."""
    predictor, dataset = r2art.load(), Dataset.open(folder)
    rows = []
    for row in track(dataset.rows(), folder.name, total=len(dataset)):
        sample = from_row(row)
        width, height = sample.camera.width, sample.camera.height
        fixed = Camera.from_fov(GUESSED_FOVS[0], width, height)
        true_R = sample.cam_T_part[0, :3, :3]
        found = [
            predictor.predict(sample.image, camera, dataset.category.name)
            for camera in (fixed, None)
        ]
        angles = [rotation_error(p.parts[0].cam_T_part[:3, :3], true_R) for p in found]
        rows.append((2 * np.arctan(width / 2 / sample.camera.fx), *angles))
    return np.degrees(np.array(rows))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, nargs="+", help="datasets of `r2art synth`")
    for folder in parser.parse_args().data:
        found = errors(folder)
        print(f"\n| {folder.name}: true field of view | photos | 60° | chosen |")
        print("| --- | ---: | ---: | ---: |")
        for low, high in BANDS:
            inside = found[(found[:, 0] >= low) & (found[:, 0] < high)]
            fixed, chosen = np.median(inside[:, 1:], axis=0)
            print(f"| {low}° to {high}° | {len(inside)} | {fixed:.1f}° | {chosen:.1f}° |")


if __name__ == "__main__":
    main()
