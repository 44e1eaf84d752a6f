"""A found box is drawn to where the mask shows the object, where it can tell."""

import numpy as np
import pytest

from r2art.core.camera import Camera
from r2art.core.image import Photo, crop_square
from r2art.run.boxes import tightened

WIDTH, HEIGHT = 320, 240
CAMERA = Camera.from_fov(1.0, WIDTH, HEIGHT)
PHOTO = Photo(np.zeros((HEIGHT, WIDTH, 3), np.uint8))
TRUE = (100.3, 80.7, 180.2, 150.9)


def seen(box, true=TRUE, size=160, places=40):
    """A crop round a box, and the exact share of each of its places that a rectangle covers."""
    view = crop_square(PHOTO.pixels, CAMERA, box, size, 1.25)
    x1, y1, x2, y2 = np.array(view.from_photo(true)) * places / size
    at = np.arange(places)
    across = np.clip(np.minimum(at + 1, x2) - np.maximum(at, x1), 0, 1)
    down = np.clip(np.minimum(at + 1, y2) - np.maximum(at, y1), 0, 1)
    return view, down[:, None] * across


@pytest.mark.parametrize("shift", [(0, 0, 0, 0), (6, -5, 4, 7), (-7, 6, -5, -4)])
def test_the_sides_go_where_the_object_ends(shift):
    box = tuple(np.add(TRUE, shift).tolist())
    view, mask = seen(box)
    place = 160 / 40 / view.scale
    assert tightened(box, mask, view, PHOTO) == pytest.approx(TRUE, abs=place / 2)


def test_half_a_place_is_told_from_a_whole_one():
    box = (60.0, 60.0, 124.0, 124.0)  # 80 px of the photo to the crop: a place is 2 px
    for side in (110.0, 110.5, 111.0):
        view, mask = seen(box, (70.0, 70.0, side, 110.0))
        assert tightened(box, mask, view, PHOTO)[2] == pytest.approx(side, abs=0.6)


def test_beyond_the_photo_the_found_side_stays():
    true = (-40.0, 50.0, 60.0, 150.0)
    box = (-35.0, 45.0, 66.0, 155.0)
    view, mask = seen(box, (0.0, *true[1:]))  # a mask shows nothing of what is beyond
    x1, y1, x2, y2 = tightened(box, mask, view, PHOTO)
    assert x1 == -35
    assert (y1, x2, y2) == pytest.approx(true[1:], abs=2)


def test_beyond_the_crop_it_reaches_at_least_to_its_edge():
    true = (100.0, 80.0, 220.0, 150.0)
    box = (100.0, 80.0, 180.0, 150.0)
    view, mask = seen(box, true)
    edge = view.corner[0] + view.pixels.shape[0] / view.scale
    assert tightened(box, mask, view, PHOTO)[2] == pytest.approx(edge, abs=0.1)


def test_without_a_mask_worth_the_name_the_box_stays():
    view, mask = seen(TRUE)
    assert tightened(TRUE, np.zeros_like(mask), view, PHOTO) == TRUE
    speck = np.zeros_like(mask)
    speck[20:22, 20:22] = 1
    assert tightened(TRUE, speck, view, PHOTO) == TRUE


def test_the_span_is_that_of_everything_seen():
    view, mask = seen(TRUE)
    holed = mask.copy()
    holed[:, 18:22] = 0
    assert tightened(TRUE, holed, view, PHOTO) == tightened(TRUE, mask, view, PHOTO)
