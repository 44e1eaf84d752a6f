"""Furniture with one drawer: nightstands, side tables, wall and desk units, sleeves."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from r2art.core.category import Mirror
from r2art.data.categories.box import contents as loose
from r2art.data.categories.box import insets
from r2art.data.categories.drawer import STAGING as STAGING
from r2art.data.categories.drawer.contents import contents
from r2art.data.categories.drawer.trays import Filler, front, slide, tray
from r2art.data.categories.drawer_single import pulls
from r2art.data.categories.drawer_single.carcass import carcass
from r2art.data.categories.drawer_single.style import SingleStyle, sample_style
from r2art.data.procedural.assembly import assembled
from r2art.data.procedural.handles import handles, lock
from r2art.data.procedural.randomness import between, chance, weighted
from r2art.data.procedural.solids import xyz
from r2art.data.shape import Instance, Surface

FloatArray = np.ndarray

MIRROR = Mirror(swap=(0, 1))


def generate(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Instance:
    """A ``cabinet`` with its ``drawer``, closed at rest."""
    shape_rng, look_rng, joint_rng = rng.spawn(3)
    style = sample_style(shape_rng)
    cabinet = carcass(look_rng, style, photos)
    drawer = _drawer(look_rng, style)
    joint = slide("slide", drawer, between(joint_rng, 0.75, 0.95))
    return assembled("drawer_single", {"cabinet": cabinet, "drawer": drawer}, [joint])


def _front_box(style: SingleStyle) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corner of the front: within its opening, or before the carcass."""
    c, (low, high) = style.cabinet, style.opening
    x, z = c.width / 2, c.depth / 2
    if c.inset:
        aside = c.wall + c.gap
        return xyz(aside - x, low + c.gap, z - c.front), xyz(x - aside, high - c.gap, z)
    aside = 0.001 if style.legs in ("none", "splayed", "wire") else c.wall + c.gap
    below = 0.0 if style.legs != "none" else c.wall - 0.001
    above = 0.0 if style.niche != "above" else 0.5 * c.wall
    lower = xyz(aside - x, low - below, z + 0.001)
    return lower, xyz(x - aside, high + above - c.gap, z + c.front)


def _drawer(rng: np.random.Generator, style: SingleStyle) -> list[Surface]:
    c = style.cabinet
    lower, upper = _front_box(style)
    if style.pull == "notch":
        pieces = pulls.notched_front(rng, c, lower, upper)
    else:
        pieces = front(c, lower, upper, rng)
    metal = c.handle.look
    if style.pull in ("handle", "card"):
        pieces += handles(c.handle, lower, upper)
        if c.handle.lock:
            pieces += lock(lower, upper)
    if style.pull == "card":
        pieces += pulls.card_holder(rng, metal, lower, upper)
    elif style.pull == "tab":
        pieces += pulls.tab(rng, lower, upper)
    elif style.pull == "ring":
        pieces += pulls.ring(metal, lower, upper)
    elif style.pull == "hole":
        pieces += pulls.hole(lower, upper)
    return pieces + tray(rng, c, style.fittings, style.opening, lower, _fill(rng, style))


def _fill(rng: np.random.Generator, style: SingleStyle) -> Filler:
    """What suits the drawer: stationery and small things, or household things."""
    desk: dict[Filler, float] = {
        insets.pencils: 3.0,
        loose.papers: 2.0,
        insets.jewels: 1.0,
        insets.spools: 1.0,
        loose.toys: 0.7,
        contents: 2.0,
    }
    home: dict[Filler, float] = {contents: 5.0, loose.papers: 1.5, insets.jewels: 0.6}
    small = style.form in ("desktop", "sleeve", "under_desk") or chance(rng, 0.2)
    return weighted(rng, desk if small else home)
