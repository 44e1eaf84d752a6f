"""Photos of every kind come in right side up, or are refused in one line."""

import io
import struct
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from r2art.core.camera import Camera
from r2art.core.errors import InputError, UsageError
from r2art.core.image import GREY, crop_square, exif_focal, letterbox, read_image

TEAL = (20, 160, 150)
EXIF = 0x8769


def scene(width=60, height=40):
    """A picture without symmetry: a dark corner top left, teal elsewhere."""
    pixels = np.full((height, width, 3), TEAL, np.uint8)
    pixels[: height // 4, : width // 3] = 10
    return pixels


def exif(image, orientation=1, **tags):
    """EXIF with an orientation, and with tags given as `_<number>=value` in the EXIF block."""
    data = image.getexif()
    data[0x0112] = orientation
    for tag, value in tags.items():
        data.get_ifd(EXIF)[int(tag[1:], 16)] = value
    return data


def png_of_size(width, height):
    """A PNG that promises pixels in its header and holds none."""
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunk = b"IHDR" + header
    return (
        b"\x89PNG\r\n\x1a\n"
        + struct.pack(">I", len(header))
        + chunk
        + struct.pack(">I", zlib.crc32(chunk))
        + struct.pack(">I", 0)
        + b"IDAT"
        + struct.pack(">I", zlib.crc32(b"IDAT"))
    )


# The way each EXIF orientation stores an upright picture.
STORED = {
    1: lambda a: a,
    2: lambda a: a[:, ::-1],
    3: lambda a: a[::-1, ::-1],
    4: lambda a: a[::-1],
    5: lambda a: a.transpose(1, 0, 2),
    6: lambda a: np.rot90(a, 1),
    7: lambda a: np.rot90(a, 2).transpose(1, 0, 2),
    8: lambda a: np.rot90(a, -1),
}


@pytest.mark.parametrize("orientation", STORED)
def test_every_exif_orientation_comes_in_upright(tmp_path, orientation):
    upright = scene()
    stored = Image.fromarray(np.ascontiguousarray(STORED[orientation](upright)))
    path = tmp_path / "photo.png"
    stored.save(path, exif=exif(stored, orientation, _A405=26))
    photo = read_image(path)
    np.testing.assert_array_equal(photo.pixels, upright)
    assert photo.focal == pytest.approx(26 / np.hypot(36, 24) * np.hypot(60, 40))


@pytest.mark.parametrize("mode", ["RGB", "RGBA", "RGBX", "CMYK", "YCbCr", "LAB", "HSV", "P"])
def test_colour_survives_every_pixel_type(mode):
    image = Image.fromarray(scene())
    image = image.quantize(8) if mode == "P" else image.convert(mode)
    assert image.mode == mode
    assert np.abs(read_image(image).pixels.astype(int) - scene()).max() <= 6


@pytest.mark.parametrize("mode", ["L", "LA", "I;16", "I;16B", "I", "F"])
def test_grey_of_any_depth_keeps_its_level(mode):
    levels = np.linspace(0, 255, 24).round().astype(np.uint8).reshape(4, 6)
    deep = {"I;16": "<u2", "I;16B": ">u2", "I": "<i4"}
    if mode in deep:
        deep_levels = (levels.astype(int) * 257).astype(deep[mode])
        image = Image.frombytes(mode, (6, 4), deep_levels.tobytes())
    elif mode == "F":
        image = Image.fromarray(levels.astype(np.float32) / 255)
    else:
        image = Image.fromarray(levels).convert(mode)
    assert image.mode == mode
    expected = np.repeat(levels[..., None], 3, axis=-1)
    np.testing.assert_array_equal(read_image(image).pixels, expected)


@pytest.mark.parametrize(("name", "mode"), [("16.png", "I;16"), ("cmyk.jpg", "CMYK")])
def test_deep_and_cmyk_files_are_read(tmp_path, name, mode):
    image = Image.new("CMYK", (32, 32), (235, 95, 105, 0))
    if mode == "I;16":
        image = Image.fromarray(np.full((32, 32), 100 * 257, np.uint16))
    image.save(tmp_path / name)
    with Image.open(tmp_path / name) as saved:
        assert saved.mode == mode
    expected = (20, 160, 150) if mode == "CMYK" else (100, 100, 100)
    assert np.abs(read_image(tmp_path / name).pixels.astype(int) - expected).max() <= 3


@pytest.mark.parametrize("mode", ["RGBA", "LA", "PA", "P"])
def test_what_is_transparent_becomes_white(mode):
    image = Image.new("RGBA", (4, 4), (0, 0, 0, 0))
    image.paste((0, 0, 0, 255), (0, 0, 2, 4))
    if mode == "P":
        image = Image.new("P", (4, 4), 1)
        image.putpalette([0, 0, 0, 9, 9, 9])
        image.paste(0, (0, 0, 2, 4))
        image.info["transparency"] = 1
    elif mode != "RGBA":
        image = image.convert(mode)
    pixels = read_image(image).pixels
    assert (pixels[:, :2] == 0).all()
    assert (pixels[:, 2:] == 255).all()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 1), (5, 7, 3), (5, 7, 4)])
