"""Boxes of sheet metal: cash boxes, pencil and biscuit tins, lunch tins, steel toolboxes."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from r2art.data.categories.box import contents, fittings, grips, insets, latches, prints
from r2art.data.categories.box.shells import (
    Box,
    Looks,
    Pieces,
    Shell,
    base,
    cap_lid,
    roofed,
    vault_lid,
)
from r2art.data.procedural.hollow import tub
from r2art.data.procedural.materials import painted
from r2art.data.procedural.randomness import Color, between, chance, pick, spread, tinted, weighted
from r2art.data.procedural.solids import decal, plate, xyz
from r2art.data.procedural.textures import brushed
from r2art.data.shape import Material, Surface

_CHROME = Material(color=(0.72, 0.72, 0.73), roughness=0.22, metallic=0.95)
_BLACK = Material(color=(0.06, 0.06, 0.065), roughness=0.5)
_ENAMELS: tuple[Color, ...] = (
    (0.75, 0.08, 0.08),
    (0.1, 0.22, 0.5),
    (0.1, 0.1, 0.11),
    (0.55, 0.57, 0.6),
    (0.12, 0.3, 0.2),
    (0.9, 0.9, 0.88),
    (0.85, 0.55, 0.6),
)


def _tin_plate(rng: np.random.Generator) -> Material:
    """Bare inside of a tin."""
    return Material(
        color=(0.68, 0.68, 0.69),
        texture=brushed(rng, 0.05, 96),
        roughness=between(rng, 0.25, 0.4),
        metallic=0.85,
    )


def _enamelled(rng: np.random.Generator, colors: tuple[Color, ...]) -> Looks:
    body = painted(rng, colors, 0.0)
    inside = body if chance(rng, 0.5) else painted(rng, ((0.6, 0.6, 0.6), (0.15, 0.15, 0.15)), 0.0)
    return Looks(outside=body, inside=inside, rim=body, metal=_CHROME, lid=body, tile=0.3)


def cash_box(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """Painted steel with a lock in front, a bail on the lid and a tray of coins."""
    del photos
    width = spread(rng, 0.25, 0.2, 0.15, 0.36)
    height = between(rng, 0.075, 0.1)
    lid = between(rng, 0.22, 0.42)
    shell = Shell(
        width=width,
        depth=width * between(rng, 0.66, 0.85),
        height=height * (1 - lid),
        lid=height * lid,
        wall=0.0015,
        radius=between(rng, 0.002, 0.012),
        edge=between(rng, 0.001, 0.006),
    )
    looks = _enamelled(rng, _ENAMELS)
    pieces = Pieces(base(shell, looks), cap_lid(shell, looks))
    if chance(rng, 0.4):  # a pressed rim on the lid
        inset = xyz(0.022, 0, 0.022)
        low, high = shell.lid_box
        low = low * (1, 0, 1) + xyz(0, shell.top - 0.001, 0) + inset
        rim = plate(
            low, high - inset + xyz(0, 0.0012, 0), 1, looks.lid, radius=0.008, bevel=(0, 1e-3)
        )
        pieces += Pieces(lid=[*rim])
    pieces += fittings.hinges(rng, shell, looks.outside, looks.outside)
    pieces += latches.key_lock(shell, _CHROME)
    if chance(rng, 0.85):
        pieces += grips.bail(rng, shell, _CHROME, _BLACK)
    if chance(rng, 0.3):
        low, high = shell.base_box
        sticker = Material(color=(1, 1, 1), texture=prints.brand(rng, 2.5, (0.9, 0.9, 0.9)))
        at = (between(rng, 0.12, 0.25), 0.5)
        size = (0.12 * width, 0.05 * width)
        pieces += Pieces([decal(low, high, "front", sticker, at=at, size=size)])
    if chance(rng, 0.85):
        pieces += Pieces(insets.money(rng, *shell.inside))
    return Box(pieces, fittings.pivot(shell), between(rng, 1.66, 2.3))


def tin(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """Printed tin plate with round corners: for pencils, mints, tea, biscuits."""
    kind = weighted(rng, {"pencils": 3, "mints": 1.6, "biscuits": 2.4})
    width, depth, height = {
        "pencils": (between(rng, 0.175, 0.22), between(rng, 0.065, 0.1), between(rng, 0.02, 0.04)),
        "mints": (between(rng, 0.085, 0.11), between(rng, 0.055, 0.075), between(rng, 0.018, 0.03)),
        "biscuits": (between(rng, 0.15, 0.28), between(rng, 0.11, 0.2), between(rng, 0.05, 0.13)),
    }[kind]
    depth = min(depth, 0.9 * width)
    lid = between(rng, 0.2, 0.35) if kind == "biscuits" else between(rng, 0.3, 0.5)
    shell = Shell(
        width=width,
        depth=depth,
        height=height * (1 - lid),
        lid=height * lid,
        wall=0.0008,
        radius=between(rng, 0.1, 0.25) * depth,
        edge=min(between(rng, 0.001, 0.004), 0.3 * height * lid),
    )
    bare = _tin_plate(rng)
    color = prints.paper_color(rng)
    plain = chance(rng, 0.25)
    skin = bare if plain else Material(color=color, roughness=between(rng, 0.2, 0.4))
    looks = Looks(outside=skin, inside=bare, rim=bare, metal=bare, lid=skin, tile=0.2)
    pieces = Pieces(base(shell, looks), cap_lid(shell, looks))
    low, high = shell.ceiling
    size = (high[0] - low[0] - 0.002, high[2] - low[2] - 0.002)
    ground = (0.62, 0.62, 0.63) if plain else color
    maker = weighted(rng, {"picture": 3, "vintage": 2.5, "pattern": 2, "brand": 2.5})
    draw = {"vintage": prints.vintage, "pattern": prints.pattern, "brand": prints.brand}
    aspect = size[0] / size[1]
    image = (
        prints.picture(rng, aspect, ground, photos)
        if maker == "picture"
        else draw[maker](rng, aspect, ground)
    )
    art = Material(color=(1, 1, 1), texture=image, roughness=between(rng, 0.2, 0.4))
    pieces += Pieces(lid=[decal(low, high, "top", art, size=size, lift=2e-4)])
    if not plain and shell.height > 0.03 and chance(rng, 0.7):
        lower, upper = shell.base_box
        size = (shell.width - 2 * shell.radius, shell.height - 2 * shell.edge)
        band = prints.brand(rng, size[0] / size[1], color)
        front = Material(color=(1, 1, 1), texture=band, roughness=art.roughness)
        pieces += Pieces([decal(lower, upper, "front", front, size=size, lift=2e-4)])
    pieces += _tin_hinge(shell, bare)
    if chance(rng, 0.5):
        pieces += latches.lip(shell, skin, 0.025)
    fills = {
        "pencils": {insets.pencils: 1},
        "mints": {contents.toys: 1, contents.tissue: 1, insets.jewels: 0.5},
        "biscuits": {
            insets.spools: 1.5,
            contents.papers: 1,
            contents.toys: 1,
            contents.tissue: 1,
        },
    }[kind]
    if chance(rng, 0.85):
        pieces += Pieces(weighted(rng, fills)(rng, *shell.inside))
    return Box(pieces, fittings.pivot(shell), between(rng, 1.75, 3.1))


def _tin_hinge(shell: Shell, look: Material) -> Pieces:
    """Two short rolled tabs."""
    pieces: list[Surface] = []
    y, z = fittings.pivot(shell)
    half, r = 0.06 * shell.width, 0.0022 * max(shell.scale, 0.5)
    for x in (-0.24, 0.24):
        low = (x * shell.width - half, y - r, z - r)
        pieces += plate(low, (x * shell.width + half, y + r, z + 1.5 * r), 0, look, radius=r)
    return Pieces(pieces)


def lunch_tin(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """A printed lunch box on its back, its handle and latch at the front."""
    width = between(rng, 0.17, 0.23)
    depth = width * between(rng, 0.68, 0.85)
    height = between(rng, 0.07, 0.1)
    lid = between(rng, 0.4, 0.5)
    shell = Shell(
        width=width,
        depth=depth,
        height=height * (1 - lid),
        lid=height * lid,
        wall=0.001,
        radius=between(rng, 0.015, 0.035),
        edge=between(rng, 0.002, 0.008),
    )
    color = prints.paper_color(rng)
    skin = Material(color=color, roughness=between(rng, 0.2, 0.4))
    bare = _tin_plate(rng)
    looks = Looks(outside=skin, inside=bare, rim=bare, metal=_CHROME, lid=skin, tile=0.2)
    pieces = Pieces(base(shell, looks), cap_lid(shell, looks))
    low, high = shell.ceiling
    size = (high[0] - low[0], high[2] - low[2])
    image = prints.picture(rng, size[0] / size[1], color, photos)
    art = Material(color=(1, 1, 1), texture=image, roughness=0.3)
    pieces += Pieces(lid=[decal(low, high, "top", art, size=size, lift=2e-4)])
    plastic = Material(
        color=tinted(rng, pick(rng, (*prints.VIVID, (0.1, 0.1, 0.1)))), roughness=0.4
    )
    pieces += grips.case_handle(shell, plastic, _CHROME, length=between(rng, 0.07, 0.09))
    pieces += fittings.hinges(rng, shell, _CHROME, looks.outside)
    for x in (-0.36, 0.36):
        pieces += latches.draw_latch(shell, _CHROME, at=x * (width - 2 * shell.radius))
    if chance(rng, 0.7):
        fills = {contents.lunch: 3, contents.toys: 1, insets.pencils: 0.7}
        pieces += Pieces(weighted(rng, fills)(rng, *shell.inside))
    return Box(pieces, fittings.pivot(shell), between(rng, 1.75, 3.1))


def steel_toolbox(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """Long, with a hipped or flat lid, a handle on it and one or two catches."""
    del photos
    width = spread(rng, 0.42, 0.14, 0.32, 0.56)
    depth = width * between(rng, 0.4, 0.52)
    height = depth * between(rng, 0.75, 1.05)
    lid = between(rng, 0.28, 0.42)
    shell = Shell(
        width=width,
        depth=depth,
        height=height * (1 - lid),
        lid=height * lid,
        wall=0.002,
    )
    colors = ((0.75, 0.08, 0.08), (0.75, 0.08, 0.08), (0.12, 0.25, 0.5), (0.3, 0.31, 0.33))
    looks = _enamelled(rng, (*colors, (0.1, 0.1, 0.1), (0.9, 0.6, 0.1), (0.15, 0.32, 0.2)))
    profile = roofed(shell, shell.lid * between(rng, 0.25, 0.5), between(rng, 0.3, 0.65))
    pieces = Pieces(base(shell, looks), vault_lid(shell, looks, profile))
    pieces += fittings.hinges(rng, shell, _CHROME, looks.outside)
    for x in (-0.28, 0.28) if chance(rng, 0.6) else (0.0,):
        maker = latches.draw_latch if chance(rng, 0.6) else None
        pieces += (
            maker(shell, _CHROME, at=x * width)
            if maker
            else latches.hasp(rng, shell, _CHROME, at=x * width, locked=chance(rng, 0.3))
        )
    look = _BLACK if chance(rng, 0.6) else _CHROME
    length, reach = 0.38 * width, between(rng, 0.03, 0.045)
    pieces += grips.grip(rng, shell, look, length=length, reach=reach)
    if chance(rng, 0.7):
        lower, upper = shell.base_box
        image = prints.brand(rng, 3.0, looks.outside.color)
        name = Material(color=(1, 1, 1), texture=image, roughness=0.4)
        size = (0.3 * width, 0.1 * width)
        at = (0.5, between(rng, 0.3, 0.5))
        pieces += Pieces([decal(lower, upper, "front", name, at=at, size=size)])
    if chance(rng, 0.85):
        pieces += Pieces(with_tray(rng, shell))
    return Box(pieces, fittings.pivot(shell), between(rng, 1.66, 2.4))


def with_tray(rng: np.random.Generator, shell: Shell) -> list[Surface]:
    """Tools on the floor of the box; often some more in a tray above."""
    low, high = shell.inside
    if chance(rng, 0.35) or shell.height < 0.08:
        return insets.tools(rng, low, xyz(high[0], min(high[1], low[1] + 0.07), high[2]))
    look = Material(color=tinted(rng, pick(rng, prints.VIVID)), roughness=0.5)
    y = high[1] - min(0.05, 0.4 * shell.height)
    floor, roof = xyz(low[0] + 0.003, y, low[2] + 0.003), high - xyz(0.003, 0, 0.003)
    tray = tub(floor, roof, 0.002, look, radius=0.006)
    return [*tray, *insets.tools(rng, floor + 0.006, roof - 0.006)]
