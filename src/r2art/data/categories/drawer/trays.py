"""The drawer itself: its front, the open box behind it, and what lies inside."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from r2art.core.category import Joint
from r2art.data.categories.drawer.contents import contents
from r2art.data.categories.drawer.style import CabinetStyle
from r2art.data.procedural.assembly import bounds
from r2art.data.procedural.randomness import between, chance
from r2art.data.procedural.solids import box, plate
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
Filler = Callable[[np.random.Generator, FloatArray, FloatArray], list[Surface]]
_STEEL = Material(color=(0.62, 0.62, 0.63), roughness=0.35, metallic=0.9)


@dataclass(frozen=True, kw_only=True)
class Fittings:
    """What the drawers of one cabinet share beyond its style (m).

    Attributes:
        side_share: Height of the sides over that of the opening.
        thickness: Of sides and back ...
        floor: ... and of the bottom.
        rails: Whether they run on steel slides.
        clearance: Beside them.
        lift: Under them.
        headroom: Of the opening's height, what no drawer fills.
        shorter: How far they end before the rear wall.
        filled: How likely something lies in one.
        labels: Whether a card is on every front.
    """

    side_share: float
    thickness: float
    floor: float = 0.006
    rails: bool
    clearance: float
    lift: float = 0.008
    headroom: float = 0.012
    shorter: float
    filled: float
    labels: bool


def sample_fittings(rng: np.random.Generator, style: CabinetStyle) -> Fittings:
    """Draw the fittings of a cabinet."""
    side_share = between(rng, 0.55, 0.88)
    thickness = {"tool": 0.003, "tower": 0.003}.get(style.kind, between(rng, 0.006, 0.014))
    rails = style.kind != "tower" and chance(rng, 0.55)
    return Fittings(
        side_share=side_share,
        thickness=thickness,
        rails=rails,
        clearance=0.013 if rails else 0.003,
        shorter=between(rng, 0.01, 0.05),
        filled=between(rng, 0.0, 0.9),
        labels=style.kind in ("pedestal", "tool", "tower") and chance(rng, 0.3),
    )


def front(
    style: CabinetStyle, lower: FloatArray, upper: FloatArray, rng: np.random.Generator
) -> list[Surface]:
    """The front that fills ``lower``..``upper``, plain or panelled."""
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


def tray(
    rng: np.random.Generator,
    style: CabinetStyle,
    fittings: Fittings,
    opening: tuple[float, float],
    front_lower: FloatArray,
    fill: Filler = contents,
) -> list[Surface]:
    """The open box behind a front: bottom, sides, back, slides and what lies inside.

    ``opening`` is the lower and upper y (m) of the opening that it slides into; ``fill`` may
    put things inside.
    """
    t, look, floor = fittings.thickness, style.inside, fittings.floor
    x = style.width / 2 - style.wall - fittings.clearance
    if style.kind == "tower":
        x -= 0.004
    y0 = opening[0] + fittings.lift
    y1 = y0 + fittings.side_share * (opening[1] - opening[0] - fittings.headroom)
    z1, z0 = front_lower[2], -style.depth / 2 + 0.008 + fittings.shorter
    pieces = [
        box((-x, y0, z0), (x, y0 + floor, z1), look, tile=style.tile),
        box((-x, y0 + floor, z0), (t - x, y1, z1), look, tile=style.tile),
        box((x - t, y0 + floor, z0), (x, y1, z1), look, tile=style.tile),
        box((t - x, y0 + floor, z0), (x - t, y1, z0 + t), look, tile=style.tile),
    ]
    if fittings.rails:
        mid, tall = y0 + 0.35 * (y1 - y0), min(0.022, 0.3 * (y1 - y0))
        for a, b in ((-x - 0.01, -x), (x, x + 0.01)):
            pieces.append(box((a, mid - tall, z0), (b, mid + tall, z1 - 0.002), _STEEL))
    if chance(rng, fittings.filled):
        inner = np.array([t - x, y0 + floor, z0 + t]), np.array([x - t, y1, z1])
        pieces += fill(rng, *inner)
    return pieces


def slide(name: str, surfaces: Sequence[Surface], travel: float) -> Joint:
    """The joint of a drawer that opens by ``travel`` times its own depth."""
    lower, upper = bounds(surfaces)
    x, y, z = ((lower + upper) / 2).tolist()
    return Joint(
        name=name,
        kind="prismatic",
        parent=0,
        axis=(0.0, 0.0, 1.0),
        pivot=(x, y, z),
        limits=(0.0, float(travel * (upper - lower)[2])),
    )
