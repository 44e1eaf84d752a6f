"""Pictures on surfaces, no larger than photos of the whole object can show."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from r2art.core.errors import InputError

LARGEST = 512
"""Longest side (px)."""


def as_texture(image: Image.Image) -> NDArray[np.uint8]:
    """(H, W, 3) sRGB pixels."""
    image = image.convert("RGB")
    if max(image.size) > LARGEST:
        image.thumbnail((LARGEST, LARGEST), Image.Resampling.LANCZOS)
    return np.asarray(image)


def read_texture(path: Path) -> NDArray[np.uint8]:
    """(H, W, 3) sRGB pixels of a file.

    Raises:
        InputError: It is no picture.
    """
    try:
        with Image.open(path) as image:
            return as_texture(image)
    except (OSError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(f"{path} is not a picture that can be read ({error})") from None


def from_pixels(pixels: NDArray[Any]) -> NDArray[np.uint8]:
    """(H, W, 3) sRGB pixels of an array of 1, 3 or 4 channels."""
    if pixels.shape[-1] < 3:
        pixels = np.repeat(pixels[..., :1], 3, axis=-1)
    return as_texture(Image.fromarray(np.ascontiguousarray(pixels[..., :3])))
