"""What cabinets stand on: a plinth, legs, feet, castors."""

import numpy as np

from r2art.data.categories.drawer.style import CabinetStyle
from r2art.data.procedural.randomness import between, chance
from r2art.data.procedural.solids import box, cylinder
from r2art.data.shape import Material, Surface


def supports(rng: np.random.Generator, style: CabinetStyle) -> list[Surface]:
    """From the ground up to the style's ``support_height``."""
    x, z, h = style.width / 2, style.depth / 2, style.support_height
    look = style.support_look
    if style.support == "none" or h <= 0.0:
        return []
    if style.support == "plinth":
        back = between(rng, 0.0, 0.05)
        return [box((-x + 0.002, 0, -z), (x - 0.002, h, z - back), look, tile=style.tile)]
    thick = between(rng, 0.012, 0.024)
    place = [(sx * (x - 1.6 * thick), sz * (z - 1.6 * thick)) for sx in (-1, 1) for sz in (-1, 1)]
    if style.support == "castors":
        return [s for px, pz in place for s in _castor(look, px, pz, h)]
    if style.support == "legs" and chance(rng, 0.5):
        return [
            box((px - thick, 0, pz - thick), (px + thick, h, pz + thick), look, tile=style.tile)
            for px, pz in place
        ]
    return [
        s for px, pz in place for s in cylinder((px, h / 2, pz), 1, thick, h, look, segments=12)
    ]


def _castor(look: Material, x: float, z: float, height: float) -> list[Surface]:
    radius = 0.42 * height
    wheels = [
        s
        for dx in (-0.009, 0.009)
        for s in cylinder((x + dx, radius, z - 0.01), 0, radius, 0.013, look, bevel=0.002)
    ]
    hood = box((x - 0.012, radius, z - 0.012), (x + 0.012, height, z + 0.012), look)
    return [*wheels, hood]
