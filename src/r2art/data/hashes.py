"""SHA-256 of a dataset's files and of the folders that it was made from."""

import hashlib
from pathlib import Path

from r2art.core.errors import InputError
from r2art.data.source import Fault

SUMS = "SHA256SUMS"
"""Hashes of a dataset's files, as `sha256sum` writes and `sha256sum --check` reads them."""


def file_hash(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal digits.

    Raises:
        InputError: It cannot be read.
    """
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None


def folder_hash(folder: Path) -> str:
    """One SHA-256 of the names (relative, sorted) and contents of all files of a folder.

    Hidden files do not count.
    """
    files = {path.relative_to(folder): path for path in folder.rglob("*") if path.is_file()}
    seen = sorted((name.as_posix(), path) for name, path in files.items() if not _hidden(name))
    lines = (f"{file_hash(path)}  {name}\n" for name, path in seen)
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def _hidden(name: Path) -> bool:
    return any(step.startswith(".") for step in name.parts)


def sums_text(hashes: dict[str, str]) -> str:
    """The content of `SUMS` for hashes by file name."""
    return "".join(f"{value}  {name}\n" for name, value in sorted(hashes.items()))


def read_sums(folder: Path) -> dict[str, str]:
    """Hashes by file name, as `SUMS` tells them; empty where there is no such file.

    Raises:
        Fault: It is damaged.
    """
    path = folder / SUMS
    try:
        lines = path.read_text().splitlines()
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise Fault(str(path), "", f"cannot be read ({error})") from None
    hashes = {}
    for number, line in enumerate(lines, start=1):
        value, _, name = line.partition("  ")
        if len(value) != 64 or not name:
            raise Fault(str(path), f"line {number}", "is not a hash, two spaces and a file's name")
        hashes[name] = value
    return hashes
