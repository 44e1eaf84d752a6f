"""`r2art data convert`: any labelled photos as a dataset of this project's own format."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from r2art.core.errors import InputError
from r2art.data import filling, shards
from r2art.data.filling import WHOLE
from r2art.data.source import Source


def convert(
    source: Source,
    about: dict[str, Any],
    out: Path,
    limit: int | None = None,
    advance: Callable[[int], None] = lambda done: None,
) -> int:
    """Write a source as a dataset; safe to kill and call again.

    Args:
        source: Where the samples come from.
        about: What the manifest shall say of it; JSON. A folder that says else is refused.
        out: Folder of the dataset.
        limit: Only the first so many samples.
        advance: Called with the number of samples done since the last call.

    Returns:
        The number of samples.

    Raises:
        InputError: The source is empty or broken (see `Fault`), or the folder cannot be written
            or holds another dataset.
    """
    n = len(source) if limit is None else min(limit, len(source))
    if n < 1:
        raise InputError(f"there is no sample of {source.category.name} to convert")
    about = {"format": shards.FORMAT, "category": source.category.name, **about}
    manifest = about | filling.counts(n, shards.SHARD_SIZE)
    filling.prepare(out, manifest, lambda: source.category)
    numbers = filling.missing(out, manifest, WHOLE)
    indices = [i for k in numbers for i in filling.block(manifest, k)]
    advance(n - len(indices))

    def rows() -> Iterator[dict[str, Any]]:
        for index in indices:
            yield shards.to_row(index, source[index])
            advance(1)

    filling.fill(out, manifest, numbers, rows())
    filling.seal(out, manifest)
    return n
