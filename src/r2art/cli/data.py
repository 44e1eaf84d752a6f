"""`r2art data`: look at labelled photos, check them, and bring them into other formats.

They need the extra ``train``, which is imported only inside them.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional, arg

from r2art.cli.group import Group
from r2art.core.errors import UsageError
from r2art.run.report import say

if TYPE_CHECKING:
    from r2art.data.source import Fault, Source

FOUND = 1
"""Exit code of a check that has found faults."""
SPELLED_OUT = 20

Folder = Annotated[Path, Positional, arg(metavar="PATH")]
Name = Annotated[str | None, arg(metavar="NAME", help_behavior_hint="")]
Limit = Annotated[int | None, arg(aliases=["-n"], metavar="N", help_behavior_hint="(default: all)")]


def show(
    path: Folder,
    /,
    *,
    n: Annotated[int, arg(aliases=["-n"], metavar="N")] = 12,
    index: Annotated[tuple[int, ...], arg(metavar="I...", help_behavior_hint="")] = (),
    category: Name = None,
    split: Name = None,
    out: Annotated[Path | None, arg(help_behavior_hint="(default: sheet.png)")] = None,
    tile: Annotated[int, arg(metavar="PX")] = 480,
    json: Annotated[bool, arg(help_behavior_hint="")] = False,
) -> int:
    """Draw the labels of samples onto their photos, on one sheet.

    Masks are tinted; part boxes, joint axes, the root frame and the 2D box are drawn; below
    stands how much of each part is seen and how far each joint is open. Where labels are right,
    each box encloses the tint of its colour and each axis runs through its hinge. Samples that
    cannot be read are told (exit code 3), the others drawn.

    Args:
        path: A folder of `r2art synth`, or of another dataset (docs/datasets.md).
        n: Samples, evenly spread over the dataset.
        index: These samples instead.
        category: Which one, where the folder holds several.
        split: Which one: train, val or test (default: all that there is).
        out: The picture (.png).
        tile: Width of each sample.
        json: Print the labels, one line of JSON each (docs/prediction.md), instead of drawing;
            with --out do both.
    """
    source = _open(path, category, split)
    indices = _chosen(len(source), n, index)
    broken = _print_labels(source, indices) if json else []
    if out is not None or not json:
        broken = _draw_sheet(source, indices, tile, out or Path("sheet.png"))
    for problem in broken:
        say("error", problem)
    return 3 if broken else 0


def _chosen(count: int, n: int, index: Sequence[int]) -> list[int]:
    if outside := [i for i in index if not 0 <= i < count]:
        raise UsageError(f"there are samples 0 to {count - 1}, not {outside[0]}")
    if n < 1:
        raise UsageError(f"need -n of at least 1, got {n}")
    n = min(n, count)
    return list(index) or [k * count // n for k in range(n)]


def _print_labels(source: "Source", indices: Sequence[int]) -> list[str]:
    from dataclasses import replace

    from r2art.core.errors import R2ArtError
    from r2art.learn.evaluation.scores import truth

    broken = []
    for index in indices:
        try:
            labels = truth(source[index], source.category)
        except R2ArtError as error:
            broken.append(str(error))
        else:
            print(replace(labels, image_path=source.file(index)).to_json(), flush=True)
    return broken


def _draw_sheet(source: "Source", indices: Sequence[int], tile: int, out: Path) -> list[str]:
    import io

    from r2art.data.shards import write_atomically
    from r2art.learn.sheet import sheet

    if not 64 <= tile <= 4096:
        raise UsageError(f"--tile must be 64 to 4096 px, got {tile}")
    picture, broken = sheet(source, indices, tile)
    png = io.BytesIO()
    picture.save(png, "PNG")
    write_atomically(out, png.getvalue())
    say("written", str(out))
    return broken


def check(
    path: Folder,
    /,
    *,
    category: Name = None,
    split: Name = None,
    tolerance: Annotated[float, arg(metavar="SHARE")] = 1e-3,
    json: Annotated[bool, arg(help_behavior_hint="")] = False,
) -> int:
    """Look for faults in labelled photos; exit code 1 if there are any.

    Every sample is read, and its labels held against each other: numbers, camera, rotations,
    joint limits, kinematics, boxes, masks, depth, visible shares; of a folder of `r2art synth`
    also manifest, prior, counts and hashes. Each fault is told by file and field.

    Args:
        path: A folder of `r2art synth`, or of another dataset (docs/datasets.md).
        category: Which one, where the folder holds several.
        split: Which one: train, val or test (default: all that there is).
        tolerance: How exact the geometry must be: in rotations, and as a share of the object's
            diagonal. Labels made by hand need more, 0.02 say.
        json: Print every fault as JSON instead of a table.
    """
    from r2art.data.checking.check import check as faults_of
    from r2art.data.source import Fault

    if not 0 < tolerance < 1:
        raise UsageError(f"--tolerance must lie between 0 and 1, got {tolerance:g}")
    samples, faults = 0, []
    try:
        source = _open(path, category, split, whole=False)
    except Fault as fault:
        faults = [fault]
    else:
        samples = len(source)
        with _progress(f"checking {path.name}", samples) as advance:
            faults = list(faults_of(source, tolerance, advance))
    if json:
        _print_json(path, samples, faults)
    else:
        _print_faults(path, samples, faults)
    return FOUND if faults else 0


def _print_json(path: Path, samples: int, faults: "Sequence[Fault]") -> None:
    import json

    each = [{"file": f.file, "field": f.field, "problem": f.problem} for f in faults]
    print(json.dumps({"path": str(path), "samples": samples, "faults": each}, indent=1))


def _print_faults(path: Path, samples: int, faults: "Sequence[Fault]") -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(highlight=False)
    if not faults:
        console.print(Text(f"{path}: {samples} samples, no fault"))
        return
    table = Table(box=box.SIMPLE_HEAD)
    for heading in ("field", "faults", "first in"):
        table.add_column(
            heading, overflow="fold", justify="right" if heading == "faults" else "left"
        )
    first = {f.field: f.file for f in reversed(faults)}
    for field, count in Counter(f.field for f in faults).most_common():
        table.add_row(Text(field or "(file)"), str(count), Text(first[field]))
    console.print(Text(f"{path}: {samples} samples, {len(faults)} faults"))
    console.print(table)
    for fault in faults[:SPELLED_OUT]:
        console.print(Text(str(fault)), soft_wrap=True)
    if (rest := len(faults) - SPELLED_OUT) > 0:
        console.print(Text(f"... and {rest} more; --json tells all"))


def convert(
    path: Folder,
    /,
    *,
    out: Annotated[Path, arg(metavar="DIR")],
    category: Name = None,
    split: Name = None,
    n: Limit = None,
) -> int:
    """Bring any labelled photos into the format that `r2art train` and `r2art eval` read.

    A run that was stopped goes on where it was when the same command is given again.

    Args:
        path: A folder of `r2art synth`, or of another dataset (docs/datasets.md).
        out: Folder of the new dataset.
        category: Which one, where the folder holds several.
        split: Which one: train, val or test (default: all that there is).
        n: Only the first so many samples.
    """
    from r2art.data.convert import convert as run

    source = _open(path, category, split)
    about = {"source": path.resolve().name, "split": split or _own_split(source) or "all"}
    with _progress(f"converting {path.name}", _count(source, n)) as advance:
        done = run(source, about, out, n, advance)
    say("written", f"{out} ({done} samples of {source.category.name})")
    return 0


def bop(
    path: Folder,
    /,
    *,
    out: Annotated[Path, arg(metavar="DIR")],
    category: Name = None,
    split: Name = None,
    n: Limit = None,
) -> int:
    """Write labelled photos in the format of BOP, the benchmark of 6D object pose estimation.

    Each part is an object of its own; docs/datasets.md tells the rest.

    Args:
        path: A folder of `r2art synth`, or of another dataset (docs/datasets.md).
        out: A new or empty folder.
        category: Which one, where the folder holds several.
        split: Which one: train, val or test (default: all that there is).
        n: Only the first so many samples.
    """
    from r2art.data.bop import export_bop

    source = _open(path, category, split)
    folder = split or _own_split(source) or "test"
    with _progress(f"exporting {path.name}", _count(source, n)) as advance:
        done = export_bop(source, out, folder, n, advance)
    say("written", f"{out / folder} ({done} images of {source.category.name})")
    return 0


def hash(path: Folder, /, *, json: Annotated[bool, arg(help_behavior_hint="")] = False) -> int:
    """Write the SHA-256 of a dataset's files into its SHA256SUMS, and print one for the whole.

    `r2art synth` does so itself when it makes the last shard. Needed is the command where the
    shards of several machines were copied together. `r2art data check` and `sha256sum --check`
    hold the files against these hashes.

    Args:
        path: A folder of `r2art synth`.
        json: Print JSON, with the hash of every file.
    """
    from json import dumps

    from r2art.data.filling import write_hashes
    from r2art.data.hashes import read_sums

    whole = write_hashes(path)
    print(dumps({"sha256": whole, "files": read_sums(path)}, indent=1) if json else whole)
    return 0


def _open(path: Path, category: str | None, split: str | None, *, whole: bool = True) -> "Source":
    from r2art.data.adapters import open_source

    return open_source(path, category, split, whole=whole)


def _own_split(source: "Source") -> str | None:
    from r2art.data.shards import Dataset

    return source.manifest.get("split") if isinstance(source, Dataset) else None


def _count(source: "Source", n: int | None) -> int:
    if n is not None and n < 1:
        raise UsageError(f"need -n of at least 1, got {n}")
    return len(source) if n is None else min(n, len(source))


@contextmanager
def _progress(title: str, total: int) -> Iterator[Callable[[int], None]]:
    """A bar on stderr, if that is a terminal; call what it gives with the number just done."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    columns: tuple[Any, ...] = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    console = Console(stderr=True)
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task(title, total=total)
        yield lambda done: bar.advance(task, done)


HELP = """usage: r2art data COMMAND ...

Look at labelled photos, check them, and bring them into other formats.

commands:
{commands}

examples:
  r2art data show data/laptop-train                   twelve samples with their labels: sheet.png
  r2art data show data/laptop-train --index 3 17 --out two.png
  r2art data check data/laptop-train                  every fault, by file and field
  r2art data check ArtImage --category laptop --split test --json
  r2art data convert ArtImage --category laptop --split train --out data/artimage-laptop
  r2art data bop data/laptop-test --out bop/laptop
  r2art data hash data/laptop-train                   one SHA-256 for the whole dataset

exit codes: 0 all done; 1 `check` has found faults; 2 an argument cannot be meant; 3 data cannot be
read or written

r2art data COMMAND --help lists a command's options."""

DATA = Group(
    summary="Look at labelled photos, check them, and bring them into other formats.",
    help=HELP,
    commands={"show": show, "check": check, "convert": convert, "bop": bop, "hash": hash},
)