def test_arrays_of_every_shape_and_depth_agree(dtype, shape):
    top = {np.uint8: 255, np.uint16: 65535}.get(dtype, 1)
    assert (read_image(np.full(shape, top, dtype)).pixels == 255).all()
    assert read_image(np.zeros(shape, dtype)).pixels.shape == (5, 7, 3)


@pytest.mark.parametrize(
    "array",
    [
        np.zeros((4, 4, 2), np.uint8),
        np.zeros((0, 4, 3), np.uint8),
        np.zeros(4, np.uint8),
        np.zeros((4, 4), np.int64),
        np.full((4, 4), 255.0),
        np.full((4, 4), np.nan),
    ],
)
def test_arrays_that_are_no_image_are_refused(array):
    with pytest.raises(InputError):
        read_image(array)


def write_bad(folder, kind):
    """A file that is no good, and a word its refusal must say."""
    path = folder / "photo.jpg"
    whole = io.BytesIO()
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (64, 64, 3), np.uint8)).save(
        whole, "JPEG" if "jpeg" in kind else "PNG"
    )
    content, word = {
        "text": (b"dear diary\n" * 40, "not an image"),
        "empty": (b"", "empty"),
        "truncated png": (whole.getvalue()[:2000], "truncated"),
        "truncated jpeg": (whole.getvalue()[:1000], "truncated"),
        "half a header": (whole.getvalue()[:20], "truncated"),
        "noise": (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), "not an image"),
        "13000 x 13000": (png_of_size(13_000, 13_000), "100"),
        "60000 x 60000": (png_of_size(60_000, 60_000), "100"),
        "heic": (b"\0\0\0\x18ftypheic" + bytes(64), "HEIC"),
        "postscript": (b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n", "not an image"),
    }[kind]
    path.write_bytes(content)
    return path, word


BAD = (
    *("text", "empty", "truncated png", "truncated jpeg", "half a header", "noise"),
    *("13000 x 13000", "60000 x 60000", "heic", "postscript"),
)


@pytest.mark.parametrize("kind", BAD)
def test_a_bad_file_is_refused_in_one_line_that_names_it(tmp_path, kind):
    path, word = write_bad(tmp_path, kind)
    with pytest.raises(InputError) as refused:
        read_image(path)
    message = str(refused.value)
    assert word in message
    assert str(path) in message
    assert "\n" not in message


@pytest.mark.parametrize("name", ["missing.png", "", "nul\0.png"])
def test_what_is_not_a_file_is_refused(tmp_path, name):
    with pytest.raises(InputError):
        read_image(f"{tmp_path}/{name}")


def test_damaged_metadata_does_not_spoil_a_photo(tmp_path):
    path = tmp_path / "photo.jpg"
    Image.fromarray(scene()).save(path, exif=b"Exif\0\0MM\0*\xff\xff\xff\xff")
    photo = read_image(path)
    assert photo.pixels.shape == scene().shape
    assert photo.focal is None


@pytest.mark.parametrize(
    ("tags", "focal"),
    [
        ({"_A405": 26}, 26 / np.hypot(36, 24) * np.hypot(400, 300)),
        ({"_A405": 26, "_A002": 4000, "_A003": 3000}, 26 / np.hypot(36, 24) * np.hypot(400, 300)),
        ({"_920A": 5.0, "_A20E": 2000.0, "_A210": 3}, 5 * 200),
        ({"_920A": 5.0, "_A20E": 5080.0}, 5 * 200),
        ({"_920A": 5.0, "_A20E": 20000.0, "_A210": 3, "_A002": 4000, "_A003": 3000}, 5 * 200),
        ({"_A405": 26, "_A002": 4000, "_A003": 4000}, None),
        ({"_A405": 0}, None),
        ({"_920A": 5.0}, None),
        ({}, None),
    ],
    ids=[
        *("35 mm", "35 mm, reduced", "focal plane in cm", "focal plane in inches"),
        *("focal plane, reduced", "cropped", "zero", "no sensor size", "nothing"),
    ],
)
def test_focal_length_from_exif(tmp_path, tags, focal):
    image = Image.new("RGB", (400, 300))
    image.save(tmp_path / "photo.jpg", exif=exif(image, **tags))
    with Image.open(tmp_path / "photo.jpg") as saved:
        assert exif_focal(saved) == (None if focal is None else pytest.approx(focal, rel=1e-4))


