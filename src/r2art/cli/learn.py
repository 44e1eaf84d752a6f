"""`r2art synth`, `prior`, `train`, `eval` and `export`: make data, learn, measure, ship.

They need the extra ``train``, which is imported only inside them.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import Positional, UseAppendAction, arg

from r2art.cli.selection import Selection, say_filled
from r2art.core.errors import UsageError

if TYPE_CHECKING:
    from r2art.core.category import Category
    from r2art.core.prediction import Prediction
    from r2art.data.sample import Sample
    from r2art.learn.evaluation.evaluate import Predict
    from r2art.learn.evaluation.testsets import TestSet
    from r2art.run.predictor import Predictor


def synth(
    *,
    selection: Annotated[Selection, arg(name="")],
    n: Annotated[int, arg(aliases=["-n"], metavar="N")],
    out: Annotated[Path, arg(metavar="DIR")],
    seed: int = 0,
    split: Literal["train", "val", "test"] = "train",
    size: Annotated[int, arg(metavar="PX")] = 224,
    backgrounds: Annotated[Path | None, arg(metavar="DIR", help_behavior_hint="")] = None,
    workers: int = 0,
    shard: Annotated[str, arg(metavar="I/N")] = "1/1",
) -> int:
    """Render labelled photos of a procedural category, or of models of your own.

    For instance `r2art synth laptop -n 1000 --out data/laptop`, then `r2art data show
    data/laptop`. The same arguments give the same bytes. A run that was stopped goes on where it
    was when the same command is given again. Your own models: `r2art synth --urdf arm.urdf -n
    1000 --out data/arm`, or --mjcf, or --partnet; several of one kind are split into train, val
    and test.

    Args:
        selection: What to show.
        n: Photos to make, each of another object (of a model of your own: in another pose).
        out: Folder of the dataset.
        seed: Another seed makes other photos, of other objects.
        split: No object is ever in two splits (but a single model of your own is in all).
        size: Side of the square photos.
        backgrounds: Folder of photos, .hdr light probes and textures; without it everything is
            procedural.
        workers: Processes; 0 takes one per core.
        shard: Make only the I-th of N shares; several runs, or machines, make the N shares of
            one dataset, into one folder or into folders to be copied together.
    """
    from r2art.data.filling import Share
    from r2art.data.synth import Synth
    from r2art.data.synth import synth as run

    objects = selection.objects(split)
    run(
        Synth(
            objects=objects,
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
    say_filled(out, objects.name)
    return 0


def prior(
    *,
    selection: Annotated[Selection, arg(name="")],
    out: Annotated[Path, arg(metavar="FILE")] = Path("category.npz"),
) -> int:
    """Write what is known of a category before any photo: its mean object.

    Mean part boxes, points on every part, joints with their limits, and how large such objects
    appear. `r2art synth` puts the same file into every dataset; alone, it is a quick way to see
    which parts and joints a model of your own has: `r2art prior --urdf arm.urdf`.

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
    minutes: float | None = None,
    turns: Annotated[tuple[str, ...], arg(metavar="NAME=N...")] = (),
    backbone_weights: Path | None = None,
    init: Path | None = None,
    backgrounds: Path | None = None,
    precision: Literal["no", "bf16"] | None = None,
    compile: Annotated[bool, arg(help_behavior_hint="")] = False,
) -> int:
    """Train a network on rendered datasets, or go on with a run that was stopped.

    Leaves the checkpoint, a log and loss curves (losses.png) in the run's folder. Several
    processes: `accelerate launch -m r2art train ...`.

    Args:
        recipe: tiny, a model from scratch; further, to go on from a trained one (--init); many,
            all categories at once on a GPU; smoke, a few steps to see that everything runs; paper,
            the paper's network; the ablations are in docs/training.md.
        data: A dataset of `r2art synth`; once per category.
        out: Folder of the run.
        steps: Instead of the recipe's number of optimiser steps.
        minutes: End after so long, if the steps are not done before; the learning rate falls in
            time.
        turns: How often categories have their turn, relative to each other (laptop=0.5): less for
            those that are learned already; else by their numbers of parts.
        backbone_weights: .npz or .safetensors to start the trunk from; for the paper's network
            its frozen backbone, or a folder of files by timm's names.
        init: Folder of a trained run, or model file (.onnx), to start from. Categories that it
            does not know get new heads on its trunk.
        backgrounds: Folder of photos to swap in behind the objects.
        precision: bf16: mixed precision, which is usual on a GPU; no: all in float32.
        compile: Compile the small network: a minute more to start, shorter steps; needs a C++
            compiler.
    """
    from r2art.learn.recipes import RECIPES
    from r2art.learn.train import Training
    from r2art.learn.train import train as run

    if recipe not in RECIPES:
        raise UsageError(f"no recipe {recipe!r}; there are {', '.join(RECIPES)}")
    if not data:
        raise UsageError("no data given; add --data DIR for each category")
    options: dict[str, Any] = {} if steps is None else {"steps": steps}
    chosen = RECIPES[recipe](**options)
    run(
        Training(
            recipe=replace(chosen, turns={**chosen.turns, **_turns(turns)}),
            data=data,
            backbone_weights=backbone_weights,
            init=init,
            backgrounds=backgrounds,
            out=out,
            minutes=minutes,
            precision=precision,
            compiled=compile,
        )
    )
    return 0


