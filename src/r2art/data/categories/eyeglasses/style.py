"""What a pair of glasses is like before it is built: measures, colours, materials."""

from dataclasses import dataclass

import numpy as np

from r2art.data.categories.eyeglasses.lenses import (
    LensLook,
    LensShape,
    sample_lens,
    sample_shape,
)
from r2art.data.procedural.randomness import (
    Color,
    between,
    chance,
    mixed,
    pick,
    spread,
    tinted,
    weighted,
)
from r2art.data.procedural.textures import Texture, seamless, smooth_noise
from r2art.data.shape import Material

BLACK: Color = (0.035, 0.035, 0.038)
TILE = 0.11  # m, of frame textures
_PLASTICS: dict[Color, float] = {
    BLACK: 9,
    (0.12, 0.07, 0.045): 2,  # dark brown
    (0.05, 0.07, 0.16): 2,  # navy
    (0.22, 0.22, 0.24): 1.5,
    (0.35, 0.03, 0.06): 1,
    (0.75, 0.1, 0.1): 0.5,
    (0.1, 0.25, 0.4): 0.7,
    (0.08, 0.2, 0.14): 0.7,
    (0.88, 0.88, 0.87): 0.8,
    (0.6, 0.45, 0.3): 0.4,
    (0.3, 0.12, 0.3): 0.5,
}
_CRYSTALS: tuple[Color, ...] = (
    (0.82, 0.84, 0.85),
    (0.85, 0.83, 0.78),
    (0.72, 0.74, 0.76),
    (0.86, 0.7, 0.68),
    (0.85, 0.74, 0.55),
    (0.6, 0.68, 0.74),
    (0.55, 0.42, 0.3),
)
_METALS: dict[Color, float] = {
    (0.78, 0.6, 0.32): 3,  # gold
    (0.72, 0.72, 0.74): 3,  # silver
    (0.3, 0.3, 0.32): 2.5,  # gunmetal
    (0.05, 0.05, 0.055): 3,  # black
    (0.78, 0.52, 0.44): 1,  # rose gold
    (0.35, 0.22, 0.14): 1,  # brown
}
_KINDS = {
    "plastic": 4.2,
    "wire": 2.6,
    "half": 1.0,
    "rimless": 0.8,
    "browline": 0.7,
    "sport": 0.9,
}


@dataclass(frozen=True)
class TempleStyle:
    """A temple: lengths along it and measures across (m), angles in radians."""

    length: float
    bend: float  # where it begins to drop behind the ear
    drop: float  # by how much
    heights: tuple[float, float, float]  # at the hinge, before the bend, at the tip
    thickness: float
    inward: float  # of the tip
    sleeve: float  # length of the plastic tip on a metal bar, 0 where there is none


@dataclass(frozen=True)
class GlassesStyle:
    """Measures (m) and looks of one pair of glasses."""

    kind: str
    width: float  # across both end pieces
    bridge: float  # between the lenses
    lens_width: float
    lens_height: float
    shape: LensShape
    lens: LensLook
    rim: float  # width seen from the front ...
    brow: float  # ... and above the lens
    flare: float  # more at the upper outer corner
    depth: float  # of the rim, from front to back
    curve: float  # radius of the front seen from above
    slant: float  # how far the front leans forward at its top, per metre of height
    hinge_height: float  # above the middle of the lens
    end_depth: float  # of the end pieces, behind the front
    temple: TempleStyle
    pads: str
    double_bridge: bool
    rivets: bool
    front_look: Material
    brow_look: Material
    temple_look: Material
    metal: Material
    tip_look: Material

    @property
    def center(self) -> float:
        """How far right of the middle the right lens is centred (m)."""
        return (self.bridge + self.lens_width) / 2

    @property
    def plastic(self) -> bool:
        """Whether the rims are plates rather than wires."""
        return self.kind in ("plastic", "sport")

    def front(self, x: float | np.ndarray, y: float | np.ndarray) -> np.ndarray:
        """z (m) of the middle of the bent front at a place seen from the front."""
        return np.asarray(-(np.asarray(x) ** 2) / (2 * self.curve) + self.slant * np.asarray(y))


