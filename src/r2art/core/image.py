"""A photo becomes pixels, and pixels become the square windows a network looks at.

Everything that can be wrong with a photo is found here, once, and told in one line.
"""

import contextlib
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps

from r2art.core.camera import Camera
from r2art.core.errors import InputError, UsageError

Box = tuple[float, float, float, float]
"""x1 y1 x2 y2 in pixels; it may leave the image where the object does."""

MAX_MEGAPIXELS = 100
GREY = 128

# Only formats that photos come in: Pillow would hand an EPS file to Ghostscript.
FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "BMP", "GIF", "PPM", "JPEG2000", "AVIF")

# EXIF tags, and the diagonal (mm) of the 36 × 24 mm film that "35 mm equivalent" refers to.
ORIENTATION, EXIF_IFD = 0x0112, 0x8769
FOCAL_LENGTH, FOCAL_LENGTH_35MM = 0x920A, 0xA405
FOCAL_PLANE_X_RESOLUTION, FOCAL_PLANE_UNIT = 0xA20E, 0xA210
PIXEL_WIDTH, PIXEL_HEIGHT = 0xA002, 0xA003
MM_PER_UNIT = {2: 25.4, 3: 10.0, 4: 1.0, 5: 0.001}
FILM_DIAGONAL = float(np.hypot(36, 24))


@dataclass(frozen=True, eq=False)
class Photo:
    """An upright RGB photo.

    Attributes:
        pixels: (H, W, 3) uint8 sRGB.
        focal: Focal length (px of ``pixels``) that the EXIF data tells, or None.
        path: Where it was read from, or None.
    """

    pixels: NDArray[np.uint8] = field(repr=False)
    focal: float | None = None
    path: Path | None = None

    @property
    def width(self) -> int:
        """Width in pixels."""
        return self.pixels.shape[1]

    @property
    def height(self) -> int:
        """Height in pixels."""
        return self.pixels.shape[0]


ImageLike = str | Path | bytes | Image.Image | NDArray | Photo


def read_image(image: ImageLike) -> Photo:
    """Read a photo of any usual format, pixel type and orientation.

    The EXIF orientation is applied. Transparent pixels are laid over white, 16 bits become 8,
    grey, palette and CMYK become RGB (colour profiles are not applied), and of an animation the
    first frame is taken. ``bytes`` are the content of a file. Arrays are (H, W), (H, W, 1),
    (H, W, 3) or (H, W, 4): uint8, uint16, or floats in [0, 1].

    Raises:
        InputError: The image is missing, unreadable, damaged, or above 100 megapixels (known
            from its header, before any pixel is decoded).
    """
    if isinstance(image, Photo):
        return image
    if isinstance(image, Image.Image):
        return _upright_rgb(image, "the image")
    if isinstance(image, np.ndarray):
        return Photo(_rgb_from_array(image))
    if isinstance(image, bytes):
        if not image:
            raise InputError("the image is empty (0 bytes); get a fresh copy")
        return _opened(BytesIO(image), image[:12], "the image")
    path = Path(image)
    return replace(_opened(path, _head(path), str(path)), path=path)


def _opened(source: Path | BytesIO, head: bytes, name: str) -> Photo:
    # Pillow's warnings (oversized, odd metadata) would reach the user without the file's name.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            opened = Image.open(source, formats=FORMATS)
        except Image.DecompressionBombError:
            raise _too_large(name, f"more than {MAX_MEGAPIXELS}") from None
        except (Image.UnidentifiedImageError, KeyError):  # KeyError: Pillow built without AVIF
            raise InputError(_not_an_image(head, name)) from None
        except Exception as error:  # decoders raise whatever a damaged file makes them trip over
            raise _damaged(name, error) from None
        with opened:
            return _upright_rgb(opened, name)


def _head(path: Path) -> bytes:
    """The first bytes of a file that is there and not empty."""
    try:
        if path.is_dir():
            raise InputError(f"{path} is a folder; give an image file")
        with path.open("rb") as file:
            head = file.read(12)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path} cannot be read: {reason}") from None
    if not head:
        raise InputError(f"{path} is empty (0 bytes); get a fresh copy")
    return head


