"""Laptops, from the thick ones of 2002 to today's."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from r2art.core.category import Joint, Mirror
from r2art.data.categories.laptop.keyboards import DeckStyle, deck
from r2art.data.categories.laptop.ports import feet, ports
from r2art.data.categories.laptop.screens import screen_texture
from r2art.data.categories.laptop.style import BLACK, LaptopStyle, sample_style
from r2art.data.procedural.assembly import assembled
from r2art.data.procedural.randomness import Color, between, chance, pick, tinted
from r2art.data.procedural.solids import box, cylinder, decal, plate, xyz
from r2art.data.procedural.textures import lid_back, sticker_image
from r2art.data.shape import Instance, Material, Surface
from r2art.data.staging import Staging

STAGING = Staging()

MIRROR = Mirror(swap=(0, 1))


@dataclass(frozen=True)
class _Hinge:
    """Where the lid turns (m; y = 0 is the base's underside, z = 0 its middle), and its look."""

    y: float
    z: float
    radius: float
    kind: str


def generate(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Instance:
    """A laptop: ``base`` and ``lid``, closed at rest; ``photos`` may appear on its screen."""
    shape_rng, look_rng, screen_rng = rng.spawn(3)
    style = sample_style(shape_rng)
    hinge = _hinge(shape_rng, style)
    joint = Joint(
        name="hinge",
        kind="revolute",
        parent=0,
        axis=(-1.0, 0.0, 0.0),
        pivot=(0.0, hinge.y, hinge.z),
        limits=(0.0, float(np.clip(shape_rng.normal(2.3, 0.12), 2.0, 2.6))),
    )
    base = [*_base(look_rng, style, hinge), *ports(look_rng, style), *feet(look_rng, style)]
    base = [_wedged(s, style) for s in base]
    lid = _lid(look_rng, screen_rng, style, hinge, photos)
    return assembled("laptop", {"base": base, "lid": lid}, [joint])


def _hinge(rng: np.random.Generator, style: LaptopStyle) -> _Hinge:
    kinds = ("barrels", "barrels", "bar", "full") if style.age < 0.65 else ("full", "bar", "hidden")
    radius = float(np.clip(style.lid_thickness * between(rng, 0.35, 0.6), 0.0022, 0.006))
    return _Hinge(
        y=style.thickness + style.gap + style.lid_thickness * between(rng, 0.0, 0.45),
        z=-style.depth / 2 + style.hinge_inset + between(rng, 0.0, 1.2) * radius,
        radius=radius,
        kind=pick(rng, kinds),
    )


def _wedged(surface: Surface, style: LaptopStyle) -> Surface:
    """Thin the base towards the front by lifting its underside."""
    if not style.wedge:
        return surface
    x, y, z = surface.vertices.T
    share = np.clip(z / style.depth + 0.5, 0, 1)
    y = y + style.wedge * share * (1 - y / style.thickness)
    return replace(surface, vertices=np.stack([x, y, z], axis=-1))


def _base(rng: np.random.Generator, style: LaptopStyle, hinge: _Hinge) -> list[Surface]:
    half = np.array([style.width / 2, 0.0, style.depth / 2])
    top_edge = between(rng, 0.0004, 0.0035)
    low_edge = min(between(rng, 0.001, 0.009), 0.4 * style.thickness)
    deck_style = DeckStyle(
        width=style.width,
        depth=style.depth - style.hinge_inset,
        age=style.age,
        color=style.deck_color,
        key_color=_key_color(rng, style),
        well_color=tinted(rng, pick(rng, (BLACK, style.deck_color)), 0.03),
    )
    look = Material(
        texture=deck(rng, deck_style), color=(1, 1, 1), roughness=between(rng, 0.35, 0.7)
    )
    seam = style.thickness * between(rng, 0.35, 0.75)
    upper_y = np.array([0.0, style.thickness, 0.0])
    cut = np.array([0.0, seam, 0.0])
    lower = plate(-half, half + cut, 1, style.underside, radius=style.corner, bevel=(low_edge, 0.0))
    upper = plate(
        -half + cut, half + upper_y, 1, style.inside, radius=style.corner, bevel=(0.0, top_edge)
    )
    front = -half + xyz(0, 0, style.hinge_inset)
    inner = 2 * top_edge + 0.0006
    face = decal(
        front,
        half + upper_y,
        "top",
        look,
        size=(style.width - inner, style.depth - style.hinge_inset - inner),
    )
    pieces = [*lower, *upper, face, *_hinge_pieces(rng, style, hinge)]
    if chance(rng, 0.2):  # a line of another colour around the seam
        rim = (-half + cut - xyz(2e-4, 5e-4, 2e-4), half + cut + xyz(2e-4, 1e-3, 2e-4))
        pieces += plate(*rim, 1, style.accent, radius=style.corner)
    return pieces


def _key_color(rng: np.random.Generator, style: LaptopStyle) -> Color:
    roll = rng.random()
    if roll < 0.68:
        return tinted(rng, BLACK, 0.02)
    if roll < 0.85:
        return tinted(rng, style.deck_color, 0.05)
    return tinted(rng, (0.85, 0.85, 0.83) if roll < 0.94 else (0.3, 0.3, 0.32), 0.03)


def _hinge_pieces(rng: np.random.Generator, style: LaptopStyle, hinge: _Hinge) -> list[Surface]:
    look = pick(rng, (style.inside, style.outside, Material(color=BLACK, roughness=0.5)))
    center = np.array([0.0, hinge.y, hinge.z])
    pieces: list[Surface] = []
    if hinge.kind == "barrels":
        at, long = style.width * between(rng, 0.28, 0.42), between(rng, 0.018, 0.05)
        for x in (-at, at):
            pieces += cylinder(center + xyz(x, 0, 0), 0, hinge.radius, long, look, bevel=5e-4)
    elif hinge.kind in ("bar", "full"):
        share = between(rng, 0.45, 0.7) if hinge.kind == "bar" else between(rng, 0.75, 0.92)
        pieces += cylinder(center, 0, hinge.radius, style.width * share, look, bevel=5e-4)
    raised = style.hinge_inset - hinge.radius - 0.004
    if raised > 0.006 and style.age < 0.65 and chance(rng, 0.6):
        lower = (-style.width / 2 + 0.002, style.thickness - 0.002, -style.depth / 2 + 0.002)
        height = style.gap + style.lid_thickness * between(rng, 0.4, 1.0)
        upper = (style.width / 2 - 0.002, style.thickness + height, -style.depth / 2 + raised)
        pieces += plate(lower, upper, 1, look, radius=0.004, bevel=(0.0, 0.003))
    return pieces


def _lid(
    rng: np.random.Generator,
    screen_rng: np.random.Generator,
    style: LaptopStyle,
    hinge: _Hinge,
    photos: Sequence[Path],
) -> list[Surface]:
    half_width = style.width / 2 - (between(rng, 0.0, 0.003) if chance(rng, 0.4) else 0.0)
    behind = hinge.radius * between(rng, -0.6, 1.0)
    if style.hinge_inset == 0.0 and chance(rng, 0.25):  # the lid drops behind the base
        behind = style.lid_thickness * between(rng, 0.5, 1.3)
    bottom = style.thickness + style.gap
    lower = np.array([-half_width, bottom, hinge.z - behind])
    front = style.depth / 2 - between(rng, -0.0005, 0.003)
    upper = np.array([half_width, bottom + style.lid_thickness, front])
    edge = between(rng, 0.0006, 0.6 * style.lid_thickness)
    back = style.outside
    if chance(rng, 0.85):
        color = style.outside.color
        image = lid_back(rng, 2 * half_width, upper[2] - lower[2], color, _sticker_count(rng))
        back = replace(style.outside, color=(1, 1, 1), texture=image)
    shell = plate(
        lower,
        upper,
        1,
        style.outside,
        radius=style.corner,
        bevel=(0.0003, edge),
        top=back,
        bottom=style.bezel_material,
    )
    return [*shell, *_screen(rng, screen_rng, style, lower, upper, photos)]


def _sticker_count(rng: np.random.Generator) -> int:
    return int(rng.integers(1, 12)) if chance(rng, 0.1) else 0


def _screen(
    rng: np.random.Generator,
    screen_rng: np.random.Generator,
    style: LaptopStyle,
    lower: np.ndarray,
    upper: np.ndarray,
    photos: Sequence[Path],
) -> list[Surface]:
    """The screen and what surrounds it, on the underside of the closed lid."""
    side, top, _ = style.bezel
    wide = upper[0] - lower[0] - 2 * side
    tall = (upper[2] - lower[2]) - style.bezel[1] - style.bezel[2]
    up = 1 - (top + tall / 2) / (upper[2] - lower[2])
    on = chance(screen_rng, 0.72)
    image = screen_texture(screen_rng, photos, wide / tall) if on else None
    look = Material(
        color=(1.0, 1.0, 1.0) if on else tinted(rng, (0.035, 0.035, 0.04), 0.012),
        texture=image,
        roughness=between(rng, 0.08, 0.3) if style.age > 0.4 else between(rng, 0.3, 0.6),
        emission=between(rng, 0.45, 1.15) if on else 0.0,
    )
    rim = Material(color=(0.02, 0.02, 0.022), roughness=0.6)
    line = between(rng, 0.001, 0.003)
    place = (lower, upper, "bottom")
    pieces = [
        decal(*place, rim, at=(0.5, up), size=(wide + 2 * line, tall + 2 * line), lift=1.5e-4),
        decal(*place, look, at=(0.5, up), size=(wide, tall), lift=3.2e-4),
    ]
    depth = upper[2] - lower[2]
    if style.age > 0.35 and chance(rng, 0.85):  # the camera
        spot = Material(color=(0.01, 0.01, 0.02), roughness=0.1)
        at = (0.5, 1 - 0.5 * top / depth)
        pieces.append(decal(*place, spot, at=at, size=(0.004, min(0.004, 0.6 * top)), lift=3e-4))
    if style.bezel[2] > 0.012 and chance(rng, 0.6):
        name = Material(
            color=(1, 1, 1), texture=sticker_image(rng, style.bezel_material.color), roughness=0.4
        )
        high = min(0.009, 0.5 * style.bezel[2])
        at = (0.5, 0.5 * style.bezel[2] / depth)
        pieces.append(decal(*place, name, at=at, size=(4 * high, high), lift=3e-4))
    if style.age < 0.4 and chance(rng, 0.6):  # the hook of the latch
        hook = np.array([0.0, lower[1], upper[2] - 0.004])
        pieces.append(
            box(hook - xyz(0.006, 3e-4, 0.001), hook + xyz(0.006, 0, 0.001), style.inside)
        )
    if style.age < 0.6:  # rubber bumpers
        for x in (0.03, 0.97):
            at = (x, 1 - 0.3 * top / depth)
            pieces.append(decal(*place, rim, at=at, size=(0.006, min(0.006, 0.4 * top)), lift=3e-4))
    return pieces