def sample_style(rng: np.random.Generator) -> GlassesStyle:
    """Draw plastic, wire, half rim, rimless, browline or sports glasses."""
    kind = weighted(rng, _KINDS)
    shape = sample_shape(rng, kind)
    width = spread(rng, 0.139, 0.04, 0.126, 0.15)
    bridge = spread(rng, 0.021 if shape.name in ("round", "panto") else 0.0175, 0.12, 0.014, 0.024)
    ends = _ends(rng, kind, shape)
    lens_width = (width - bridge) / 2 - ends
    lens_height = float(np.clip(lens_width * shape.ratio, 0.028, 0.056))
    lens = sample_lens(rng, kind, shape)
    metal = _metal(rng)
    front, brow, temple_look = _looks(rng, kind, shape, metal)
    plates = kind in ("plastic", "sport")
    bold = between(rng, 0.0, 1.0)
    rim = 0.0016 + 0.0034 * bold if plates else between(rng, 0.0011, 0.0019)
    sporty = kind == "sport" or shape.name == "sport"
    temple = _temple(rng, "sport" if sporty else kind, bold, lens_height)
    return GlassesStyle(
        kind=kind,
        width=width,
        bridge=bridge,
        lens_width=lens_width,
        lens_height=lens_height,
        shape=shape,
        lens=lens,
        rim=rim,
        brow=rim * between(rng, 1.0, 1.6),
        flare=between(rng, 0.002, 0.006) if shape.name in ("cat", "butterfly") else 0.0,
        depth=between(rng, 0.0032, 0.0048) if plates else between(rng, 0.0016, 0.0024),
        curve=between(rng, 0.11, 0.16) if sporty else between(rng, 0.24, 0.55),
        slant=between(rng, 0.0, 0.12),
        hinge_height=lens_height / 2 * _hinge_share(rng, shape),
        end_depth=between(rng, 0.006, 0.01),
        temple=temple,
        pads="moulded" if plates and chance(rng, 0.8) else "arms",
        double_bridge=kind == "wire" and chance(rng, 0.8 if shape.name == "aviator" else 0.12),
        rivets=plates and chance(rng, 0.35),
        front_look=front,
        brow_look=brow,
        temple_look=temple_look,
        metal=metal,
        tip_look=_tip(rng, temple_look if plates else brow),
    )


def _ends(rng: np.random.Generator, kind: str, shape: LensShape) -> float:
    """Width (m) of rim and end piece beside each lens."""
    if shape.name in ("round", "panto", "hexagon"):
        return between(rng, 0.009, 0.0135)
    return between(rng, 0.006, 0.01) if kind in ("plastic", "sport") else between(rng, 0.004, 0.008)


def _hinge_share(rng: np.random.Generator, shape: LensShape) -> float:
    if shape.name in ("cat", "butterfly", "aviator"):
        return between(rng, 0.5, 0.75)
    if shape.name in ("round", "oval"):
        return between(rng, 0.1, 0.5)
    return between(rng, 0.3, 0.65)


