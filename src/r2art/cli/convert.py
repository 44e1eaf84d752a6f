"""`r2art convert`: predictions into the formats of other programs."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg

from r2art.cli.patterns import expand
from r2art.core.errors import InputError, UsageError
from r2art.run.report import say

if TYPE_CHECKING:
    from r2art.core.prediction import Prediction
    from r2art.run.export import Format

DEFAULT_OUT = Path("r2art_out")
TABLE = "predictions"
"""Name of a table of several predictions."""


def convert(
    predictions: Annotated[
        tuple[str, ...], Positional, arg(metavar="JSON...", help_behavior_hint="")
    ],
    /,
    *,
    to: Annotated[
        tuple[str, ...], UseAppendAction, arg(metavar="FORMAT", help_behavior_hint="")
    ] = (),
    out: Annotated[
        Path, arg(metavar="DIR", help_behavior_hint=f"(default: {DEFAULT_OUT})")
    ] = DEFAULT_OUT,
) -> int:
    """Write predictions as URDF, MJCF, GLB, CSV or BOP results.

    $ r2art predict photos/ --out out

    $ r2art convert out/ --to urdf --to glb --out models    a file for each prediction

    $ r2art convert out/*.json --to csv --out tables        tables/predictions.csv, for all

    urdf: robot description, for ROS, yourdfpy and simulators

    mjcf: model for MuJoCo, the photo as its keyframe

    glb: 3D scene, with an animation of every joint

    csv: table, a row for each part and the joint that moves it

    bop: results for the BOP toolkit

    json: the prediction itself, a file for each line of a .jsonl

    What is in them, and what loads them: docs/exports.md.

    Args:
        predictions: NAME.json as `r2art predict` writes them, .jsonl with one on each line,
            folders of both, and globs.
        to: One of the above; give it again for more.
        out: Folder for the results; it is made if need be.
    """
    if not predictions:
        raise UsageError("no prediction given; try `r2art convert r2art_out/ --to urdf`")

    from r2art.run.export import FORMATS
    from r2art.run.files import make_folder

    if not to:
        raise UsageError(f"no format given; choose --to {', '.join(FORMATS)}")
    if unknown := [name for name in to if name not in FORMATS]:
        raise UsageError(f"unknown format {unknown[0]!r}; choose --to {', '.join(FORMATS)}")
    make_folder(out)
    named, exit_code = _read(predictions)
    for name, prediction in named.items():
        if prediction.rejected is not None:
            say("rejected", f"{name}: {prediction.rejected}")
    for name in dict.fromkeys(to):
        _write(named, FORMATS[name], out)
    return exit_code


def _read(patterns: Sequence[str]) -> tuple[dict[str, "Prediction"], int]:
    """Every prediction meant, by the name of its results, and the exit code so far."""
    from r2art.run.export.reading import read_predictions
    from r2art.run.files import find_predictions, result_names, untaken

    paths, exit_code = expand(patterns, find_predictions)
    named: dict[str, Prediction] = {}
    names = result_names(paths)
    taken = {name.casefold() for name in names}
    for path, name in zip(paths, names, strict=True):
        try:
            found = read_predictions(path)
        except InputError as error:
            say("error", str(error))
            exit_code = error.exit_code
            continue
        if len(found) == 1:
            named[name] = found[0]
        else:
            named.update({untaken(f"{name}-{i:06d}", taken): p for i, p in enumerate(found)})
    return named, exit_code


def _write(named: dict[str, "Prediction"], format: "Format", out: Path) -> None:
    """One file for each prediction, or a table of all."""
    from r2art.run.files import write_whole

    if not named:
        return
    only = next(iter(named)) if len(named) == 1 else None
    if format.encode_all is not None:
        path = out / f"{only or TABLE}{format.suffix}"
        write_whole(path, format.encode_all(list(named.values())))
        say("written", str(path))
        return
    for name, prediction in named.items():
        write_whole(out / f"{name}{format.suffix}", format.encode(prediction))
    many = f"{out / 'NAME'}{format.suffix} ({len(named)} files)"
    say("written", f"{out / only}{format.suffix}" if only is not None else many)
