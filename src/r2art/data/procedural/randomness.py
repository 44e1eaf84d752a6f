"""Draws that read well: short names for what the generators ask of an rng."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

T = TypeVar("T")
Color = tuple[float, float, float]


def chance(rng: np.random.Generator, probability: float) -> bool:
    """True with this probability."""
    return bool(rng.random() < probability)


def pick(rng: np.random.Generator, choices: Sequence[T]) -> T:
    """One of ``choices``, all equally likely."""
    return choices[int(rng.integers(len(choices)))]


def weighted(rng: np.random.Generator, choices: dict[T, float]) -> T:
    """One of the keys, as likely as its weight."""
    threshold = rng.random() * sum(choices.values())
    for choice, weight in choices.items():
        threshold -= weight
        if threshold < 0:
            return choice
    return next(reversed(choices))


def between(rng: np.random.Generator, low: float, high: float) -> float:
    """Uniform in [low, high)."""
    return float(low + (high - low) * rng.random())


def spread(rng: np.random.Generator, mean: float, sigma: float, low: float, high: float) -> float:
    """Log-normal with median ``mean`` and relative ``sigma``, clipped to [low, high]."""
    return float(np.clip(mean * np.exp(sigma * rng.standard_normal()), low, high))


def tinted(rng: np.random.Generator, color: Color, amount: float = 0.04) -> Color:
    """A colour near ``color``: brightness and, less, hue are shifted."""
    shift = amount * (rng.standard_normal() + 0.7 * max(color) * rng.standard_normal(3))
    red, green, blue = np.clip(np.asarray(color) + shift, 0.035, 0.97).tolist()
    return red, green, blue


def mixed(color: Color, other: Color, share: float) -> Color:
    """``share`` of ``other`` and the rest of ``color``."""
    red, green, blue = ((1 - share) * a + share * b for a, b in zip(color, other, strict=True))
    return red, green, blue


def pixel(color: Color) -> tuple[int, int, int]:
    """The same colour as PIL draws it."""
    return int(color[0] * 255), int(color[1] * 255), int(color[2] * 255)
