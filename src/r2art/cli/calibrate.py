"""`r2art calibrate`: make a model's confidence a probability. Needs the extra ``train``."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional, UseAppendAction, arg

from r2art.cli.learn import chosen_tests
from r2art.core.errors import UsageError

if TYPE_CHECKING:
    from r2art.core.prediction import Prediction
    from r2art.data.sample import Sample
    from r2art.learn.calibrate import Calibrated, Found
    from r2art.learn.evaluation.tables import Table


def calibrate(
    model: Annotated[Path, Positional, arg(metavar="MODEL.onnx")],
    /,
    *,
    data: UseAppendAction[tuple[Path, ...]],
    out: Annotated[Path, arg(metavar="OUT.onnx")],
    json: Annotated[bool, arg(help_behavior_hint="")] = False,
) -> int:
    """Make a model's confidence the probability that a part, or a joint's state, is right.

    What a network says is no probability: it was taught on photos that it has learned by heart,
    and knows nothing of the refinement that follows. So ask it about new photos, count how
    often it is right, and let the model file remember that: per category a few weights, of what
    the network says and of how well the refined outline fits. Poses stay as they are,
    to the bit; only `confidence` changes. *Right* is a part whose ADD, scale aligned,
    is within 10 % of its diameter, and a joint's state within 10 % of its limits' range.

    The photos must be held out: never those of training, for of these it is sure and right; nor
    those of the final test, for its figures would then be too good. That is what the val split
    is for: `r2art synth laptop -n 100 --split val --out data/laptop-val`. A hundred photos of
    each category will do; a category that no dataset shows gets no calibration. What is learned
    holds for photos like these, so calibrate on real ones if you have labelled some.

    Printed is what it brings: the calibration error (0: of the parts with confidence 0.8, 80 %
    are right) and the AUROC (1: every right part is trusted more than every wrong one; 0.5:
    confidence tells nothing). After: cross-validated, so that every photo is judged by weights
    fitted without it. A calibration that the model file has already is ignored and replaced.

    Args:
        model: A file of `r2art export`.
        data: A dataset of held-out photos; once per category, or more often.
        out: The model file with calibration; may be the same file.
        json: Print JSON instead of a table.
    """
    from r2art.data.shards import write_atomically
    from r2art.learn.calibrate import calibrate as run
    from r2art.learn.calibrate import with_calibration
    from r2art.learn.evaluation.evaluate import count
    from r2art.learn.exported import read_model
    from r2art.run.model import Model
    from r2art.run.predictor import Predictor
    from r2art.run.refinement.mask_fit import STEPS
    from r2art.run.report import progress, say

    if not data:
        raise UsageError("no data given; add --data DIR for each category")
    if not out.parent.is_dir():
        raise UsageError(f"cannot write {out}: there is no folder {out.parent}; make it first")
    predictor = Predictor(Model(model), calibrated=False)
    tests = chosen_tests(predictor, data)
    for test in tests:
        if (split := test.about.get("split")) in ("train", "test"):
            say("warning", f"{test.name} is of the {split} split; calibrate on val")

    def predict(sample: "Sample", category: str, refined: bool) -> "Prediction":
        known = (sample.camera, category, sample.box.tolist())
        return predictor.predict(sample.image, *known, refine=STEPS if refined else 0)

    with progress(sum(count(test, None) for test in tests)) as advance:
        results, broken = run(tests, predict, advance)
    write_atomically(out, with_calibration(read_model(model), results).SerializeToString())
    for problem in broken:
        say("error", problem)
    found = {result.category for result in results}
    if without := [name for name in predictor.categories if name not in found]:
        names = ", ".join(without)
        say("warning", f"no data of {names}: what the network says stays as it is there")
    say("written", str(out))
    _print(results, as_json=json)
    return 3 if broken else 0


def _print(results: Sequence["Calibrated"], *, as_json: bool) -> None:
    from rich.console import Console

    if as_json:
        told = {
            result.category: {
                "parts": _found(result.parts),
                "joints": None if result.joints is None else _found(result.joints),
            }
            for result in results
        }
        print(dumps(told, indent=1, allow_nan=False))
        return
    console = Console()
    if not console.is_terminal:
        console.width = 200  # a file or a pipe need not wrap
    console.print(_table(results).rich())


def _found(found: "Found") -> dict[str, Any]:
    return {
        "calibration": found.calibration.to_dict(),
        "refined": None if found.refined is None else _told(asdict(found.refined)),
        "plain": _told(asdict(found.plain)),
    }


def _told(value: Any) -> Any:
    """Nested values as JSON has them: what is not known is null."""
    if isinstance(value, dict):
        return {key: _told(inner) for key, inner in value.items()}
    return None if isinstance(value, float) and math.isnan(value) else value


def _table(results: Sequence["Calibrated"]) -> "Table":
    from r2art.learn.evaluation.tables import Table

    judged = [
        (result.category, what, how, judged)
        for result in results
        for what, found in (("parts", result.parts), ("joints", result.joints))
        if found is not None
        for how, judged in (("yes", found.refined), ("no", found.plain))
        if judged is not None
    ]
    return Table(
        title="Confidence before → after calibration (after: cross-validated)",
        columns=("category", "of", "refined", "photos", "right", "calibration error", "AUROC"),
        rows=tuple(
            (
                *(category, what, how, str(found.photos), f"{found.right:.0%}"),
                f"{_figure(found.before.error)} → {_figure(found.after.error)}",
                f"{_figure(found.before.auroc)} → {_figure(found.after.auroc)}",
            )
            for category, what, how, found in judged
        ),
        words=3,
    )


def _figure(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.3f}"