def _temple(rng: np.random.Generator, kind: str, bold: float, lens_height: float) -> TempleStyle:
    length = spread(rng, 0.143, 0.025, 0.135, 0.15)
    bend = length - between(rng, 0.034, 0.05)
    drop = between(rng, 0.5, 0.85)
    if kind == "sport":
        high = between(rng, 0.009, 0.019)
        heights = (high, between(rng, 0.007, 0.011), between(rng, 0.007, 0.011))
        thickness, drop = between(rng, 0.0032, 0.0048), between(rng, 0.15, 0.45)
    elif kind == "plastic" or (kind == "browline" and chance(rng, 0.7)):
        high = 0.006 + 0.007 * bold + between(rng, 0.0, 0.004)
        if chance(rng, 0.12):
            high *= 1.6
        high = min(high, 0.5 * lens_height)
        heights = (
            high,
            min(high, between(rng, 0.0045, 0.0075)),
            between(rng, 0.006, 0.0095),
        )
        thickness = between(rng, 0.0026, 0.0042)
    else:
        high = between(rng, 0.0014, 0.0045)
        heights = (
            high,
            max(0.0013, high * between(rng, 0.5, 1.0)),
            between(rng, 0.0045, 0.007),
        )
        thickness = between(rng, 0.001, 0.0016)
        inward, sleeve = (
            between(rng, 0, 0.005),
            length - bend + between(rng, 0.012, 0.03),
        )
        return TempleStyle(length, bend, drop, heights, thickness, inward, sleeve)
    return TempleStyle(length, bend, drop, heights, thickness, between(rng, 0, 0.005), 0.0)


def _looks(
    rng: np.random.Generator, kind: str, shape: LensShape, metal: Material
) -> tuple[Material, Material, Material]:
    """Front, brow and temples."""
    plastic = _plastic(rng, kind)
    if kind in ("plastic", "sport"):
        other = _plastic(rng, kind) if chance(rng, 0.18) else plastic
        return plastic, plastic, other
    if shape.name == "sport":
        return plastic, plastic, plastic
    if kind == "browline":
        return metal, plastic, plastic
    if kind == "half" and chance(rng, 0.4):
        return plastic, plastic, metal
    return metal, plastic, metal


def _plastic(rng: np.random.Generator, kind: str) -> Material:
    roughness = between(rng, 0.45, 0.7) if chance(rng, 0.3) else between(rng, 0.1, 0.28)
    sort = weighted(rng, {"plain": 6, "tortoise": 2.6, "crystal": 1.4 if kind != "sport" else 0})
    if sort == "tortoise":
        return Material(color=(1, 1, 1), texture=_tortoise(rng), roughness=min(roughness, 0.35))
    if sort == "crystal":
        color = tinted(rng, pick(rng, _CRYSTALS), 0.03)
        return Material(color=color, roughness=between(rng, 0.08, 0.25), emission=0.07)
    return Material(color=tinted(rng, weighted(rng, _PLASTICS), 0.02), roughness=roughness)


def _metal(rng: np.random.Generator) -> Material:
    color = tinted(rng, weighted(rng, _METALS), 0.02)
    if max(color) < 0.12:  # lacquered
        return Material(color=color, roughness=between(rng, 0.25, 0.6))
    return Material(color=color, roughness=between(rng, 0.18, 0.4), metallic=0.9)


def _tip(rng: np.random.Generator, like: Material) -> Material:
    if chance(rng, 0.5):
        return like
    return Material(color=tinted(rng, BLACK, 0.02), roughness=between(rng, 0.2, 0.6))


def _tortoise(rng: np.random.Generator, size: int = 96) -> Texture:
    """Dark clouds in amber, as of horn or tortoise shell."""
    amber = pick(
        rng,
        ((0.62, 0.36, 0.13), (0.5, 0.26, 0.1), (0.7, 0.48, 0.24), (0.42, 0.22, 0.1)),
    )
    dark = mixed(amber, (0.05, 0.025, 0.015), between(rng, 0.8, 1.0))
    shape = (size, size)
    cells = int(rng.integers(6, 13))
    value = smooth_noise(rng, shape, (cells, cells)) + 0.5 * smooth_noise(rng, shape, (20, 20))
    share = np.clip((value - between(rng, 0.55, 0.85)) * between(rng, 2.5, 7) + 0.5, 0, 1)
    color = np.array(amber) + share[..., None] * (np.array(dark) - np.array(amber))
    return seamless((255 * color).astype(np.uint8))
