"""Cutters: knives with a blade that slides out, snap-off or trapezoid."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from r2art.core.category import Joint
from r2art.data.categories.cutter.blade import blade
from r2art.data.categories.cutter.details import details
from r2art.data.categories.cutter.handle import rail, shell
from r2art.data.categories.cutter.style import sample_style
from r2art.data.procedural.assembly import assembled, bounds
from r2art.data.shape import Instance
from r2art.data.staging import UPRIGHT, Rest, Spread, Staging

STAGING = Staging(
    azimuth=None,
    elevation=(float(np.radians(55)), float(np.radians(20))),
    elevation_limits=(float(np.radians(10)), float(np.radians(89))),
    joints={"slide": Spread(closed=0.15)},
    rests=(UPRIGHT, Rest(axis="z", angle=np.pi)),
)


def generate(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Instance:
    """A cutter: ``handle`` and ``blade``; at rest the blade is drawn in, +z is where it goes."""
    del photos  # nothing on a cutter shows one
    shape_rng, handle_rng, detail_rng, blade_rng = rng.spawn(4)
    style = sample_style(shape_rng)
    body, handle = shell(handle_rng, style)
    if style.rail > 0:
        handle += rail(style)
    handle += details(detail_rng, style, body)
    steel = blade(blade_rng, style, body)
    lower, upper = bounds(steel)
    x, y, z = ((lower + upper) / 2).tolist()
    joint = Joint(
        name="slide",
        kind="prismatic",
        parent=0,
        axis=(0.0, 0.0, 1.0),
        pivot=(x, y, z),
        limits=(0.0, style.travel),
    )
    return assembled("cutter", {"handle": handle, "blade": steel}, [joint])
