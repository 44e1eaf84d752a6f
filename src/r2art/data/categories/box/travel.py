"""Boxes to travel with: trunks, suitcases, flight cases."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from r2art.data.categories.box import contents, fittings, grips, insets, latches, prints
from r2art.data.categories.box.shells import Box, Looks, Pieces, Shell, base, cap_lid
from r2art.data.procedural.materials import WOODS, cloth, fitting, leather, painted, wooden
from r2art.data.procedural.randomness import Color, between, chance, pick, spread, weighted
from r2art.data.procedural.solids import decal, xyz
from r2art.data.shape import Material, Surface

_TONES: tuple[Color, ...] = (
    (0.1, 0.1, 0.11),
    (0.15, 0.2, 0.35),
    (0.35, 0.22, 0.13),
    (0.6, 0.5, 0.35),
    (0.2, 0.3, 0.22),
    (0.5, 0.12, 0.12),
    (0.82, 0.78, 0.7),
)
_HIDES: tuple[Color, ...] = ((0.3, 0.18, 0.1), (0.5, 0.32, 0.18), (0.09, 0.08, 0.08))
_LININGS: tuple[Color, ...] = ((0.85, 0.8, 0.7), (0.6, 0.2, 0.2), (0.3, 0.35, 0.45))


def trunk(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """A travelling or storage trunk: covered boards, bound edges, corner caps, two latches."""
    width = spread(rng, 0.46, 0.2, 0.26, 0.6)
    depth = width * between(rng, 0.5, 0.68)
    height = depth * between(rng, 0.7, 1.0)
    lid = between(rng, 0.16, 0.32)
    shell = Shell(
        width=width,
        depth=depth,
        height=height * (1 - lid),
        lid=height * lid,
        wall=between(rng, 0.006, 0.01),
    )
    tone = pick(rng, _TONES)
    maker = pick(rng, (cloth, leather))
    cover = maker(rng, tone) if chance(rng, 0.7) else painted(rng, (tone,), 0.0)
    lining = cloth(rng, pick(rng, _LININGS))
    metal = fitting(rng)
    looks = Looks(outside=cover, inside=lining, rim=metal, metal=metal, lid=cover, tile=0.25)
    pieces = Pieces(base(shell, looks), cap_lid(shell, looks))
    binding = leather(rng, (0.3, 0.18, 0.1)) if chance(rng, 0.5) else metal
    if chance(rng, 0.75):
        pieces += fittings.edging(shell, binding, between(rng, 0.018, 0.03))
    if chance(rng, 0.75):
        pieces += fittings.corners(shell, metal, between(rng, 0.03, 0.055))
    if chance(rng, 0.4):
        slat = wooden(rng, pick(rng, WOODS)) if chance(rng, 0.6) else binding
        places = [-0.3 * width, 0.3 * width]
        pieces += fittings.bands(shell, slat, places, between(rng, 0.025, 0.045), None)
    if chance(rng, 0.3):
        pieces += Pieces(lid=_stickers(rng, shell, photos))
    pieces += fittings.hinges(rng, shell, metal, looks.outside)
    for x in (-0.22, 0.22) if chance(rng, 0.7) else (0.0,):
        pieces += latches.draw_latch(shell, metal, at=x * width)
    if chance(rng, 0.6):
        pieces += latches.hasp(rng, shell, metal, locked=chance(rng, 0.3))
    kind = pick(rng, ("strap", "strap", "bar"))
    pieces += grips.side_handles(rng, shell, binding if kind == "strap" else metal, kind)
    if chance(rng, 0.65):
        fills = {contents.household: 4, contents.toys: 1, contents.tissue: 0.5}
        pieces += Pieces(weighted(rng, fills)(rng, *shell.inside))
    return Box(pieces, fittings.pivot(shell), between(rng, 1.66, 1.95))


def _stickers(rng: np.random.Generator, shell: Shell, photos: Sequence[Path]) -> list[Surface]:
    top = (xyz(-shell.x, 0, -shell.z), xyz(shell.x, shell.top, shell.z))
    pieces = []
    for k in range(int(rng.integers(1, 5))):
        wide = between(rng, 0.06, 0.13)
        image = prints.picture(rng, 1.4, prints.paper_color(rng), photos)
        look = Material(color=(1, 1, 1), texture=image, roughness=0.5)
        at = (between(rng, 0.2, 0.8), between(rng, 0.25, 0.75))
        size = (wide, wide / 1.4)
        pieces.append(decal(*top, "top", look, at=at, size=size, lift=1e-3 + 1e-4 * k))
    return pieces


def suitcase(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """Laid flat, its handle to the front: vintage suitcases, attaché cases, aluminium cases."""
    kind = weighted(rng, {"vintage": 3, "attache": 2, "aluminium": 2})
    width = spread(rng, 0.43, 0.16, 0.28, 0.6)
    height = width * (between(rng, 0.2, 0.28) if kind == "attache" else between(rng, 0.26, 0.42))
    lid = between(rng, 0.3, 0.48)
    shell = Shell(
        width=width,
        depth=width * between(rng, 0.64, 0.76),
        height=height * (1 - lid),
        lid=height * lid,
        wall=0.005,
        radius=0.0 if kind == "aluminium" else between(rng, 0.004, 0.04),
        edge=0.0 if kind == "aluminium" else between(rng, 0.001, 0.008),
    )
    metal = fitting(rng)
    looks, binding = _case_looks(rng, kind, metal)
    pieces = Pieces(base(shell, looks), cap_lid(shell, looks))
    if kind == "aluminium":
        pieces += fittings.edging(shell, binding, between(rng, 0.016, 0.024))
        pieces += fittings.corners(shell, metal, between(rng, 0.025, 0.04))
    elif kind == "vintage" and chance(rng, 0.6):
        places = [-0.28 * width, 0.28 * width]
        pieces += fittings.bands(shell, binding, places, between(rng, 0.02, 0.035), None)
    if kind == "vintage" and chance(rng, 0.4):
        pieces += Pieces(lid=_stickers(rng, shell, photos))
    black = Material(color=(0.06, 0.06, 0.065), roughness=0.5)
    handle = binding if kind == "vintage" else black
    pieces += grips.case_handle(shell, handle, metal, length=between(rng, 0.1, 0.14))
    pieces += fittings.hinges(rng, shell, metal, looks.outside)
    for x in (-0.36, 0.36):
        pieces += latches.draw_latch(shell, metal, at=x * width)
    fills = {contents.household: 3, contents.papers: 2, insets.equipment: 0.3}
    if kind != "vintage":
        fills |= {insets.equipment: 3, insets.tools: 2}
    if chance(rng, 0.8):
        pieces += Pieces(weighted(rng, fills)(rng, *shell.inside))
    return Box(pieces, fittings.pivot(shell), between(rng, 1.66, 2.9))


def _case_looks(rng: np.random.Generator, kind: str, metal: Material) -> tuple[Looks, Material]:
    """Materials of a suitcase and of its straps or edges."""
    brown = leather(rng, pick(rng, _HIDES))
    if kind == "aluminium":
        tone = pick(rng, ((0.7, 0.71, 0.73), (0.7, 0.71, 0.73), (0.12, 0.12, 0.13)))
        skin = painted(rng, (tone,), 0.5 if tone[0] > 0.5 else 0.0)
        edge = Material(color=(0.6, 0.6, 0.62), roughness=0.4, metallic=0.85)
    else:
        skin = brown if kind == "attache" or chance(rng, 0.5) else cloth(rng, pick(rng, _TONES))
        edge = leather(rng, pick(rng, _HIDES))
    lining = cloth(rng, pick(rng, _LININGS))
    rim = edge if kind == "aluminium" else metal
    return Looks(outside=skin, inside=lining, rim=rim, metal=metal, lid=skin, tile=0.25), edge
