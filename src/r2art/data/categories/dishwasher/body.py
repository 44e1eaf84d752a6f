"""The body: casing, base, worktop, tub, and what is in the tub."""

import numpy as np

from r2art.data.categories.dishwasher.racks import basket, cups, plates, pots, rack, wheels
from r2art.data.categories.dishwasher.style import DishwasherStyle
from r2art.data.pose import transformed
from r2art.data.procedural.carved import carved
from r2art.data.procedural.materials import TILE
from r2art.data.procedural.randomness import between, chance, pick, tinted
from r2art.data.procedural.solids import box, cylinder, decal, plate, xyz
from r2art.data.procedural.textures import label
from r2art.data.procedural.wires import wires
from r2art.data.shape import Material, Surface
from r2art.data.staging import about

FloatArray = np.ndarray
_RUBBER = Material(color=(0.05, 0.05, 0.05), roughness=0.8)
_DARK = Material(color=(0.06, 0.06, 0.065), roughness=0.6)


def body(rng: np.random.Generator, style: DishwasherStyle) -> list[Surface]:
    """All that stands still; closed, nothing of it is where the door's lining is."""
    lower, upper = style.cavity
    margin = xyz(0.012, 0, 0.042)
    room = lower + margin, upper - margin
    return [
        *_casing(rng, style),
        *_base(rng, style),
        *_tub(rng, style),
        *_lower_rack(rng, style, *room),
        *(_upper_racks(rng, style, *room) if style.kind != "tabletop" else []),
    ]


def _casing(rng: np.random.Generator, style: DishwasherStyle) -> list[Surface]:
    """Sides, tub, the rubber around its opening, worktop, a label at the edge."""
    x, top = style.width / 2, style.height - style.top
    lower, upper = style.cavity
    rim = style.body if chance(rng, 0.3) else Material(color=style.tub.color, roughness=0.4)
    pieces = [
        *carved(
            (xyz(-x, style.kick, -style.depth), xyz(x, top, 0)),
            (lower, upper),
            2,
            style.body,
            inside=style.tub,
            rim=rim,
            radius=0.002,
            inner_radius=between(rng, 0.012, 0.035),
            tile=TILE,
        ),
        *_seal(lower, upper),
    ]
    paper = Material(color=(1, 1, 1), texture=label(rng), roughness=0.6)
    place = (xyz(-x, style.kick, -style.depth), xyz(x, top, 0))
    pieces.append(decal(*place, "right", paper, at=(0.06, 0.5), size=(0.03, 0.015)))
    if not style.top:
        return pieces
    front = style.door + between(rng, -0.002, 0.022)
    edge = between(rng, 0.001, 0.4 * style.top)
    return [
        *pieces,
        *plate(
            (-x, top, -style.depth),
            (x, style.height, front),
            1,
            style.top_look,
            radius=between(rng, 0.001, 0.012),
            bevel=(0.001, edge),
            tile=TILE,
        ),
    ]


