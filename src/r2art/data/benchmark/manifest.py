"""`benchmark.json`: what a benchmark is made of, and the hash of every file."""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from r2art.core.errors import InputError
from r2art.data.hashes import SUMS, file_hash, read_sums, sums_text
from r2art.data.shards import write_atomically
from r2art.data.source import Fault

FORMAT = "r2art/benchmark/1"
NAME = "benchmark.json"


@dataclass(frozen=True)
class Verified:
    """How a benchmark's files compare with its manifest.

    Attributes:
        files: How many it names.
        sha256: The one hash of all of them, as it ought to be.
        faults: What is wrong, file by file.
    """

    files: int
    sha256: str
    faults: tuple[Fault, ...]


def begin(out: Path, about: dict[str, Any], told: dict[str, Any]) -> None:
    """Make or check the folder and its manifest, which has no hashes until `finish`.

    Args:
        out: The benchmark's folder.
        about: What it is, which every run that makes some of it must agree on.
        told: What else the manifest says.

    Raises:
        InputError: It cannot be written to, or holds another benchmark.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot write to {out}: {error.strerror}; choose another --out") from None
    if not (out / NAME).exists():
        _write(out, {"format": FORMAT, **told, **about})
        return
    found = read_manifest(out)
    wanted = json.loads(json.dumps(about))
    if odd := [k for k in wanted if found.get(k) != wanted[k]]:
        raise InputError(
            f"{out} already holds another benchmark (differs in {', '.join(odd)}); "
            "choose another --out"
        )


def finish(out: Path) -> str:
    """Write the hashes of all its datasets' files; each dataset must be whole.

    Returns:
        The one SHA-256 of all.
    """
    manifest = read_manifest(out)
    hashes: dict[str, str] = {}
    for member in manifest["datasets"]:
        folder = out / member["folder"]
        sums = read_sums(folder) | {SUMS: file_hash(folder / SUMS)}
        hashes |= {f"{member['folder']}/{name}": value for name, value in sums.items()}
    whole = hashlib.sha256(sums_text(hashes).encode()).hexdigest()
    _write(out, {**manifest, "sha256": whole, "files": dict(sorted(hashes.items()))})
    return whole


def verify(out: Path, advance: Callable[[int], None] = lambda _: None) -> Verified:
    """Hold every file against its hash.

    Args:
        out: The benchmark's folder.
        advance: Told how many files have just been read.

    Raises:
        InputError: There is no benchmark, or one that is not finished.
    """
    manifest = read_manifest(out)
    hashes = _hashes(out, manifest)
    faults = []
    if hashlib.sha256(sums_text(hashes).encode()).hexdigest() != manifest.get("sha256"):
        faults.append(Fault(str(out / NAME), "sha256", "is not that of its files"))
    for name, value in hashes.items():
        path = out / name
        if not path.exists():
            faults.append(Fault(str(path), "", "is missing"))
        elif file_hash(path) != value:
            faults.append(Fault(str(path), "", "differs from the manifest"))
        advance(1)
    for path in _others(out, [member["folder"] for member in manifest["datasets"]], hashes):
        faults.append(Fault(str(path), "", "is no file of the benchmark"))
    return Verified(len(hashes), str(manifest["sha256"]), tuple(faults))


def read_manifest(out: Path) -> dict[str, Any]:
    """The content of a benchmark's `NAME`.

    Raises:
        InputError: It is not there or of another format.
    """
    path = out / NAME
    try:
        manifest = json.loads(path.read_text())
    except FileNotFoundError:
        raise InputError(
            f"{out} holds no {NAME}; make one with `r2art benchmark make --out {out}`"
        ) from None
    except (OSError, ValueError) as error:
        raise Fault(str(path), "", f"cannot be read ({error})") from None
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        raise Fault(str(path), "format", f"is not of a benchmark in format {FORMAT}")
    return manifest


def _hashes(out: Path, manifest: dict[str, Any]) -> dict[str, str]:
    hashes = manifest.get("files")
    if not isinstance(hashes, dict):
        raise InputError(
            f"the benchmark in {out} is not finished; run its command again: {manifest['command']}"
        )
    return hashes


def _others(out: Path, folders: Sequence[str], hashes: dict[str, str]) -> list[Path]:
    here = (path for folder in folders for path in (out / folder).glob("*") if path.is_file())
    return sorted(path for path in here if path.relative_to(out).as_posix() not in hashes)


def _write(out: Path, manifest: dict[str, Any]) -> None:
    write_atomically(out / NAME, (json.dumps(manifest, indent=1) + "\n").encode())
