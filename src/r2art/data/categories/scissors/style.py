"""What a pair of scissors is like before it is built: measures, colours, materials."""

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
from r2art.data.procedural.textures import brushed, seamless, worn
from r2art.data.shape import Material

_KINDS = {
    "office": 4.5,
    "school": 1.2,
    "tailor": 1.5,
    "nail": 1.2,
    "embroidery": 0.9,
    "kitchen": 1.1,
    "hair": 1.2,
}
_PLASTICS: dict[Color, float] = {
    (0.04, 0.04, 0.042): 5,
    (0.72, 0.06, 0.06): 2.2,
    (0.08, 0.2, 0.55): 2,
    (0.92, 0.38, 0.04): 1.6,
    (0.3, 0.31, 0.33): 1.2,
    (0.12, 0.45, 0.2): 1,
    (0.1, 0.5, 0.6): 0.8,
    (0.85, 0.3, 0.5): 0.8,
    (0.4, 0.15, 0.5): 0.7,
    (0.9, 0.75, 0.1): 0.8,
    (0.88, 0.88, 0.86): 0.8,
}
_GRIPS: tuple[Color, ...] = (
    (0.3, 0.31, 0.33),
    (0.55, 0.56, 0.57),
    (0.05, 0.05, 0.05),
    (0.85, 0.2, 0.1),
    (0.4, 0.65, 0.15),
    (0.15, 0.45, 0.75),
    (0.95, 0.6, 0.1),
)
# Length (median, least, greatest), blades' share of it, blade width at the pivot over length.
_MEASURES = {
    "office": ((0.19, 0.14, 0.235), (0.48, 0.56), (0.07, 0.1)),
    "school": ((0.132, 0.118, 0.148), (0.43, 0.52), (0.09, 0.125)),
    "tailor": ((0.225, 0.19, 0.26), (0.5, 0.58), (0.085, 0.115)),
    "nail": ((0.094, 0.09, 0.105), (0.28, 0.38), (0.07, 0.1)),
    "embroidery": ((0.105, 0.092, 0.128), (0.38, 0.48), (0.07, 0.095)),
    "kitchen": ((0.212, 0.195, 0.235), (0.42, 0.5), (0.095, 0.13)),
    "hair": ((0.16, 0.14, 0.185), (0.44, 0.52), (0.055, 0.075)),
}


@dataclass(frozen=True)
class LoopStyle:
    """A finger loop: half length and half width of its hole (m), its roundness and turn (rad)."""

    long: float
    wide: float
    exponents: tuple[float, float, float, float]
    turn: float
    end: float  # how much nearer to the pivot it ends than the handle may reach


@dataclass(frozen=True)
class ScissorsStyle:
    """Measures (m) and looks; blades reach from the pivot to -z, handles to +z."""

    kind: str
    blade: float  # from the pivot to the tip
    handle: float  # from the pivot to the end of the longer loop
    width: float  # of a blade at the pivot
    tip: float  # of a blade at its tip
    belly: float  # how convex its back is
    thickness: float  # of a blade
    bevel: float  # width of the ground edge
    curl: float  # how far the tips are bent out of the plane (m)
    main: LoopStyle
    other: LoopStyle
    ring: float  # width of a loop's wall ...
    height: float  # ... and of the handles, square to the blades
    gap: float  # between the closed handles
    solid: bool  # loop and arm are one plate, not a ring on a rod
    edge: float  # radius of that plate's edges
    neck: float  # where the handle begins behind the pivot, over the blade's width ...
    broad: float  # ... and how broad it is there, the same
    slim: float  # how high it is there, over the height of the loop
    waist: float  # how hollow its outer side is, over the length of that side
    heavy: float  # how much thicker the loop's far end is
    jaw: float  # depth (m) of a toothed hollow between the arms, to crack nuts or open bottles
    splay: float  # where a rod meets its ring: 0 on the inner side, 1 on top
    lining: float  # thickness of a soft lining of the loops, or 0
    rest: bool  # for the little finger, on the main loop
    upper: bool  # whether the main half's blade is the upper one
    screw: float  # radius
    slot: bool
    limit: float  # rad
    steel: Material
    ground: Material
    handle_look: Material
    lining_look: Material
    screw_look: Material

    @property
    def equal(self) -> bool:
        """Whether both halves look alike, so that turned over the scissors look the same."""
        return self.main == self.other and not self.rest


