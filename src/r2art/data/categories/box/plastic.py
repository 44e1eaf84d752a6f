"""Boxes of plastic: toolboxes, hard cases, first-aid kits, lunch and storage boxes."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from r2art.data.categories.box import contents, fittings, grips, insets, latches, prints
from r2art.data.categories.box.metal import with_tray
from r2art.data.categories.box.shells import GAP, Box, Looks, Pieces, Shell, base, cap_lid
from r2art.data.procedural.hollow import collar
from r2art.data.procedural.materials import painted
from r2art.data.procedural.randomness import Color, between, chance, pick, spread, tinted, weighted
from r2art.data.procedural.solids import box, decal, plate, xyz
from r2art.data.shape import Material, Surface

_DARKS: tuple[Color, ...] = ((0.1, 0.1, 0.105), (0.14, 0.15, 0.17), (0.25, 0.26, 0.28))
_BRIGHTS: tuple[Color, ...] = (
    (0.95, 0.75, 0.1),
    (0.9, 0.4, 0.05),
    (0.8, 0.1, 0.1),
    (0.1, 0.3, 0.65),
    (0.15, 0.45, 0.25),
    (0.6, 0.62, 0.64),
)
_STEEL = Material(color=(0.66, 0.66, 0.68), roughness=0.3, metallic=0.9)


def _moulded(rng: np.random.Generator, colors: tuple[Color, ...], two_tone: float) -> Looks:
    body = painted(rng, colors, 0.0)
    lid = painted(rng, (*_DARKS, *_BRIGHTS), 0.0) if chance(rng, two_tone) else body
    return Looks(outside=body, inside=body, rim=body, metal=_STEEL, lid=lid, tile=0.3)


def _accent(rng: np.random.Generator) -> Material:
    return Material(color=tinted(rng, pick(rng, _BRIGHTS)), roughness=between(rng, 0.3, 0.5))


def _flange(shell: Shell, look: Material, wide: float, tall: float) -> Pieces:
    """Thick rims above and below the seam, less far out at the rear."""
    x, front, rear = shell.x + wide, shell.z + wide, -shell.z - 5e-4
    h = shell.height

    def rim(low: float, high: float) -> list[Surface]:
        corners = (-x, low, rear), (x, high, front)
        wall = wide + shell.wall
        return list(collar(*corners, wall, 1, look, radius=shell.radius + wide))

    return Pieces(rim(h - tall, h - 2e-4), rim(h + GAP, h + tall))


def _ribs(rng: np.random.Generator, shell: Shell, look: Material) -> Pieces:
    """Upright ribs on front and rear of the base, and lengthwise ones on the lid."""
    count, half = int(rng.integers(2, 5)), between(rng, 0.003, 0.008) * shell.scale
    z, rise = shell.z - shell.draft, 0.004 * shell.scale
    top = shell.height * between(rng, 0.6, 0.8)
    base_ribs, lid_ribs = [], []
    reach = 0.36 * shell.width
    for x in np.linspace(-reach, reach, 2 * count) if count < 4 else (-reach, reach):
        low, high = (x - half, 0.01, z - 0.002), (x + half, top, z + rise + 0.5 * shell.draft)
        base_ribs += plate(low, high, 2, look, bevel=(0.0, 0.4 * rise))
        low, high = (x - half, 0.01, -z - rise), (x + half, top, -z + 0.002)
        base_ribs += plate(low, high, 2, look, bevel=(0.4 * rise, 0.0))
    for x in np.linspace(-reach, reach, count):
        low = (x - half, shell.top - 0.002, -0.8 * shell.z)
        high = (x + half, shell.top + rise, 0.8 * shell.z)
        lid_ribs += plate(low, high, 1, look, bevel=(0.0, 0.4 * rise))
    return Pieces(base_ribs, lid_ribs)


def toolbox(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """A grip and recesses on the lid, bright clips, often a tray under the lid."""
    del photos
    width = spread(rng, 0.41, 0.16, 0.28, 0.58)
    depth = width * between(rng, 0.46, 0.56)
    height = depth * between(rng, 0.75, 1.0)
    lid = between(rng, 0.22, 0.36)
    shell = Shell(
        width=width,
        depth=depth,
        height=height * (1 - lid),
        lid=height * lid,
        wall=0.003,
        radius=between(rng, 0.012, 0.03),
        edge=between(rng, 0.004, 0.012),
        draft=between(rng, 0.003, 0.012),
    )
    looks = _moulded(rng, (*_DARKS, *_DARKS, *_BRIGHTS), 0.55)
    bright = _accent(rng)
    pieces = Pieces(base(shell, looks), cap_lid(shell, looks))
    pieces += _flange(shell, looks.outside if chance(rng, 0.5) else looks.lid, 0.004, 0.009)
    length, reach = between(rng, 0.36, 0.55) * width, between(rng, 0.028, 0.045)
    pieces += grips.grip(
        rng, shell, bright if chance(rng, 0.6) else looks.lid, length=length, reach=reach
    )
    pieces += _organisers(rng, shell, length)
    for x in (-0.3, 0.3) if chance(rng, 0.8) else (0.0,):
        wide = between(rng, 0.02, 0.032)
        pieces += latches.clip(shell, bright, at=x * width, wide=wide, out=0.004)
    if chance(rng, 0.6):
        pieces += _ribs(rng, shell, looks.outside)
    pieces += fittings.hinges(rng, shell, looks.outside, looks.outside)
    if chance(rng, 0.75):
        pieces += Pieces([_badge(rng, shell)])
    if chance(rng, 0.85):
        pieces += Pieces(with_tray(rng, shell))
    return Box(pieces, fittings.pivot(shell), between(rng, 1.75, 2.6))


def _badge(rng: np.random.Generator, shell: Shell) -> Surface:
    color = pick(rng, (*_BRIGHTS, *_DARKS))
    look = Material(color=(1, 1, 1), texture=prints.brand(rng, 2.6, color), roughness=0.35)
    lower, upper = shell.base_box
    wide = between(rng, 0.2, 0.32) * shell.width
    at = (0.5, between(rng, 0.42, 0.55))
    return decal(lower, upper, "front", look, at=at, size=(wide, wide / 2.6), lift=1e-3)


def _organisers(rng: np.random.Generator, shell: Shell, length: float) -> Pieces:
    """Small bins under clear covers on both ends of the lid."""
    room = shell.x - length / 2 - 0.012
    if room < 0.04 or chance(rng, 0.5):
        return Pieces()
    clear = Material(color=(0.35, 0.37, 0.4), roughness=0.08)
    line = Material(color=(0.1, 0.1, 0.1), roughness=0.6)
    pieces: list[Surface] = []
    for sign in (-1, 1):
        x0, x1 = sorted((sign * (shell.x - 0.015), sign * (length / 2 + 0.01)))
        low = (x0, shell.top - 0.002, -0.75 * shell.z)
        high = (x1, shell.top + 0.004, 0.75 * shell.z)
        pieces += plate(low, high, 1, clear, radius=0.006, bevel=(0, 0.003))
        for z in (-0.25, 0.25):
            pieces.append(decal(low, high, "top", line, at=(0.5, 0.5 + z), size=(x1 - x0, 0.002)))
    return Pieces(lid=pieces)


def hard_case(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """For cameras, instruments, power tools: ribbed, foam inside, carried by its front."""
    del photos
    width = spread(rng, 0.36, 0.24, 0.2, 0.56)
    height = width * between(rng, 0.26, 0.42)
    lid = between(rng, 0.3, 0.46)
    shell = Shell(
        width=width,
        depth=width * between(rng, 0.66, 0.82),
        height=height * (1 - lid),
        lid=height * lid,
        wall=0.004,
        radius=between(rng, 0.012, 0.035),
        edge=between(rng, 0.003, 0.012),
        draft=between(rng, 0.0, 0.008),
    )
    looks = _moulded(rng, (*(3 * _DARKS), *_BRIGHTS), 0.15)
    pieces = Pieces(base(shell, looks), cap_lid(shell, looks))
    pieces += _flange(shell, looks.outside, 0.006, between(rng, 0.007, 0.014))
    if chance(rng, 0.75):
        pieces += _ribs(rng, shell, looks.outside)
    clip_look = looks.outside if chance(rng, 0.55) else _accent(rng)
    for x in (-0.33, 0.33):
        pieces += latches.clip(shell, clip_look, at=x * width, out=0.006)
    pieces += grips.case_handle(
        shell, looks.outside, looks.outside, length=between(rng, 0.28, 0.36) * width
    )
    pieces += fittings.hinges(rng, shell, looks.outside, looks.outside)
    pieces += Pieces(lid=_foam_lid(rng, shell))
    if chance(rng, 0.55):
        top = (xyz(-shell.x, 0, -shell.z), xyz(shell.x, shell.top, shell.z))
        name = Material(color=(1, 1, 1), texture=prints.brand(rng, 2.2, pick(rng, _DARKS)))
        wide = 0.28 * width
        pieces += Pieces(
            lid=[decal(*top, "top", name, size=(wide, wide / 2.2), lift=0.0045 * shell.scale)]
        )
    fill = insets.equipment if chance(rng, 0.75) else insets.tools
    if chance(rng, 0.92):
        pieces += Pieces(fill(rng, *shell.inside))
    return Box(pieces, fittings.pivot(shell), between(rng, 1.66, 2.6))


def _foam_lid(rng: np.random.Generator, shell: Shell) -> list[Surface]:
    """A slab of foam under the lid, in pyramids if it is egg-crate."""
    shade = between(rng, 0.1, 0.2)
    look = Material(color=(shade, shade, shade), roughness=1.0)
    low, high = shell.ceiling
    deep = 0.6 * (shell.lid - shell.wall)
    inset = xyz(0.003, 0, 0.003)
    y = low[1]
    if chance(rng, 0.4):
        return [box(low + inset - xyz(0, deep, 0), high * (1, 0, 1) + xyz(0, y, 0) - inset, look)]
    return [insets.egg_crate(low + inset, high - inset, y - deep, y - 0.3 * deep, look)]


def first_aid_kit(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """White, green, red or orange, a cross on its lid, often a handle."""
    del photos
    width = spread(rng, 0.26, 0.18, 0.16, 0.38)
    height = width * between(rng, 0.3, 0.42)
    lid = between(rng, 0.3, 0.5)
    shell = Shell(
        width=width,
        depth=width * between(rng, 0.62, 0.8),
        height=height * (1 - lid),
        lid=height * lid,
        wall=0.0025,
        radius=between(rng, 0.006, 0.035),
        edge=between(rng, 0.002, 0.012),
    )
    colors: tuple[Color, ...] = ((0.92, 0.92, 0.91), (0.92, 0.92, 0.91), (0.8, 0.08, 0.1))
    body = painted(rng, (*colors, (0.1, 0.45, 0.28), (0.92, 0.45, 0.1)), 0.0)
    inside = body if chance(rng, 0.6) else Material(color=(0.9, 0.9, 0.9), roughness=0.5)
    looks = Looks(outside=body, inside=inside, rim=body, metal=_STEEL, lid=body, tile=0.3)
    pieces = Pieces(base(shell, looks), cap_lid(shell, looks))
    low, high = shell.ceiling
    art = Material(color=(1, 1, 1), texture=prints.cross(rng, 1.25, body.color), roughness=0.35)
    tall = between(rng, 0.65, 0.95) * (high[2] - low[2])
    size = (min(1.25 * tall, high[0] - low[0]), tall)
    pieces += Pieces(lid=[decal(low, high, "top", art, size=size, lift=3e-4)])
    if chance(rng, 0.6):
        pieces += grips.case_handle(shell, body, body, length=between(rng, 0.28, 0.4) * width)
    maker = pick(rng, (latches.clip, latches.draw_latch))
    look = body if maker is latches.clip else _STEEL
    for x in (-0.32, 0.32):
        pieces += maker(shell, look, at=x * width)
    pieces += fittings.hinges(rng, shell, looks.outside, looks.outside)
    if chance(rng, 0.9):
        pieces += Pieces(contents.medical(rng, *shell.inside))
    return Box(pieces, fittings.pivot(shell), between(rng, 1.75, 3.1))


def food_box(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """A lunch box: soft corners, one or two clips, a picture or a plain lid."""
    width = between(rng, 0.15, 0.23)
    height = between(rng, 0.05, 0.085)
    lid = between(rng, 0.2, 0.4)
    shell = Shell(
        width=width,
        depth=width * between(rng, 0.6, 0.85),
        height=height * (1 - lid),
        lid=height * lid,
        wall=0.002,
        radius=between(rng, 0.015, 0.04),
        edge=between(rng, 0.004, 0.014),
        draft=between(rng, 0.0, 0.005),
    )
    pale: tuple[Color, ...] = ((0.92, 0.92, 0.9), (0.65, 0.8, 0.85), (0.9, 0.7, 0.75))
    looks = _moulded(rng, (*pale, (0.7, 0.85, 0.7), *_BRIGHTS), 0.5)
    pieces = Pieces(base(shell, looks), cap_lid(shell, looks))
    if chance(rng, 0.65):
        low, high = shell.ceiling
        size = (0.9 * (high[0] - low[0]), 0.9 * (high[2] - low[2]))
        draw = prints.pattern if chance(rng, 0.3) else None
        ground = looks.lid.color
        aspect = size[0] / size[1]
        image = draw(rng, aspect, ground) if draw else prints.picture(rng, aspect, ground, photos)
        art = Material(color=(1, 1, 1), texture=image, roughness=0.35)
        pieces += Pieces(lid=[decal(low, high, "top", art, size=size)])
    bright = _accent(rng)
    places = (0.0,) if chance(rng, 0.6) else (-0.25, 0.25)
    for x in places:
        pieces += latches.clip(shell, bright, at=x * width, wide=0.02)
    pieces += fittings.hinges(rng, shell, looks.lid, looks.outside)
    if chance(rng, 0.85):
        pieces += Pieces(contents.lunch(rng, *shell.inside))
    return Box(pieces, fittings.pivot(shell), between(rng, 1.75, 3.1))


def storage_box(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """A milky or coloured bin with a flat hinged lid and side clips, for toys and papers."""
    del photos
    width = spread(rng, 0.38, 0.25, 0.2, 0.6)
    depth = width * between(rng, 0.62, 0.8)
    shell = Shell(
        width=width,
        depth=depth,
        height=depth * between(rng, 0.45, 0.8),
        lid=between(rng, 0.014, 0.03),
        wall=0.0025,
        radius=between(rng, 0.02, 0.04),
        edge=between(rng, 0.004, 0.01),
        draft=between(rng, 0.006, 0.02),
    )
    milky: tuple[Color, ...] = ((0.86, 0.88, 0.89), (0.86, 0.88, 0.89), (0.8, 0.85, 0.9))
    looks = _moulded(rng, (*milky, *_DARKS, *_BRIGHTS), 0.6)
    pieces = Pieces(base(shell, looks), cap_lid(shell, looks))
    pieces += _flange(shell, looks.lid, 0.005, min(0.007, 0.4 * shell.lid))
    bright = _accent(rng)
    for x in (-0.25, 0.25):
        pieces += latches.clip(shell, bright, at=x * width, wide=0.022, out=0.005)
    if chance(rng, 0.5):
        pieces += Pieces([_badge(rng, shell)])
    pieces += fittings.hinges(rng, shell, looks.lid, looks.outside)
    if chance(rng, 0.9):
        fills = {contents.toys: 3.0, contents.household: 3.0, contents.papers: 1.0}
        pieces += Pieces(weighted(rng, fills)(rng, *shell.inside))
    return Box(pieces, fittings.pivot(shell), between(rng, 1.75, 3.2))
