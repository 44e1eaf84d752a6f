"""What a laptop is like before it is built: measures, colours, materials."""

from dataclasses import dataclass

import numpy as np

from r2art.data.procedural.randomness import (
    Color,
    between,
    chance,
    pick,
    spread,
    tinted,
    weighted,
)
from r2art.data.procedural.textures import speckled
from r2art.data.shape import Material

BLACK: Color = (0.12, 0.12, 0.125)
_OUTSIDE: dict[Color, float] = {
    BLACK: 4.2,
    (0.17, 0.17, 0.18): 3,
    (0.72, 0.73, 0.74): 5,  # silver
    (0.5, 0.51, 0.53): 2,
    (0.36, 0.37, 0.4): 1.5,
    (0.9, 0.9, 0.9): 1.2,  # white
    (0.1, 0.14, 0.3): 0.8,  # navy
    (0.25, 0.35, 0.5): 0.6,
    (0.78, 0.73, 0.62): 0.6,  # beige
    (0.45, 0.08, 0.1): 0.4,
    (0.8, 0.68, 0.6): 0.3,  # rose gold
}


@dataclass(frozen=True)
class LaptopStyle:
    """Measures (m) and looks of one laptop; ``age`` runs from 0 (about 2002) to 1 (now)."""

    age: float
    width: float
    depth: float
    thickness: float
    lid_thickness: float
    bezel: tuple[float, float, float]  # sides, top, bottom
    gap: float
    hinge_inset: float
    wedge: float
    corner: float
    outside: Material
    inside: Material
    underside: Material
    bezel_material: Material
    deck_color: Color
    accent: Material


def sample_style(rng: np.random.Generator) -> LaptopStyle:
    """Draw a laptop between a thick one of 2002 and a thin one of today."""
    age = _age(rng)
    aspect = _aspect(rng, age)
    narrow = 0.93 if aspect < 1.4 else 1.0
    width = narrow * spread(rng, 0.343, 0.075, 0.265, 0.41)
    side = _aged(rng, age, 0.02, 0.006, 0.25)
    bezel = (side, side * between(rng, 0.9, 1.5), side * between(rng, 1.1, 2.3))
    depth = (width - 2 * side) / aspect + bezel[1] + bezel[2]
    thickness = _aged(rng, age, 0.034, 0.0115, 0.14)
    outside, inside, underside, deck_color = _shells(rng, age)
    return LaptopStyle(
        age=age,
        width=width,
        depth=depth,
        thickness=thickness,
        lid_thickness=float(np.clip(_aged(rng, age, 0.0125, 0.005, 0.16), 0.0038, 0.0145)),
        bezel=bezel,
        gap=between(rng, 0.0004, 0.0018),
        hinge_inset=depth * between(rng, 0.02, 0.08) if chance(rng, 0.45) else 0.0,
        wedge=thickness * between(rng, 0.15, 0.5) if chance(rng, 0.45) else 0.0,
        corner=between(rng, 0.003, 0.016),
        outside=outside,
        inside=inside,
        underside=underside,
        bezel_material=_bezel(rng, age, deck_color),
        deck_color=deck_color,
        accent=Material(color=tinted(rng, pick(rng, tuple(_OUTSIDE))), roughness=0.35),
    )


def _age(rng: np.random.Generator) -> float:
    low, high = weighted(rng, {(0.0, 0.25): 4, (0.3, 0.65): 3, (0.7, 1.0): 3})
    return between(rng, low, high)


def _aged(rng: np.random.Generator, age: float, old: float, new: float, sigma: float) -> float:
    """Log-interpolate a measure over the years, and scatter it."""
    return float(old ** (1 - age) * new**age * np.exp(sigma * rng.standard_normal()))


def _aspect(rng: np.random.Generator, age: float) -> float:
    if age < 0.28:
        return weighted(rng, {4 / 3: 6, 1.5: 1, 1.6: 3})
    if age < 0.68:
        return weighted(rng, {4 / 3: 0.7, 1.6: 5, 16 / 9: 4})
    return weighted(rng, {1.5: 1.5, 1.6: 3.5, 16 / 9: 5})


def _shell(rng: np.random.Generator, color: Color, metal: bool) -> Material:
    roughness = between(rng, 0.3, 0.5) if metal else between(rng, 0.3, 0.75)
    texture = speckled(rng, between(rng, 0.03, 0.1)) if chance(rng, 0.5) else None
    return Material(
        color=color, roughness=roughness, metallic=0.85 if metal else 0.0, texture=texture
    )


def _shells(rng: np.random.Generator, age: float) -> tuple[Material, Material, Material, Color]:
    """Outside, inside and underside; the inside's colour is the deck's."""
    color = tinted(rng, weighted(rng, _OUTSIDE))
    bright = min(color) > 0.4 and max(color) - min(color) < 0.2
    metal = bright and chance(rng, 0.2 + 0.6 * age)
    outside = _shell(rng, color, metal)
    two_tone = chance(rng, 0.45)
    inner = tinted(rng, weighted(rng, _OUTSIDE)) if two_tone else color
    inside = _shell(rng, inner, metal and chance(rng, 0.6)) if two_tone else outside
    under = BLACK if chance(rng, 0.4) else color
    underside = _shell(rng, under, False) if chance(rng, 0.55) else outside
    return outside, inside, underside, inner


def _bezel(rng: np.random.Generator, age: float, deck_color: Color) -> Material:
    color = tinted(rng, BLACK, 0.015) if chance(rng, 0.45 + 0.4 * age) else deck_color
    glossy = chance(rng, 0.1 + 0.5 * age)
    return Material(
        color=color, roughness=between(rng, 0.08, 0.2) if glossy else between(rng, 0.4, 0.7)
    )
