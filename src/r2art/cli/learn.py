"""`r2art synth`, `prior`, `train`, `eval` and `export`: make data, learn, measure, ship.

They need the extra ``train``, which is imported only inside them.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import Positional, UseAppendAction, arg

from r2art.cli.selection import Selection
from r2art.core.errors import UsageError

if TYPE_CHECKING:
    from r2art.core.prediction import Prediction
    from r2art.data.sample import Sample


def synth(
    *,
    selection: Annotated[Selection, arg(name="")],
    n: Annotated[int, arg(aliases=["-n"])],
    out: Path,
    seed: int = 0,
    split: Literal["train", "val", "test"] = "train",
    size: int = 224,
    backgrounds: Path | None = None,
    workers: int = 0,
    shard: Annotated[str, arg(metavar="I/N")] = "1/1",
) -> int:
    """Render labelled photos of a procedural category, or of models of your own.

    The same arguments give the same bytes. A run that was stopped goes on where it was when the
    same command is given again. Your own: `r2art synth --urdf arm.urdf --fix joint7 ...`, or
    --mjcf, or --partnet; several models of one kind are split into train, val and test.

    Args:
        selection: What to show.
        n: Photos to make; each shows an object of its own.
        out: Folder of the dataset.
        seed: Another seed makes other objects.
        split: No object is ever in two splits.
        size: Side of the square photos (px).
        backgrounds: Folder of photos, .hdr light probes and textures; without it everything is
            procedural.
        workers: Processes; 0 takes one per core.
        shard: Make only the I-th of N shares; several runs, or machines, make the N shares of
            one dataset, into one folder or into folders to be copied together.
    """
    from r2art.data.filling import Share
    from r2art.data.synth import Synth
    from r2art.data.synth import synth as run

    run(
        Synth(
            objects=selection.objects(split),
            n=n,
            seed=seed,
            split=split,
            size=size,
            backgrounds=backgrounds,
            out=out,
            workers=workers,
            share=Share.parse(shard),
        )
    )
    return 0


def prior(
    *,
    selection: Annotated[Selection, arg(name="")],
    out: Path = Path("category.npz"),
) -> int:
    """Write what is known of a category before any photo: its mean object.

    Mean part boxes, points on every part, joints with their limits, and how large such objects
    appear. `r2art synth` puts the same file into every dataset.

    Args:
        selection: Whose prior.
        out: The file (.npz), which `r2art.core.category.Category.load` reads.
    """
    from r2art.cli.selection import write_prior

    write_prior(selection.objects().prior(), out)
    return 0


def train(
    recipe: Annotated[str, Positional, arg(metavar="RECIPE")],
    /,
    *,
    data: UseAppendAction[tuple[Path, ...]],
    out: Path,
    steps: int | None = None,
    backbone_weights: Path | None = None,
    init: Path | None = None,
    backgrounds: Path | None = None,
) -> int:
    """Train a network on rendered datasets, or go on with a run that was stopped.

    Leaves the checkpoint, a log and loss curves (losses.png) in the run's folder. Several
    processes: `accelerate launch -m r2art train ...`.

    Args:
        recipe: tiny, a model from scratch; further, to go on from a trained one (--init); or
            smoke, a few steps to see that everything runs.
        data: A dataset of `r2art synth`; once per category.
        out: Folder of the run.
        steps: Instead of the recipe's number of optimiser steps.
        backbone_weights: .npz or .safetensors to start the trunk from.
        init: Folder of a trained run to start from. Categories that it does not know get new
            heads on its trunk.
        backgrounds: Folder of photos to swap in behind the objects.
    """
    from r2art.learn.recipes import RECIPES
    from r2art.learn.train import Training
    from r2art.learn.train import train as run

    if recipe not in RECIPES:
        raise UsageError(f"no recipe {recipe!r}; there are {', '.join(RECIPES)}")
    if not data:
        raise UsageError("no data given; add --data DIR for each category")
    options: dict[str, Any] = {} if steps is None else {"steps": steps}
    run(
        Training(
            recipe=RECIPES[recipe](**options),
            data=data,
            backbone_weights=backbone_weights,
            init=init,
            backgrounds=backgrounds,
            out=out,
        )
    )
    return 0


def export(
    run: Annotated[Path, Positional, arg(metavar="RUN")], /, *, out: Path = Path("r2art.onnx")
) -> int:
    """Write a trained run as one self-contained ONNX file.

    Args:
        run: Folder of `r2art train`.
        out: The model file, for `r2art predict --model`.
    """
    from r2art.learn.export import export as write
    from r2art.run.report import say

    write(run, out)
    say("written", f"{out} ({out.stat().st_size / 1e6:.1f} MB)")
    return 0


def evaluate(
    *,
    data: Path,
    model: Path | None = None,
    out: Path | None = None,
    limit: int | None = None,
    results: Path | None = None,
) -> int:
    """Measure a model on a labelled dataset, part by part.

    Every photo is predicted twice: with its box and category given, and with neither.

    Args:
        data: A dataset of `r2art synth`.
        model: A model of `r2art export`; default: the one inside r2art.
        out: Folder for the report: tables, figures, the worst photos.
        limit: Take only the first so many photos.
        results: Markdown file in which to (re)write this category's section.
    """
    from r2art.data.shards import Dataset
    from r2art.learn.report import run_eval
    from r2art.run.predictor import SHIPPED_MODEL, load

    predictor, name = load(model), Dataset.open(data).category.name
    predictor.category(name)

    def predict(sample: "Sample", given_box: bool) -> "Prediction":
        if given_box:
            return predictor.predict(sample.image, sample.camera, name, sample.box.tolist())
        return predictor.predict(sample.image, sample.camera)

    path = model or Path(str(SHIPPED_MODEL))
    run_eval(data, predict, path, out=out, limit=limit, results=results)
    return 0
