"""Which images and films are meant, and where their results go."""

import contextlib
import glob
import itertools
import os
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from r2art.core.errors import InputError, UsageError

if TYPE_CHECKING:
    from PIL import Image

SUFFIXES = frozenset(
    {".jpg", ".jpeg", ".png", ".webp", ".avif", ".tif", ".tiff", ".bmp", ".gif", ".ppm", ".jp2"}
)
OVERLAY = ".overlay.png"
PREDICTIONS = frozenset({".json", ".jsonl"})
FILMS = frozenset(
    {".mp4", ".m4v", ".mov", ".mkv", ".webm", ".avi", ".mpg", ".mpeg", ".ts", ".mts", ".3gp"}
    | {".wmv", ".flv", ".ogv", ".mjpeg", ".y4m"}
)
"""Endings by which a file is taken for a film without being told."""
ANNOTATED = ".tracked.mp4"
"""How r2art's own films end; a glob leaves them out."""


def find_images(pattern: str) -> list[Path]:
    """The images a file name, folder or glob (``**`` for all folders below) stands for, sorted.

    A file is taken whatever its name; a folder or glob gives the files in it that are named like
    images, except the overlays r2art itself writes. A file that does not exist is returned as it
    is: reading it tells so.

    Raises:
        InputError: A folder or glob holds no image.
    """
    return _find(pattern, _looks_like_image, "images")


def find_predictions(pattern: str) -> list[Path]:
    """The same for predictions: files named ``.json``, or ``.jsonl`` with one on each line.

    Raises:
        InputError: A folder or glob holds no such file.
    """
    return _find(pattern, lambda path: path.suffix.lower() in PREDICTIONS, "predictions")


def _find(pattern: str, wanted: Callable[[Path], bool], what: str) -> list[Path]:
    path = Path(pattern)
    if path.is_dir():
        found = [p for p in sorted(path.iterdir()) if wanted(p)]
        if not found:
            raise InputError(f"no {what} in the folder {pattern}")
        return found
    if not path.exists() and glob.has_magic(pattern):
        names = sorted(glob.glob(os.path.expanduser(pattern), recursive=True))
        if not (found := [Path(n) for n in names if wanted(Path(n))]):
            raise InputError(f"no {what} match {pattern}")
        return found
    return [path]


def films_of(pattern: str) -> list[str]:
    """The films that a file name or glob stands for by its ending, sorted; none if it is another.

    A file that does not exist is returned as it is: reading it tells so.
    """
    if Path(pattern).suffix.lower() not in FILMS or Path(pattern).is_dir():
        return []
    if not Path(pattern).exists() and glob.has_magic(pattern):
        found = glob.glob(os.path.expanduser(pattern), recursive=True)
        return sorted(p for p in found if not p.endswith(ANNOTATED)) or [pattern]
    return [pattern]


def _looks_like_image(path: Path) -> bool:
    return path.suffix.lower() in SUFFIXES and not path.name.endswith(OVERLAY) and not path.is_dir()


def result_names(images: Sequence[Path]) -> list[str]:
    """A name for the results of each image that no other image shares.

    It is the file's stem where that is unique (``a/cup.jpg`` gives ``cup``), else folder and full
    name (``a_cup.jpg``), with a number where even these agree. Case is not enough to differ.
    """
    stems = Counter(image.stem.casefold() for image in images)
    taken: set[str] = {stem for stem, count in stems.items() if count == 1}
    names = []
    for image in images:
        name = image.stem
        if stems[name.casefold()] > 1:
            long = f"{image.absolute().parent.name}_{image.name}".lstrip("_")
            name = untaken(long, taken)
        names.append(name)
    return names


def untaken(name: str, taken: set[str]) -> str:
    """``name``, numbered from the second on until it is free; from now on it is taken.

    Args:
        name: Wanted.
        taken: Names that are not free, by their casefold; the one returned is added.
    """
    numbered = itertools.chain([name], (f"{name}-{n}" for n in itertools.count(2)))
    free = next(n for n in numbered if n.casefold() not in taken)
    taken.add(free.casefold())
    return free


def png_bytes(picture: "Image.Image") -> bytes:
    """A picture as a PNG file, written quickly rather than small."""
    png = BytesIO()
    picture.save(png, "PNG", compress_level=1)
    return png.getvalue()


def make_folder(folder: Path) -> None:
    """Make sure that results can be written to ``folder``.

    Raises:
        UsageError: They cannot.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise unwritable(folder, error) from None


def write_whole(path: Path, data: bytes) -> None:
    """Write a file such that under its name there is never only a part of it.

    Raises:
        UsageError: It cannot be written.
    """
    partial = temporary(path)
    try:
        partial.write_bytes(data)
        os.replace(partial, path)
    except OSError as error:
        raise unwritable(path, error) from None
    finally:
        with contextlib.suppress(OSError):
            partial.unlink()


def temporary(path: Path) -> Path:
    """A hidden name beside ``path``, for what is not whole yet."""
    return path.with_name(f".{path.name}.{os.getpid()}.tmp")


def unwritable(path: Path, error: Exception) -> UsageError:
    """What to tell where ``error`` has kept something from being written to ``path``."""
    reason = getattr(error, "strerror", None) or error
    return UsageError(f"cannot write to {path}: {reason}; choose another --out")
