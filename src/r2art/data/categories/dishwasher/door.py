"""The door: its front with controls and handle, and its inside with the detergent dispenser."""

from dataclasses import replace

import numpy as np

from r2art.data.categories.dishwasher.controls import Strip, controls, energy_label, top_edge
from r2art.data.categories.dishwasher.style import GAP, DishwasherStyle
from r2art.data.procedural.carved import carved
from r2art.data.procedural.grips import grip
from r2art.data.procedural.materials import TILE
from r2art.data.procedural.randomness import between, chance, pick, tinted
from r2art.data.procedural.solids import box, cylinder, decal, plate, xyz
from r2art.data.procedural.textures import sticker_image
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
_PANEL = 0.018  # m, thickness of what covers the front
_GRIPS = ("bar", "rod", "bow")
_PANE = Material(color=(0.035, 0.037, 0.04), roughness=0.06)
_DARK = Material(color=(0.04, 0.04, 0.045), roughness=0.7)


def door(rng: np.random.Generator, style: DishwasherStyle) -> list[Surface]:
    """All of the door, shut."""
    low, high = style.door_span
    x, split = style.width / 2 - 0.001, high - _strip_height(rng, style)
    core_look = Material(color=(0.5, 0.51, 0.52), roughness=0.5)
    if style.kind in ("freestanding", "tabletop"):
        core_look = style.body
    pieces = [box((-x, low, GAP), (x, split, style.door - _PANEL), core_look)]
    front = xyz(-x, low, style.door - _PANEL), xyz(x, split, style.door)
    pieces += _panel(rng, style, *front)
    if split < high:
        bulge = between(rng, -0.003, 0.009)
        strip = xyz(-x, split + 0.0025, GAP), xyz(x, high, style.door + bulge)
        pieces += _strip(rng, style, *strip)
    whole = xyz(-x, low, GAP), xyz(x, high, style.door)
    if not style.fascia and style.kind != "semi":
        pieces += top_edge(rng, *whole)
    pieces += _handle(rng, style, *front)
    pieces += _marks(rng, style, *front)
    return [*pieces, *_inside(rng, style)]


def _strip_height(rng: np.random.Generator, style: DishwasherStyle) -> float:
    """Height of what is above the main panel: the controls, or only a pocket to pull at."""
    if style.fascia:
        return style.fascia
    return between(rng, 0.05, 0.075) if style.handle == "pocket" else 0.0


def _panel(
    rng: np.random.Generator, style: DishwasherStyle, lower: FloatArray, upper: FloatArray
) -> list[Surface]:
    """The main panel: a sheet of metal, or a furniture front."""
    if style.kind not in ("integrated", "semi"):
        edge = between(rng, 0.002, 0.006)
        sheet = plate(lower, upper, 2, style.front, radius=edge, bevel=(0.0, edge), tile=TILE)
        window = style.kind == "tabletop" and chance(rng, 0.4)
        return [*sheet, *(_window(rng, lower, upper) if window else [])]
    (x0, y0, _), (x1, y1, z1) = lower.tolist(), upper.tolist()
    shift = between(rng, 0, 1), between(rng, 0, 1)
    board = box(lower, upper, style.front, tile=TILE, offset=shift)
    pieces = [replace(board, uv=board.uv[:, ::-1])]  # grain runs upwards
    if style.shaker:
        rim = between(rng, 0.05, 0.08)
        for a, b, c, d in (
            (x0, x1, y0, y0 + rim),
            (x0, x1, y1 - rim, y1),
            (x0, x0 + rim, y0 + rim, y1 - rim),
            (x1 - rim, x1, y0 + rim, y1 - rim),
        ):
            ends = (a, c, z1), (b, d, z1 + 0.007)
            pieces.append(box(*ends, style.front, tile=TILE, upright=b - a <= rim, offset=shift))
    return pieces


