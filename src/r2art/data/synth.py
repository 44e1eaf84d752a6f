"""`r2art synth`: render a labelled dataset of a procedural category, resumably."""

import multiprocessing
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from r2art.core.errors import UsageError
from r2art.data import filling, shards
from r2art.data.filling import WHOLE, Share
from r2art.data.hashes import folder_hash
from r2art.data.objects import Objects, Split, instance_seed
from r2art.data.sample import Sample
from r2art.data.scenes.scene import Arrange, make_sample
from r2art.data.scenes.surroundings import Surroundings

SHARD_SIZE = shards.SHARD_SIZE


class Arrangement(Arrange, Protocol):
    """An `Arrange` that a dataset's manifest can tell of."""

    def about(self) -> dict[str, Any]:
        """What the manifest says of it; JSON."""
        ...


@dataclass(frozen=True, kw_only=True)
class Synth:
    """What to render; all but ``out``, ``workers`` and ``share`` decides the bytes of the result.

    Attributes:
        objects: Of one category.
        n: Photos, of one object each.
        seed: Another seed makes other objects.
        split: No object is in two splits.
        size: Side of the square photos (px).
        backgrounds: Folder to draw surroundings from.
        out: Folder of the dataset.
        workers: Processes; 0: one per core.
        share: The part of the dataset that this run makes.
        arrange: What stands round and before the objects; None: what is usual.
    """

    objects: Objects
    n: int
    seed: int
    split: Split
    size: int
    backgrounds: Path | None
    out: Path
    workers: int = 0
    share: Share = WHOLE
    arrange: Arrangement | None = None

    def __post_init__(self) -> None:
        if self.n < 1 or not 32 <= self.size <= 2048:
            raise UsageError(f"need n >= 1 and 32 <= size <= 2048, got n={self.n} size={self.size}")


def synthesise(job: Synth, index: int) -> Sample:
    """Sample ``index`` of a dataset; it depends on nothing else."""
    files = Surroundings.from_folder(job.backgrounds)
    seed = instance_seed(job.objects.name, job.split, job.seed, index)
    instance = job.objects.instance(seed, files.photos)
    rng = np.random.default_rng([seed, 1])
    return make_sample(rng, instance, job.objects.staging, files, job.size, job.arrange)


_job: Synth | None = None


def _start_worker(job: Synth) -> None:
    global _job
    _job = job


def _make_row(index: int) -> dict[str, Any]:
    assert _job is not None
    return shards.to_row(index, synthesise(_job, index))


@contextmanager
def _rows(job: Synth, indices: Sequence[int]) -> Iterator[Iterable[dict[str, Any]]]:
    """The rows of some samples, in order, made by as many processes as the job asks for."""
    if (workers := job.workers or os.cpu_count() or 1) == 1:
        yield (shards.to_row(index, synthesise(job, index)) for index in indices)
        return
    synthesise(job, indices[0])  # compiles the kernels once, before the workers start
    with multiprocessing.get_context("spawn").Pool(workers, _start_worker, (job,)) as pool:
        yield pool.imap(_make_row, indices, chunksize=4)


def _manifest(job: Synth) -> dict[str, Any]:
    return {
        "format": shards.FORMAT,
        **job.objects.about(),
        "seed": job.seed,
        "split": job.split,
        "size": job.size,
        "backgrounds": f"sha256:{folder_hash(job.backgrounds)}" if job.backgrounds else False,
        **(job.arrange.about() if job.arrange else {}),
        **filling.counts(job.n, SHARD_SIZE),
    }


def synth(job: Synth) -> None:
    """Render what is missing of a dataset, with a progress bar; safe to kill and call again.

    Raises:
        InputError: The folder cannot be written or holds another dataset, the disk is full, or
            there are no such backgrounds.
    """
    Surroundings.from_folder(job.backgrounds)
    manifest = _manifest(job)
    filling.prepare(job.out, manifest, job.objects.prior)
    if numbers := filling.missing(job.out, manifest, job.share):
        indices = [i for k in numbers for i in filling.block(manifest, k)]
        with _rows(job, indices) as rows, _progress() as progress:
            title = f"{job.objects.name} {job.split}"
            tracked = progress.track(rows, len(indices), description=title)
            filling.fill(job.out, manifest, numbers, tracked)
    filling.seal(job.out, manifest)


def _progress() -> Progress:
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    return Progress(*columns, TimeRemainingColumn(), console=Console(stderr=True))
