"""Gift boxes: rigid board with a book-like cover, magnets, ribbons."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from r2art.data.categories.box import contents, insets, prints
from r2art.data.categories.box.cardboard import WHITE, board, crease, plain, printed
from r2art.data.categories.box.shells import Box, Pieces, Shell, base
from r2art.data.procedural.materials import cloth
from r2art.data.procedural.randomness import between, chance, pick, spread, tinted, weighted
from r2art.data.procedural.slabs import bent
from r2art.data.procedural.solids import box, decal, plate, xyz
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
_SILVER = Material(color=(0.7, 0.7, 0.72), roughness=0.3, metallic=0.9)


def gift_box(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """The cover's front flap is held by magnets; some have a ribbon and a bow."""
    width = spread(rng, 0.25, 0.25, 0.12, 0.38)
    depth = width * between(rng, 0.6, 1.0)
    shell = Shell(
        width=width,
        depth=depth,
        height=float(np.clip(depth * between(rng, 0.25, 0.6), 0.04, 0.16)),
        lid=0.003,
        wall=between(rng, 0.002, 0.0035),
    )
    color = prints.paper_color(rng)
    look = weighted(rng, {"plain": 5, "pattern": 2, "cloth": 1, "picture": 1})
    outer = cloth(rng, color) if look == "cloth" else board(rng, color)
    inside = board(rng, pick(rng, (color, WHITE, (0.1, 0.1, 0.1), prints.paper_color(rng))))
    pieces = base(shell, plain(outer, inside, outer))
    over = between(rng, 0.0015, 0.003)
    x, z = shell.x + over, shell.z + over
    pieces.append(box((-x, 0, -z), (x, shell.height, -shell.z), outer))  # the book's spine
    pieces.append(box((-x, -0.002, -z), (x, 0, z), outer))  # and its other cover
    pieces += crease(shell, outer)
    lid, drop = _cover(rng, shell, outer, inside, over)
    if chance(rng, 0.6):
        pieces += _magnets(shell)
    aspect = shell.width / (shell.depth + over + 0.003)
    cover = (xyz(-shell.x, 0, -shell.z), xyz(shell.x, shell.height + 0.003, z + 0.003))
    if look == "pattern":
        art = printed(prints.pattern(rng, aspect, color), 0.5)
        lid.append(decal(*cover, "top", art))
    elif look == "picture":
        art = printed(prints.picture(rng, aspect, color, photos), 0.5)
        lid.append(decal(*cover, "top", art))
    elif chance(rng, 0.6):
        foil = printed(prints.brand(rng, 2.5, outer.color), 0.4)
        lid.append(decal(*cover, "top", foil, size=(0.45 * width, 0.18 * width)))
    if chance(rng, 0.45):
        lid += _ribbon(rng, shell, drop)
    fills = {contents.tissue: 3.0, contents.goods: 2.0, contents.household: 1.0}
    if chance(rng, 0.7):
        fill = insets.jewels if chance(rng, 0.1) else weighted(rng, fills)
        pieces += fill(rng, *shell.inside)
    return Box(Pieces(pieces, lid), (shell.height, -shell.z), between(rng, 1.75, 3.2))


def _magnets(shell: Shell) -> list[Surface]:
    """Two discs at the front, under the flap."""
    y = 1 - min(0.012 / shell.height, 0.4)
    size = (0.012, 0.012)
    return [
        decal(*shell.base_box, "front", _SILVER, at=(x, y), size=size, lift=2e-4)
        for x in (0.25, 0.75)
    ]


def _cover(
    rng: np.random.Generator, shell: Shell, outer: Material, inside: Material, over: float
) -> tuple[list[Surface], float]:
    """The lid with its flap before the front of the base, and how far that comes down."""
    x, h, z, t = shell.x + over, shell.height, shell.z + 4e-4, 0.003
    drop = h * (between(rng, 0.9, 0.99) if chance(rng, 0.35) else between(rng, 0.3, 0.65))
    top = plate((-x, h + 2e-4, -shell.z), (x, h + t, z + t), 1, outer, bottom=inside, tile=0.4)
    flap = plate((-x, h - drop, z), (x, h + 2e-4, z + t), 2, outer, bottom=inside, tile=0.4)
    return [*top, *flap], drop


def _ribbon(rng: np.random.Generator, shell: Shell, drop: float) -> list[Surface]:
    """A band over lid and flap, perhaps another across, perhaps a bow."""
    tone = pick(rng, (*prints.VIVID, WHITE, (0.1, 0.1, 0.1), (0.75, 0.6, 0.3)))
    look = Material(color=tinted(rng, tone), roughness=0.3)
    wide = min(between(rng, 0.015, 0.032), 0.2 * shell.width)
    y, z = shell.height + 0.0035, shell.z + 0.0042
    x = 0.0 if chance(rng, 0.7) else between(rng, -0.28, 0.28) * shell.width
    path = [(-z, shell.height - drop), (-z, y), (shell.z, y)]  # clockwise: outward is left
    pieces = [*bent(path, 8e-4, 0, (x - wide / 2, x + wide / 2), look)]
    at = xyz(x, y, between(rng, -0.1, 0.25) * shell.depth)
    if chance(rng, 0.6):
        low = (-shell.x, y, at[2] - wide / 2)
        pieces.append(box(low, (shell.x, y + 8e-4, at[2] + wide / 2), look))
    return [*pieces, *_bow(look, at, wide)] if chance(rng, 0.7) else pieces


def _bow(look: Material, at: FloatArray, wide: float) -> list[Surface]:
    """Two loops and two ends about a knot at ``at``."""
    loop = np.array([(0, 0.1), (0.9, 1.0), (1.9, 1.05), (2.3, 0.5), (1.8, 0.1), (0.3, 0.05)]) * wide
    tail = np.array([(0.1, 0.3), (0.9, 0.35), (1.7, 0.06)]) * wide
    span = (at[2] - 0.42 * wide, at[2] + 0.42 * wide)
    pieces: list[Surface] = []
    for sign in (-1, 1):
        for path in (loop, tail):
            pieces += bent(at[:2] + (path * (sign, 1))[::sign], 8e-4, 2, span, look)
    knot = plate(
        at - xyz(0.3 * wide, 0, 0.36 * wide),
        at + xyz(0.3 * wide, 0.55 * wide, 0.36 * wide),
        1,
        look,
        radius=0.1 * wide,
        bevel=0.15 * wide,
    )
    return [*pieces, *knot]
