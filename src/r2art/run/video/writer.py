"""Results that grow frame by frame and have their name only when they are whole."""

import contextlib
import os
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from r2art.run.files import temporary, unwritable
from r2art.run.video.film import needed_av

CLOCK = 90_000
"""Ticks per second of a film's times."""
CODECS = ("libx264", "libopenh264", "mpeg4")
"""The first that this PyAV has is taken."""


class Growing:
    """A file under a temporary name.

    Attributes:
        path: The name it will have.
    """

    failures: tuple[type[Exception], ...] = (OSError,)
    """What writing may raise."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._temporary = temporary(path)

    def _open(self, opening: Callable[[], Any]) -> Any:
        """What is opened; where that fails, nothing of the file is left."""
        try:
            self._guarded(self._temporary.touch)  # FFmpeg tells only when it is too late
            return self._guarded(opening)
        except BaseException:
            self._discard()
            raise

    def _guarded(self, writing: Callable[[], Any]) -> Any:
        try:
            return writing()
        except self.failures as error:
            raise unwritable(self.path, error) from None

    def _discard(self) -> None:
        with contextlib.suppress(OSError):
            self._temporary.unlink()

    def _close(self) -> bool:
        """Finish writing; whether there is anything to keep."""
        raise NotImplementedError

    def finish(self) -> bool:
        """Give the file its name; whether it holds anything, else there is no file.

        Raises:
            UsageError: It cannot be written; then there is none either.
        """
        try:
            kept = self._guarded(self._close)
            if kept:
                self._guarded(lambda: os.replace(self._temporary, self.path))
        finally:
            self._discard()
        return kept


class Lines(Growing):
    """A file of lines of text."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._file = self._open(lambda: self._temporary.open("w", encoding="utf-8", newline="\n"))
        self._count = 0

    def add(self, line: str) -> None:
        """One more line."""
        self._guarded(lambda: self._file.write(line + "\n"))
        self._count += 1

    def _close(self) -> bool:
        self._file.close()
        return self._count > 0


class Film(Growing):
    """An MP4 (H.264) whose frames keep their own times."""

    def __init__(self, path: Path) -> None:
        av = needed_av()
        super().__init__(path)
        # Not every error of FFmpeg's is an OSError: an encoder's, for one, is not.
        self.failures = (OSError, av.error.FFmpegError)
        self._container = self._open(
            lambda: av.open(
                f"file:{self._temporary}",
                "w",
                format="mp4",
                container_options={"movflags": "faststart"},
            ),
        )
        self._stream: Any = None
        self._began, self._tick = 0.0, -1

    def add(self, picture: Image.Image, time: float) -> None:
        """One more frame (RGB, of the size of the first), at a time in s."""
        av = needed_av()
        if self._stream is None:
            self._stream = self._guarded(lambda: self._new_stream(picture.size))
            self._began = time
        pixels = _even(np.asarray(picture.convert("RGB")))
        frame = av.VideoFrame.from_ndarray(pixels, format="rgb24")
        self._tick = max(self._tick + 1, round((time - self._began) * CLOCK))
        frame.pts, frame.time_base = self._tick, Fraction(1, CLOCK)
        self._guarded(lambda: self._container.mux(self._stream.encode(frame)))

    def _new_stream(self, size: tuple[int, int]) -> Any:
        av = needed_av()
        codec = next(name for name in CODECS if name in av.codecs_available)
        stream = self._container.add_stream(codec, rate=30)
        stream.width, stream.height = (v + v % 2 for v in size)
        stream.pix_fmt = "yuv420p"
        stream.time_base = stream.codec_context.time_base = Fraction(1, CLOCK)
        if codec == "libx264":
            stream.options = {"preset": "veryfast", "crf": "20"}
        else:
            stream.bit_rate = 4_000_000
        return stream

    def _close(self) -> bool:
        try:
            if self._stream is not None:
                self._container.mux(self._stream.encode(None))
        finally:
            self._container.close()
        return self._stream is not None


def _even(pixels: np.ndarray) -> np.ndarray:
    """With even sides, as H.264 wants them; the last row or column is repeated."""
    height, width = pixels.shape[:2]
    return np.pad(pixels, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
