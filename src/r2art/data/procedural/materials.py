"""Looks of common materials, ready to build with: wood, paint, metal, leather, cloth, board."""

import numpy as np

from r2art.data.procedural.randomness import Color, between, chance, pick, tinted
from r2art.data.procedural.textures import (
    Texture,
    brushed,
    seamless,
    smooth_noise,
    speckled,
    wood,
    worn,
)
from r2art.data.shape import Material

TILE = 1.3  # m, at which these textures repeat on furniture
WOODS: tuple[Color, ...] = (
    (0.72, 0.55, 0.36),  # oak
    (0.82, 0.66, 0.46),  # beech
    (0.85, 0.7, 0.46),  # pine
    (0.36, 0.23, 0.15),  # walnut
    (0.42, 0.19, 0.11),  # mahogany
    (0.55, 0.35, 0.2),  # cherry
    (0.17, 0.12, 0.1),  # wenge
    (0.6, 0.55, 0.48),  # grey ash
)
PAINTS: tuple[Color, ...] = (
    (0.93, 0.93, 0.92),
    (0.93, 0.93, 0.92),
    (0.88, 0.86, 0.8),
    (0.16, 0.16, 0.17),
    (0.45, 0.47, 0.5),
    (0.25, 0.4, 0.5),
    (0.4, 0.5, 0.4),
    (0.75, 0.45, 0.45),
    (0.2, 0.25, 0.4),
)
LACQUERS: tuple[Color, ...] = (
    (0.65, 0.66, 0.67),
    (0.4, 0.41, 0.43),
    (0.78, 0.75, 0.66),
    (0.9, 0.9, 0.9),
    (0.15, 0.15, 0.16),
)
METALS: tuple[Color, ...] = (
    (0.72, 0.72, 0.73),  # nickel, chrome
    (0.5, 0.5, 0.51),
    (0.72, 0.58, 0.3),  # brass
    (0.4, 0.28, 0.18),  # bronze
    (0.12, 0.12, 0.12),  # blackened
)


def wooden(rng: np.random.Generator, color: Color) -> Material:
    """Wood, oiled or varnished, sometimes worn."""
    image = wood(rng, tinted(rng, color, 0.03))
    if chance(rng, 0.4):
        image = worn(rng, image, between(rng, 0.2, 0.8))
    return Material(color=(1, 1, 1), texture=seamless(image), roughness=between(rng, 0.25, 0.7))


def painted(rng: np.random.Generator, colors: tuple[Color, ...], metallic: float) -> Material:
    """Paint, lacquer or plastic in one of the colours, sometimes scratched."""
    image = speckled(rng, between(rng, 0.02, 0.07))
    if chance(rng, 0.3):
        image = worn(rng, image, between(rng, 0.3, 1.0))
    return Material(
        color=tinted(rng, pick(rng, colors), 0.03),
        texture=seamless(image),
        roughness=between(rng, 0.2, 0.65),
        metallic=metallic,
    )


def steel(rng: np.random.Generator) -> Material:
    """Brushed steel."""
    return Material(color=(0.6, 0.6, 0.62), texture=brushed(rng), roughness=0.4, metallic=0.8)


def fitting(rng: np.random.Generator) -> Material:
    """The metal of hinges, locks and handles."""
    return Material(color=pick(rng, METALS), roughness=between(rng, 0.2, 0.5), metallic=0.9)


def leather(rng: np.random.Generator, color: Color) -> Material:
    """Leather or its imitation, grained."""
    shape = (160, 160)
    grain = smooth_noise(rng, shape, (90, 90)) * smooth_noise(rng, shape, (60, 60))
    image = _grey(1 - between(rng, 0.25, 0.6) * np.abs(grain - 0.25))
    if chance(rng, 0.4):
        image = worn(rng, image, between(rng, 0.3, 1.0))
    return Material(
        color=tinted(rng, color, 0.02),
        texture=seamless(image),
        roughness=between(rng, 0.3, 0.6),
    )


def cloth(rng: np.random.Generator, color: Color) -> Material:
    """Linen or canvas: threads that cross."""
    count, size = int(rng.integers(24, 49)), 192
    phase = np.arange(size) / size * count * 2 * np.pi
    threads = np.maximum(np.sin(phase)[:, None], np.sin(phase)[None] * 0.9)
    uneven = smooth_noise(rng, (size, size), (40, 8)) + smooth_noise(rng, (size, size), (8, 40))
    image = _grey(0.74 + 0.14 * threads + 0.06 * uneven)
    return Material(color=tinted(rng, color, 0.02), texture=image, roughness=0.95)


def felt(rng: np.random.Generator, color: Color) -> Material:
    """Felt, velvet or flock: dull, with clouds where it was stroked."""
    shape = (128, 128)
    clouds, grain = smooth_noise(rng, shape, (5, 4)), rng.random(shape)
    image = _grey(1 - 0.22 * clouds - 0.1 * grain)
    return Material(color=tinted(rng, color, 0.02), texture=seamless(image), roughness=1.0)


def cardboard(rng: np.random.Generator, color: Color = (0.71, 0.55, 0.38)) -> Material:
    """Kraft board: fibres, a few specks, and the flutes faintly showing through."""
    size = 192
    flutes = np.sin(np.arange(size) / size * 2 * np.pi * int(rng.integers(30, 46)))
    fibres = smooth_noise(rng, (size, size), (120, 40))
    clouds = smooth_noise(rng, (size, size), (4, 4))
    image = _grey(0.93 + 0.02 * flutes[:, None] - 0.1 * (fibres - 0.5) - 0.06 * clouds)
    if chance(rng, 0.5):
        image = worn(rng, image, between(rng, 0.2, 0.7))
    return Material(
        color=tinted(rng, color, 0.02), texture=seamless(image), roughness=between(rng, 0.75, 0.95)
    )


def _grey(value: np.ndarray) -> Texture:
    """(H, W) shares of white as an image."""
    return np.repeat((255 * np.clip(value, 0, 1)).astype(np.uint8)[..., None], 3, axis=-1)
