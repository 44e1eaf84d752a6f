"""What a cabinet of three drawers is like before it is built: measures, colours, materials."""

from dataclasses import dataclass

import numpy as np

from r2art.data.procedural.handles import HandleStyle, sample_handle
from r2art.data.procedural.materials import (
    LACQUERS,
    PAINTS,
    TILE,
    WOODS,
    painted,
    steel,
    wooden,
)
from r2art.data.procedural.randomness import (
    Color,
    between,
    chance,
    pick,
    spread,
    tinted,
    weighted,
)
from r2art.data.shape import Material

_TOOL_COLORS: tuple[Color, ...] = (
    (0.7, 0.07, 0.07),
    (0.13, 0.13, 0.14),
    (0.08, 0.2, 0.55),
    (0.55, 0.56, 0.58),
    (0.9, 0.45, 0.05),
    (0.1, 0.35, 0.2),
)
_PLASTICS: tuple[Color, ...] = (
    (0.93, 0.93, 0.93),
    (0.8, 0.86, 0.9),
    (0.12, 0.12, 0.12),
    (0.6, 0.75, 0.85),
    (0.9, 0.7, 0.75),
    (0.75, 0.85, 0.7),
)


@dataclass(frozen=True)
class CabinetStyle:
    """Measures (m) and looks of one cabinet; ``height`` is overall, legs and all."""

    kind: str
    width: float
    height: float
    depth: float
    wall: float
    top: float
    overhang: float
    support: str
    support_height: float
    front: float
    inset: bool
    gap: float
    dividers: bool
    shares: tuple[float, ...]
    body: Material
    top_look: Material
    front_look: Material
    inside: Material
    support_look: Material
    panel: str
    edge: float
    handle: HandleStyle
    tile: float | None


_SHAPES = {  # width / height, depth / height, wall, support
    "bedside": ((0.62, 1.0), (0.6, 0.85), (0.014, 0.022)),
    "pedestal": ((0.6, 0.78), (0.75, 1.0), (0.012, 0.019)),
    "dresser": ((0.95, 1.35), (0.58, 0.8), (0.016, 0.024)),
    "tool": ((0.8, 1.2), (0.6, 0.8), (0.01, 0.02)),
    "tower": ((0.52, 0.75), (0.55, 0.75), (0.008, 0.014)),
}


def sample_style(rng: np.random.Generator) -> CabinetStyle:
    """Draw a bedside table, office pedestal, dresser, tool cabinet or plastic tower."""
    kind = weighted(
        rng, {"bedside": 3.2, "pedestal": 2.4, "dresser": 2.2, "tool": 1.1, "tower": 1.1}
    )
    wide, deep, walls = _SHAPES[kind]
    height = spread(rng, 0.61, 0.085, 0.45, 0.8)
    width = float(np.clip(height * between(rng, *wide), 0.3, 0.8))
    depth = float(np.clip(height * between(rng, *deep), 0.34, 0.6))
    body, top_look, front_look, inside, tile = looks(rng, kind)
    support, support_height = _support(rng, kind, height)
    inset = kind in ("tool", "tower") or chance(rng, 0.3)
    top = 0.012 if kind in ("tool", "tower") else between(rng, 0.014, 0.035)
    overhangs = kind in ("bedside", "dresser") and chance(rng, 0.6)
    return CabinetStyle(
        kind=kind,
        width=width,
        height=height,
        depth=depth,
        wall=between(rng, *walls),
        top=top,
        overhang=between(rng, 0.004, 0.025) if overhangs else 0.0,
        support=support,
        support_height=support_height,
        front=between(rng, 0.015, 0.024) if kind not in ("tool", "tower") else 0.012,
        inset=inset,
        gap=between(rng, 0.002, 0.006),
        dividers=inset or chance(rng, 0.5),
        shares=_shares(rng, kind),
        body=body,
        top_look=top_look,
        front_look=front_look,
        inside=inside,
        support_look=support_look(rng, support, body),
        panel=panel(rng, kind),
        edge=pick(rng, (0.0, 0.0006, 0.002, 0.005)),
        handle=sample_handle(rng, kind, width, front_look),
        tile=tile,
    )


