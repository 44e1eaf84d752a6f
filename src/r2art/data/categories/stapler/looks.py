"""What staplers are made of: plastic, lacquered or chromed steel, rubber."""

import numpy as np

from r2art.data.procedural.randomness import Color, between, chance, pick, tinted, weighted
from r2art.data.procedural.textures import Texture, brushed, seamless, speckled, worn
from r2art.data.shape import Material

_PLASTICS: dict[Color, float] = {
    (0.06, 0.06, 0.065): 7,
    (0.2, 0.21, 0.22): 2,
    (0.45, 0.46, 0.48): 1.5,
    (0.88, 0.88, 0.86): 1.5,
    (0.08, 0.18, 0.45): 2,
    (0.1, 0.4, 0.7): 1.2,
    (0.65, 0.06, 0.08): 2,
    (0.1, 0.4, 0.22): 0.8,
    (0.9, 0.45, 0.08): 0.7,
    (0.85, 0.35, 0.5): 0.7,
    (0.45, 0.75, 0.75): 0.7,
    (0.45, 0.3, 0.6): 0.5,
    (0.93, 0.8, 0.2): 0.5,
}
_LACQUERS: dict[Color, float] = {
    (0.05, 0.05, 0.055): 4,
    (0.4, 0.42, 0.43): 2,
    (0.55, 0.54, 0.48): 1.5,
    (0.3, 0.36, 0.3): 1,
    (0.5, 0.05, 0.06): 1.2,
    (0.1, 0.2, 0.32): 1,
    (0.75, 0.7, 0.58): 1.2,
    (0.35, 0.22, 0.14): 0.6,
    (0.45, 0.62, 0.6): 0.6,
}
_STEEL: Color = (0.68, 0.68, 0.69)


def looks(rng: np.random.Generator, kind: str) -> dict[str, Material]:
    """Materials of base, cover, steel pieces, rubber and accents, by their field's name."""
    chrome = Material(
        color=tinted(rng, (0.78, 0.78, 0.79), 0.02),
        roughness=between(rng, 0.18, 0.28),
        metallic=1.0,
    )
    satin = Material(
        color=tinted(rng, _STEEL, 0.03),
        texture=seamless(brushed(rng, between(rng, 0.03, 0.09), size=96)),
        roughness=between(rng, 0.32, 0.48),
        metallic=0.9,
    )
    steel = pick(rng, (chrome, satin, satin))
    metal = kind in ("vintage", "heavy", "long")
    cover = _lacquer(rng) if metal and chance(rng, 0.75) else _plastic(rng)
    if kind == "vintage" and chance(rng, 0.22):
        cover = steel
    same = chance(rng, 0.55)
    base = cover if same else (_lacquer(rng) if metal else _plastic(rng, dark=chance(rng, 0.7)))
    black = Material(color=tinted(rng, (0.05, 0.05, 0.05), 0.01), roughness=0.85)
    grey = Material(color=tinted(rng, (0.35, 0.35, 0.36), 0.03), roughness=0.85)
    accent = weighted(rng, {0: 3, 1: 2, 2: 2})
    return {
        "base": base,
        "cover": cover,
        "steel": steel,
        "pad_look": grey if chance(rng, 0.15) else black,
        "accent": (black, _plastic(rng), steel)[accent],
    }


def _plastic(rng: np.random.Generator, *, dark: bool = False) -> Material:
    color = (0.06, 0.06, 0.065) if dark else weighted(rng, _PLASTICS)
    glossy = chance(rng, 0.35)
    return Material(
        color=tinted(rng, color, 0.025),
        texture=None if glossy else _grain(rng),
        roughness=between(rng, 0.18, 0.33) if glossy else between(rng, 0.35, 0.7),
    )


def _lacquer(rng: np.random.Generator) -> Material:
    return Material(
        color=tinted(rng, weighted(rng, _LACQUERS), 0.025),
        texture=_grain(rng),
        roughness=between(rng, 0.15, 0.5),
    )


def _grain(rng: np.random.Generator) -> Texture:
    image = speckled(rng, between(rng, 0.03, 0.1))
    return seamless(worn(rng, image, between(rng, 0.2, 1.0)) if chance(rng, 0.5) else image)
