"""Scissors: office, school, kitchen, tailor's, nail, embroidery and hairdressing scissors."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from r2art.core.category import Joint, Symmetry
from r2art.data.categories.scissors.blades import blade, etching, screw
from r2art.data.categories.scissors.handles import Handle
from r2art.data.categories.scissors.style import ScissorsStyle, sample_style
from r2art.data.procedural.assembly import assembled
from r2art.data.procedural.swept import mirrored
from r2art.data.shape import Instance, Surface
from r2art.data.staging import UPRIGHT, Rest, Spread, Staging

STAGING = Staging(
    azimuth=None,
    elevation=(float(np.radians(55)), float(np.radians(20))),
    elevation_limits=(float(np.radians(10)), float(np.radians(89))),
    joints={"pivot": Spread(closed=0.2, typical=1.0, beta=(2.4, 2.4))},
    rests=(UPRIGHT, Rest(axis="z", angle=np.pi)),
)

SYMMETRY = Symmetry(swap=(1, 0), axis="z")
"""Turned over about their length; a photo hardly tells which loop is the larger one."""


def generate(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Instance:
    """``half_main``, whose loop is on the right, and ``half_other``, closed at rest."""
    del photos  # nothing on scissors shows one
    style_rng, main_rng, other_rng = rng.spawn(3)
    style = sample_style(style_rng)
    main = _half(main_rng, style, style.upper, 1)
    other = _half(other_rng, style, not style.upper, -1)
    joint = Joint(
        name="pivot",
        kind="revolute",
        parent=0,
        axis=(0.0, -1.0, 0.0),
        pivot=(0.0, 0.0, 0.0),
        limits=(0.0, style.limit),
    )
    rests = (UPRIGHT,) if style.equal else ()
    parts = {"half_main": main, "half_other": other}
    return assembled("scissors", parts, [joint], rests)


def _half(rng: np.random.Generator, style: ScissorsStyle, up: bool, side: int) -> list[Surface]:
    """One half, its handle on the right (side 1) or mirrored; ``up``: its blade lies above."""
    handle = Handle(style, style.main if side > 0 else style.other)
    pieces = [*blade(style, handle.tang, up), *handle.surfaces(side > 0 and style.rest)]
    if side < 0:
        pieces = [mirrored(s) for s in pieces]
    return [*pieces, *screw(style, up), *etching(rng, style, handle.tang, up, side)]
