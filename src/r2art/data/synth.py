"""`r2art synth`: render a labelled dataset of a procedural category, resumably."""

import io
import json
import multiprocessing
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from r2art.core.errors import InputError, UsageError
from r2art.data import shards
from r2art.data.objects import Objects, Split, instance_seed
from r2art.data.sample import Sample
from r2art.data.scene import make_sample
from r2art.data.surroundings import Surroundings

SHARD_SIZE = 250


@dataclass(frozen=True, kw_only=True)
class Synth:
    """What to render. Everything but ``workers`` decides the bytes of the result."""

    objects: Objects
    n: int
    seed: int
    split: Split
    size: int
    backgrounds: Path | None
    out: Path
    workers: int = 0

    def __post_init__(self) -> None:
        if self.n < 1 or not 32 <= self.size <= 2048:
            raise UsageError(f"need n >= 1 and 32 <= size <= 2048, got n={self.n} size={self.size}")


def synthesise(job: Synth, index: int) -> Sample:
    """Sample ``index`` of a dataset; it depends on nothing else."""
    files = Surroundings.from_folder(job.backgrounds)
    seed = instance_seed(job.objects.name, job.split, job.seed, index)
    instance = job.objects.instance(seed, files.photos)
    rng = np.random.default_rng([seed, 1])
    return make_sample(rng, instance, job.objects.staging, files, job.size)


_job: Synth | None = None


def _start_worker(job: Synth) -> None:
    global _job
    _job = job


def _make_row(index: int) -> dict[str, Any]:
    assert _job is not None
    return shards.to_row(index, synthesise(_job, index))


def _manifest(job: Synth) -> dict[str, Any]:
    return {
        "format": shards.FORMAT,
        **job.objects.about(),
        "n": job.n,
        "seed": job.seed,
        "split": job.split,
        "size": job.size,
        "backgrounds": bool(job.backgrounds),
        "shards": -(-job.n // SHARD_SIZE),
    }


def _prepare(job: Synth) -> None:
    """Make or check the folder; refuse to mix two datasets."""
    try:
        job.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot write to {job.out}: {error.strerror}; choose another --out"
        ) from error
    wanted, path = _manifest(job), job.out / shards.MANIFEST
    if path.exists():
        found = shards.read_manifest(job.out)
        if odd := [k for k in wanted | found if found.get(k) != wanted.get(k)]:
            raise InputError(
                f"{job.out} already holds another dataset (differs in {', '.join(odd)}); "
                "choose another --out"
            )
    if not (job.out / shards.PRIOR).exists():
        out = io.BytesIO()
        job.objects.prior().save(out)
        shards.write_atomically(job.out / shards.PRIOR, out.getvalue())
    shards.write_atomically(path, json.dumps(wanted, indent=1).encode())


def synth(job: Synth) -> None:
    """Render what is missing of a dataset, with a progress bar; safe to kill and call again.

    Raises:
        InputError: The folder cannot be written or holds another dataset, or there are no
            such backgrounds.
    """
    Surroundings.from_folder(job.backgrounds)
    _prepare(job)
    count = -(-job.n // SHARD_SIZE)
    missing = [k for k in range(count) if not shards.shard_path(job.out, k).exists()]
    if not missing:
        return
    blocks = [range(k * SHARD_SIZE, min(job.n, (k + 1) * SHARD_SIZE)) for k in missing]
    synthesise(job, 0)  # compiles the kernels once, before the workers start
    context = multiprocessing.get_context("spawn")
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    with (
        context.Pool(job.workers or os.cpu_count() or 1, _start_worker, (job,)) as pool,
        Progress(*columns, TimeRemainingColumn(), console=Console(stderr=True)) as progress,
    ):
        task = progress.add_task(f"{job.objects.name} {job.split}", total=sum(map(len, blocks)))
        rows = pool.imap(_make_row, [i for block in blocks for i in block], chunksize=4)
        for number, block in zip(missing, blocks, strict=True):
            made = []
            for _ in block:
                made.append(next(rows))
                progress.advance(task)
            shards.write_shard(shards.shard_path(job.out, number), made)
