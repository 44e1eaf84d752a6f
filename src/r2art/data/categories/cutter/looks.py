"""What cutters are made of: bright or dark plastic, rubber, cast and sheet metal."""

import numpy as np

from r2art.data.procedural.randomness import Color, between, chance, tinted, weighted
from r2art.data.procedural.textures import Texture, brushed, seamless, speckled, worn
from r2art.data.shape import Material

_BRIGHT: dict[Color, float] = {
    (0.95, 0.78, 0.05): 4,  # yellow
    (0.07, 0.07, 0.075): 3.5,
    (0.8, 0.08, 0.07): 3,
    (0.95, 0.42, 0.05): 2.5,
    (0.07, 0.25, 0.6): 2.5,
    (0.15, 0.5, 0.75): 1,
    (0.35, 0.36, 0.38): 1.8,
    (0.85, 0.85, 0.83): 1.4,
    (0.1, 0.5, 0.28): 1.2,
    (0.5, 0.75, 0.2): 0.8,
    (0.9, 0.45, 0.6): 0.7,
    (0.6, 0.75, 0.85): 0.7,
    (0.5, 0.3, 0.6): 0.4,
}
_CAST: dict[Color, float] = {
    (0.5, 0.51, 0.53): 4,
    (0.68, 0.68, 0.69): 2,
    (0.2, 0.2, 0.21): 1.5,
    (0.92, 0.74, 0.05): 1.5,
    (0.65, 0.06, 0.06): 1.2,
    (0.08, 0.2, 0.45): 1,
    (0.85, 0.4, 0.05): 0.6,
}
_BLACK: Color = (0.06, 0.06, 0.065)


def looks(rng: np.random.Generator, kind: str) -> dict[str, Material]:
    """Materials of body, rubber, steel, accents and slider, by their field's name."""
    steel = Material(
        color=tinted(rng, (0.72, 0.72, 0.73), 0.03),
        texture=seamless(brushed(rng, between(rng, 0.02, 0.07), size=96)),
        roughness=between(rng, 0.3, 0.48),
        metallic=0.95,
    )
    body = _cast(rng) if kind == "metal" else _plastic(rng)
    if kind == "slim" and chance(rng, 0.18):
        body = steel
    rubber = Material(
        color=tinted(rng, _BLACK if chance(rng, 0.75) else weighted(rng, _BRIGHT), 0.02),
        texture=seamless(speckled(rng, 0.1)),
        roughness=between(rng, 0.7, 0.95),
    )
    black = Material(color=tinted(rng, _BLACK, 0.015), roughness=between(rng, 0.35, 0.7))
    button = weighted(rng, {0: 5, 1: 2.5, 2: 1.5, 3: 1.5 if kind == "metal" else 0.4})
    accent = _plastic(rng) if chance(rng, 0.5) else black
    button = 0 if body is steel else button
    return {
        "body": body,
        "rubber": rubber,
        "steel": steel,
        "accent": accent,
        "button": (black, accent, body, steel)[button],
    }


def _plastic(rng: np.random.Generator) -> Material:
    glossy = chance(rng, 0.4)
    return Material(
        color=tinted(rng, weighted(rng, _BRIGHT), 0.025),
        texture=None if glossy else _grain(rng),
        roughness=between(rng, 0.18, 0.33) if glossy else between(rng, 0.35, 0.65),
    )


def _cast(rng: np.random.Generator) -> Material:
    color = weighted(rng, _CAST)
    bare = max(color) - min(color) < 0.1 and color[0] > 0.4
    return Material(
        color=tinted(rng, color, 0.025),
        texture=_grain(rng),
        roughness=between(rng, 0.3, 0.55),
        metallic=between(rng, 0.5, 0.9) if bare else 0.0,
    )


def _grain(rng: np.random.Generator) -> Texture:
    image = speckled(rng, between(rng, 0.03, 0.1))
    return seamless(worn(rng, image, between(rng, 0.3, 1.4)) if chance(rng, 0.6) else image)