def _not_an_image(head: bytes, name: str) -> str:
    if head[4:8] == b"ftyp" and head[8:12] in (b"heic", b"heix", b"mif1", b"msf1"):
        return f"{name} is a HEIC photo, which this program does not read; save it as JPEG"
    return f"{name} is not an image; readable are {', '.join(FORMATS)}"


def _damaged(name: str, error: Exception) -> InputError:
    reason = " ".join(str(error).split()) or type(error).__name__
    return InputError(f"{name} is damaged or truncated ({reason}); get a fresh copy")


def _too_large(name: str, megapixels: str) -> InputError:
    return InputError(
        f"{name} has {megapixels} megapixels, the limit is {MAX_MEGAPIXELS}; make it smaller first"
    )


def _upright_rgb(image: Image.Image, name: str) -> Photo:
    width, height = image.size
    if width * height > MAX_MEGAPIXELS * 1e6:
        raise _too_large(name, f"{width} × {height} px = {width * height / 1e6:.0f}")
    try:
        image.load()
    except Exception as error:  # decoders raise whatever a damaged file makes them trip over
        raise _damaged(name, error) from None
    focal = None
    with contextlib.suppress(Exception):  # a photo with damaged metadata is still a photo
        focal = exif_focal(image)
        if image.getexif().get(ORIENTATION, 1) != 1:
            image = ImageOps.exif_transpose(image)
    return Photo(np.asarray(_to_rgb(image, name)), focal)


def _to_rgb(image: Image.Image, name: str) -> Image.Image:
    if image.mode.startswith(("I", "F")):
        values = np.asarray(image)
        if image.mode == "F" and not np.all((values >= 0) & (values <= 1)):
            raise InputError(f"{name} holds floats outside [0, 1]; save it with 8 bits per channel")
        values = values if image.mode == "F" else np.clip(values, 0, 65535) / 65535
        return Image.fromarray(np.rint(255 * values).astype(np.uint8)).convert("RGB")
    try:
        if image.has_transparency_data:
            image = image.convert("RGBA")
            white = Image.new("RGBA", image.size, "white")
            image = Image.alpha_composite(white, image)
        return image if image.mode == "RGB" else image.convert("RGB")
    except ValueError:
        raise InputError(f"{name} has pixels of type {image.mode}; save it as RGB") from None


def _rgb_from_array(array: NDArray) -> NDArray[np.uint8]:
    shape = array.shape
    good_shape = array.ndim == 2 or (array.ndim == 3 and shape[2] in (1, 3, 4))
    if not good_shape or array.size == 0:
        raise InputError(f"an image array must be (H, W), or (H, W, 1, 3 or 4), got {shape}")
    if array.dtype == np.uint16:
        array = np.rint(array / 257).astype(np.uint8)
    elif np.issubdtype(array.dtype, np.floating):
        if not np.all((array >= 0) & (array <= 1)):
            raise InputError("an image array of floats must lie in [0, 1]; divide it by 255")
        array = np.rint(255 * array).astype(np.uint8)
    elif array.dtype != np.uint8:
        raise InputError(
            f"an image array must be uint8, uint16 or floats in [0, 1], got {array.dtype}"
        )
    if array.ndim == 3 and shape[2] == 1:
        array = array[..., 0]
    return np.asarray(_to_rgb(Image.fromarray(array), "the array"))


def exif_focal(image: Image.Image) -> float | None:
    """Focal length in pixels of ``image`` as its EXIF data tells it, or None.

    With ``FocalLengthIn35mmFilm`` f₃₅ it is f₃₅ / 43.27 mm × the image's diagonal, which is how
    CIPA defines the equivalent; otherwise ``FocalLength`` × ``FocalPlaneXResolution``. Neither
    needs the orientation, for pixels are square. A photo that was cropped after it was taken (its
    proportions differ from those recorded) tells nothing, and gives None.
    """
    exif = image.getexif().get_ifd(EXIF_IFD)
    width, height = image.size
    recorded = [_positive(exif.get(tag)) for tag in (PIXEL_WIDTH, PIXEL_HEIGHT)]
    if all(recorded):
        stretch = max(recorded) / min(recorded) / (max(width, height) / min(width, height))
        if not 0.98 < stretch < 1.02:
            return None
    if equivalent := _positive(exif.get(FOCAL_LENGTH_35MM)):
        return equivalent / FILM_DIAGONAL * float(np.hypot(width, height))
    focal = _positive(exif.get(FOCAL_LENGTH))
    resolution = _positive(exif.get(FOCAL_PLANE_X_RESOLUTION))
    unit = MM_PER_UNIT.get(exif.get(FOCAL_PLANE_UNIT, 2))
    if not (focal and resolution and unit):
        return None
    scale = max(width, height) / max(recorded) if all(recorded) else 1.0
    return focal * resolution / unit * scale


