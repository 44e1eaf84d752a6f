"""An image message of any encoding is the picture it was made of."""

import io

import numpy as np
import pytest
from PIL import Image
from r2art_ros.images import LAYOUTS, photo_of_compressed, photo_of_image
from ros_messages import image

from r2art.core.errors import InputError


@pytest.fixture(scope="module")
def picture():
    return np.random.default_rng(0).integers(0, 256, (5, 7, 3), np.uint8)


def encode(picture, encoding):
    """The picture in an encoding, channel by channel."""
    r, g, b = np.moveaxis(picture, -1, 0)
    opaque = np.full_like(r, 255)
    of = {
        "rgb": (r, g, b),
        "bgr": (b, g, r),
        "rgba": (r, g, b, opaque),
        "bgra": (b, g, r, opaque),
        "mono": (g,),
    }
    names = {"8UC1": "mono8", "8UC3": "bgr8", "8UC4": "bgra8"}
    name = names.get(encoding, encoding)
    pixels = np.stack(of[name.rstrip("0123456789")], axis=-1)
    return pixels.astype(np.uint16) * 257 if name.endswith("16") else pixels


@pytest.mark.parametrize("padding", [0, 1, 13])
@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize("encoding", LAYOUTS)
def test_every_encoding_is_read(types, raw, header, picture, encoding, big, padding):
    message = image(raw, header, encode(picture, encoding), encoding, padding=padding, big=big)
    photo = photo_of_image(types.there_and_back(message))
    grey = np.repeat(picture[..., 1:2], 3, axis=-1)
    expected = grey if encoding in ("mono8", "mono16", "8UC1") else picture
    np.testing.assert_array_equal(photo.pixels, expected)


def test_the_last_row_needs_no_padding(raw, header, picture):
    message = image(raw, header, picture, "rgb8", padding=4)
    message.data = message.data[:-4]
    np.testing.assert_array_equal(photo_of_image(message).pixels, picture)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"encoding": "bayer_rggb8"}, "image_proc"),
        ({"encoding": "16UC1"}, "16UC1"),
        ({"encoding": ""}, "''"),
        ({"step": 20}, "step of 20"),
        ({"height": 6}, "105 bytes"),
        ({"width": 0}, "0×5"),
        ({"data": np.zeros(0, np.uint8)}, "0 bytes"),
    ],
)
def test_images_that_cannot_be_read(raw, header, picture, change, says):
    message = image(raw, header, picture, "rgb8")
    for name, value in change.items():
        setattr(message, name, value)
    with pytest.raises(InputError, match=says):
        photo_of_image(message)


@pytest.mark.parametrize(("kind", "told"), [("PNG", "rgb8; png compressed bgr8"), ("JPEG", "jpeg")])
def test_compressed_images_are_read(types, raw, header, kind, told):
    smooth = Image.fromarray(np.full((5, 7, 3), (200, 100, 50), np.uint8))
    file = io.BytesIO()
    smooth.save(file, kind)
    data = np.frombuffer(file.getvalue(), np.uint8)
    message = raw["sensor_msgs/msg/CompressedImage"](header=header, format=told, data=data)
    photo = photo_of_compressed(types.there_and_back(message))
    np.testing.assert_allclose(photo.pixels, np.asarray(smooth), atol=3)
    message.format = "16UC1; compressedDepth png"
    with pytest.raises(InputError, match="depth"):
        photo_of_compressed(message)
    message.format, message.data = told, data[:20]
    with pytest.raises(InputError):
        photo_of_compressed(message)