def _window(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Dark glass in the upper part of the panel."""
    size = upper - lower
    low = lower + size * (between(rng, 0.06, 0.16), between(rng, 0.15, 0.4), 1)
    high = np.array([-low[0], upper[1] - between(rng, 0.02, 0.06), upper[2] + 0.003])
    return [*plate(low, high, 2, _PANE, radius=between(rng, 0.004, 0.03), bevel=(0.0, 0.001))]


def _strip(
    rng: np.random.Generator, style: DishwasherStyle, lower: FloatArray, upper: FloatArray
) -> list[Surface]:
    """What is above the main panel, with its controls and perhaps a pocket to pull at."""
    size = upper - lower
    look = style.fascia_look if style.fascia else style.front
    pocket = None
    if style.handle == "pocket":
        wide = size[0] * (between(rng, 0.24, 0.45) if style.fascia else between(rng, 0.3, 0.92))
        tall = size[1] * between(rng, 0.42, 0.62)
        foot = size[1] * between(rng, 0.06, 0.2)
        left = (size[0] - wide) / 2
        pocket = lower + xyz(left, foot, 0.016), lower + xyz(left + wide, foot + tall, size[2])
    strip = Strip(
        lower, upper, look, None if pocket is None else (float(pocket[0][0]), float(pocket[1][0]))
    )
    pieces = controls(rng, strip) if style.fascia else []
    face = strip.face() if style.fascia else None
    if pocket is None:
        edge = between(rng, 0.002, 0.008)
        return [
            *pieces,
            *plate(lower, upper, 2, look, radius=edge, bevel=(0, edge), top=face, tile=TILE),
        ]
    shape = carved(
        (lower, upper),
        pocket,
        2,
        look,
        inside=_DARK,
        rim=face,
        inner_radius=between(rng, 0.002, 0.012),
        tile=TILE,
    )
    return [*pieces, *shape]


def _handle(
    rng: np.random.Generator, style: DishwasherStyle, lower: FloatArray, upper: FloatArray
) -> list[Surface]:
    """A bar across the upper part of the front that is given, or a lip along its edge."""
    size = upper - lower
    middle = xyz(0, upper[1], upper[2])
    if style.handle == "lip":
        return [
            *plate(
                middle - xyz(0.49 * size[0], 0.022, 0.001),
                middle + xyz(0.49 * size[0], 0, between(rng, 0.014, 0.024)),
                2,
                style.trim,
                radius=0.004,
                bevel=(0, 0.006),
            )
        ]
    if style.handle not in _GRIPS:
        return []
    furniture = style.kind in ("integrated", "semi")
    length = (
        pick(rng, (0.16, 0.192, 0.32, 0.8 * size[0]))
        if furniture
        else between(rng, 0.7, 0.93) * size[0]
    )
    at = middle - xyz(0, between(rng, 0.035, 0.075), 0)
    return grip(
        rng, at, 0, min(length, 0.93 * size[0]), between(rng, 0.03, 0.05), style.trim, style.handle
    )


def _marks(
    rng: np.random.Generator, style: DishwasherStyle, lower: FloatArray, upper: FloatArray
) -> list[Surface]:
    """A maker's badge and, on a new machine, its energy label."""
    pieces = []
    if style.kind not in ("integrated", "semi") and chance(rng, 0.5):
        badge = Material(
            color=(1, 1, 1), texture=sticker_image(rng, style.front.color), roughness=0.4
        )
        at = pick(rng, ((0.5, 0.93), (0.12, 0.95), (0.88, 0.06), (0.5, 0.82)))
        pieces.append(decal(lower, upper, "front", badge, at=at, size=(0.07, 0.0175)))
    if chance(rng, 0.07):
        sticker = Material(color=(1, 1, 1), texture=energy_label(rng), roughness=0.5)
        at = between(rng, 0.2, 0.8), between(rng, 0.45, 0.8)
        pieces.append(decal(lower, upper, "front", sticker, at=at, size=(0.09, 0.18), lift=8e-4))
    return pieces


def _inside(rng: np.random.Generator, style: DishwasherStyle) -> list[Surface]:
    """The lining, pressed like the tub and of its material, with dispenser and lower seal."""
    lower, upper = style.cavity
    lower, upper = lower + xyz(0.007, 0.006, 0), upper - xyz(0.007, 0.007, 0)
    lower[2], upper[2] = -between(rng, 0.008, 0.014), GAP + 1e-3
    size = upper - lower
    look = replace(style.tub, emission=0.0)
    raised = lower + size * (0.1, 0.12, 0) - (0, 0, 0.004), upper - size * (0.1, 0.07, 0.5)
    low, high = style.door_span
    x = style.width / 2 - 0.001
    return [
        decal((-x, low, GAP), (x, high, GAP), "back", look),
        *plate(lower, upper, 2, look, radius=0.025, bevel=(0.007, 0.0)),
        *plate(*raised, 2, look, radius=0.04, bevel=(0.003, 0.0)),
        box(
            (lower[0] + 0.01, lower[1] + 0.004, lower[2] - 0.005),
            (upper[0] - 0.01, lower[1] + 0.014, lower[2]),
            _DARK,
        ),
        *_dispenser(
            rng,
            xyz(
                between(rng, -0.06, 0.06),
                lower[1] + between(rng, 0.42, 0.62) * size[1],
                raised[0][2],
            ),
        ),
    ]


def _dispenser(rng: np.random.Generator, at: FloatArray) -> list[Surface]:
    """Detergent lid and the cap of the rinse aid; they face -z."""
    grey = pick(rng, ((0.55, 0.56, 0.58), (0.8, 0.8, 0.8), (0.3, 0.31, 0.33)))
    case = Material(color=tinted(rng, grey, 0.03), roughness=0.5)
    lid = Material(
        color=tinted(rng, pick(rng, ((0.75, 0.76, 0.78), (0.5, 0.5, 0.52))), 0.03), roughness=0.4
    )
    side = pick(rng, (-1, 1))
    cap, cover = at + xyz(0.05 * side, 0, -0.009), at - xyz(0.03 * side, 0, 0)
    return [
        *plate(
            at - xyz(0.09, 0.052, 0.008),
            at + xyz(0.09, 0.052, 0),
            2,
            case,
            radius=0.014,
            bevel=(0.004, 0),
        ),
        *plate(
            cover - xyz(0.042, 0.04, 0.014),
            cover + xyz(0.042, 0.04, 0),
            2,
            lid,
            radius=0.01,
            bevel=(0.004, 0),
        ),
        *cylinder(cap, 2, 0.021, 0.012, _DARK, bevel=0.003),
        box(cap - xyz(0.018, 0.003, 0.009), cap + xyz(0.018, 0.003, 0), lid),
    ]
