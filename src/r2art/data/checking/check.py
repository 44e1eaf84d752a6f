"""`r2art data check`: every fault of a dataset, by file and field."""

from collections.abc import Callable, Iterator

from r2art.core.errors import R2ArtError
from r2art.data.checking.agreement import TOLERANCE
from r2art.data.checking.sample_faults import sample_faults
from r2art.data.checking.store_faults import prior_faults, store_faults
from r2art.data.shards import PRIOR, Dataset
from r2art.data.source import Fault, Source


def check(
    source: Source, tolerance: float = TOLERANCE, advance: Callable[[int], None] = lambda done: None
) -> Iterator[Fault]:
    """All faults of a dataset, each once; nothing that it holds makes this raise.

    Args:
        source: Of a folder of `r2art synth`, files and hashes are checked too.
        tolerance: How exact the geometry must be; see `sample_faults`.
        advance: Called with the number of samples done since the last call.
    """
    told: set[tuple[str, str, str]] = set()
    for fault in _all_faults(source, tolerance, advance):
        key = (fault.file, fault.field, fault.problem)
        if key not in told:
            told.add(key)
            yield fault


def _all_faults(
    source: Source, tolerance: float, advance: Callable[[int], None]
) -> Iterator[Fault]:
    folder = source.folder if isinstance(source, Dataset) else None
    if isinstance(source, Dataset):
        yield from store_faults(source)
    try:
        prior = str(folder / PRIOR) if folder else f"prior of {source.category.name}"
        wrong = [Fault(prior, *problem) for problem in prior_faults(source.category)]
    except Fault as fault:  # of a dataset whose category is worked out from its objects
        wrong = [fault]
    yield from wrong
    for index in range(len(source)):
        yield from _faults_of(source, index, None if wrong else tolerance)
        advance(1)


def _faults_of(source: Source, index: int, tolerance: float | None) -> Iterator[Fault]:
    """What is wrong with a sample; without a tolerance, only what keeps it from being read."""
    file = source.file(index)
    try:
        sample = source[index]
    except Fault as fault:
        yield fault
        return
    except R2ArtError as error:
        yield Fault(file, "", str(error))
        return
    if isinstance(source, Dataset) and isinstance(size := source.manifest.get("size"), int):
        height, width = sample.mask.shape
        if (width, height) != (size, size):
            yield Fault(file, "image", f"has {width}×{height} px, the manifest says {size}×{size}")
    if tolerance is not None:
        for field, problem in sample_faults(sample, source.category, tolerance):
            yield Fault(file, field, problem)
