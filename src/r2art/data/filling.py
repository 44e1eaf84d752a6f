"""Filling a dataset's folder: by several runs, in any order, each killed at any moment.

A run makes its share of the shards that are missing. Manifest and prior are the same for all
runs of a dataset, so any of them may write these files; whichever finds all shards there seals
the dataset with a file of hashes.
"""

import hashlib
import io
import json
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from r2art.core.category import Category
from r2art.core.errors import InputError, UsageError
from r2art.data import shards
from r2art.data.hashes import SUMS, file_hash, sums_text


@dataclass(frozen=True)
class Share:
    """The shards that one of several runs makes: every ``of``-th, beginning with ``number``.

    Attributes:
        number: Of this run, 1 to ``of``.
        of: How many runs there are.
    """

    number: int = 1
    of: int = 1

    def __post_init__(self) -> None:
        if not 1 <= self.number <= self.of:
            raise UsageError(
                f"there is no shard {self.number}/{self.of}; give I/N with I from 1 to N"
            )

    @classmethod
    def parse(cls, text: str) -> "Share":
        """Read ``"2/4"``: the second of four.

        Raises:
            UsageError: It is something else.
        """
        if not (match := re.fullmatch(r"(\d{1,9})/(\d{1,9})", text.strip())):
            raise UsageError(f"--shard {text!r} is not I/N, such as 2/4: the second of four runs")
        return cls(int(match[1]), int(match[2]))

    def of_shards(self, count: int) -> range:
        """Numbers of the shards that this run makes, of ``count``."""
        return range(self.number - 1, count, self.of)


WHOLE = Share()


def counts(n: int, shard_size: int) -> dict[str, int]:
    """What the manifest of ``n`` samples says of their number."""
    return {"n": n, "shards": -(-n // shard_size), "shard_size": shard_size}


def block(manifest: dict[str, Any], number: int) -> range:
    """Indices of the samples of a shard."""
    size = shards.shard_size(manifest)
    return range(number * size, min(manifest["n"], (number + 1) * size))


def prepare(folder: Path, manifest: dict[str, Any], prior: Callable[[], Category]) -> None:
    """Make or check a dataset's folder, its manifest and its prior.

    Raises:
        InputError: It cannot be written to, or holds another dataset.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot write to {folder}: {error.strerror}; choose another --out"
        ) from error
    path = folder / shards.MANIFEST
    if path.exists():
        found = shards.read_manifest(folder)
        if odd := [k for k in manifest | found if found.get(k) != manifest.get(k)]:
            raise InputError(
                f"{folder} already holds another dataset (differs in {', '.join(odd)}); "
                "choose another --out"
            )
    out = io.BytesIO()
    if not (folder / shards.PRIOR).exists():
        prior().save(out)  # before anything is written: objects that cannot be read end it here
    if not path.exists():  # before all else that is written, for it tells whose the rest is
        shards.write_atomically(path, json.dumps(manifest, indent=1).encode())
    if content := out.getvalue():
        shards.write_atomically(folder / shards.PRIOR, content)


def missing(folder: Path, manifest: dict[str, Any], share: Share) -> list[int]:
    """Numbers of the shards of a share that are not there yet."""
    mine = share.of_shards(manifest["shards"])
    return [k for k in mine if not shards.shard_path(folder, k).exists()]


def fill(
    folder: Path, manifest: dict[str, Any], numbers: Iterable[int], rows: Iterable[dict[str, Any]]
) -> None:
    """Write shards from the rows of all their samples, in order."""
    rest = iter(rows)
    for number in numbers:
        made = [next(rest) for _ in block(manifest, number)]
        shards.write_shard(shards.shard_path(folder, number), made)


def seal(folder: Path, manifest: dict[str, Any]) -> None:
    """Where all shards are there, hash them and clear away what killed runs have left."""
    if missing(folder, manifest, WHOLE) or (folder / SUMS).exists():
        return
    for path in folder.glob("*.????????.part"):
        path.unlink(missing_ok=True)
    write_hashes(folder)


def write_hashes(folder: Path) -> str:
    """Hash every file of a dataset into `SUMS`; see there.

    Returns:
        SHA-256 of that file: one hash for the whole dataset.

    Raises:
        InputError: It is no whole dataset, or a file cannot be read or written.
    """
    count = shards.Dataset.open(folder).manifest["shards"]
    paths = [shards.shard_path(folder, k) for k in range(count)]
    paths += [folder / shards.MANIFEST, folder / shards.PRIOR]
    content = sums_text({path.name: file_hash(path) for path in paths}).encode()
    shards.write_atomically(folder / SUMS, content)
    return hashlib.sha256(content).hexdigest()
