"""What a camera makes of radiance: white balance, blur, vignetting, noise, sharpening, JPEG.

Half of the photos stay clean, for whoever trains adds changes of their own; in the others each
effect is mild and comes in a share of them. Labels are not touched.
"""

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from r2art.data.rendering.render import GAMMA

FloatArray = NDArray[np.floating]
Picture = NDArray[np.uint8]

CLEAN = 0.5
REFERENCE = 224
"""Side (px) of the photos for which lengths in pixels are given; they grow with the photo."""


def developed(
    rng: np.random.Generator, radiance: FloatArray, depth: FloatArray, focus: float
) -> Picture:
    """An 8-bit sRGB photo.

    Args:
        rng: Decides which effects there are, and how strong.
        radiance: (H, W, 3) linear, 1 is white.
        depth: (H, W) z in metres, 0: infinitely far.
        focus: Depth (m) that is sharp.
    """
    radiance = radiance.astype(np.float32)
    if rng.random() < CLEAN:
        return _bytes(_toned(radiance))
    if rng.random() < 0.5:
        radiance = radiance * np.exp(rng.normal(0, 0.08, 3)).astype(np.float32)
    radiance = _blurred(rng, radiance, depth, focus)
    if rng.random() < 0.4:
        radiance = radiance * _vignette(radiance.shape[:2], rng.uniform(0.1, 0.5))
    if rng.random() < 0.6:
        radiance = _noisy(rng, radiance)
    tones = _toned(radiance)
    if rng.random() < 0.4:
        tones = tones + rng.uniform(0.2, 0.8) * (tones - _gaussian(tones, 1.0))
    picture = _bytes(tones)
    return _compressed(picture, int(rng.integers(45, 92))) if rng.random() < 0.4 else picture


def _toned(radiance: FloatArray) -> FloatArray:
    return np.clip(radiance, 0, 1) ** np.float32(1 / GAMMA)


def _bytes(tones: FloatArray) -> Picture:
    return (255 * np.clip(tones, 0, 1) + 0.5).astype(np.uint8)


def _blurred(
    rng: np.random.Generator, radiance: FloatArray, depth: FloatArray, focus: float
) -> FloatArray:
    """Nothing, a soft lens, a small aperture's depth of field, or a shake of the hand."""
    kind, strength = rng.random(), rng.random()
    scale = max(radiance.shape[:2]) / REFERENCE
    if kind < 0.2:
        return _gaussian(radiance, scale * (0.35 + 0.65 * strength))
    if kind < 0.4:
        return _defocused(radiance, depth, focus, scale * (1 + 3 * strength))
    if kind < 0.55:
        angle = rng.uniform(0, np.pi)
        reach = scale * (1 + 2.5 * strength) * np.array([np.sin(angle), np.cos(angle)])
        return _mean_along(radiance, reach)
    return radiance


def _gaussian(picture: FloatArray, sigma: float) -> FloatArray:
    """Blurred by ``sigma`` px; edges are repeated."""
    reach = max(1, int(np.ceil(2.5 * sigma)))
    weight = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2).astype(np.float32)
    weight /= weight.sum()
    for axis in (0, 1):
        padding = [(0, 0)] * picture.ndim
        padding[axis] = (reach, reach)
        wide = np.pad(picture, padding, mode="edge")
        count = picture.shape[axis]
        shifted = (wide[(slice(None),) * axis + (slice(i, i + count),)] for i in range(len(weight)))
        picture = np.add.reduce([w * p for w, p in zip(weight, shifted, strict=True)])
    return picture


def _defocused(radiance: FloatArray, depth: FloatArray, focus: float, sigma: float) -> FloatArray:
    """Blurred by up to ``sigma`` px where depth is far from the focus."""
    nearness = np.where(depth > 0, focus / np.where(depth > 0, depth, 1), 0)
    amount = np.clip(np.abs(1 - nearness) * 1.5 - 0.15, 0, 1).astype(np.float32)
    amount = _gaussian(amount, 1.0)[..., None]
    half, full = _gaussian(radiance, 0.5 * sigma), _gaussian(radiance, sigma)
    low, high = np.clip(2 * amount, 0, 1), np.clip(2 * amount - 1, 0, 1)
    return (radiance * (1 - low) + half * low) * (1 - high) + full * high


def _mean_along(radiance: FloatArray, reach: FloatArray) -> FloatArray:
    """The mean of the picture moved by up to ``reach`` (rows, columns) both ways."""
    height, width = radiance.shape[:2]
    offsets = np.round(np.linspace(-reach, reach, 9)).astype(int)
    pad = int(np.abs(offsets).max())
    wide = np.pad(radiance, [(pad, pad), (pad, pad), (0, 0)], mode="edge") / np.float32(9)
    return np.add.reduce([wide[pad + y :, pad + x :][:height, :width] for y, x in offsets])


def _vignette(shape: tuple[int, ...], amount: float) -> FloatArray:
    """(H, W, 1) light that is left; the corners lose ``amount``."""
    y, x = (np.linspace(-1, 1, n, dtype=np.float32) ** 2 / 2 for n in shape)
    return 1 - np.float32(amount) * (y[:, None] + x)[..., None]


def _noisy(rng: np.random.Generator, radiance: FloatArray) -> FloatArray:
    """Shot noise grows with the light, read noise does not."""
    read, shot = rng.uniform(0.0005, 0.004), rng.uniform(0.00005, 0.0008)
    spread = np.sqrt(read**2 + shot * np.maximum(radiance, 0), dtype=np.float32)
    return radiance + spread * rng.standard_normal(radiance.shape, dtype=np.float32)


def _compressed(picture: Picture, quality: int) -> Picture:
    """As a camera's JPEG of this quality shows it."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "JPEG", quality=quality)
    with Image.open(file) as image:
        return np.asarray(image.convert("RGB"))