def _shares(rng: np.random.Generator, kind: str) -> tuple[float, ...]:
    """Heights of the three drawers, top first, as shares of the whole."""
    choices = {
        (1.0, 1.0, 1.0): 5,
        (1.0, 1.2, 1.45): 2,
        (1.0, 1.0, 1.35): 1.0,
        (0.6, 1.0, 1.1): 1.2,
        (1.0, 1.0, 2.0): 3 if kind == "pedestal" else 0.3,
        (0.5, 1.0, 1.9): 2 if kind == "pedestal" else 0.0,
    }
    return weighted(rng, choices)


def panel(rng: np.random.Generator, kind: str) -> str:
    """How a front is panelled: ``flat``, ``frame`` or ``raised``."""
    if kind in ("bedside", "dresser"):
        return weighted(rng, {"flat": 6, "frame": 2, "raised": 1.5})
    return "flat"


def _support(rng: np.random.Generator, kind: str, height: float) -> tuple[str, float]:
    if kind in ("pedestal", "tool", "tower"):
        name = weighted(rng, {"castors": 6, "plinth": 2, "feet": 2, "none": 1})
    else:
        name = weighted(rng, {"legs": 4, "plinth": 2.5, "feet": 1.5, "none": 1.5})
    low, high = {
        "castors": (0.045, 0.075),
        "legs": (0.07, 0.24),
        "plinth": (0.03, 0.08),
        "feet": (0.01, 0.04),
        "none": (0.0, 0.0),
    }[name]
    return name, min(between(rng, low, high), 0.3 * height)


def support_look(rng: np.random.Generator, support: str, body: Material) -> Material:
    """Look of what a cabinet stands on."""
    black = Material(color=(0.06, 0.06, 0.06), roughness=0.6)
    if support == "castors":
        return black if chance(rng, 0.8) else Material(color=(0.5, 0.5, 0.5), roughness=0.5)
    if support == "legs" and chance(rng, 0.4):
        metal = Material(color=(0.55, 0.55, 0.56), roughness=0.3, metallic=0.9)
        return pick(rng, (black, metal))
    return body if chance(rng, 0.7) else black


def looks(
    rng: np.random.Generator, kind: str
) -> tuple[Material, Material, Material, Material, float | None]:
    """Body, top, fronts and inside of the drawers, and the tile (m) of their textures."""
    if kind == "tower":
        body = painted(rng, _PLASTICS, 0.0)
        clear = tinted(rng, pick(rng, ((0.88, 0.9, 0.92), (0.8, 0.87, 0.92), (0.95, 0.95, 0.93))))
        drawers = Material(color=clear, roughness=between(rng, 0.15, 0.4), emission=0.08)
        return body, body, drawers, drawers, TILE
    if kind == "tool":
        body = painted(rng, _TOOL_COLORS, 0.0)
        front = painted(rng, _TOOL_COLORS, 0.0) if chance(rng, 0.3) else body
        mat = Material(color=(0.08, 0.08, 0.08), roughness=0.8)
        return body, pick(rng, (body, mat)), front, pick(rng, (body, steel(rng))), TILE
    metal = kind == "pedestal" and chance(rng, 0.6)
    inside = _inside(rng, metal)
    if metal:
        body = painted(rng, LACQUERS, 0.0)
        top = wooden(rng, pick(rng, WOODS)) if chance(rng, 0.2) else body
        front = painted(rng, LACQUERS + PAINTS, 0.0) if chance(rng, 0.25) else body
        return body, top, front, inside, TILE
    if chance(rng, 0.62):
        body = wooden(rng, pick(rng, WOODS))
        other = chance(rng, 0.25)
        front = painted(rng, PAINTS, 0.0) if other else body
        return body, body, front, inside, TILE
    body = painted(rng, PAINTS, 0.0)
    top = wooden(rng, pick(rng, WOODS)) if chance(rng, 0.25) else body
    front = wooden(rng, pick(rng, WOODS)) if chance(rng, 0.2) else body
    return body, top, front, inside, TILE


def _inside(rng: np.random.Generator, metal: bool) -> Material:
    if metal:
        return Material(color=tinted(rng, (0.62, 0.62, 0.63)), roughness=0.5, metallic=0.3)
    color = pick(rng, ((0.85, 0.76, 0.6), (0.75, 0.6, 0.42), (0.9, 0.9, 0.88), (0.6, 0.45, 0.3)))
    return Material(color=tinted(rng, color), roughness=0.7)
