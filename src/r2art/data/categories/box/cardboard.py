"""Boxes of board: shoe boxes with their lid attached, mailers that tuck in, pizza boxes."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from r2art.data.categories.box import contents, prints
from r2art.data.categories.box.shells import Box, Looks, Pieces, Shell, base
from r2art.data.procedural.curved import prism
from r2art.data.procedural.materials import cardboard
from r2art.data.procedural.randomness import Color, between, chance, pick, spread, tinted, weighted
from r2art.data.procedural.solids import box, decal, plate, xyz
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
WHITE: Color = (0.93, 0.93, 0.91)


def crease(shell: Shell, look: Material) -> list[Surface]:
    """The fold between rear wall and lid."""
    x, h, z = shell.x, shell.height, -shell.z
    return [box((-x, h - 0.004, z - 0.0012), (x, h + 0.0018, z + 0.001), look)]


def printed(image: prints.Texture, roughness: float) -> Material:
    """A print, ready to be laid on a face."""
    return Material(color=(1, 1, 1), texture=image, roughness=roughness)


def board(rng: np.random.Generator, color: Color) -> Material:
    """Smooth board of a colour."""
    return Material(color=tinted(rng, color, 0.02), roughness=between(rng, 0.5, 0.85))


def plain(look: Material, inside: Material, metal: Material) -> Looks:
    """One look outside, one inside and on the rim."""
    return Looks(outside=look, inside=inside, rim=inside, metal=metal, lid=look, tile=0.4)


def shoe_box(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """A lid with a skirt at front and sides, hinged on the rear wall; a size label on one end."""
    del photos
    width = spread(rng, 0.32, 0.06, 0.24, 0.37)
    shell = Shell(
        width=width,
        depth=width * between(rng, 0.56, 0.68),
        height=width * between(rng, 0.33, 0.42),
        lid=0.003,
        wall=between(rng, 0.0018, 0.003),
    )
    color = prints.paper_color(rng)
    kraft = chance(rng, 0.25)
    outer = cardboard(rng) if kraft else board(rng, color)
    lid_color = color if kraft or chance(rng, 0.55) else prints.paper_color(rng)
    lid_look = outer if kraft or lid_color == color else board(rng, lid_color)
    inside = board(rng, pick(rng, ((0.68, 0.6, 0.5), WHITE, (0.55, 0.52, 0.48))))
    looks = plain(outer, inside, lid_look)
    ground = (0.68, 0.53, 0.37) if kraft else color
    lower, upper = shell.base_box
    pieces = [*base(shell, looks), *crease(shell, outer)]
    if chance(rng, 0.7):
        art = prints.brand(rng, shell.width / shell.height, ground)
        pieces.append(decal(lower, upper, "front", printed(art, 0.6)))
    side = pick(rng, ("left", "right"))
    size_label = printed(prints.parcel_label(rng), 0.6)
    at = (between(rng, 0.25, 0.75), 0.36)
    wide = min(0.07, 0.4 * shell.depth)
    pieces.append(decal(lower, upper, side, size_label, at=at, size=(wide, 0.65 * wide)))
    for end in ("left", "right"):  # finger holes
        if chance(rng, 0.5):
            look = Material(color=(0.08, 0.07, 0.06), roughness=0.9)
            pieces += [
                decal(lower, upper, end, look, at=(0.5, 0.72), size=(0.022, 0.022), lift=4e-4)
            ]
    lid_ground = (0.68, 0.53, 0.37) if kraft else lid_color
    lid = _skirted_lid(rng, shell, lid_look, inside, lid_ground)
    room = shell.inside
    fill = weighted(
        rng, {contents.shoes: 4, contents.tissue: 2, contents.papers: 1, contents.household: 2}
    )
    if chance(rng, 0.8):
        pieces += fill(rng, *room)
    return Box(Pieces(pieces, lid), (shell.height, -shell.z), float(between(rng, 1.75, 3.25)))


def _skirted_lid(
    rng: np.random.Generator, shell: Shell, look: Material, inside: Material, color: Color
) -> list[Surface]:
    x, z, h, t = shell.x, shell.z, shell.height, 0.0022
    drop = between(rng, 0.025, 0.05)
    low, high = xyz(-x - t, h + 2e-4, -z), xyz(x + t, h + t, z + t)
    pieces = [*plate(low, high, 1, look, bottom=inside, tile=0.4)]
    walls = [(xyz(-x - t, h - drop, z + 4e-4), xyz(x + t, h, z + t))]
    walls += [
        (
            xyz(s * x + (4e-4 if s > 0 else -t), h - drop, -z),
            xyz(s * x + (t if s > 0 else -4e-4), h, z),
        )
        for s in (-1, 1)
    ]
    pieces += [box(a, b, look, tile=0.4) for a, b in walls]
    art = prints.brand(rng, shell.width / shell.depth, color)
    pieces.append(decal(low, high, "top", printed(art, 0.6)))
    if chance(rng, 0.4):
        strip = prints.brand(rng, shell.width / drop, color)
        pieces.append(decal(*walls[0], "front", printed(strip, 0.6)))
    return pieces


def mailer(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """Corrugated board; the lid has a tuck-in flap at its front and ears at its sides."""
    del photos
    width = spread(rng, 0.27, 0.25, 0.14, 0.42)
    shell = Shell(
        width=width,
        depth=width * between(rng, 0.55, 0.95),
        height=float(np.clip(width * between(rng, 0.18, 0.5), 0.035, 0.16)),
        lid=0.003,
        wall=between(rng, 0.004, 0.007),
    )
    colored = chance(rng, 0.45)
    color: Color = prints.paper_color(rng) if colored else (0.68, 0.53, 0.37)
    outer = board(rng, color) if colored else cardboard(rng)
    lined = chance(rng, 0.25)
    inside = board(rng, pick(rng, (WHITE, *prints.VIVID))) if lined else cardboard(rng)
    edge = Material(color=(1, 1, 1), texture=prints.stripes_of_board(), roughness=0.9)
    looks = replace(plain(outer, inside, edge), rim=cardboard(rng))
    pieces = [*base(shell, looks), *crease(shell, outer)]
    pieces += _mailer_prints(rng, shell, color, colored)
    fills = {contents.goods: 5, contents.tissue: 2, contents.household: 1.5, contents.papers: 1}
    if chance(rng, 0.65):
        lower, upper = shell.inside
        flaps = xyz(0.005, 0, 0.005)
        pieces += weighted(rng, fills)(rng, lower + flaps, upper - flaps)
    lid = _tucked_lid(rng, shell, outer, inside, edge)
    lid += _parcel_top(rng, shell, color, colored)
    return Box(Pieces(pieces, lid), (shell.height, -shell.z), float(between(rng, 1.75, 3.2)))


def _mailer_prints(
    rng: np.random.Generator, shell: Shell, color: Color, colored: bool
) -> list[Surface]:
    if not chance(rng, 0.75 if colored else 0.35):
        return []
    lower, upper = shell.base_box
    front = prints.brand(rng, shell.width / shell.height, color)
    return [decal(lower, upper, "front", printed(front, 0.8))]


def _tucked_lid(
    rng: np.random.Generator, shell: Shell, outer: Material, inside: Material, edge: Material
) -> list[Surface]:
    x, z, h, t = shell.x, shell.z, shell.height, 0.003
    low, high = xyz(-x, h + 2e-4, -z), xyz(x, h + t, z)
    pieces = [*plate(low, high, 1, edge, top=outer, bottom=inside, tile=0.4)]
    deep = min(between(rng, 0.5, 0.95) * h, 0.08)
    front = z - shell.wall - 5e-4
    taper = between(rng, 0.004, 0.02)
    flap = np.array([(x - 0.006, h), (-x + 0.006, h), (-x + 0.006 + taper, h - deep)])
    flap = np.concatenate([flap, [(x - 0.006 - taper, h - deep)]])
    pieces += prism(_counter_clockwise(flap), 2, (front - t, front), inside, tile=0.4)
    if chance(rng, 0.75):
        ear = min(between(rng, 0.3, 0.8) * h, 0.05)
        side = x - shell.wall - 5e-4
        near, far = -front + 0.008, z - 0.01  # of -z
        ears = np.array([(near, h), (far, h), (far - 0.02, h - ear), (near + 0.02, h - ear)])
        for span in ((side - t, side), (-side, -side + t)):
            pieces += prism(_counter_clockwise(ears), 0, span, inside, tile=0.4)
    return pieces


def _counter_clockwise(outline: FloatArray) -> FloatArray:
    x, y = outline.T
    left = (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() > 0
    return outline if left else outline[::-1]


def _parcel_top(
    rng: np.random.Generator, shell: Shell, color: Color, colored: bool
) -> list[Surface]:
    """A brand, an address label, strips of tape."""
    top = (xyz(-shell.x, 0, -shell.z), xyz(shell.x, shell.height + 0.003, shell.z))
    pieces = []
    if chance(rng, 0.8 if colored else 0.45):
        aspect = shell.width / shell.depth
        draw = prints.pattern if chance(rng, 0.25) else prints.brand
        pieces.append(decal(*top, "top", printed(draw(rng, aspect, color), 0.8)))
    if chance(rng, 0.5):
        wide = min(0.1, 0.5 * shell.width)
        at = (between(rng, 0.3, 0.7), between(rng, 0.35, 0.65))
        look = printed(prints.parcel_label(rng), 0.5)
        pieces.append(
            decal(
                *top, "top", look, at=at, size=(wide, min(0.7 * wide, 0.5 * shell.depth)), lift=6e-4
            )
        )
    if chance(rng, 0.35):
        tone: Color = pick(rng, ((0.72, 0.6, 0.42), (0.85, 0.82, 0.74), (0.8, 0.15, 0.12)))
        tape = Material(color=tone, roughness=0.2)
        deep = between(rng, 0.2, 1.0) * shell.depth
        at = (between(rng, 0.4, 0.6), 0.5 * deep / shell.depth)
        pieces.append(decal(*top, "top", tape, at=at, size=(0.048, deep), lift=5e-4))
    return pieces


def pizza_box(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Box:
    """Flat and square; its lid tucks in; one or two inks on kraft or white."""
    del photos
    width = spread(rng, 0.33, 0.14, 0.24, 0.42)
    shell = Shell(
        width=width,
        depth=width * between(rng, 0.97, 1.03),
        height=between(rng, 0.035, 0.05),
        lid=0.003,
        wall=between(rng, 0.003, 0.004),
    )
    kraft = chance(rng, 0.45)
    color: Color = (0.68, 0.53, 0.37) if kraft else WHITE
    outer = cardboard(rng) if kraft else board(rng, color)
    inside = cardboard(rng)
    edge = Material(color=(1, 1, 1), texture=prints.stripes_of_board(), roughness=0.9)
    looks = replace(plain(outer, inside, edge), rim=inside)
    pieces = [*base(shell, looks), *crease(shell, outer)]
    if chance(rng, 0.85):
        pieces += contents.pizza(rng, *shell.inside)
    lid = _tucked_lid(rng, shell, outer, inside, edge)
    top = (xyz(-shell.x, 0, -shell.z), xyz(shell.x, shell.height + 0.003, shell.z))
    lid.append(decal(*top, "top", printed(prints.pizzeria(rng, color), 0.8)))
    return Box(Pieces(pieces, lid), (shell.height, -shell.z), between(rng, 1.75, 3.2))
