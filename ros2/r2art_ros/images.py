"""ROS images to photos: encodings, byte order and padding.

Messages are anything with the fields of the message definitions, so this needs no ROS.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from r2art.core.errors import InputError
from r2art.core.image import Photo, read_image


@dataclass(frozen=True)
class Layout:
    """Pixels of an encoding.

    Attributes:
        depth: Bits of a channel.
        order: Where red, green and blue (or grey, thrice) are among ``channels``.
        channels: How many there are.
    """

    depth: int
    order: tuple[int, int, int]
    channels: int


RGB, BGR, GREY = (0, 1, 2), (2, 1, 0), (0, 0, 0)

# sensor_msgs/image_encodings.hpp. Transparency is dropped, for cameras have none. The encodings
# of OpenCV do not tell the order of colours; it is OpenCV's.
LAYOUTS = {
    "rgb8": Layout(8, RGB, 3),
    "bgr8": Layout(8, BGR, 3),
    "rgba8": Layout(8, RGB, 4),
    "bgra8": Layout(8, BGR, 4),
    "mono8": Layout(8, GREY, 1),
    "8UC1": Layout(8, GREY, 1),
    "8UC3": Layout(8, BGR, 3),
    "8UC4": Layout(8, BGR, 4),
    "rgb16": Layout(16, RGB, 3),
    "bgr16": Layout(16, BGR, 3),
    "rgba16": Layout(16, RGB, 4),
    "bgra16": Layout(16, BGR, 4),
    "mono16": Layout(16, GREY, 1),
}


def photo_of_image(message: Any) -> Photo:
    """The photo in a ``sensor_msgs/Image``.

    Raises:
        InputError: Its encoding is none of ``LAYOUTS``, or its sizes contradict each other.
    """
    layout = LAYOUTS.get(message.encoding)
    if layout is None:
        raise InputError(
            f"images of encoding {message.encoding!r} are not read, only "
            f"{', '.join(LAYOUTS)}; convert them, raw Bayer patterns with image_proc"
        )
    height, width, step = int(message.height), int(message.width), int(message.step)
    row = width * layout.channels * layout.depth // 8
    data = np.frombuffer(bytes(message.data), np.uint8)
    if width < 1 or height < 1 or step < row or data.size < step * (height - 1) + row:
        raise InputError(
            f"an image of {width}×{height} px in {message.encoding} needs rows of {row} bytes, "
            f"but has a step of {step} and {data.size} bytes in all; check who publishes it"
        )
    rows = np.lib.stride_tricks.as_strided(data, (height, row), (step, 1), writeable=False)
    kind = np.dtype(np.uint8)
    if layout.depth == 16:
        kind = np.dtype(">u2" if message.is_bigendian else "<u2")
    values = np.ascontiguousarray(rows).view(kind).reshape(height, width, layout.channels)
    pixels = values[..., layout.order]
    if layout.depth == 16:
        pixels = np.rint(pixels / 257)
    return Photo(np.ascontiguousarray(pixels, np.uint8))


def photo_of_compressed(message: Any) -> Photo:
    """The photo in a ``sensor_msgs/CompressedImage``: JPEG, PNG or what else `read_image` reads.

    Raises:
        InputError: It is compressed depth, or unreadable.
    """
    if "compressedDepth" in message.format:
        raise InputError("this is a depth image; subscribe to a colour image")
    return read_image(bytes(message.data))
