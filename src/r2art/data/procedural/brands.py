"""Makers' names, as they are printed on small tools."""

from dataclasses import replace

import numpy as np
from PIL import Image, ImageDraw

from r2art.data.procedural.randomness import Color, between, chance, mixed, pick, pixel
from r2art.data.procedural.textures import Texture, font, word
from r2art.data.shape import Material

Pixel = tuple[int, int, int]
_INKS: tuple[Color, ...] = ((0.08, 0.08, 0.08), (0.08, 0.08, 0.08), (0.7, 0.05, 0.05))


def brand(rng: np.random.Generator, under: Material) -> tuple[Material, float]:
    """A name printed on the material ``under``, and its width over its height."""
    tone = 1.0 if under.texture is None else float(under.texture.mean()) / 255
    color = mixed((0.0, 0.0, 0.0), under.color, tone)
    pale = sum(color) < 1.5 and under.metallic < 0.5
    ink = (0.92, 0.92, 0.9) if pale else pick(rng, _INKS)
    image = _name_plate(rng, pixel(color), pixel(mixed(color, ink, between(rng, 0.5, 1.0))))
    look = replace(under, color=(1.0, 1.0, 1.0), texture=image)
    return look, image.shape[1] / image.shape[0]


def _name_plate(rng: np.random.Generator, background: Pixel, ink: Pixel) -> Texture:
    """The maker's name, perhaps with a sign, a model number or a frame."""
    high = 40
    name = word(rng, int(rng.integers(1, 4)))
    name = name.upper() if chance(rng, 0.55) else name.title()
    if chance(rng, 0.35):
        name += f" {int(rng.integers(1, 99)) * pick(rng, (1, 5, 10))}"
    letters = font(int(high * between(rng, 0.55, 0.85)))
    left, top, right, bottom = letters.getbbox(name)
    sign = high if chance(rng, 0.4) else 0
    wide = int(right - left) + sign + high // 2
    image = Image.new("RGB", (min(wide, 512), high), background)
    draw = ImageDraw.Draw(image)
    draw.text((sign + high // 4 - left, (high - top - bottom) / 2), name, fill=ink, font=letters)
    if sign:
        shape = pick(rng, (draw.ellipse, draw.rectangle))
        shape([high // 4, high // 4, high - high // 4, high - high // 4], fill=ink)
    if chance(rng, 0.12):
        draw.rectangle([1, 1, image.width - 2, high - 2], outline=ink, width=2)
    return np.asarray(image)
