"""Images and camera_info of one moment."""

from collections import deque
from typing import Any

KEPT = 30  # camera_info that wait for their image


def seconds(stamp: Any) -> float:
    """A ``builtin_interfaces/Time`` in seconds."""
    return stamp.sec + 1e-9 * stamp.nanosec


class Pairing:
    """Finds the camera_info of an image, and the image of a camera_info that comes after it.

    Only the latest image waits: an older one would be answered too late to be of use.
    """

    def __init__(self, slop: float) -> None:
        self._slop_ns = round(1e9 * slop)
        self._infos: deque[Any] = deque(maxlen=KEPT)
        self._image: Any = None

    def add_image(self, image: Any) -> tuple[Any, Any] | None:
        """The image with its camera_info, if that is here already."""
        self._image = image
        return self._pair()

    def add_info(self, info: Any) -> tuple[Any, Any] | None:
        """The image that has waited for this camera_info, with it."""
        self._infos.append(info)
        return self._pair()

    def _pair(self) -> tuple[Any, Any] | None:
        if self._image is None or not self._infos:
            return None
        at = _nanoseconds(self._image)
        nearest = min(self._infos, key=lambda info: abs(_nanoseconds(info) - at))
        if abs(_nanoseconds(nearest) - at) > self._slop_ns:
            return None
        image, self._image = self._image, None
        return image, nearest


def _nanoseconds(message: Any) -> int:
    stamp = message.header.stamp
    return 1_000_000_000 * stamp.sec + stamp.nanosec
