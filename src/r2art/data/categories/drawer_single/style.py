"""What furniture with one drawer is like before it is built: form, measures, materials."""

from dataclasses import dataclass

import numpy as np

from r2art.data.categories.drawer.style import CabinetStyle, looks, panel, support_look
from r2art.data.categories.drawer.trays import Fittings
from r2art.data.procedural.handles import HandleStyle, sample_handle
from r2art.data.procedural.materials import METALS, PAINTS, WOODS, cardboard, painted, wooden
from r2art.data.procedural.randomness import Color, between, chance, pick, spread, weighted
from r2art.data.shape import Material

FORMS = {
    "nightstand": 3.0,  # an open shelf below or above the drawer
    "table": 2.6,  # on four legs
    "wall": 1.2,  # hung on the wall
    "desktop": 2.0,  # a small unit for the desk
    "under_desk": 1.0,  # screwed under a desk
    "sleeve": 1.6,  # slides in a sleeve as in a matchbox
}
Looks = tuple[Material, Material, Material, Material, float | None]


@dataclass(frozen=True, kw_only=True)
class SingleStyle:
    """One drawer in its carcass (m).

    Attributes:
        form: One of ``FORMS``.
        cabinet: Measures and looks; its ``wall`` is what stands left and right of the drawer.
        opening: Lower and upper y of the drawer's opening.
        legs: ``square``, ``round``, ``splayed``, ``wire`` or ``none``.
        niche: ``below``, ``above`` or ``none``: where an open shelf is.
        fittings: Of the drawer.
        pull: How the drawer is pulled: ``handle``, ``notch``, ``tab``, ``ring`` or ``card``.
    """

    form: str
    cabinet: CabinetStyle
    opening: tuple[float, float]
    legs: str
    niche: str
    fittings: Fittings
    pull: str


@dataclass(frozen=True, kw_only=True)
class _Frame:
    """Outer measures (m), and where the drawer's opening is."""

    width: float
    height: float
    depth: float
    wall: float
    top: float
    opening: tuple[float, float]
    legs: str = "none"
    niche: str = "none"
    support: str = "none"
    support_height: float = 0.0
    overhang: float = 0.0


def sample_style(rng: np.random.Generator) -> SingleStyle:
    """Draw one of the forms."""
    form = weighted(rng, FORMS)
    frame = {
        "nightstand": _nightstand,
        "table": _table,
        "wall": _wall,
        "desktop": _desktop,
        "under_desk": _under_desk,
        "sleeve": _sleeve,
    }[form](rng)
    body, top_look, front_look, inside, tile = _looks(rng, form)
    small = form in ("desktop", "sleeve", "under_desk")
    inset = form == "sleeve" or chance(rng, 0.6 if form == "table" else 0.4)
    cabinet = CabinetStyle(
        kind="bedside",
        width=frame.width,
        height=frame.height,
        depth=frame.depth,
        wall=frame.wall,
        top=frame.top,
        overhang=frame.overhang,
        support=frame.support,
        support_height=frame.support_height,
        front=min(between(rng, 0.014, 0.022), 0.9 * frame.wall)
        if small
        else between(rng, 0.015, 0.024),
        inset=inset,
        gap=between(rng, 0.0006, 0.0015) if small else between(rng, 0.0015, 0.004),
        dividers=False,
        shares=(1.0,),
        body=body,
        top_look=top_look,
        front_look=front_look,
        inside=inside,
        support_look=support_look(rng, frame.support, body),
        panel="flat" if small else panel(rng, "bedside"),
        edge=pick(rng, (0.0, 0.0006, 0.002)) if small else pick(rng, (0.0, 0.0006, 0.002, 0.005)),
        handle=_handle(rng, form, frame, front_look),
        tile=tile,
    )
    return SingleStyle(
        form=form,
        cabinet=cabinet,
        opening=frame.opening,
        legs=frame.legs,
        niche=frame.niche,
        fittings=_fittings(rng, small, frame),
        pull=_pull(rng, form),
    )


