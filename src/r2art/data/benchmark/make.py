"""`r2art benchmark make`: all datasets of a benchmark, one after the other."""

import platform
from collections.abc import Callable
from importlib.metadata import version

from r2art.data.benchmark import manifest
from r2art.data.benchmark.plan import Benchmark, members
from r2art.data.synth import synth

DECISIVE = ("numpy", "pillow", "scipy", "trimesh", "warp-lang")
"""Packages whose other versions may give other bytes."""


def make(
    benchmark: Benchmark, command: str, announce: Callable[[str], None] = lambda _: None
) -> str:
    """Make what is missing of a benchmark; safe to kill and call again.

    Args:
        benchmark: Which.
        command: The command line that makes it, for the manifest.
        announce: Told of each dataset before it is made.

    Returns:
        One SHA-256 of all its files.

    Raises:
        InputError: The folder cannot be written to or holds another benchmark, or a file that
            was asked for cannot be read.
    """
    planned = members(benchmark)
    datasets = [member.about(benchmark.out) for member in planned]
    about = {**benchmark.about(), "datasets": datasets}
    manifest.begin(benchmark.out, about, {"command": command, "made_by": _versions()})
    for k, member in enumerate(planned, start=1):
        folder = member.job.out.relative_to(benchmark.out)
        announce(f"{k}/{len(planned)} {folder} ({member.job.n} photos)")
        synth(member.job)
    return manifest.finish(benchmark.out)


def _versions() -> dict[str, str]:
    packages = {name: version(name) for name in ("r2art", *DECISIVE)}
    return {"python": platform.python_version(), "machine": platform.machine(), **packages}
