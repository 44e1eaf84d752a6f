"""Cabinets of three drawers: bedside tables, office pedestals, dressers, tool cabinets, towers."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from r2art.core.category import Mirror
from r2art.data.categories.drawer.style import CabinetStyle, sample_style
from r2art.data.categories.drawer.supports import supports
from r2art.data.categories.drawer.trays import Fittings, front, sample_fittings, slide, tray
from r2art.data.procedural.assembly import assembled
from r2art.data.procedural.handles import handles, lock
from r2art.data.procedural.randomness import between, chance
from r2art.data.procedural.solids import box, decal, plate
from r2art.data.procedural.textures import label
from r2art.data.shape import Instance, Material, Surface
from r2art.data.staging import Staging

DRAWERS = ("top", "middle", "bottom")
FloatArray = np.ndarray
STAGING = Staging()

MIRROR = Mirror(swap=(0, 1, 2, 3))


def generate(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Instance:
    """A ``cabinet`` with ``drawer_top``, ``_middle`` and ``_bottom``; all closed at rest."""
    del photos  # nothing on a cabinet shows one
    shape_rng, look_rng, joint_rng = rng.spawn(3)
    style = sample_style(shape_rng)
    openings = _openings(style)
    parts: dict[str, list[Surface]] = {"cabinet": _cabinet(look_rng, style, openings)}
    fittings = sample_fittings(look_rng, style)
    for k, name in enumerate(DRAWERS):
        parts[f"drawer_{name}"] = _drawer(look_rng, style, fittings, openings, k)
    travel = between(joint_rng, 0.75, 0.95)
    joints = [slide(f"slide_{name}", parts[f"drawer_{name}"], travel) for name in DRAWERS]
    return assembled("drawer", parts, joints)


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
    return pieces + supports(rng, style)


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
    fittings: Fittings,
    openings: list[tuple[float, float]],
    k: int,
) -> list[Surface]:
    lower, upper = _front_box(style, openings, k)
    pieces = front(style, lower, upper, rng)
    pieces += handles(style.handle, lower, upper)
    if style.handle.lock and k == 0:
        pieces += lock(lower, upper)
    if fittings.labels:
        card = Material(color=(1, 1, 1), texture=label(rng), roughness=0.8)
        pieces.append(decal(lower, upper, "front", card, at=(0.2, 0.78), size=(0.06, 0.03)))
    return pieces + tray(rng, style, fittings, openings[k], lower)
