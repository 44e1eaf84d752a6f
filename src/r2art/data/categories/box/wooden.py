"""Boxes of wood: jewellery boxes, cigar boxes, tea boxes, watch cases."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from r2art.data.categories.box import contents, fittings, insets, latches, prints
from r2art.data.categories.box.shells import (
    Box,
    Looks,
    Pieces,
    Shell,
    arched,
    base,
    board_lid,
    cap_lid,
    vault_lid,
)
from r2art.data.procedural.materials import (
    PAINTS,
    WOODS,
    felt,
    fitting,
    leather,
    painted,
    wooden,
)
from r2art.data.procedural.randomness import Color, between, chance, pick, spread, tinted, weighted
from r2art.data.procedural.solids import decal, plate, xyz
from r2art.data.shape import Material, Surface

_FELTS: tuple[Color, ...] = (
    (0.4, 0.06, 0.1),
    (0.07, 0.1, 0.28),
    (0.1, 0.25, 0.15),
    (0.12, 0.12, 0.12),
    (0.8, 0.75, 0.66),
    (0.3, 0.12, 0.32),
)
_BRASS = Material(color=(0.72, 0.58, 0.3), roughness=0.3, metallic=0.9)


def wooden_looks(rng: np.random.Generator, lined: bool) -> Looks:
    """Of wood, a quarter painted; lined with felt or plain."""
    body = painted(rng, PAINTS, 0.0) if chance(rng, 0.25) else wooden(rng, pick(rng, WOODS))
    raw = wooden(rng, pick(rng, WOODS[:3])) if chance(rng, 0.3) else body
    inside = felt(rng, pick(rng, _FELTS)) if lined else raw
    return Looks(
        outside=body,
        inside=inside,
        rim=raw,
        metal=fitting(rng),
        lid=body,
        tile=between(rng, 0.25, 0.6),
    )


def opening(rng: np.random.Generator) -> float:
    """Lids of wood mostly stop a little behind the vertical."""
    return between(rng, 1.66, 2.0) if chance(rng, 0.7) else between(rng, 2.0, 3.1)


def jewellery_box(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """Wood or leather, felt inside, often a mirror in the lid; trays of rings and chains."""
    width = spread(rng, 0.19, 0.32, 0.08, 0.32)
    lid = between(rng, 0.14, 0.34)
    depth = width * between(rng, 0.6, 0.95)
    height = depth * between(rng, 0.35, 0.7)
    shell = Shell(
        width=width,
        depth=depth,
        height=height * (1 - lid),
        lid=height * lid,
        wall=float(np.clip(0.035 * width, 0.004, 0.009)),
        radius=between(rng, 0.0, 0.012) if chance(rng, 0.5) else 0.0,
        edge=between(rng, 0.001, 0.004) if chance(rng, 0.5) else 0.0,
    )
    looks = wooden_looks(rng, lined=True)
    covered = chance(rng, 0.45)
    if covered:
        tones: tuple[Color, ...] = ((0.1, 0.1, 0.1), (0.35, 0.2, 0.12), (0.88, 0.84, 0.78))
        tones += ((0.75, 0.5, 0.52), (0.45, 0.08, 0.12), (0.55, 0.6, 0.62))
        hide = leather(rng, pick(rng, tones))
        looks = replace(looks, outside=hide, lid=hide, rim=looks.inside, tile=0.12)
    vaulted = not covered and chance(rng, 0.25)
    pieces = Pieces(base(shell, looks))
    if vaulted:
        pieces += Pieces(lid=vault_lid(shell, looks, arched(shell, 0.4 * shell.lid)))
    else:
        pieces += Pieces(lid=cap_lid(shell, looks))
        pieces += _lid_of_jewels(rng, shell, looks, covered, photos)
    pieces += fittings.hinges(rng, shell, looks.metal, looks.outside)
    kind = weighted(rng, {"hook": 3, "key": 2, "lip": 2, "hasp": 1})
    if kind == "hasp":
        pieces += latches.hasp(rng, shell, looks.metal)
    elif kind == "key":
        pieces += latches.key_lock(shell, looks.metal)
    else:
        maker = latches.hook if kind == "hook" else latches.lip
        pieces += maker(shell, looks.metal)
    if chance(rng, 0.35):
        foot = 0.05 * shell.width
        pieces += fittings.feet(shell, looks.metal, height=0.5 * foot, radius=0.5 * foot)
    if chance(rng, 0.9):
        pieces += Pieces(
            insets.jewels(rng, *shell.inside, lining=looks.inside if chance(rng, 0.7) else None)
        )
    return Box(pieces, fittings.pivot(shell), opening(rng))


def _lid_of_jewels(
    rng: np.random.Generator, shell: Shell, looks: Looks, covered: bool, photos: Sequence[Path]
) -> Pieces:
    """A mirror or a cushion inside; an inlay, a monogram or a picture on top."""
    pieces: list[Surface] = []
    low, high = shell.ceiling
    inner = high - low
    if chance(rng, 0.65):
        glass = Material(color=(0.85, 0.87, 0.88), roughness=0.05, metallic=1.0)
        size = (0.86 * inner[0], 0.84 * inner[2])
        pieces.append(decal(low, high, "bottom", glass, size=size, lift=6e-4))
    else:
        inset = 0.06 * inner * (1, 0, 1)
        puff = min(0.5 * (shell.lid - shell.wall), 0.012)
        cushion = (low + inset - xyz(0, puff, 0), high - inset - xyz(0, shell.wall, 0))
        pieces += plate(*cushion, 1, looks.inside, radius=0.01, bevel=(0.9 * puff, 0.0))
    top = (xyz(-shell.x, 0, -shell.z), xyz(shell.x, shell.top, shell.z))
    size = 0.62 * np.array([shell.width, shell.depth])
    if not covered and chance(rng, 0.4):
        art = wooden(rng, pick(rng, WOODS))
        if chance(rng, 0.4):
            image = prints.picture(rng, size[0] / size[1], prints.paper_color(rng), photos)
            art = Material(color=(1, 1, 1), texture=image, roughness=0.3)
        pieces += plate(
            (-size[0] / 2, shell.top - 0.001, -size[1] / 2),
            (size[0] / 2, shell.top + 8e-4, size[1] / 2),
            1,
            _BRASS,
        )
        pieces.append(decal(*top, "top", art, size=(size[0] - 0.006, size[1] - 0.006), lift=1.1e-3))
    elif covered and chance(rng, 0.4):
        name = Material(
            color=(1, 1, 1), texture=prints.brand(rng, 2.0, looks.lid.color), roughness=0.4
        )
        pieces.append(decal(*top, "top", name, size=(0.4 * size[0], 0.2 * size[0])))
    return Pieces(lid=pieces)


def cigar_box(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """Thin cedar, trimmed with paper and printed labels, one inside the lid too."""
    del photos
    width = spread(rng, 0.22, 0.12, 0.15, 0.28)
    shell = Shell(
        width=width,
        depth=width * between(rng, 0.65, 0.85),
        height=between(rng, 0.035, 0.075),
        lid=between(rng, 0.005, 0.008),
        wall=between(rng, 0.004, 0.006),
    )
    cedar = wooden(rng, pick(rng, ((0.6, 0.38, 0.22), (0.7, 0.47, 0.29), (0.72, 0.55, 0.36))))
    papered = chance(rng, 0.4)
    ground = tinted(rng, pick(rng, ((0.93, 0.9, 0.8), (0.9, 0.8, 0.55), (0.8, 0.2, 0.15))))
    cover = Material(color=ground, roughness=0.5) if papered else cedar
    looks = Looks(outside=cover, inside=cedar, rim=cedar, metal=_BRASS, lid=cover, tile=0.35)
    pieces = Pieces(base(shell, looks), board_lid(shell, looks, 0.0, 0.0006))
    trim = Material(color=tinted(rng, pick(rng, prints.VIVID)), roughness=0.5)
    if chance(rng, 0.75):
        pieces += fittings.edging(shell, trim, between(rng, 0.004, 0.01))
    lower, upper = shell.base_box

    def art(aspect: float) -> Material:
        return Material(
            color=(1, 1, 1), texture=prints.vintage(rng, aspect, ground), roughness=0.45
        )

    top = (lower, upper + xyz(0, shell.lid, 0))
    wide = between(rng, 0.5, 0.92)
    aspect = shell.width / shell.depth
    size = (wide * shell.width, wide * shell.depth)
    label = art(aspect)
    pieces += Pieces(lid=[decal(*top, "top", label, size=size, lift=8e-4)])
    if chance(rng, 0.7):
        low, high = shell.inside
        under = (low + xyz(0, shell.height - 0.004, 0), high)
        inner = label if chance(rng, 0.5) else art(aspect)
        size = (0.9 * (high[0] - low[0]), 0.9 * (high[2] - low[2]))
        under = (low * (1, 0, 1) + xyz(0, _lid_floor(shell), 0), high)
        pieces += Pieces(lid=[decal(*under, "bottom", inner, size=size)])
    if chance(rng, 0.7):
        front = art(shell.width / shell.height)
        size = (0.8 * shell.width, 0.8 * shell.height)
        pieces += Pieces([decal(lower, upper, "front", front, size=size, lift=9e-4)])
    if chance(rng, 0.6):
        pieces += latches.hook(shell, _BRASS)
    pieces += fittings.hinges(rng, shell, _BRASS, looks.outside) if chance(rng, 0.6) else Pieces()
    if chance(rng, 0.8):
        fills = {insets.cigars: 5, contents.papers: 1, contents.household: 0.6}
        low, high = shell.inside
        high = high - xyz(0, 0.004, 0)
        pieces += Pieces(weighted(rng, fills)(rng, low, high))
    return Box(pieces, fittings.pivot(shell), opening(rng))


def _lid_floor(shell: Shell) -> float:
    """Height of the underside of `board_lid`."""
    return shell.height - min(0.35 * shell.height, 0.004)


def case_with_window(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """A tea box or a watch case: compartments under a lid, most with a pane in it."""
    del photos
    tea = chance(rng, 0.45)
    width = spread(rng, 0.26, 0.2, 0.16, 0.36)
    height = between(rng, 0.075, 0.1)
    lid = between(rng, 0.18, 0.3)
    shell = Shell(
        width=width,
        depth=width * between(rng, 0.4, 0.85),
        height=height * (1 - lid),
        lid=height * lid,
        wall=between(rng, 0.006, 0.01),
        edge=between(rng, 0.0005, 0.003),
    )
    looks = wooden_looks(rng, lined=not tea)
    if not tea and chance(rng, 0.5):
        hide = leather(rng, pick(rng, ((0.08, 0.08, 0.08), (0.3, 0.17, 0.1), (0.5, 0.5, 0.52))))
        looks = replace(looks, outside=hide, lid=hide, rim=hide, tile=0.12)
    pieces = Pieces(base(shell, looks), cap_lid(shell, looks))
    if chance(rng, 0.75):
        glass = Material(color=(0.1, 0.12, 0.13), roughness=0.05)
        size = (shell.width - 0.055, shell.depth - 0.055)
        top = (xyz(-shell.x, 0, -shell.z), xyz(shell.x, shell.top, shell.z))
        pieces += Pieces(
            lid=[
                decal(*top, "top", glass, size=size, lift=4e-4),
                decal(*shell.ceiling, "bottom", glass, size=size, lift=4e-4),
            ]
        )
    elif tea:
        top = (xyz(-shell.x, 0, -shell.z), xyz(shell.x, shell.top, shell.z))
        word = Material(
            color=(1, 1, 1), texture=prints.brand(rng, 2.4, (0.7, 0.55, 0.38)), roughness=0.6
        )
        pieces += Pieces(lid=[decal(*top, "top", word, size=(0.4 * width, 0.4 * width / 2.4))])
    pieces += fittings.hinges(rng, shell, looks.metal, looks.outside)
    pieces += pick(rng, (latches.hook, latches.key_lock, latches.draw_latch))(shell, looks.metal)
    if tea:
        pieces += Pieces(insets.sachets(rng, *shell.inside))
    else:
        lining = looks.inside if chance(rng, 0.6) else None
        pieces += Pieces(insets.watches(rng, *shell.inside, lining=lining))
    return Box(pieces, fittings.pivot(shell), opening(rng))
