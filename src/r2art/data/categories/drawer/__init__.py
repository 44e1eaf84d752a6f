"""Cabinets of three drawers: bedside tables, office pedestals, dressers, tool cabinets, towers."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from r2art.core.category import Joint
from r2art.data.categories.drawer.contents import contents
from r2art.data.categories.drawer.style import CabinetStyle, sample_style
from r2art.data.procedural.assembly import assembled, bounds
from r2art.data.procedural.handles import handles, lock
from r2art.data.procedural.randomness import between, chance
from r2art.data.procedural.solids import box, cylinder, decal, plate
from r2art.data.procedural.textures import label
from r2art.data.shape import Instance, Material, Surface
from r2art.data.staging import Staging

DRAWERS = ("top", "middle", "bottom")
FloatArray = np.ndarray
STAGING = Staging()
_STEEL = Material(color=(0.62, 0.62, 0.63), roughness=0.35, metallic=0.9)


def generate(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Instance:
    """A ``cabinet`` with ``drawer_top``, ``_middle`` and ``_bottom``; all closed at rest."""
    del photos  # nothing on a cabinet shows one
    shape_rng, look_rng, joint_rng = rng.spawn(3)
    style = sample_style(shape_rng)
    openings = _openings(style)
    parts: dict[str, list[Surface]] = {"cabinet": _cabinet(look_rng, style, openings)}
    fittings = _Fittings(look_rng, style)
    for k, name in enumerate(DRAWERS):
        parts[f"drawer_{name}"] = _drawer(look_rng, style, fittings, openings, k)
    travel = between(joint_rng, 0.75, 0.95)
    joints = [_slide(name, parts[f"drawer_{name}"], travel) for name in DRAWERS]
    return assembled("drawer", parts, joints)


def _slide(name: str, surfaces: Sequence[Surface], travel: float) -> Joint:
    lower, upper = bounds(surfaces)
    x, y, z = ((lower + upper) / 2).tolist()
    return Joint(
        name=f"slide_{name}",
        kind="prismatic",
        parent=0,
        axis=(0.0, 0.0, 1.0),
        pivot=(x, y, z),
        limits=(0.0, float(travel * (upper - lower)[2])),
    )


class _Fittings:
    """What the three drawers of one cabinet share beyond its style."""

    def __init__(self, rng: np.random.Generator, style: CabinetStyle) -> None:
        self.side_share = between(rng, 0.55, 0.88)
        self.thickness = {"tool": 0.003, "tower": 0.003}.get(style.kind, between(rng, 0.006, 0.014))
        self.rails = style.kind != "tower" and chance(rng, 0.55)
        self.clearance = 0.013 if self.rails else 0.003
        self.shorter = between(rng, 0.01, 0.05)
        self.filled = between(rng, 0.0, 0.9)
        self.labels = style.kind in ("pedestal", "tool", "tower") and chance(rng, 0.3)


def _openings(style: CabinetStyle) -> list[tuple[float, float]]:
    """Lower and upper y of the three openings of the carcass, top first, rails left out."""
    rail = style.wall if style.dividers else 0.0
    low = style.support_height + style.wall
    high = style.height - style.top
    room = high - low - 2 * rail
    shares = np.array(style.shares) / sum(style.shares)
    edges, y = [], high
    for share in shares:
        edges.append((y - share * room, y))
        y -= share * room + rail
    return edges


def _cabinet(
    rng: np.random.Generator, style: CabinetStyle, openings: list[tuple[float, float]]
) -> list[Surface]:
    x, z, t = style.width / 2, style.depth / 2, style.wall
    low, high = style.support_height, style.height - style.top
    tile, body = style.tile, style.body
    shift = (between(rng, 0, 1), between(rng, 0, 1))
    pieces = []
    if style.kind == "tower":
        pieces += _tower_frame(style, low, high)
    else:
        for side in (-x, x - t):
            pieces.append(
                box(
                    (side, low, -z),
                    (side + t, high, z),
                    body,
                    tile=tile,
                    upright=True,
                    offset=shift,
                )
            )
    pieces.append(box((t - x, low, -z), (x - t, low + t, z), body, tile=tile, offset=shift))
    pieces.append(box((t - x, low + t, -z), (x - t, high, 0.006 - z), body, tile=tile))
    if style.dividers:
        deep = 0.06 if chance(rng, 0.5) else style.depth - 0.01
        for _, y in openings[1:]:
            pieces.append(
                box((t - x, y, z - deep), (x - t, y + t, z), body, tile=tile, offset=shift)
            )
    pieces += _top(rng, style)
    return pieces + _supports(rng, style)


def _tower_frame(style: CabinetStyle, low: float, high: float) -> list[Surface]:
    """Four posts instead of sides."""
    x, z, post = style.width / 2, style.depth / 2, 0.028
    return [
        box((px, low, pz), (px + style.wall, high, pz + post), style.body, tile=style.tile)
        for px in (-x, x - style.wall)
        for pz in (-z, z - post)
    ]


def _top(rng: np.random.Generator, style: CabinetStyle) -> tuple[Surface, ...]:
    x, z, over = style.width / 2, style.depth / 2, style.overhang
    front = z + over
    if not style.inset and over == 0.0 and chance(rng, 0.6):
        front = z + style.front  # the top covers the fronts
    lower = (-x - over, style.height - style.top, -z)
    upper = (x + over, style.height, front)
    radius = between(rng, 0.0, 0.03) if chance(rng, 0.5) else 0.001
    return plate(
        lower,
        upper,
        1,
        style.top_look,
        radius=radius,
        bevel=(0.0, min(0.4 * style.top, style.edge + 0.001)),
        tile=style.tile,
    )


def _supports(rng: np.random.Generator, style: CabinetStyle) -> list[Surface]:
    x, z, h = style.width / 2, style.depth / 2, style.support_height
    look = style.support_look
    if style.support == "none" or h <= 0.0:
        return []
    if style.support == "plinth":
        back = between(rng, 0.0, 0.05)
        return [box((-x + 0.002, 0, -z), (x - 0.002, h, z - back), look, tile=style.tile)]
    thick = between(rng, 0.012, 0.024)
    place = [(sx * (x - 1.6 * thick), sz * (z - 1.6 * thick)) for sx in (-1, 1) for sz in (-1, 1)]
    if style.support == "castors":
        return [s for px, pz in place for s in _castor(look, px, pz, h)]
    if style.support == "legs" and chance(rng, 0.5):
        return [
            box((px - thick, 0, pz - thick), (px + thick, h, pz + thick), look, tile=style.tile)
            for px, pz in place
        ]
    return [
        s for px, pz in place for s in cylinder((px, h / 2, pz), 1, thick, h, look, segments=12)
    ]


def _castor(look: Material, x: float, z: float, height: float) -> list[Surface]:
    radius = 0.42 * height
    wheels = [
        s
        for dx in (-0.009, 0.009)
        for s in cylinder((x + dx, radius, z - 0.01), 0, radius, 0.013, look, bevel=0.002)
    ]
    hood = box((x - 0.012, radius, z - 0.012), (x + 0.012, height, z + 0.012), look)
    return [*wheels, hood]


def _front_box(
    style: CabinetStyle, openings: list[tuple[float, float]], k: int
) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corner of front ``k``: within its opening, or before the carcass."""
    low, high = openings[k]
    x, z, gap = style.width / 2, style.depth / 2, style.gap
    if style.inset:
        back = z - style.front - (0.0 if style.kind != "tower" else 0.004)
        return (
            np.array([-x + style.wall + gap, low + gap, back]),
            np.array([x - style.wall - gap, high - gap, back + style.front]),
        )
    rail = style.wall / 2 if style.dividers else 0.0
    bottom = low - (rail if k < 2 else style.wall)
    top = high + (rail if k > 0 else -0.0)
    return (
        np.array([-x + 0.001, bottom + gap / 2, z + 0.0015]),
        np.array([x - 0.001, top - gap / 2 - (0.001 if k == 0 else 0), z + style.front]),
    )


