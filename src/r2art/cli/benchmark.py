"""`r2art benchmark`: make the benchmark from fixed seeds, and hold its files against its hashes.

Both need the extra ``train``, which is imported only inside them.
"""

import shlex
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, arg

from r2art.cli.group import Group
from r2art.run.report import say

if TYPE_CHECKING:
    from r2art.data.benchmark.manifest import Verified
    from r2art.data.benchmark.plan import Benchmark

FOUND = 1
"""Exit code of a verification that has found faults."""


def make(
    *,
    out: Annotated[Path, arg(metavar="DIR")],
    n: Annotated[int, arg(aliases=["-n"], metavar="N")] = 1000,
    sweep_n: Annotated[int, arg(metavar="N")] = 200,
    settings: Annotated[
        tuple[Literal["physical", "artimage-scale", "occlusion", "truncation", "cad"], ...],
        arg(metavar="SETTING...", help_behavior_hint="(default: all; cad if there are --models)"),
    ] = (),
    categories: Annotated[
        tuple[str, ...], arg(metavar="CATEGORY...", help_behavior_hint="(default: all)")
    ] = (),
    size: int = 320,
    split: Literal["test", "val", "train"] = "test",
    backgrounds: Path | None = None,
    models: Path | None = None,
    workers: int = 0,
) -> int:
    """Make the benchmark: a dataset per setting, level and category, from fixed seeds.

    The same arguments give the same bytes; benchmark.json tells their hashes. A run that was
    stopped goes on where it was when the same command is given again. docs/benchmark.md says
    what the settings measure.

    Args:
        out: Its folder.
        n: Photos per category of physical and of artimage-scale.
        sweep_n: Photos per category and level of occlusion and of truncation, and per category
            of cad.
        settings: Which: physical (real sizes, many cameras), artimage-scale (ArtImage's sizes
            and camera), occlusion (0 to 60 % of the object's pixels hidden), truncation (0 to
            50 % of its box outside the photo), cad (models that strangers made).
        categories: Which.
        size: Side of the square photos (px); those of artimage-scale have 640.
        split: Whose objects; train makes data of the same kind to learn from.
        backgrounds: Folder of photos, .hdr light probes and textures; without it everything is
            procedural.
        models: Folder of models for cad: with a models.toml, or one of the public collections
            that docs/benchmark.md names.
        workers: Processes; 0 takes one per core.
    """
    from r2art.data.benchmark.make import make as run
    from r2art.data.benchmark.plan import SETTINGS, Benchmark

    possible = SETTINGS if models is not None else SETTINGS[:-1]
    benchmark = Benchmark(
        out=out,
        settings=settings or possible,
        categories=categories,
        n=n,
        sweep_n=sweep_n,
        size=size,
        split=split,
        backgrounds=backgrounds,
        models=models,
        workers=workers,
    )
    whole = run(benchmark, _command(benchmark), lambda text: print(text, file=sys.stderr))
    say("written", f"{out} (sha256 {whole})")
    return 0


def _command(benchmark: "Benchmark") -> str:
    """The command line that makes the same anywhere, in ``DIR``."""
    given: dict[str, tuple[object, ...]] = {
        "--out": ("DIR",),
        "-n": (benchmark.n,),
        "--sweep-n": (benchmark.sweep_n,),
        "--settings": benchmark.settings,
        "--categories": benchmark.names,
        "--size": (benchmark.size,),
        "--split": (benchmark.split,),
        "--backgrounds": () if benchmark.backgrounds is None else (benchmark.backgrounds.name,),
        "--models": () if benchmark.models is None else (benchmark.models.name,),
    }
    words = [word for option, values in given.items() if values for word in (option, *values)]
    return shlex.join(["r2art", "benchmark", "make", *map(str, words)])


def verify(
    path: Annotated[Path, Positional, arg(metavar="DIR")],
    /,
    *,
    json: Annotated[bool, arg(help_behavior_hint="")] = False,
) -> int:
    """Hold every file of a benchmark against its hash; exit code 1 if one differs or is missing.

    Args:
        path: A folder of `r2art benchmark make`.
        json: Print JSON instead of lines.
    """
    from r2art.data.benchmark.manifest import read_manifest
    from r2art.data.benchmark.manifest import verify as run

    with _progress(len(read_manifest(path).get("files", ()))) as advance:
        verified = run(path, advance)
    if json:
        _print_json(path, verified)
    else:
        for fault in verified.faults:
            print(fault)
        print(f"{path}: {verified.files} files, {len(verified.faults) or 'no'} faults")
        print(f"sha256 {verified.sha256}")
    return FOUND if verified.faults else 0


def _print_json(path: Path, verified: "Verified") -> None:
    from json import dumps

    faults = [{"file": f.file, "problem": f.problem} for f in verified.faults]
    told = {"path": str(path), "files": verified.files, "sha256": verified.sha256, "faults": faults}
    print(dumps(told, indent=1))


@contextmanager
def _progress(total: int) -> Iterator[Callable[[int], None]]:
    """A bar on stderr; call what it gives with the number of files just read."""
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("verifying", total=total)
        yield lambda done: bar.advance(task, done)


HELP = """usage: r2art benchmark COMMAND ...

Make the benchmark from fixed seeds, and hold its files against its hashes.

commands:
{commands}

examples:
  r2art benchmark make --out bench                    everything but cad, all categories
  r2art benchmark make --out bench-laptop --categories laptop -n 200 --sweep-n 50
  r2art benchmark make --out bench-cad --settings cad --models articulated
  r2art benchmark verify bench                        names each file that differs or is missing

exit codes: 0 all done; 1 `verify` has found faults; 2 an argument cannot be meant; 3 data cannot
be read or written

r2art benchmark COMMAND --help lists a command's options."""

BENCHMARK = Group(
    summary="Make the benchmark from fixed seeds, and hold its files against its hashes.",
    help=HELP,
    commands={"make": make, "verify": verify},
)
