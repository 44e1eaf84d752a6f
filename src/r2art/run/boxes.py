"""2D boxes of the object in a photo: given, found, and drawn to where the object is seen."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from r2art.core.errors import UsageError
from r2art.core.image import Box, Photo, View

LEAST_INSIDE = 0.1
"""Share of a box that must lie in the photo, else it cannot be meant."""
SHOWN = 0.5
"""Share of a place from which on a mask shows the object there."""
RELATED = 0.25
"""IoU with the found box below which a mask's box is of something else."""


def check_box(box: Sequence[float], photo: Photo) -> Box:
    """A box given by the user, as floats.

    Raises:
        UsageError: It is not four finite numbers, is empty, or lies outside the photo.
    """
    try:
        x1, y1, x2, y2 = (float(v) for v in box)
    except (TypeError, ValueError):
        raise UsageError(f"a box is four numbers x1 y1 x2 y2, got {box!r}") from None
    shown = f"box {x1:g} {y1:g} {x2:g} {y2:g}"
    if not np.all(np.isfinite((x1, y1, x2, y2))):
        raise UsageError(f"{shown} is not finite; give x1 y1 x2 y2 in pixels")
    if x2 <= x1 or y2 <= y1:
        raise UsageError(f"{shown} is empty; x1 < x2 and y1 < y2 are needed")
    if _share_inside((x1, y1, x2, y2), photo) < LEAST_INSIDE:
        raise UsageError(
            f"{shown} lies outside the photo of {photo.width}×{photo.height} px "
            "(at least a tenth of it must lie within); give x1 y1 x2 y2 in pixels"
        )
    return x1, y1, x2, y2


def usable_box(found: Box, photo: Photo) -> tuple[Box, tuple[str, ...]]:
    """The box the model found, or with a warning the whole photo where that cannot be one."""
    x1, y1, x2, y2 = (round(v, 2) for v in found)
    if x2 - x1 >= 1 and y2 - y1 >= 1 and _share_inside(found, photo) >= LEAST_INSIDE:
        return (x1, y1, x2, y2), ()
    whole = (0.0, 0.0, float(photo.width), float(photo.height))
    return whole, ("no object found: took the whole photo as its box; give the box (--box)",)


def tightened(box: Box, mask: NDArray[np.floating], view: View, photo: Photo) -> Box:
    """A found box, drawn to where a look at it shows the object.

    A side stays where the mask cannot tell: where the object reaches beyond the photo or the crop.
    All of them stay where what the mask shows has little to do with the box.

    Args:
        box: x1 y1 x2 y2 (px) in the photo.
        mask: (h, w) share of each place of the crop that shows the object.
        view: The crop.
        photo: What it was cut from.
    """
    across, down = _span(mask.max(axis=0)), _span(mask.max(axis=1))
    if across is None or down is None:
        return box
    stride = view.pixels.shape[0] / np.array(mask.shape[::-1], float)
    seen = np.array([across, down]).T * stride  # first and last corner, in the crop
    first, last = np.reshape(view.to_photo(seen.ravel().tolist()), (2, 2))
    # Less than a place from where photo or crop end, the object may go on.
    end = np.minimum(
        [photo.width, photo.height], np.add(view.corner, view.pixels.shape[0] / view.scale)
    )
    margin = stride / view.scale
    found = np.reshape(box, (2, 2))
    goes_on = first < np.maximum(view.corner, 0) + margin, last > end - margin
    first = np.where(goes_on[0], np.minimum(first, found[0]), first)
    last = np.where(goes_on[1], np.maximum(last, found[1]), last)
    x1, y1, x2, y2 = np.round([*first, *last], 2).tolist()
    drawn = x1, y1, x2, y2
    return drawn if overlap(drawn, box) > RELATED else box


def _span(shown: NDArray[np.floating]) -> tuple[float, float] | None:
    """Where a row of shares rises above `SHOWN` and falls below it for good, in places."""
    (inside,) = np.nonzero(shown > SHOWN)
    if not inside.size:
        return None
    padded = np.pad(shown.astype(float), 1)

    def crossing(within: int, beyond: int) -> float:
        a, b = padded[within], padded[beyond]
        return (a - SHOWN) / (a - b)

    first, last = int(inside[0]) + 1, int(inside[-1]) + 1
    begin = first - 0.5 - crossing(first, first - 1)
    end = last - 0.5 + crossing(last, last + 1)
    return max(0.0, begin), min(float(len(shown)), end)


def overlap(one: Box, other: Box) -> float:
    """Intersection over union."""
    a, b = np.reshape(one, (2, 2)), np.reshape(other, (2, 2))
    common = np.prod(np.clip(np.minimum(a[1], b[1]) - np.maximum(a[0], b[0]), 0, None))
    return float(common / (np.prod(a[1] - a[0]) + np.prod(b[1] - b[0]) - common))


def _share_inside(box: Box, photo: Photo) -> float:
    x1, y1, x2, y2 = box
    width = max(0.0, min(x2, photo.width) - max(x1, 0))
    height = max(0.0, min(y2, photo.height) - max(y1, 0))
    return width * height / ((x2 - x1) * (y2 - y1))
