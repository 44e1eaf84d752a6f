"""Go on training a model with new data, write it as one ONNX file, predict with it.

python examples/06_train_and_export.py [STEPS]        needs pip install 'r2art[train]'

A few steps show that everything runs; thousands, on thousands of photos, make a model better.
"""

import sys
from dataclasses import replace
from pathlib import Path

import r2art
from r2art.data.objects import Procedural, Split
from r2art.data.shards import Dataset
from r2art.data.synth import Synth, synth
from r2art.learn.export import export
from r2art.learn.recipes import further
from r2art.learn.train import Training, train
from r2art.run.predictor import SHIPPED_MODEL

OUT = Path("r2art_out")


def photos(split: Split, n: int) -> Path:
    """A dataset of single drawers; training and validation never share one."""
    folder = OUT / f"drawers-{split}"
    what = Procedural("drawer_single")
    options = {"seed": 0, "size": 128, "backgrounds": None, "workers": 1}
    synth(Synth(objects=what, n=n, split=split, out=folder, **options))
    return folder


def main(steps: int) -> None:
    """Data, training, export, prediction."""
    # A recipe is a frozen dataclass: take one and change what is yours to change.
    recipe = replace(further(steps), crops=8, photos=2, others=1, warm_up=1)
    run, model = OUT / "drawers-run", OUT / "drawers.onnx"
    train(
        Training(
            recipe=recipe,
            data=(photos("train", 12),),  # one folder per category
            init=Path(str(SHIPPED_MODEL)),  # heads of categories it does not know are new
            out=run,  # the same call goes on where a run was stopped
        )
    )
    export(run, model)
    predictor = r2art.load(model)
    sample = Dataset.open(photos("val", 2))[0]
    prediction = predictor.predict(sample.image, sample.camera, "drawer_single")
    told, true = prediction.joints[0].state, sample.joint_state[0]
    print(f"{', '.join(predictor.categories)}: open by {told:.3f} m, in truth {true:.3f} m")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2)