def _drawer(
    rng: np.random.Generator,
    style: CabinetStyle,
    fittings: _Fittings,
    openings: list[tuple[float, float]],
    k: int,
) -> list[Surface]:
    lower, upper = _front_box(style, openings, k)
    pieces = _front(style, lower, upper, rng)
    pieces += handles(style.handle, lower, upper)
    if style.handle.lock and k == 0:
        pieces += lock(lower, upper)
    if fittings.labels:
        card = Material(color=(1, 1, 1), texture=label(rng), roughness=0.8)
        pieces.append(decal(lower, upper, "front", card, at=(0.2, 0.78), size=(0.06, 0.03)))
    return pieces + _tray(rng, style, fittings, openings[k], lower)


def _front(
    style: CabinetStyle, lower: FloatArray, upper: FloatArray, rng: np.random.Generator
) -> list[Surface]:
    look, tile = style.front_look, style.tile
    offset = (between(rng, 0, 1), between(rng, 0, 1))
    if style.edge > 0.0:
        pieces = [
            *plate(lower, upper, 2, look, radius=style.edge, bevel=(0.0, style.edge), tile=tile)
        ]
    else:
        pieces = [box(lower, upper, look, tile=tile, offset=offset)]
    rim = min(0.05, 0.28 * (upper[1] - lower[1]))
    z0, z1 = upper[2], upper[2] + 0.006
    if style.panel == "raised":
        pieces += plate(
            (lower[0] + rim, lower[1] + rim, z0),
            (upper[0] - rim, upper[1] - rim, z1),
            2,
            look,
            bevel=(0.0, 0.004),
            tile=tile,
        )
    if style.panel == "frame":
        (x0, y0, _), (x1, y1, _) = lower, upper
        for a, b, c, d in (
            (x0, x1, y0, y0 + rim),
            (x0, x1, y1 - rim, y1),
            (x0, x0 + rim, y0 + rim, y1 - rim),
            (x1 - rim, x1, y0 + rim, y1 - rim),
        ):
            pieces.append(box((a, c, z0), (b, d, z1), look, tile=tile, upright=b - a <= rim))
    return pieces


