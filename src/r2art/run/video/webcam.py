"""Webcams. What is shown is now: a frame that comes while the last is still worked on replaces the
one that waits.
"""

import sys
import threading
import time
from collections.abc import Iterable, Iterator
from typing import TypeVar

from r2art.core.errors import InputError
from r2art.run.video.film import needed_av, upright
from r2art.run.video.frame import Frame
from r2art.run.video.source import Source

T = TypeVar("T")

PAUSE = 0.002
"""Seconds between two looks at a camera that has no picture yet."""

# FFmpeg's device and the name of camera N, by platform.
DEVICES = {
    "linux": ("v4l2", "/dev/video{}"),
    "darwin": ("avfoundation", "{}:none"),
    "win32": ("dshow", "video={}"),
}


def open_webcam(number: str) -> Source:
    """A camera by its number (on Windows by its name), opened when it is read.

    Raises:
        UsageError: PyAV is not installed.
        InputError: When read: there is no such camera, or somebody else uses it.
    """
    needed_av()
    name = f"webcam{number}" if number.isdigit() else "webcam"
    label = f"webcam {number}"
    return Source(label=label, name=name, frames=lambda: newest(_frames(number)), live=True)


def _frames(number: str) -> Iterator[Frame]:
    av = needed_av()
    device, pattern = DEVICES.get(sys.platform, DEVICES["linux"])
    options = {"framerate": "30"} if sys.platform == "darwin" else {}
    try:
        camera = av.open(pattern.format(number), format=device, options=options)
    except (av.error.FFmpegError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(
            f"no picture from webcam {number} ({reason}); is it plugged in and free?"
        ) from None
    with camera:
        began = time.monotonic()
        while True:
            try:
                frame = next(camera.decode(video=0))
            except av.error.BlockingIOError:  # macOS has no picture yet
                time.sleep(PAUSE)
                continue
            except (StopIteration, av.error.EOFError):
                return
            except av.error.FFmpegError as error:
                raise InputError(f"webcam {number} has stopped ({error.strerror})") from None
            yield Frame(time=time.monotonic() - began, image=upright(frame, f"webcam {number}"))


def newest(items: Iterable[T]) -> Iterator[T]:
    """Of items that come by themselves always the newest, in order; those missed are dropped.

    They are taken by a thread of its own, which ends with them, or after the next one where the
    reader leaves.
    """
    changed = threading.Condition()
    waiting: list[T] = []
    ended: list[BaseException | None] = []
    left = threading.Event()

    def take() -> None:
        failure: BaseException | None = None
        try:
            for item in items:
                with changed:
                    waiting[:] = [item]
                    changed.notify()
                if left.is_set():
                    break
        except BaseException as error:  # told to the reader
            failure = error
        with changed:
            ended.append(failure)
            changed.notify()

    threading.Thread(target=take, daemon=True).start()
    try:
        while True:
            with changed:
                changed.wait_for(lambda: waiting or ended)
                if not waiting:
                    break
                item = waiting.pop()
            yield item
        if ended[0] is not None:
            raise ended[0]
    finally:
        left.set()
