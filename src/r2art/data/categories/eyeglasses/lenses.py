"""Lenses of glasses: their outlines, and how they look.

Clear lenses are left out: they are open holes, as the renderer knows no transparency. Where no
rim holds them, their polished edge is seen.
"""

from dataclasses import dataclass

import numpy as np

from r2art.data.procedural.outlines import evenly, oval, polygon
from r2art.data.procedural.randomness import (
    Color,
    between,
    chance,
    mixed,
    pick,
    tinted,
    weighted,
)
from r2art.data.shape import Material

POINTS = 52
FloatArray = np.ndarray
Range = tuple[float, float]


@dataclass(frozen=True)
class LensShape:
    """A lens outline: ``ratio`` of its height to its width, and how a superellipse is bent.

    ``exponents`` are those of `outlines.oval`, from the temple upwards. ``trapeze`` widens it
    towards the top, ``lift`` raises its upper outer corner, ``shift`` moves its lowest point
    outwards, ``taper`` lowers it towards the temple.
    """

    name: str
    ratio: float
    exponents: tuple[float, float, float, float]
    trapeze: float
    lift: float
    shift: float
    taper: float


@dataclass(frozen=True)
class LensLook:
    """Front and back of a tinted lens, None where clear; and the edge of a lens without rim."""

    front: Material | None
    back: Material
    edge: Material


_SHAPES: dict[str, tuple[Range, tuple[float, float, float, float], float, float, float, float]] = {
    # ratio, exponents, trapeze, lift, shift, taper
    "rectangle": ((0.52, 0.68), (3.8, 3.8, 2.9, 3.2), 0.04, 0.0, 0.0, 0.0),
    "square": ((0.78, 0.9), (3.6, 3.4, 2.7, 3.0), 0.05, 0.0, 0.0, 0.0),
    "wayfarer": ((0.72, 0.84), (3.4, 3.2, 2.2, 2.5), 0.12, 0.06, 0.0, 0.0),
    "round": ((0.93, 1.0), (2.0, 2.0, 2.0, 2.0), 0.0, 0.0, 0.0, 0.0),
    "panto": ((0.84, 0.94), (2.7, 2.7, 2.0, 2.0), 0.06, 0.0, 0.0, 0.0),
    "oval": ((0.62, 0.76), (2.1, 2.1, 2.1, 2.1), 0.0, 0.0, 0.0, 0.0),
    "cat": ((0.62, 0.8), (3.0, 2.5, 2.0, 2.1), 0.15, 0.3, 0.0, 0.0),
    "aviator": ((0.8, 0.92), (2.7, 2.4, 1.75, 2.3), 0.1, 0.0, 0.16, 0.0),
    "butterfly": ((0.78, 0.94), (2.8, 2.6, 1.9, 2.5), 0.08, 0.1, 0.1, -0.04),
    "hexagon": ((0.84, 0.95), (2.0, 2.0, 2.0, 2.0), 0.0, 0.0, 0.0, 0.0),
    "sport": ((0.52, 0.68), (2.6, 3.2, 1.9, 2.1), 0.04, 0.14, 0.02, 0.2),
}
_BY_KIND: dict[str, dict[str, float]] = {
    "plastic": {
        "rectangle": 3,
        "wayfarer": 3,
        "square": 2,
        "round": 1.5,
        "panto": 2,
        "cat": 2,
        "oval": 0.8,
        "butterfly": 1,
        "hexagon": 0.4,
        "aviator": 0.4,
    },
    "wire": {
        "round": 3,
        "aviator": 3,
        "rectangle": 1.5,
        "oval": 1.5,
        "panto": 1.5,
        "square": 1,
        "hexagon": 1,
        "cat": 0.4,
    },
    "half": {"sport": 1.6, "rectangle": 4, "oval": 1, "square": 0.6, "cat": 0.4},
    "rimless": {
        "rectangle": 3,
        "oval": 2,
        "round": 0.6,
        "square": 0.6,
        "butterfly": 0.5,
    },
    "browline": {"wayfarer": 3, "panto": 2, "square": 1},
    "sport": {"sport": 5, "rectangle": 1, "wayfarer": 1.5},
}
_TINTED = {
    "plastic": 0.38,
    "wire": 0.25,
    "half": 0.12,
    "rimless": 0.25,
    "browline": 0.4,
    "sport": 0.93,
}
_GLASS: tuple[Color, ...] = (
    (0.04, 0.04, 0.045),
    (0.06, 0.045, 0.035),
    (0.045, 0.055, 0.045),
    (0.11, 0.075, 0.045),
    (0.09, 0.1, 0.11),
)
_MIRRORS: tuple[Color, ...] = (
    (0.2, 0.4, 0.75),
    (0.7, 0.72, 0.75),
    (0.8, 0.5, 0.15),
    (0.25, 0.55, 0.4),
    (0.65, 0.3, 0.5),
    (0.75, 0.25, 0.12),
)