def sample_style(rng: np.random.Generator) -> ScissorsStyle:
    """Draw office, school, tailor's, nail, embroidery, kitchen or hairdressing scissors."""
    kind = weighted(rng, _KINDS)
    (median, low, high), shares, widths = _MEASURES[kind]
    length = spread(rng, median, 0.09, low, high)
    blade = length * between(rng, *shares)
    handle = length - blade
    plastic = kind in ("office", "school", "kitchen") or (kind == "tailor" and chance(rng, 0.35))
    curled = kind == "nail" and chance(rng, 0.5)
    small = kind in ("nail", "embroidery", "hair")
    ring = _ring(rng, kind, plastic, length)
    height = ring * between(rng, 1.1, 1.7) if plastic else ring * between(rng, 0.75, 1.1)
    main, other = _loops(rng, kind, handle, ring)
    steel, ground = _steel(rng, kind)
    handle_look = _handle_look(rng, kind, plastic, steel)
    bright = Material(color=(0.75, 0.75, 0.76), roughness=0.25, metallic=0.9)
    return ScissorsStyle(
        kind=kind,
        blade=blade,
        handle=handle,
        width=length * between(rng, *widths),
        tip=between(rng, 0.006, 0.009) if kind == "school" else between(rng, 0.0008, 0.0028),
        belly=between(rng, 0.0, 0.35),
        thickness=length * between(rng, 0.009, 0.013),
        bevel=length * between(rng, 0.012, 0.028),
        curl=pick(rng, (-1, 1)) * between(rng, 0.0015, 0.0045) if curled else 0.0,
        main=main,
        other=other,
        ring=ring,
        height=height,
        gap=between(rng, 0.0005, 0.003),
        solid=not small,
        edge=height * between(rng, 0.2, 0.48) if plastic else 0.48 * height,
        neck=between(rng, 0.6, 0.8) if plastic else between(rng, 0.5, 0.65),
        broad=between(rng, 0.55, 0.72) if plastic else between(rng, 0.42, 0.55),
        slim=between(rng, 0.6, 1.0),
        waist=between(rng, 0.02, 0.2),
        heavy=between(rng, 0.0, 0.5),
        jaw=between(rng, 0.0025, 0.0045) if kind == "kitchen" and chance(rng, 0.6) else 0.0,
        splay=between(rng, 0.1, 1.0),
        lining=between(rng, 0.0015, 0.0028) if plastic and chance(rng, 0.4) else 0.0,
        rest=kind == "hair" and chance(rng, 0.75),
        upper=chance(rng, 0.08),
        screw=length * between(rng, 0.015, 0.026) if small else length * between(rng, 0.016, 0.03),
        slot=not plastic or chance(rng, 0.3),
        limit=float(np.radians(between(rng, 45, 62) if kind == "hair" else between(rng, 48, 75))),
        steel=steel,
        ground=ground,
        handle_look=handle_look,
        lining_look=Material(color=tinted(rng, pick(rng, _GRIPS)), roughness=0.7),
        screw_look=pick(rng, (bright, bright, steel, handle_look if plastic else bright)),
    )


def _ring(rng: np.random.Generator, kind: str, plastic: bool, length: float) -> float:
    if plastic:
        return length * between(rng, 0.026, 0.038)
    if kind == "tailor":
        return length * between(rng, 0.026, 0.034)
    return length * between(rng, 0.023, 0.033)


def _loops(
    rng: np.random.Generator, kind: str, handle: float, ring: float
) -> tuple[LoopStyle, LoopStyle]:
    """The main half's loop and the other's, which is smaller or alike."""
    if kind in ("nail", "embroidery", "hair"):
        radius = between(rng, 0.0095, 0.0125)
        oblong = between(rng, 1.0, 1.25)
        main = LoopStyle(
            radius * oblong, radius, (2.0, 2.0, 2.0, 2.0), between(rng, -0.25, 0.25), 0
        )
        if kind == "hair":
            less = between(rng, 0.86, 0.94)
            end = between(rng, 0.0, 0.12) * handle
            return main, LoopStyle(less * main.long, less * radius, main.exponents, main.turn, end)
        return main, main
    equal = kind == "school" and chance(rng, 0.35)
    long = 0.5 * handle * between(rng, 0.5, 0.66)
    wide = min(max(long * between(rng, 0.42, 0.6), 0.0105), 0.017)
    powers = tuple(between(rng, 1.9, 2.7) for _ in range(4))
    exponents = (powers[0], powers[1], powers[2], powers[3])
    main = LoopStyle(long, wide, exponents, between(rng, -0.02, 0.2), 0.0)
    if equal:
        return main, main
    shorter = between(rng, 0.55, 0.8)
    other_long = max(shorter * long, 0.011)
    end = between(rng, 0.0, 1.0) * 2 * (long - other_long)
    other_wide = min(wide * between(rng, 0.85, 1.05), other_long)
    other = LoopStyle(other_long, other_wide, exponents, between(rng, -0.05, 0.25), end)
    return main, other


def _steel(rng: np.random.Generator, kind: str) -> tuple[Material, Material]:
    """Blade, and its ground edge."""
    grey = between(rng, 0.6, 0.82)
    color = tinted(rng, (grey, grey, grey + 0.01), 0.015)
    image = brushed(rng, between(rng, 0.03, 0.12))
    if chance(rng, 0.5):
        image = worn(rng, image, between(rng, 0.2, 0.6))
    metallic, roughness = 0.85, between(rng, 0.3, 0.48)
    if kind in ("office", "kitchen", "school") and chance(rng, 0.1):  # coated
        color = pick(rng, ((0.07, 0.07, 0.075), (0.6, 0.48, 0.25), (0.06, 0.06, 0.07)))
        metallic = 0.5
    steel = Material(color=color, texture=seamless(image), roughness=roughness, metallic=metallic)
    bright = Material(
        color=(0.82, 0.82, 0.83), texture=seamless(image), roughness=0.36, metallic=0.8
    )
    return steel, bright


def _handle_look(rng: np.random.Generator, kind: str, plastic: bool, steel: Material) -> Material:
    if plastic:
        roughness = between(rng, 0.2, 0.6)
        return Material(color=tinted(rng, weighted(rng, _PLASTICS), 0.025), roughness=roughness)
    if kind == "tailor" and chance(rng, 0.55):  # enamelled
        color = pick(rng, ((0.04, 0.04, 0.04), (0.04, 0.04, 0.04), (0.45, 0.05, 0.05)))
        return Material(color=color, roughness=between(rng, 0.2, 0.5))
    if kind == "embroidery" and chance(rng, 0.6):
        return Material(color=tinted(rng, (0.8, 0.6, 0.25)), roughness=0.28, metallic=0.9)
    if kind in ("hair", "nail") and chance(rng, 0.15):
        color = pick(rng, ((0.05, 0.05, 0.055), (0.75, 0.5, 0.42), (0.2, 0.3, 0.55)))
        return Material(color=color, roughness=0.3, metallic=0.7)
    return steel
