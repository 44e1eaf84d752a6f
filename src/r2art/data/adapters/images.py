"""Pictures of other datasets: colour, depth in its two forms, part masks, COCO polygons."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from r2art.core.camera import Camera
from r2art.data.adapters.reading import Node
from r2art.data.source import Fault

BEYOND = 4.0  # px by which polygons may leave the image
PER_METRE = 1000.0  # both depth forms count millimetres


def read_color(path: Path, camera: Camera) -> NDArray[np.uint8]:
    """(H, W, 3) RGB photo of the camera's size.

    Raises:
        Fault: It is missing, damaged or of another size.
    """
    return np.asarray(_read(path, camera, "RGB"))


def read_depth(path: Path, camera: Camera) -> NDArray[np.float32]:
    """(H, W) z in metres, 0 where unknown, from a PNG of millimetres.

    Either one channel of 16 bits, or three of 8 bits with the high byte in green and the low
    byte in red.

    Raises:
        Fault: It is missing, damaged, of another size or form.
    """
    stored = np.asarray(_read(path, camera))
    if stored.ndim == 3 and stored.shape[2] >= 3 and stored.dtype == np.uint8:
        millimetres = stored[..., 1].astype(np.float32) * 256 + stored[..., 0]
    elif stored.ndim == 2 and stored.dtype in (np.uint16, np.int32) and stored.min() >= 0:
        millimetres = stored.astype(np.float32)
    else:
        form = f"{stored.dtype} of {' × '.join(map(str, stored.shape))}"
        raise Fault(str(path), "", f"must have 16 bits or 3 × 8 bits a pixel, has {form}")
    return (millimetres / PER_METRE).astype(np.float32)


def read_labels(path: Path, camera: Camera) -> NDArray[np.uint8]:
    """(H, W) indices of a mask image, from its blue channel (the first of a BGR reader).

    Raises:
        Fault: It is missing, damaged, or of another size.
    """
    stored = np.asarray(_read(path, camera))
    if stored.ndim == 3 and stored.shape[2] >= 3:
        stored = stored[..., 2]
    if stored.ndim != 2:
        raise Fault(str(path), "", "must have one or three channels")
    return np.clip(stored, 0, 255).astype(np.uint8)


def _read(path: Path, camera: Camera, mode: str | None = None) -> Image.Image:
    try:
        with Image.open(path) as image:
            image.load()
            found = image.convert(mode) if mode else image.copy()
    except FileNotFoundError:
        raise Fault(str(path), "", "is missing") from None
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise Fault(str(path), "", f"is no readable image ({error})") from None
    if found.size != (camera.width, camera.height):
        size, wanted = found.size, (camera.width, camera.height)
        raise Fault(
            str(path), "", f"has {size[0]} × {size[1]} px, its annotation {wanted[0]} × {wanted[1]}"
        )
    return found


def polygon_mask(segmentation: Node, height: int, width: int) -> NDArray[np.bool_]:
    """(H, W) pixels whose centre lies in any of the COCO polygons of a field.

    Polygons of less than three points, which some tools write for specks, cover nothing.

    Raises:
        Fault: The field is no list of polygons ``[x, y, x, y, ...]`` within the image.
    """
    mask = np.zeros((height, width), bool)
    for polygon in segmentation.items():
        flat = polygon.array(-1)
        if len(flat) % 2:
            raise polygon.fault(f"must be x, y pairs, has {len(flat)} numbers")
        points = flat.reshape(-1, 2)
        if (points < -BEYOND).any() or (points > np.array([width, height]) + BEYOND).any():
            raise polygon.fault(f"reaches beyond the image of {width} × {height} px")
        if len(points) > 2:
            mask |= inside(points, height, width)
    return mask


def inside(polygon: NDArray[np.float64], height: int, width: int) -> NDArray[np.bool_]:
    """(H, W) pixels whose centre a closed polygon (N, 2) encloses, by the even-odd rule."""
    start, end = polygon, np.roll(polygon, -1, axis=0)
    row = np.arange(height) + 0.5
    crossed = (start[:, None, 1] <= row) != (end[:, None, 1] <= row)
    edge, at = np.nonzero(crossed)
    (x0, y0), (x1, y1) = start[edge].T, end[edge].T
    x = x0 + (row[at] - y0) / (y1 - y0) * (x1 - x0)
    # Every crossing turns inside to outside for all pixel centres to its right.
    column = np.clip(np.ceil(x - 0.5), 0, width).astype(int)
    turns = np.zeros((height, width + 1), int)
    np.add.at(turns, (at, column), 1)
    return np.cumsum(turns, axis=1)[:, :width] % 2 == 1