def ramp(width, height):
    """An image whose red tells x and whose green tells y, 2 levels to the pixel."""
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    return np.stack([2 * x, 2 * y, 0 * x], axis=-1).astype(np.uint8)


boxes = st.tuples(
    st.floats(-40, 80), st.floats(-40, 60), st.floats(10, 120), st.floats(10, 120)
).map(lambda b: (b[0], b[1], b[0] + b[2], b[1] + b[3]))


@given(box=boxes, margin=st.floats(1, 2), size=st.sampled_from([32, 64, 101]))
def test_camera_and_boxes_follow_a_crop(box, margin, size):
    camera = Camera(90.0, 80.0, 47.0, 33.0, 100, 70)
    view = crop_square(ramp(100, 70), camera, box, size, margin)
    point = np.array([0.1, -0.2, 1.5])
    u, v = camera.project(point)
    np.testing.assert_allclose(view.camera.project(point), view.from_photo((u, v, u, v))[:2])
    np.testing.assert_allclose(view.to_photo(view.from_photo(box)), box, atol=1e-9)


@given(box=boxes, size=st.sampled_from([32, 64, 101]))
def test_a_crop_shows_what_its_mapping_says(box, size):
    """Red and green of a ramp tell each pixel's place in the photo; elsewhere is grey."""
    view = crop_square(ramp(100, 70), Camera.from_fov(1.0, 100, 70), box, size, 1.0)
    centers = np.arange(size) + 0.5
    x, _, _, y = np.array([view.to_photo((c, c, c, c)) for c in centers]).T
    reach = 1 + 1 / view.scale  # beyond the filter's reach of the photo's border
    inside_x = (x > reach) & (x < 100 - reach)
    inside_y = (y > reach) & (y < 70 - reach)
    red, green, _ = view.pixels[np.ix_(inside_y, inside_x)].astype(float).transpose(2, 0, 1)
    assert np.all(np.abs(red - 2 * (x[inside_x] - 0.5)) <= 1.3)
    assert np.all(np.abs(green - 2 * (y[inside_y] - 0.5)[:, None]) <= 1.3)
    assert (view.pixels[(y < -reach) | (y > 70 + reach)] == GREY).all()
    assert (view.pixels[:, (x < -reach) | (x > 100 + reach)] == GREY).all()


def test_a_letterboxed_photo_is_centred_on_grey():
    view = letterbox(np.full((50, 100, 3), 200, np.uint8), Camera.from_fov(1.0, 100, 50), 64)
    assert (view.pixels[16:48] == 200).all()
    assert (view.pixels[:16] == GREY).all()
    assert (view.pixels[48:] == GREY).all()
    assert view.from_photo((0, 0, 100, 50)) == (0, 16, 64, 48)


def test_an_empty_box_has_no_crop():
    with pytest.raises(UsageError):
        crop_square(ramp(9, 9), Camera.from_fov(1.0, 9, 9), (4, 4, 4, 4), 32, 1.25)


@pytest.mark.parametrize("kind", ["PNG", "GIF", "TIFF", "WEBP"])
def test_the_content_of_a_file_is_read_like_the_file(tmp_path, kind):
    path = tmp_path / "photo"
    Image.fromarray(scene()).save(path, kind)
    read = read_image(path.read_bytes())
    np.testing.assert_array_equal(read.pixels, read_image(path).pixels)
    assert read.path is None


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "the image is empty"),
        (b"dear diary", "the image is not an image"),
        (b"\0\0\0\x18ftypheic" + bytes(9), "HEIC"),
        (png_of_size(20_000, 20_000), "megapixels"),
    ],
)
def test_content_that_is_no_photo_is_refused(content, says):
    with pytest.raises(InputError, match=says):
        read_image(content)
