"""What surrounds an object: files to draw from, materials, backdrops, things that stand about.

Everything works without any file; a folder of photos (``.jpg``, ``.png``), light probes
(``.hdr``) and textures (pictures in a folder whose name contains "texture") adds variety.
"""

from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from r2art.core.errors import InputError
from r2art.data.rendering.render import TO_LINEAR
from r2art.data.scenes.things import UP, some_thing
from r2art.data.shape import Material, Surface
from r2art.data.staging import about

FloatArray = NDArray[np.floating]
PICTURES = {".jpg", ".jpeg", ".png"}


@dataclass(frozen=True)
class Surroundings:
    """Files to draw backgrounds, light and textures from; all may be empty."""

    photos: tuple[Path, ...] = field(default=(), repr=False)
    probes: tuple[Path, ...] = field(default=(), repr=False)
    textures: tuple[Path, ...] = field(default=(), repr=False)

    @classmethod
    @lru_cache(maxsize=4)
    def from_folder(cls, folder: Path | None) -> "Surroundings":
        """Sort a folder's files (recursively) by what they are good for."""
        if folder is None:
            return cls()
        if not folder.is_dir():
            raise InputError(f"backgrounds folder {folder} does not exist; give a folder of photos")
        files = sorted(p for p in folder.rglob("*") if p.is_file())
        probes = tuple(p for p in files if p.suffix.lower() == ".hdr")
        pictures = [p for p in files if p.suffix.lower() in PICTURES]
        textures = tuple(p for p in pictures if "texture" in p.parent.name)
        photos = tuple(p for p in pictures if "texture" not in p.parent.name)
        return cls(photos, probes, textures)


