"""Where frames come from: a film, or pictures that are frames."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from r2art.core.errors import InputError, UsageError
from r2art.core.image import read_image
from r2art.run.files import FILMS, find_images
from r2art.run.video.frame import Frame


@dataclass(frozen=True, kw_only=True)
class Source:
    """A clip that can be read.

    Attributes:
        label: As the user named it.
        name: For the files of its results.
        frames: Reads it from the beginning.
        count: How many frames there are; None: not known.
        live: Whether it goes on by itself while nobody reads.
    """

    label: str
    name: str
    frames: Callable[[], Iterator[Frame]] = field(repr=False)
    count: int | None = None
    live: bool = False


def find_clip(pattern: str, fps: float) -> Source:
    """The clip that a film, a folder or a glob stands for.

    Args:
        pattern: A file is a film; of a folder or glob every picture is a frame, in the order of the
            numbers in their names.
        fps: Of pictures; films know theirs.

    Raises:
        InputError: There is no such file, or it is not a film; no picture in the folder.
        UsageError: ``fps`` is not positive.
    """
    if not 0 < fps < float("inf"):
        raise UsageError(f"pictures per second must be a positive number, got --fps {fps:g}")
    path = Path(pattern)
    if path.is_file() or path.suffix.lower() in FILMS:
        from r2art.run.video.film import open_film

        return open_film(path)
    pictures = sorted(find_images(pattern), key=_in_order)
    if pictures == [path]:
        raise InputError(f"{pattern}: no such file; --video takes a film, a folder or a glob")

    def frames() -> Iterator[Frame]:
        for k, picture in enumerate(pictures):
            try:
                yield Frame(time=k / fps, image=read_image(picture))
            except InputError as error:
                yield Frame(time=k / fps, image=None, fault=str(error))

    name = path.absolute().name if path.is_dir() else pictures[0].absolute().parent.name
    return Source(label=pattern, name=name or "clip", frames=frames, count=len(pictures))


def _in_order(path: Path) -> list[tuple[int, int, str]]:
    """A key by which frame_2 comes before frame_10."""
    pieces = re.split(r"(\d+)", str(path))
    return [(1, int(p), "") if p.isdigit() else (0, 0, p) for p in pieces]