def _seal(lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Rubber along the sides and the top of the opening."""
    (x0, y0, _), (x1, y1, _) = lower + 0.004, upper - 0.004
    corners = np.array([[x0, y0, -0.018], [x0, y1, -0.018], [x1, y1, -0.018], [x1, y0, -0.018]])
    return [wires(np.stack([corners[:-1], corners[1:]], axis=1), 0.005, _RUBBER)]


def _base(rng: np.random.Generator, style: DishwasherStyle) -> list[Surface]:
    """What is below the door: a base on feet, its front set back."""
    x, foot = style.width / 2, between(rng, 0.008, 0.018)
    side = style.body if style.kind in ("freestanding", "tabletop") else _DARK
    lower, upper = xyz(-x, foot, -style.depth), xyz(x, style.kick, -style.recess)
    pieces = [box(lower, upper, side, tile=TILE), decal(lower, upper, "front", style.kick_look)]
    if style.kind == "american" and chance(rng, 0.5):  # a grille in the toe kick
        for k in range(7):
            slot = (2 * x * 0.7, 0.002)
            pieces.append(
                decal(
                    lower, upper, "front", _RUBBER, at=(0.5, 0.25 + 0.08 * k), size=slot, lift=6e-4
                )
            )
    at = [
        (sx * (x - 0.04), z) for sx in (-1, 1) for z in (-style.depth + 0.04, -style.recess - 0.05)
    ]
    return pieces + [
        s for px, z in at for s in cylinder((px, foot / 2, z), 1, 0.018, foot, _DARK, segments=10)
    ]


def _tub(rng: np.random.Generator, style: DishwasherStyle) -> list[Surface]:
    """Filter, lower spray arm, supply pipe behind, vent at the side, pressed ribs."""
    lower, upper = style.cavity
    size = upper - lower
    plastic = Material(
        color=tinted(rng, pick(rng, ((0.5, 0.51, 0.53), (0.2, 0.2, 0.21)))), roughness=0.5
    )
    middle = xyz(0, lower[1], (lower[2] + upper[2]) / 2)
    filter_at = middle + xyz(between(rng, -0.1, 0.1), 0.006, between(rng, 0.08, 0.14))
    pipe = xyz(between(rng, -0.05, 0.05), lower[1] + 0.02, lower[2])
    rib = xyz(0, 0.55 * size[1], 0.004)
    pieces = [
        *cylinder(filter_at, 1, 0.055, 0.012, plastic, segments=20, bevel=0.003),
        *cylinder(filter_at + xyz(0, 0.012, 0), 1, 0.03, 0.02, _DARK, segments=14),
        *plate(
            pipe - xyz(0.022, 0, 0),
            pipe + xyz(0.022, 0.6 * size[1], 0.02),
            2,
            plastic,
            bevel=(0, 0.008),
        ),
        *_spray_arm(rng, middle + xyz(0, 0.045, 0), 0.46 * min(size[0], size[2]), plastic),
        *cylinder(middle + xyz(0, 0.022, 0), 1, 0.022, 0.044, plastic, segments=12),
        *cylinder(
            xyz(upper[0] - 0.004, lower[1] + 0.3 * size[1], middle[2]),
            0,
            0.05,
            0.008,
            plastic,
            segments=20,
        ),
    ]
    for x in (-0.3, 0.3):
        at = xyz(x * size[0], lower[1] + 0.2 * size[1], lower[2])
        pieces += plate(
            at - xyz(0.03, 0, 0),
            at + rib + xyz(0.03, 0, 0),
            2,
            style.tub,
            radius=0.02,
            bevel=(0, 0.002),
        )
    return pieces


def _spray_arm(
    rng: np.random.Generator, at: FloatArray, reach: float, look: Material
) -> list[Surface]:
    """Two wings that stand at any angle."""
    wide = between(rng, 0.016, 0.026)
    arm = plate(xyz(-reach, 0, -wide), xyz(reach, 0.012, wide), 1, look, radius=wide, bevel=0.004)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = about(1, between(rng, 0, np.pi)), at
    holes = [
        decal(xyz(x, 0, 0), xyz(x, 0.012, 0), "top", _DARK, size=(0.012, 0.004))
        for x in np.linspace(-0.85, 0.85, 7) * reach
    ]
    return [transformed(s, pose) for s in (*arm, *holes)]


def _lower_rack(
    rng: np.random.Generator, style: DishwasherStyle, lower: FloatArray, upper: FloatArray
) -> list[Surface]:
    """The rack that rolls on the tub's floor, with plates, pots and cutlery."""
    tall = min(between(rng, 0.11, 0.15), 0.4 * (upper - lower)[1])
    low = lower + xyz(0.012, 0.07, 0)
    high = np.array([upper[0] - 0.012, low[1] + tall, upper[2]])
    space = low + xyz(0.01, 0.004, 0.01), np.array([high[0] - 0.01, low[1] + 0.275, high[2] - 0.02])
    space[1][1] = min(space[1][1], upper[1] - 0.01)
    pieces = [*rack(rng, low, high, style.wire, tines=between(rng, 0.05, 0.09))]
    pieces += wheels(rng, low, high)
    if chance(rng, 0.55):
        pieces += basket(
            rng, xyz(pick(rng, (low[0] + 0.02, high[0] - 0.24)), low[1] + 0.004, high[2] - 0.012)
        )
    load = pick(rng, ("", "", "plates", "plates", "pots", "cups"))
    if load == "plates":
        pieces += plates(rng, *space)
    elif load == "pots":
        pieces += pots(rng, space[0], np.minimum(space[1], space[0] + xyz(1, 0.17, 1)))
    elif load == "cups":
        pieces += cups(rng, *space)
    return pieces


def _upper_racks(
    rng: np.random.Generator, style: DishwasherStyle, lower: FloatArray, upper: FloatArray
) -> list[Surface]:
    """The upper rack on its rails, the spray arm below it, perhaps a tray for cutlery above."""
    floor = lower[1] + between(rng, 0.56, 0.64) * (upper - lower)[1]
    low = np.array([lower[0], floor, lower[2]])
    high = np.array([upper[0], floor + between(rng, 0.085, 0.12), upper[2] - between(rng, 0, 0.02)])
    grey = Material(color=(0.55, 0.56, 0.58), roughness=0.5)
    pieces = [*rack(rng, low, high, style.wire, tines=between(rng, 0.03, 0.06))]
    middle = (low + high) / 2 * (1, 0, 1) + xyz(0, floor - 0.025, 0)
    pieces += _spray_arm(rng, middle, 0.4 * min(high[0] - low[0], high[2] - low[2]), grey)
    for x in (lower[0] - 0.011, upper[0] + 0.003):  # rails
        y = floor + 0.05
        pieces.append(box((x, y, low[2]), (x + 0.008, y + 0.018, high[2]), style.tub))
    if chance(rng, 0.6):  # the grip of the rack
        grip = xyz((low[0] + high[0]) / 2, floor + 0.04, high[2])
        pieces += plate(
            grip - xyz(0.06, 0.012, 0.004), grip + xyz(0.06, 0.016, 0.006), 2, grey, radius=0.006
        )
    room = upper[1] - high[1]
    if chance(rng, 0.6):
        pieces += cups(rng, low + 0.01, np.array([high[0], upper[1] - 0.07, high[2]]))
    if room > 0.1 and chance(rng, 0.35):
        tray = xyz(lower[0], upper[1] - 0.055, lower[2]), xyz(upper[0], upper[1] - 0.025, high[2])
        pieces += rack(rng, *tray, style.wire, tines=0.012)
    return pieces