@lru_cache(maxsize=512)
def read_picture(path: Path, longest: int = 512) -> NDArray[np.uint8]:
    """A photo as (H, W, 3) uint8, at most ``longest`` px on its longer side."""
    try:
        with Image.open(path) as image:
            rgb = image.convert("RGB")
    except (OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise InputError(f"cannot read the background {path}: {error}; remove it") from error
    rgb.thumbnail((longest, longest))
    return np.asarray(rgb)


def noise_picture(rng: np.random.Generator, size: int = 128) -> NDArray[np.uint8]:
    """(size, size, 3) smooth random pattern between two or three random colours."""
    value = np.zeros((size, size))
    stretch = rng.integers(1, 5) if rng.random() < 0.4 else 1
    for octave in range(rng.integers(2, 6)):
        cells = 2 ** (octave + 1)
        grid = rng.random((cells, max(1, cells // stretch))).astype(np.float32)
        layer = Image.fromarray(grid).resize((size, size), Image.Resampling.BICUBIC)
        value += np.asarray(layer) / 1.7**octave
    value = (value - value.min()) / np.ptp(value)
    stops = random_color(rng, 3)
    mixed = np.stack([np.interp(value, (0, 0.5, 1), stops[:, c]) for c in range(3)], axis=-1)
    return (255 * mixed).astype(np.uint8)


def random_color(rng: np.random.Generator, n: int = 1) -> FloatArray:
    """(n, 3) sRGB colours, mostly muted."""
    grey = rng.uniform(0.05, 1, (n, 1))
    vivid = rng.random((n, 3))
    amount = rng.beta(1.2, 3, (n, 1))
    return np.clip(grey * (1 - amount) + vivid * amount, 0, 1)


def picture_or_noise(rng: np.random.Generator, files: tuple[Path, ...]) -> NDArray[np.uint8]:
    """One of the files, or a noise picture where there are none."""
    if files:
        return read_picture(files[rng.integers(len(files))])
    return noise_picture(rng)


def backdrop(
    rng: np.random.Generator, photos: tuple[Path, ...], height: int, width: int
) -> NDArray[np.uint8]:
    """(height, width, 3) picture behind everything: a photo crop, a plain shade, or noise."""
    kind = rng.random()
    if kind < 0.35:
        return plain_backdrop(rng, height, width)
    photo = picture_or_noise(rng, photos if kind < 0.9 else ())
    h, w = photo.shape[:2]
    side = rng.uniform(0.4, 1) * min(h, w)
    x, y = rng.uniform(0, w - side), rng.uniform(0, h - side)
    image = Image.fromarray(photo).resize(
        (width, height), Image.Resampling.BILINEAR, box=(x, y, x + side, y + side)
    )
    if rng.random() < 0.5:
        image = image.transpose(Image.Transpose.FLIP_LEFT_RIGHT)
    return np.asarray(image)


def plain_backdrop(rng: np.random.Generator, height: int, width: int) -> NDArray[np.uint8]:
    """White, another plain colour, or a soft gradient, as in product photos."""
    first = np.ones(3) * rng.uniform(0.9, 1) if rng.random() < 0.5 else random_color(rng)[0]
    second = first if rng.random() < 0.5 else np.clip(first + rng.normal(0, 0.15, 3), 0, 1)
    angle = rng.uniform(0, 2 * np.pi)
    y, x = np.mgrid[0 : 1 : height * 1j, 0 : 1 : width * 1j]
    ramp = x * np.cos(angle) + y * np.sin(angle)
    ramp = ((ramp - ramp.min()) / np.ptp(ramp))[..., None]
    return (255 * (first * (1 - ramp) + second * ramp)).astype(np.uint8)


def some_material(rng: np.random.Generator, files: Surroundings) -> Material:
    """Plain, or with a texture, a photo or a pattern on it."""
    kind = rng.random()
    texture = None
    if kind < 0.45:
        texture = picture_or_noise(rng, files.textures)
    elif kind < 0.6:
        texture = picture_or_noise(rng, files.photos)
    elif kind < 0.75:
        texture = noise_picture(rng)
    tint = random_color(rng)[0] if texture is None else rng.uniform(0.6, 1) * np.ones(3)
    return Material(color=tuple(tint), roughness=float(rng.uniform(0.25, 1)), texture=texture)


def thing(
    rng: np.random.Generator, center: FloatArray, size: float, files: Surroundings
) -> Surface:
    """Something of about ``size`` (m) around ``center``, turned about the vertical or anyhow."""
    surface = some_thing(rng, some_material(rng, files))
    lower, upper = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    R = about(UP, rng.uniform(0, 2 * np.pi))
    if rng.random() < 0.3:
        R = R @ about(0, rng.uniform(0, 2 * np.pi)) @ about(2, rng.uniform(0, 2 * np.pi))
    unit = (surface.vertices - (lower + upper) / 2) / (upper - lower).max()
    return replace(surface, vertices=size * unit @ R.T + center, normals=surface.normals @ R.T)


def standing_thing(
    rng: np.random.Generator, foot: FloatArray, size: float, files: Surroundings
) -> Surface:
    """Something of about ``size`` (m) that stands on the point ``foot``."""
    moved = thing(rng, np.zeros(3), size, files)
    rise = foot - np.array([0, moved.vertices[:, UP].min(), 0])
    return replace(moved, vertices=moved.vertices + rise)


def clutter(
    rng: np.random.Generator, lower: FloatArray, upper: FloatArray, files: Surroundings
) -> list[Surface]:
    """Up to four things standing round the box, in the object's frame."""
    size = float(np.linalg.norm(upper - lower))
    out = []
    for _ in range(rng.integers(0, 5)):
        extent = size * rng.uniform(0.1, 0.45)
        angle = rng.uniform(0, 2 * np.pi)
        far = size * rng.uniform(0.55, 1.2) + extent / 2
        place = (lower + upper) / 2 + far * np.array([np.sin(angle), 0, np.cos(angle)])
        place[UP] = lower[UP]
        out.append(standing_thing(rng, place, extent, files))
    return out


def linear(picture: NDArray[np.uint8]) -> FloatArray:
    """sRGB bytes to linear radiance in [0, 1]."""
    return TO_LINEAR[picture]