def sample_shape(rng: np.random.Generator, kind: str) -> LensShape:
    """A lens shape that suits the kind of frame."""
    name = weighted(rng, _BY_KIND[kind])
    ratio, exponents, trapeze, lift, shift, taper = _SHAPES[name]
    wobble = 0.0 if name in ("round", "hexagon") else 1.0
    powers = [max(1.7, e + wobble * between(rng, -0.35, 0.35)) for e in exponents]
    return LensShape(
        name=name,
        ratio=between(rng, *ratio),
        exponents=(powers[0], powers[1], powers[2], powers[3]),
        trapeze=trapeze * between(rng, 0.5, 1.4) + wobble * between(rng, -0.01, 0.02),
        lift=lift * between(rng, 0.5, 1.3) + wobble * between(rng, -0.01, 0.03),
        shift=shift * between(rng, 0.6, 1.3),
        taper=taper * between(rng, 0.6, 1.3),
    )


def sample_lens(rng: np.random.Generator, kind: str, shape: LensShape) -> LensLook:
    """Clear, dark, graduated or mirrored."""
    edge = Material(color=tinted(rng, (0.72, 0.78, 0.78), 0.03), roughness=0.15, emission=0.1)
    back = Material(color=(0.04, 0.04, 0.042), roughness=0.08)
    sporty = shape.name == "sport"
    likely = _TINTED["sport" if sporty else kind]
    if shape.name in ("aviator", "butterfly"):
        likely = 0.72
    if not chance(rng, likely):
        return LensLook(None, back, edge)
    color = tinted(rng, pick(rng, _GLASS), 0.012)
    edge = Material(color=color, roughness=0.2)
    sort = weighted(rng, {"dark": 5, "graduated": 2.5, "mirror": 4 if sporty else 1.5})
    roughness = between(rng, 0.04, 0.1)
    if sort == "dark":
        return LensLook(Material(color=color, roughness=roughness), back, edge)
    if sort == "mirror":
        sheen = tinted(rng, pick(rng, _MIRRORS), 0.04)
        front = Material(color=sheen, roughness=roughness, metallic=between(rng, 0.6, 0.95))
        return LensLook(front, back, edge)
    low = mixed(
        color,
        pick(rng, ((0.75, 0.7, 0.62), (0.7, 0.72, 0.75))),
        between(rng, 0.25, 0.6),
    )
    share = np.linspace(0, 1, 32)[:, None, None] ** between(rng, 0.8, 2.0)
    fade = np.array(color) + share * (np.array(low) - np.array(color))
    texture = np.repeat((255 * fade).astype(np.uint8), 4, axis=1)
    return LensLook(Material(color=(1, 1, 1), texture=texture, roughness=roughness), back, edge)


def outline(shape: LensShape, width: float, height: float) -> FloatArray:
    """(N, 2) outline of a right lens about its centre, filling ``width`` by ``height`` (m)."""
    if shape.name == "hexagon":
        points = polygon(6, 1.0, count=400)
    else:
        points = oval((1, 1, 1, 1), shape.exponents, count=400)
    x, y = points.T
    upper, lower = np.clip(y, 0, None), np.clip(-y, 0, None)
    bent_x = x * (1 + shape.trapeze * y) + shape.shift * lower**1.5 * (1 - np.abs(x))
    bent_y = y * (1 - shape.taper * np.clip(x, 0, None)) + shape.lift * x * (0.3 + upper)
    low = np.array([bent_x.min(), bent_y.min()])
    high = np.array([bent_x.max(), bent_y.max()])
    middle = (np.stack([bent_x, bent_y], axis=-1) - (low + high) / 2) / (high - low)
    return evenly(middle * (width, height), POINTS)