def _nightstand(rng: np.random.Generator) -> _Frame:
    height = spread(rng, 0.53, 0.1, 0.4, 0.68)
    wall, top = between(rng, 0.014, 0.022), between(rng, 0.015, 0.03)
    support = weighted(rng, {"legs": 4, "plinth": 2, "feet": 1.5, "none": 2})
    low = {"legs": (0.07, 0.2), "plinth": (0.03, 0.07), "feet": (0.01, 0.03), "none": (0.0, 0.0)}
    raised = between(rng, *low[support])
    room = height - top - raised - wall
    tall = room * between(rng, 0.32, 0.5)
    below = chance(rng, 0.8)
    low_edge = height - top - tall if below else raised + wall
    return _Frame(
        width=height * between(rng, 0.68, 0.98),
        height=height,
        depth=height * between(rng, 0.6, 0.82),
        wall=wall,
        top=top,
        opening=(low_edge, low_edge + tall),
        niche="below" if below else "above",
        support=support,
        support_height=raised,
        overhang=between(rng, 0.004, 0.02) if chance(rng, 0.5) else 0.0,
    )


def _table(rng: np.random.Generator) -> _Frame:
    desk = chance(rng, 0.25)
    height = between(rng, 0.72, 0.77) if desk else spread(rng, 0.57, 0.1, 0.42, 0.7)
    width = between(rng, 0.6, 0.9) if desk else height * between(rng, 0.65, 1.0)
    top = between(rng, 0.016, 0.03)
    tall = between(rng, 0.08, 0.14)
    return _Frame(
        width=width,
        height=height,
        depth=between(rng, 0.38, 0.5) if desk else height * between(rng, 0.55, 0.85),
        wall=between(rng, 0.018, 0.042),
        top=top,
        opening=(height - top - tall, height - top),
        legs=weighted(rng, {"square": 4, "round": 1.5, "splayed": 2.5, "wire": 1.5}),
        niche="below" if not desk and chance(rng, 0.4) else "none",
        overhang=between(rng, 0.0, 0.025),
    )


def _wall(rng: np.random.Generator) -> _Frame:
    width, wall, top = (
        between(rng, 0.3, 0.55),
        between(rng, 0.012, 0.02),
        between(rng, 0.014, 0.022),
    )
    tall = between(rng, 0.08, 0.16)
    niche = weighted(rng, {"none": 4, "below": 2, "above": 1.5})
    extra = between(rng, 0.1, 0.2) if niche != "none" else 0.0
    height = tall + extra + wall + top + (wall if extra else 0.0)
    low = height - top - tall if niche == "below" else wall
    return _Frame(
        width=width,
        height=height,
        depth=between(rng, 0.24, 0.36),
        wall=wall,
        top=top,
        opening=(low, low + tall),
        niche=niche,
    )


def _desktop(rng: np.random.Generator) -> _Frame:
    width = spread(rng, 0.26, 0.25, 0.15, 0.42)
    tall, wall, top = (
        width * between(rng, 0.26, 0.55),
        between(rng, 0.006, 0.013),
        between(rng, 0.006, 0.014),
    )
    feet = between(rng, 0.004, 0.01) if chance(rng, 0.5) else 0.0
    height = feet + wall + tall + top
    return _Frame(
        width=width,
        height=height,
        depth=width * between(rng, 0.75, 1.35),
        wall=wall,
        top=top,
        opening=(feet + wall, feet + wall + tall),
        support="feet" if feet else "none",
        support_height=feet,
        overhang=between(rng, 0.0, 0.006) if chance(rng, 0.3) else 0.0,
    )


def _under_desk(rng: np.random.Generator) -> _Frame:
    tall = between(rng, 0.05, 0.095)
    wall = between(rng, 0.004, 0.012)
    return _Frame(
        width=between(rng, 0.3, 0.56),
        height=wall + tall + 0.004,
        depth=between(rng, 0.28, 0.42),
        wall=wall,
        top=0.004,
        opening=(wall, wall + tall),
    )


def _sleeve(rng: np.random.Generator) -> _Frame:
    width = spread(rng, 0.14, 0.35, 0.08, 0.28)
    height = width * between(rng, 0.22, 0.6)
    wall = between(rng, 0.0015, 0.005)
    return _Frame(
        width=width,
        height=height,
        depth=width * between(rng, 0.9, 1.7),
        wall=wall,
        top=wall,
        opening=(wall, height - wall),
    )


