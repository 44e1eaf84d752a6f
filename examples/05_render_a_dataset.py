"""Make labelled photos of a category, and look at every label.

python examples/05_render_a_dataset.py [CATEGORY]     needs pip install 'r2art[train]'
"""

import sys
from pathlib import Path

import numpy as np

from r2art.data.objects import Procedural
from r2art.data.shards import Dataset
from r2art.data.synth import Synth, synth
from r2art.learn.sheet import sheet

OUT = Path("r2art_out")


def main(category: str) -> None:
    """Render six photos, read them back, draw their labels."""
    folder = OUT / f"{category}-val"
    synth(
        Synth(
            objects=Procedural(category),
            n=6,  # another object in each
            seed=0,
            split="val",
            size=160,
            backgrounds=None,  # or a folder of your own photos
            out=folder,
            workers=1,
        )
    )
    dataset = Dataset.open(folder)
    for index in range(len(dataset)):
        sample = dataset[index]
        seen = [f"{np.mean(sample.mask == p + 1):.1%}" for p in range(len(sample.cam_T_part))]
        print(f"{index}: joints at {sample.joint_state.round(2)}, parts fill {', '.join(seen)}")
    picture, faults = sheet(dataset, range(len(dataset)))
    assert not faults
    picture.save(OUT / f"{category}-labels.png")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "microwave")