def _positive(value: object) -> float:
    """The value as a number, or 0 where EXIF holds none, zero or nonsense."""
    try:
        number = float(value)  # pyright: ignore[reportArgumentType]
    except (TypeError, ValueError, ZeroDivisionError):
        return 0.0
    return number if 0 < number < np.inf else 0.0


@dataclass(frozen=True, eq=False)
class View:
    """A square window of a photo, resampled: view pixel = scale · (photo pixel - corner).

    Attributes:
        pixels: (S, S, 3) uint8; grey 128 where the window leaves the photo.
        camera: The photo's camera, carried into the window.
        corner: Photo coordinates (px) of the window's top left corner.
        scale: Pixels of the view per pixel of the photo.
    """

    pixels: NDArray[np.uint8] = field(repr=False)
    camera: Camera
    corner: tuple[float, float]
    scale: float

    def through(self, camera: Camera) -> "View":
        """The same window as another camera of the whole photo would have taken it."""
        (x, y), scale, size = self.corner, self.scale, self.pixels.shape[0]
        in_window = (camera.fx, camera.fy, camera.cx - x, camera.cy - y)
        return replace(
            self, camera=Camera(*(v * scale for v in in_window), width=size, height=size)
        )

    def from_photo(self, box: Sequence[float]) -> Box:
        """A box of the photo in pixels of this view."""
        x1, y1, x2, y2 = (np.asarray(box, float) - 2 * self.corner) * self.scale
        return float(x1), float(y1), float(x2), float(y2)

    def to_photo(self, box: Sequence[float]) -> Box:
        """A box of this view in pixels of the photo."""
        x1, y1, x2, y2 = np.asarray(box, float) / self.scale + 2 * self.corner
        return float(x1), float(y1), float(x2), float(y2)


def letterbox(pixels: NDArray[np.uint8], camera: Camera, size: int) -> View:
    """The whole photo, scaled to fit ``size`` × ``size`` and centred on grey."""
    height, width = pixels.shape[:2]
    return _square(pixels, camera, (width / 2, height / 2), max(width, height), size)


def crop_square(
    pixels: NDArray[np.uint8], camera: Camera, box: Sequence[float], size: int, margin: float
) -> View:
    """The square around a box, ``margin`` times its longer side wide, as ``size`` × ``size``."""
    x1, y1, x2, y2 = box
    side = margin * max(x2 - x1, y2 - y1)
    if not side > 0:
        raise UsageError(f"the box {tuple(box)} is empty; x1 < x2 and y1 < y2 are needed")
    return _square(pixels, camera, ((x1 + x2) / 2, (y1 + y2) / 2), side, size)


def _square(
    pixels: NDArray[np.uint8], camera: Camera, center: tuple[float, float], side: float, size: int
) -> View:
    scale = size / side
    corner = np.asarray(center) - side / 2
    extent = np.array([pixels.shape[1], pixels.shape[0]])
    # Those pixels of the view that lie wholly in the photo, and exactly what they show of it.
    first = np.clip(np.ceil(-corner * scale - 1e-6), 0, size).astype(int)
    last = np.clip(np.floor((extent - corner) * scale + 1e-6), 0, size).astype(int)
    view = np.full((size, size, 3), GREY, np.uint8)
    if np.all(last > first):
        source = np.clip([first / scale + corner, last / scale + corner], 0, extent)
        left, top = np.floor(source[0]).astype(int)
        right, bottom = np.ceil(source[1]).astype(int)
        part = Image.fromarray(np.ascontiguousarray(pixels[top:bottom, left:right]))
        x1, y1, x2, y2 = (source - (left, top)).ravel().tolist()
        width, height = (last - first).tolist()
        window = part.resize((width, height), Image.Resampling.BILINEAR, box=(x1, y1, x2, y2))
        view[first[1] : last[1], first[0] : last[0]] = np.asarray(window)
    x, y = corner.tolist()
    return View(view, camera, (x, y), scale).through(camera)
