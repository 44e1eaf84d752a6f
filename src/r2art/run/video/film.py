"""Films, through PyAV (FFmpeg's libraries in a wheel); only here and in `writer` is it imported."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from r2art.core.errors import InputError, UsageError
from r2art.core.image import MAX_MEGAPIXELS
from r2art.run.video.frame import Frame
from r2art.run.video.source import Source

COMPLETE = 0.9
"""A film that gives fewer than this share of the frames it promises was cut off."""
USUAL_RATE = 30.0


def needed_av() -> ModuleType:
    """PyAV.

    Raises:
        UsageError: It is not installed.
    """
    try:
        import av
        import av.logging
    except ModuleNotFoundError:
        raise UsageError(
            "films and webcams need `pip install 'r2art[video]'` (av is missing)"
        ) from None
    av.logging.set_level(av.logging.PANIC)  # what is wrong with a file is told by exceptions
    return av


def open_film(path: Path) -> Source:
    """A film file, looked at but not yet read.

    Raises:
        InputError: It is missing, empty, damaged, no film, or holds no pictures.
        UsageError: PyAV is not installed.
    """
    needed_av()
    try:
        empty = path.stat().st_size == 0
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from None
    if empty:
        raise InputError(f"{path} is empty (0 bytes); get a fresh copy")
    with _opened(path) as (_, stream):
        count = stream.frames or None
    return Source(label=str(path), name=path.stem, frames=lambda: _frames(path), count=count)


@contextmanager
def _opened(path: Path) -> Iterator[tuple[Any, Any]]:
    """The film and its stream of pictures."""
    av = needed_av()
    try:
        # Some formats are lists of other files; none of these may be on the network.
        film = av.open(f"file:{path}", options={"protocol_whitelist": "file"})
    except av.error.FFmpegError as error:
        raise InputError(
            f"{path} is not a film that can be read, or its beginning or end is missing "
            f"({_reason(error)}); get a fresh copy"
        ) from None
    with film:
        covers = av.stream.Disposition.attached_pic
        streams = [s for s in film.streams.video if not s.disposition & covers]
        if not streams:
            held = "sound" if film.streams.audio else "no pictures"
            raise InputError(f"{path} holds only {held}; give a film with pictures")
        stream = streams[0]
        _check_pixels(stream.width or 0, stream.height or 0, str(path))
        stream.thread_type = "AUTO"
        yield film, stream


def _frames(path: Path) -> Iterator[Frame]:
    """All frames, upright, each at its own time."""
    av = needed_av()
    with _opened(path) as (film, stream):
        rate = float(stream.average_rate or stream.guessed_rate or USUAL_RATE)
        aspect = float(stream.sample_aspect_ratio or 1)
        decoded = film.decode(stream)
        time, count = -1 / rate, 0
        while True:
            try:
                frame = next(decoded)
                picture = upright(frame, str(path), aspect)
            except StopIteration:
                break
            except av.error.FFmpegError as error:
                raise _cut(path, count, time, f"damaged: {_reason(error)}") from None
            # Broken films repeat times or lack them.
            time = max(time, frame.time) if frame.time is not None else time + 1 / rate
            yield Frame(time=time, image=picture)
            count += 1
        if count == 0:
            raise InputError(f"{path} holds no frame that can be read; get a fresh copy")
        if count < COMPLETE * stream.frames:
            raise _cut(path, count, time, f"it should have {stream.frames} frames")


def _cut(path: Path, count: int, time: float, why: str) -> InputError:
    after = f"after {count} frames ({time:.2f} s)" if count else "before its first frame"
    return InputError(f"{path} ends {after} ({why}); get a fresh copy")


def _check_pixels(width: int, height: int, name: str) -> None:
    megapixels = width * height / 1e6
    if megapixels > MAX_MEGAPIXELS:
        raise InputError(
            f"{name} has frames of {width} × {height} px = {megapixels:.0f} megapixels, "
            f"the limit is {MAX_MEGAPIXELS}; make them smaller first"
        )


def upright(frame: Any, name: str, aspect: float = 1.0) -> NDArray[np.uint8]:
    """(H, W, 3) RGB of a decoded frame, turned as it is meant to be shown, with square pixels.

    Args:
        frame: PyAV's.
        name: Of the film or camera, for the error.
        aspect: Width over height of its pixels.

    Raises:
        InputError: It has more megapixels than photos may have.
    """
    width = max(1, round(frame.width * aspect))
    _check_pixels(width, frame.height, name)
    pixels = frame.reformat(width=width, format="rgb24").to_ndarray()
    quarters = round(getattr(frame, "rotation", 0) / 90) % 4
    return np.ascontiguousarray(np.rot90(pixels, quarters))


def _reason(error: Exception) -> str:
    text = getattr(error, "strerror", None) or str(error)
    return " ".join(str(text).split())