def _turns(given: Sequence[str]) -> dict[str, float]:
    """NAME=N to numbers by name."""
    found: dict[str, float] = {}
    for text in given:
        name, _, number = text.partition("=")
        try:
            found[name] = float(number)
        except ValueError:
            found[name] = math.nan
        if not (math.isfinite(found[name]) and found[name] > 0):
            raise UsageError(f"--turns takes NAME=N with N above 0, not {text!r}")
    return found


def export(
    run: Annotated[Path, Positional, arg(metavar="RUN")],
    /,
    *,
    out: Path = Path("r2art.onnx"),
    category: Annotated[tuple[str, ...], arg(metavar="NAME...", help_behavior_hint="")] = (),
    blend: Annotated[Path | None, arg(metavar="MODEL", help_behavior_hint="")] = None,
    finding_for: Annotated[Path | None, arg(metavar="MODEL", help_behavior_hint="")] = None,
) -> int:
    """Write a trained run as one self-contained ONNX file.

    Args:
        run: Folder of `r2art train`; or a model file of an older r2art, to be completed with the
            shapes of its objects, and to compute only what is asked for.
        out: The model file, for `r2art predict --model`.
        category: Those it shall know, where not all; the others then are nothing known to it.
        blend: The model file that the run started from (`r2art train --init`): the weights halfway
            between both often do better than either. Calibrate the result.
        finding_for: The model file that a run of recipe `finding` started from: it is written again
            with only what finds objects and names their category from the run.
    """
    from r2art.learn.export import export as write
    from r2art.run.report import say

    write(run, out, category, blend, finding_for)
    say("written", f"{out} ({out.stat().st_size / 1e6:.1f} MB)")
    return 0


def evaluate(
    *,
    data: UseAppendAction[tuple[Path, ...]],
    category: Annotated[str | None, arg(metavar="NAME", help_behavior_hint="")] = None,
    split: Annotated[str | None, arg(metavar="NAME", help_behavior_hint="")] = None,
    model: Path | None = None,
    out: Path | None = None,
    limit: int | None = None,
    refine: Annotated[
        int | None, arg(metavar="STEPS", help_behavior_hint="(default: as predict)")
    ] = None,
    results: Path | None = None,
    json: Annotated[bool, arg(help_behavior_hint="")] = False,
) -> int:
    """Measure a model on labelled photos, part by part.

    Every photo is predicted twice: with its box and category given, and with neither. Samples
    that cannot be read are told (exit code 3), the others evaluated; docs/evaluation.md explains
    every figure and file.

    Args:
        data: A dataset of `r2art synth` or of another kind (docs/datasets.md), or a folder of
            `r2art benchmark make`; once per dataset.
        category: Which one, where a dataset or benchmark holds several.
        split: Which one, where a dataset has several.
        model: A model of `r2art export`; default: the one inside r2art.
        out: Folder for the report: tables, figures, the worst photos.
        limit: Take only the first so many photos of each dataset.
        refine: Most steps to fit estimates to where the network sees the parts; 0 for none.
        results: Markdown file in which to (re)write the sections on these datasets.
        json: Print JSON instead of tables.
    """
    from r2art.learn.evaluation.report import Evaluation, run_eval
    from r2art.run.predictor import SHIPPED_MODEL, load
    from r2art.run.refinement.mask_fit import STEPS, check_steps
    from r2art.run.report import say

    if not data:
        raise UsageError("no data given; add --data DIR for each dataset")
    predictor, steps = load(model), STEPS if refine is None else refine
    check_steps(steps)
    tests = chosen_tests(predictor, data, category, split)

    def ask(name: str) -> "Predict":
        def predict(sample: "Sample", given_box: bool) -> "Prediction":
            known = (name, sample.box.tolist()) if given_box else (None, None)
            return predictor.predict(sample.image, sample.camera, *known, refine=steps)

        return predict

    done = run_eval(
        Evaluation(
            tests=tests,
            ask=ask,
            model=model or Path(str(SHIPPED_MODEL)),
            out=out,
            limit=limit,
            refine=refine,
            results=results,
            as_json=json,
        )
    )
    broken = [problem for result in done for problem in result.report.broken]
    for problem in broken:
        say("error", problem)
    return 3 if broken else 0


def chosen_tests(
    predictor: "Predictor",
    data: Sequence[Path],
    category: str | None = None,
    split: str | None = None,
) -> "list[TestSet]":
    """Those datasets that a model can be measured on; the others are told.

    Raises:
        UsageError: There is none.
    """
    from r2art.learn.evaluation.testsets import open_testsets
    from r2art.run.report import say

    tests = [test for path in data for test in open_testsets(path, category, split)]
    reasons = [_misfit(predictor, test.source.category) for test in tests]
    if all(reasons):
        raise UsageError(f"cannot evaluate {tests[0].name}: {reasons[0]}")
    for test, reason in zip(tests, reasons, strict=True):
        if reason:
            say("warning", f"{test.name} is left out: {reason}")
    return [test for test, reason in zip(tests, reasons, strict=True) if not reason]


def _misfit(predictor: "Predictor", category: "Category") -> str:
    """Why a model cannot be measured on a category; empty where it can."""
    if category.name not in predictor.categories:
        return f"this model knows {', '.join(predictor.categories)}, not {category.name}"
    known = predictor.category(category.name)
    ours, theirs = ([(j.kind, j.parent) for j in c.joints] for c in (known, category))
    if ours == theirs:
        return ""
    joints = (" ".join(kind for kind, _ in found) or "none" for found in (ours, theirs))
    has, needed = joints
    return f"the joints of this model's {category.name} are {has}, those of the data {needed}"
