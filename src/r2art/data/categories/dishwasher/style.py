"""What a dishwasher is like before it is built: measures, colours, materials."""

from dataclasses import dataclass, replace

import numpy as np

from r2art.data.procedural.materials import PAINTS, WOODS, painted, steel, wooden
from r2art.data.procedural.randomness import Color, between, chance, pick, tinted, weighted
from r2art.data.procedural.textures import seamless, speckled, worn
from r2art.data.shape import Material

GAP = 0.003  # m, around the door
_WHITE: Color = (0.93, 0.93, 0.92)
_BLACK: Color = (0.07, 0.07, 0.075)
_SILVER: Color = (0.68, 0.69, 0.7)
_COLORFUL: tuple[Color, ...] = ((0.65, 0.1, 0.1), (0.9, 0.85, 0.7), (0.5, 0.65, 0.75))
_STONES: tuple[Color, ...] = ((0.25, 0.25, 0.26), (0.6, 0.58, 0.55), (0.85, 0.84, 0.8))
_WIRES: tuple[Color, ...] = (
    (0.5, 0.51, 0.53),
    (0.72, 0.73, 0.74),
    (0.85, 0.85, 0.85),
    (0.3, 0.32, 0.35),
    (0.35, 0.45, 0.6),
    (0.75, 0.68, 0.58),
)


_GLOSSY = Material(color=(0.05, 0.05, 0.055), roughness=0.08)


