"""Wooden chests: flat, arched or hipped, with straps, hasps and handles."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from r2art.data.categories.box import contents, fittings, grips, latches
from r2art.data.categories.box.shells import (
    Box,
    Looks,
    Pieces,
    Shell,
    arched,
    base,
    board_lid,
    cap_lid,
    roofed,
    vault_lid,
)
from r2art.data.categories.box.wooden import opening, wooden_looks
from r2art.data.procedural.materials import leather
from r2art.data.procedural.randomness import between, chance, pick, spread, weighted
from r2art.data.procedural.solids import decal
from r2art.data.shape import Material

_SEAM = Material(color=(0.05, 0.035, 0.025), roughness=0.9)


def chest(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """Flat, arched or hipped; iron straps, hasp and padlock, handles at the ends."""
    del photos
    width = spread(rng, 0.32, 0.35, 0.15, 0.6)
    form = weighted(rng, {"arch": 4, "flat": 3, "cap": 2, "roof": 1})
    depth = width * between(rng, 0.5, 0.75)
    lid = {"arch": (0.3, 0.5), "flat": (0.04, 0.07), "cap": (0.12, 0.3), "roof": (0.25, 0.4)}[form]
    shell = Shell(
        width=width,
        depth=depth,
        height=depth * between(rng, 0.5, 0.85),
        lid=max(depth * between(rng, *lid), 0.008),
        wall=float(np.clip(0.028 * width, 0.005, 0.014)),
    )
    looks = wooden_looks(rng, chance(rng, 0.3))
    profile = None
    if form == "arch":
        profile = arched(shell, shell.lid * between(rng, 0.08, 0.4))
    elif form == "roof":
        profile = roofed(shell, shell.lid * between(rng, 0.1, 0.3), between(rng, 0.35, 0.7))
    pieces = Pieces(base(shell, looks))
    if form == "flat":
        over = between(rng, 0.0, 0.012)
        pieces += Pieces(lid=board_lid(shell, looks, over, 0.3 * shell.lid))
    elif form == "cap":
        pieces += Pieces(lid=cap_lid(shell, looks))
    elif profile is not None:
        pieces += Pieces(lid=vault_lid(shell, looks, profile))
    if chance(rng, 0.4):
        pieces += _planks(rng, shell)
    pieces += _ironwork(rng, shell, looks, form, profile)
    if chance(rng, 0.65):
        fills = {contents.household: 3, contents.papers: 1, contents.toys: 1, contents.tissue: 0.6}
        pieces += Pieces(weighted(rng, fills)(rng, *shell.inside))
    return Box(pieces, fittings.pivot(shell), opening(rng))


def _planks(rng: np.random.Generator, shell: Shell) -> Pieces:
    """Joints between horizontal boards, on all sides of the base."""
    count = int(rng.integers(2, 5))
    lower, upper = shell.base_box
    return Pieces(
        [
            decal(lower, upper, side, _SEAM, at=(0.5, k / count), size=(wide, 0.0016))
            for k in range(1, count)
            for side, wide in (
                ("front", shell.width),
                ("back", shell.width),
                ("left", shell.depth),
                ("right", shell.depth),
            )
        ]
    )


def _ironwork(
    rng: np.random.Generator, shell: Shell, looks: Looks, form: str, profile: np.ndarray | None
) -> Pieces:
    metal = looks.metal
    pieces = fittings.hinges(rng, shell, metal, looks.outside)
    strapped = form != "flat" and chance(rng, 0.6)
    if strapped:
        wide = between(rng, 0.05, 0.1) * shell.width
        places = pick(rng, ([-0.36, 0.36], [-0.3, 0.3], [-0.4, 0.0, 0.4]))
        places = [p * shell.width for p in places]
        metal_or_leather = metal if chance(rng, 0.6) else leather(rng, (0.3, 0.18, 0.1))
        pieces += fittings.bands(shell, metal_or_leather, places, wide, profile)
        if chance(rng, 0.6):
            ys = np.linspace(0.12, 0.88, 4) * shell.height
            points = np.array([(x, y, shell.z + 0.0016) for x in places for y in ys])
            pieces += Pieces(fittings.studs(points, 0.14 * wide, metal, 2))
    elif chance(rng, 0.5):
        pieces += fittings.corners(
            shell, metal, between(rng, 0.06, 0.12) * shell.width, lid=form == "cap"
        )
    kind = weighted(rng, {"hasp": 5, "draw": 2, "keyhole": 1, "none": 1})
    if kind == "hasp":
        pieces += latches.hasp(rng, shell, metal, locked=chance(rng, 0.4))
    elif kind == "draw" and form != "flat":
        places = (0.0,) if shell.width < 0.3 else (-0.27 * shell.width, 0.27 * shell.width)
        for x in places:
            pieces += latches.draw_latch(shell, metal, at=x)
    elif kind == "keyhole":
        pieces += latches.escutcheon(shell, metal)
    if shell.width > 0.2 and chance(rng, 0.65):
        kind = pick(rng, ("rope", "ring", "strap", "bar"))
        rope = Material(color=(0.72, 0.6, 0.42), roughness=0.95)
        look = {"rope": rope, "strap": leather(rng, (0.32, 0.2, 0.12))}.get(kind, metal)
        pieces += grips.side_handles(rng, shell, look, kind)
    return pieces