def _tray(
    rng: np.random.Generator,
    style: CabinetStyle,
    fittings: _Fittings,
    opening: tuple[float, float],
    front_lower: FloatArray,
) -> list[Surface]:
    """The open box behind a front: bottom, sides, back, slides and what lies inside."""
    t, look = fittings.thickness, style.inside
    x = style.width / 2 - style.wall - fittings.clearance
    if style.kind == "tower":
        x -= 0.004
    y0 = opening[0] + 0.008
    y1 = y0 + fittings.side_share * (opening[1] - opening[0] - 0.012)
    z1, z0 = front_lower[2], -style.depth / 2 + 0.008 + fittings.shorter
    pieces = [
        box((-x, y0, z0), (x, y0 + 0.006, z1), look, tile=style.tile),
        box((-x, y0 + 0.006, z0), (t - x, y1, z1), look, tile=style.tile),
        box((x - t, y0 + 0.006, z0), (x, y1, z1), look, tile=style.tile),
        box((t - x, y0 + 0.006, z0), (x - t, y1, z0 + t), look, tile=style.tile),
    ]
    if fittings.rails:
        mid, tall = y0 + 0.35 * (y1 - y0), min(0.022, 0.3 * (y1 - y0))
        for a, b in ((-x - 0.01, -x), (x, x + 0.01)):
            pieces.append(box((a, mid - tall, z0), (b, mid + tall, z1 - 0.002), _STEEL))
    if chance(rng, fittings.filled):
        inner = np.array([t - x, y0 + 0.006, z0 + t]), np.array([x - t, y1, z1])
        pieces += contents(rng, *inner)
    return pieces
