"""What stands still around one drawer: boards, legs, an open shelf, a sleeve, brackets."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from r2art.data.categories.box import prints
from r2art.data.categories.drawer.contents import contents
from r2art.data.categories.drawer.supports import supports
from r2art.data.categories.drawer_single.style import SingleStyle
from r2art.data.procedural.curved import tube
from r2art.data.procedural.randomness import between, chance
from r2art.data.procedural.slabs import notched, slab
from r2art.data.procedural.solids import box, cylinder, decal, plate, xyz
from r2art.data.procedural.wires import wires
from r2art.data.shape import Material, Surface

_STEEL = Material(color=(0.6, 0.6, 0.61), roughness=0.4, metallic=0.8)
_BLACK = Material(color=(0.06, 0.06, 0.06), roughness=0.5)


def carcass(
    rng: np.random.Generator, style: SingleStyle, photos: Sequence[Path] = ()
) -> list[Surface]:
    """All pieces of the cabinet; ``photos`` may be printed on a sleeve."""
    if style.form == "sleeve":
        return _sleeve(rng, style, photos)
    if style.form == "under_desk":
        return _brackets(style)
    if style.form == "table":
        return [*_table(rng, style), *_top(rng, style)]
    return [*_boards(rng, style), *_top(rng, style), *supports(rng, style.cabinet)]


def _boards(rng: np.random.Generator, style: SingleStyle) -> list[Surface]:
    """Sides from the supports to the top, bottom, rear wall, and a board beside the drawer."""
    c = style.cabinet
    x, z, t = c.width / 2, c.depth / 2, c.wall
    low, high = c.support_height, c.height - c.top
    offset = (between(rng, 0, 1), between(rng, 0, 1))
    pieces = [
        box((side, low, -z), (side + t, high, z), c.body, tile=c.tile, upright=True, offset=offset)
        for side in (-x, x - t)
    ]
    pieces.append(box((t - x, low, -z), (x - t, low + t, z), c.body, tile=c.tile, offset=offset))
    open_back = style.niche != "none" and chance(rng, 0.2)
    back = style.opening if open_back else (low + t, high)
    pieces.append(box((t - x, back[0], -z), (x - t, back[1], 0.006 - z), c.body, tile=c.tile))
    if style.niche == "none":
        return pieces
    y = style.opening[0] - t if style.niche == "below" else style.opening[1]
    pieces.append(box((t - x, y, 0.006 - z), (x - t, y + t, z), c.body, tile=c.tile))
    room = (low + t, y) if style.niche == "below" else (y + t, high)
    if chance(rng, 0.35) and room[1] - room[0] > 0.08:
        inner = xyz(t - x + 0.01, room[0], 0.02 - z), xyz(x - t - 0.01, room[1] - 0.01, z - 0.03)
        pieces += contents(rng, *inner)
    return pieces


def _top(rng: np.random.Generator, style: SingleStyle) -> list[Surface]:
    """A board, flush or overhanging; it covers the front unless that is inset."""
    c = style.cabinet
    x, z, over = c.width / 2, c.depth / 2, c.overhang
    ahead = over if c.inset else max(over, c.front if chance(rng, 0.7) else 0.0)
    return [
        *plate(
            (-x - over, c.height - c.top, -z),
            (x + over, c.height, z + ahead),
            1,
            c.top_look,
            radius=between(rng, 0.0, 0.03) if chance(rng, 0.5) else 0.001,
            bevel=(0.0, min(0.4 * c.top, c.edge + 0.001)),
            tile=c.tile,
        )
    ]


def _table(rng: np.random.Generator, style: SingleStyle) -> list[Surface]:
    """A shallow case under the top, on four legs, perhaps with a shelf near the ground."""
    c, (low, high) = style.cabinet, style.opening
    x, z, t = c.width / 2, c.depth / 2, c.wall
    pieces = [
        box((side, low, -z), (side + t, high, z), c.body, tile=c.tile) for side in (-x, x - t)
    ]
    pieces.append(box((t - x, low, -z), (x - t, high, 0.012 - z), c.body, tile=c.tile))
    under = low - 0.006
    pieces.append(box((-x, under, -z), (x, low, z), c.body, tile=c.tile))
    look = c.body if chance(rng, 0.7) else _BLACK
    thick = max(0.5 * t, between(rng, 0.011, 0.018))
    pieces += _legs(rng, style, look, thick, under)
    if style.niche == "below":
        y, inset = between(rng, 0.14, 0.3) * c.height, 1.2 * thick
        shelf = (inset - x, y, inset - z), (x - inset, y + 0.016, z - inset)
        pieces.append(box(*shelf, c.body, tile=c.tile))
        if chance(rng, 0.3):
            inner = xyz(0.05 - x, y + 0.016, 0.04 - z), xyz(x - 0.05, y + 0.2, z - 0.05)
            pieces += contents(rng, *np.minimum(inner, (9.0, under - 0.01, 9.0)))
    return pieces


def _legs(
    rng: np.random.Generator, style: SingleStyle, look: Material, thick: float, top: float
) -> list[Surface]:
    c = style.cabinet
    inset = thick + 0.002
    x, z = c.width / 2 - inset, c.depth / 2 - inset
    places = [(sx * x, sz * z) for sx in (-1, 1) for sz in (-1, 1)]
    if style.legs == "square":
        return [
            box(
                (px - thick, 0, pz - thick),
                (px + thick, top, pz + thick),
                look,
                tile=c.tile,
                upright=True,
            )
            for px, pz in places
        ]
    if style.legs == "round":
        return [
            s
            for px, pz in places
            for s in cylinder((px, top / 2, pz), 1, thick, top, look, segments=12)
        ]
    if style.legs == "wire":  # hairpins
        ends = []
        for px, pz in places:
            foot = (px, 0.0, pz)
            for dx, dz in ((-0.05, 0.0), (0.0, -0.05)):
                ends.append(((px + np.sign(px) * dx, top, pz + np.sign(pz) * dz), foot))
        return [wires(np.array(ends), 0.0055, _BLACK, sides=6)]
    splay = between(rng, 0.02, 0.06)
    pieces: list[Surface] = []
    for px, pz in places:
        inward = np.array([-np.sign(px), 0.0, -np.sign(pz)])
        foot, head = np.array([px, 0.0, pz]), np.array([px, top, pz]) + splay * inward
        path = foot + np.linspace(0, 1, 3)[:, None] * (head - foot)
        side = np.cross(head - foot, inward)
        pieces.append(tube(path, 0.8 * thick, look, up=side / np.linalg.norm(side), segments=10))
    return pieces


def _brackets(style: SingleStyle) -> list[Surface]:
    """A plate to be screwed under a desk, and two rails that hold the drawer."""
    c = style.cabinet
    x, z, t = c.width / 2, c.depth / 2, c.wall
    low, top = 0.0, c.height
    wide = 0.022
    pieces = [box((-x, top - c.top, -z), (x, top, z), c.body, tile=c.tile)]
    for sign in (-1, 1):
        a, b = sorted((sign * x, sign * (x - t)))
        pieces.append(box((a, low, -z), (b, top - c.top, z), c.body, tile=c.tile))
        a, b = sorted((sign * x, sign * (x + wide)))
        flange = ((a, top - 0.003, -z), (b, top, z))
        pieces.append(box(*flange, c.body, tile=c.tile))
        for share in (-0.7, 0.0, 0.7):
            at = (sign * (x + 0.5 * wide), top - 0.0035, share * z)
            pieces += cylinder(at, 1, 0.0045, 0.0025, _STEEL, segments=10)
        a, b = sorted((sign * (x - t), sign * (x - t - 0.012)))
        pieces.append(box((a, low, -z), (b, low + 0.002, z), c.body))
    pieces.append(box((t - x, low, -z), (x - t, top - c.top, 0.003 - z), c.body, tile=c.tile))
    return pieces


def _sleeve(rng: np.random.Generator, style: SingleStyle, photos: Sequence[Path]) -> list[Surface]:
    """A tube, open in front and mostly closed behind, printed or plain."""
    c = style.cabinet
    x, z, t, h = c.width / 2, c.depth / 2, c.wall, c.height
    pieces = [box((side, t, -z), (side + t, h - t, z), c.body, tile=c.tile) for side in (-x, x - t)]
    pieces.append(box((-x, 0, -z), (x, t, z), c.body, tile=c.tile))
    if chance(rng, 0.7):
        pieces.append(box((t - x, t, -z), (x - t, h - t, t - z), c.body, tile=c.tile))
    if chance(rng, 0.3):  # a notch in the sleeve's upper front edge
        first, other = notched((-x, -z), (x, z), 0.25 * c.width, 0.1 * c.width)
        flip = np.array([1.0, -1.0])  # up is -z here: the notch is at the front
        pieces += slab(other * flip, first * flip, 1, (h - t, h), c.body, tile=c.tile)
    else:
        pieces.append(box((-x, h - t, -z), (x, h, z), c.body, tile=c.tile))
        pieces += _printed(rng, style, photos)
    return pieces


def _printed(rng: np.random.Generator, style: SingleStyle, photos: Sequence[Path]) -> list[Surface]:
    """A label or a picture on the sleeve."""
    c = style.cabinet
    if chance(rng, 0.4):
        return []
    color = prints.paper_color(rng)
    aspect = c.width / c.depth
    image = (
        prints.picture(rng, aspect, color, photos)
        if chance(rng, 0.3)
        else (prints.vintage, prints.brand, prints.pattern)[int(rng.integers(3))](
            rng, aspect, color
        )
    )
    share = 1.0 if chance(rng, 0.5) else between(rng, 0.4, 0.8)
    look = Material(color=(1, 1, 1), texture=image, roughness=between(rng, 0.3, 0.8))
    body = xyz(-c.width / 2, 0, -c.depth / 2), xyz(c.width / 2, c.height, c.depth / 2)
    return [decal(*body, "top", look, size=(share * c.width, share * c.depth))]