def _looks(rng: np.random.Generator, form: str) -> Looks:
    """Body, top, front, inside of the drawer, and the tile (m) of their textures."""
    if form == "under_desk":
        steel: tuple[Color, ...] = ((0.1, 0.1, 0.105), (0.92, 0.92, 0.91), (0.6, 0.61, 0.62))
        body = painted(rng, steel, 0.0)
        front = wooden(rng, pick(rng, WOODS)) if chance(rng, 0.25) else body
        return body, body, front, body, 0.6
    if form == "sleeve":
        body = _sleeve_look(rng)
        other = chance(rng, 0.5)
        tray = _sleeve_look(rng) if other else body
        return body, body, tray, tray, 0.35
    if form == "desktop":
        kind = weighted(rng, {"bedside": 5, "tool": 1, "tower": 1.5})
        body, top, front, inside, _ = looks(rng, kind)
        return body, top, front, inside, 0.5
    return looks(rng, "bedside")


def _sleeve_look(rng: np.random.Generator) -> Material:
    kind = weighted(rng, {"board": 3, "kraft": 2, "wood": 2.5, "plastic": 1.5})
    if kind == "kraft":
        return cardboard(rng)
    if kind == "wood":
        return wooden(rng, pick(rng, WOODS))
    return painted(rng, PAINTS, 0.0)


def _handle(rng: np.random.Generator, form: str, frame: _Frame, front: Material) -> HandleStyle:
    if form in ("nightstand", "table", "wall"):
        return sample_handle(rng, "bedside", frame.width, front)
    metal = Material(color=pick(rng, METALS), roughness=between(rng, 0.2, 0.45), metallic=0.9)
    kind = weighted(rng, {"knob": 5, "bar": 1.5, "bow": 1, "cup": 1.5, "recess": 0.7})
    if form == "under_desk":
        kind = weighted(rng, {"lip": 3, "bar": 2, "recess": 2, "knob": 0.7})
    tall = frame.opening[1] - frame.opening[0]
    length = between(rng, 0.012, 0.024) if kind == "knob" else pick(rng, (0.04, 0.05, 0.064))
    return HandleStyle(
        kind=kind,
        length=min(length, 0.4 * frame.width, 0.9 * tall if kind != "lip" else 1.0),
        reach=between(rng, 0.012, 0.02),
        count=1,
        at=0.5,
        look=pick(rng, (metal, metal, front)),
        lock=form == "under_desk" and tall > 0.06 and chance(rng, 0.4),
    )


def _pull(rng: np.random.Generator, form: str) -> str:
    if form == "sleeve":
        return weighted(rng, {"notch": 4, "tab": 3, "handle": 1.5, "ring": 1.5, "hole": 1})
    if form == "desktop":
        return weighted(rng, {"handle": 5, "notch": 2, "ring": 1, "card": 2})
    if form == "under_desk":
        return "handle"
    return weighted(rng, {"handle": 9, "notch": 1, "ring": 0.7})


def _fittings(rng: np.random.Generator, small: bool, frame: _Frame) -> Fittings:
    tall = frame.opening[1] - frame.opening[0]
    if small:
        thickness = float(np.clip(0.02 * frame.width, 0.0015, 0.005))
        return Fittings(
            side_share=between(rng, 0.82, 0.99),
            thickness=thickness,
            floor=thickness,
            rails=False,
            clearance=0.001,
            lift=0.001,
            headroom=0.004 if tall < 0.05 else 0.008,
            shorter=between(rng, -0.001, 0.006),
            filled=0.7,
            labels=False,
        )
    rails = chance(rng, 0.4)
    return Fittings(
        side_share=between(rng, 0.65, 0.92),
        thickness=between(rng, 0.006, 0.013),
        rails=rails,
        clearance=0.013 if rails else 0.003,
        shorter=between(rng, 0.004, 0.03),
        filled=0.6,
        labels=False,
    )