@dataclass(frozen=True)
class DishwasherStyle:
    """Measures (m) and looks; x = 0 is the middle, y = 0 the floor, z = 0 the door's back.

    Attributes:
        kind: ``"freestanding"``, ``"integrated"`` (behind a furniture front), ``"semi"`` (its
            controls show above one), ``"american"`` (under a counter) or ``"tabletop"``.
        width: Of the body ...
        height: ... from the floor to the top ...
        depth: ... and behind the door.
        door: Thickness of the door.
        kick: Height of the base below the door ...
        recess: ... and how far it stands back from the door's back.
        top: Thickness of the worktop, 0 if the body ends without one.
        fascia: Height of the strip with controls on top of the door, 0 if they are hidden.
        handle: ``"pocket"``, ``"lip"``, ``"none"`` or a kind of `procedural.grips`.
        shaker: Whether the furniture front has a frame.
        body: Look of the sides ...
        front: ... the door ...
        fascia_look: ... the strip with controls ...
        top_look: ... the worktop ...
        kick_look: ... the base ...
        trim: ... handles and badges ...
        tub: ... the inside ...
        wire: ... and the racks.
    """

    kind: str
    width: float
    height: float
    depth: float
    door: float
    kick: float
    recess: float
    top: float
    fascia: float
    handle: str
    shaker: bool
    body: Material
    front: Material
    fascia_look: Material
    top_look: Material
    kick_look: Material
    trim: Material
    tub: Material
    wire: Material

    @property
    def door_span(self) -> tuple[float, float]:
        """Lower and upper y of the door."""
        return self.kick + GAP, self.height - self.top - (GAP if self.top else 0.0)

    @property
    def cavity(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner of the tub."""
        low, high = self.door_span
        x = self.width / 2 - 0.028
        ceiling = min(high - 0.022, self.height - self.top - 0.022)
        return np.array([-x, low + 0.04, 0.05 - self.depth]), np.array([x, ceiling, 0.0])


# Ranges of height without worktop, depth of the body, height of the base and its recess (m).
_SIZES = {
    "freestanding": ((0.815, 0.845), (0.54, 0.59), (0.085, 0.13), (0.0, 0.04)),
    "american": ((0.85, 0.885), (0.56, 0.6), (0.1, 0.14), (0.03, 0.07)),
    "integrated": ((0.815, 0.87), (0.53, 0.56), (0.1, 0.15), (0.03, 0.06)),
    "semi": ((0.815, 0.87), (0.53, 0.57), (0.09, 0.14), (0.03, 0.06)),
    "tabletop": ((0.435, 0.475), (0.43, 0.47), (0.05, 0.062), (0.0, 0.01)),
}
# How the door is opened.
_HANDLES: dict[str, dict[str, float]] = {
    "freestanding": {"pocket": 6, "lip": 2, "bar": 1, "rod": 1, "bow": 1},
    "american": {"pocket": 4, "bar": 2.5, "rod": 2.5, "bow": 1.5},
    "integrated": {"bar": 2.5, "rod": 2.5, "bow": 1.5, "lip": 1.5, "none": 0.5},
    "semi": {"pocket": 6, "bar": 1, "rod": 1},
    "tabletop": {"pocket": 5, "lip": 2, "bar": 1, "bow": 1},
}


def sample_style(rng: np.random.Generator) -> DishwasherStyle:
    """Draw a freestanding, built-in or tabletop dishwasher."""
    kind = weighted(
        rng, {"freestanding": 3.2, "american": 2.4, "integrated": 1.6, "semi": 1.4, "tabletop": 0.9}
    )
    height, depth, kick, recess = (between(rng, *limits) for limits in _SIZES[kind])
    body, front, fascia_look = _looks(rng, kind)
    top, top_look = _top(rng, kind, body)
    shown = kind in ("freestanding", "semi", "tabletop") or (
        kind == "american" and chance(rng, 0.5)
    )
    return DishwasherStyle(
        kind=kind,
        width=_width(rng, kind),
        height=height + top,
        depth=depth,
        door=between(rng, 0.036, 0.044) if kind == "tabletop" else between(rng, 0.04, 0.055),
        kick=kick,
        recess=recess,
        top=top,
        fascia=between(rng, 0.07, 0.09 if kind == "tabletop" else 0.135) if shown else 0.0,
        handle=weighted(rng, _HANDLES[kind]),
        shaker=kind in ("integrated", "semi") and chance(rng, 0.3),
        body=body,
        front=front,
        fascia_look=fascia_look,
        top_look=top_look,
        kick_look=_kick_look(rng, kind, body, front),
        trim=_trim(rng, front),
        tub=_tub(rng, kind),
        wire=Material(color=tinted(rng, pick(rng, _WIRES), 0.03), roughness=0.45),
    )


def _width(rng: np.random.Generator, kind: str) -> float:
    if kind == "tabletop":
        return between(rng, 0.545, 0.56)
    slim = chance(rng, 0.08 if kind == "american" else 0.2)
    return (0.448 if slim else 0.598) + between(rng, -0.003, 0.008)


def _enamel(rng: np.random.Generator, color: Color, metallic: float = 0.0) -> Material:
    """Painted sheet metal or plastic, smooth and hardly ever worn."""
    image = speckled(rng, between(rng, 0.01, 0.035))
    if chance(rng, 0.25):
        image = worn(rng, image, between(rng, 0.2, 0.8))
    return Material(
        color=tinted(rng, color, 0.008),
        texture=seamless(image),
        roughness=between(rng, 0.2, 0.5),
        metallic=metallic,
    )


def _looks(rng: np.random.Generator, kind: str) -> tuple[Material, Material, Material]:
    """Sides, door and the strip with the controls."""
    white, black, silver = (_enamel(rng, color) for color in (_WHITE, _BLACK, _SILVER))
    metal = steel(rng)
    metal = replace(metal, color=tinted(rng, metal.color, 0.025))
    if kind in ("freestanding", "tabletop"):
        color = weighted(rng, {"white": 5, "steel": 2, "silver": 1.5, "black": 1.5, "other": 0.7})
        bodies = {"white": white, "black": black, "other": _enamel(rng, pick(rng, _COLORFUL))}
        body = bodies.get(color, silver)
        front = metal if color == "steel" else body
        return body, front, pick(rng, (front, front, front, front, metal, black, _GLOSSY))
    body = pick(rng, (_enamel(rng, (0.6, 0.61, 0.62), 0.3), _enamel(rng, (0.3, 0.3, 0.31))))
    if kind == "american":
        slate = _enamel(rng, (0.3, 0.31, 0.32), 0.4)
        color = weighted(rng, {"steel": 5, "black": 2, "white": 2.5, "slate": 0.8})
        front = {"steel": metal, "black": black, "white": white, "slate": slate}[color]
        return body, front, black if chance(rng, 0.25) else front
    front = wooden(rng, pick(rng, WOODS)) if chance(rng, 0.5) else _enamel(rng, pick(rng, PAINTS))
    return body, front, pick(rng, (metal, metal, white, black, silver, _GLOSSY))


def _top(rng: np.random.Generator, kind: str, body: Material) -> tuple[float, Material]:
    """Thickness and look of the worktop; machines that are built in may show a piece of it."""
    if kind == "tabletop":
        return 0.0, body
    if kind == "freestanding":
        board = _enamel(rng, pick(rng, (_WHITE, (0.55, 0.56, 0.57), _BLACK)))
        return between(rng, 0.022, 0.036), body if chance(rng, 0.7) else board
    if chance(rng, 0.55):
        return 0.0, body
    stone = painted(rng, _STONES, 0.0)
    return between(rng, 0.02, 0.042), pick(rng, (stone, wooden(rng, pick(rng, WOODS))))


def _kick_look(rng: np.random.Generator, kind: str, body: Material, front: Material) -> Material:
    if kind in ("freestanding", "tabletop"):
        return body if chance(rng, 0.75) else Material(color=_BLACK, roughness=0.6)
    dark = Material(color=tinted(rng, _BLACK, 0.02), roughness=0.6)
    return front if chance(rng, 0.3) else dark


def _trim(rng: np.random.Generator, front: Material) -> Material:
    chrome = Material(color=(0.74, 0.74, 0.75), roughness=between(rng, 0.15, 0.4), metallic=0.9)
    black = Material(color=(0.05, 0.05, 0.05), roughness=0.45)
    return pick(rng, (chrome, chrome, chrome, black, front))


def _tub(rng: np.random.Generator, kind: str) -> Material:
    """Steel as a rule; plastic in some American machines. A little light is within."""
    light = between(rng, 0.02, 0.14)
    if kind == "american" and chance(rng, 0.25):
        color = tinted(rng, pick(rng, (_WHITE, (0.5, 0.51, 0.53))), 0.02)
        return Material(color=color, roughness=0.5, emission=light)
    color = tinted(rng, (0.66, 0.67, 0.68), 0.02)
    return Material(color=color, roughness=between(rng, 0.25, 0.4), metallic=0.45, emission=light)
