"""Staplers: desk staplers slim and bulky, of metal and plastic, mini, heavy-duty, long-reach."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from r2art.core.category import Joint, Mirror
from r2art.data.categories.stapler.arm import arm
from r2art.data.categories.stapler.base import base
from r2art.data.categories.stapler.style import StaplerStyle, sample_style
from r2art.data.procedural.assembly import assembled
from r2art.data.shape import Instance, Surface
from r2art.data.staging import Rest, Spread, Staging

STAGING = Staging(
    azimuth=None,
    elevation=(float(np.radians(28)), float(np.radians(15))),
    joints={"hinge": Spread(closed=0.45)},
    rests=(
        Rest(weight=5),
        Rest(weight=1, axis="z", angle=np.pi / 2),
        Rest(weight=1, axis="z", angle=-np.pi / 2),
    ),
)

MIRROR = Mirror(swap=(0, 1))


def generate(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Instance:
    """A stapler: ``base`` and ``arm``; at rest it stands on a desk, its mouth at +z."""
    del photos  # nothing on a stapler shows one
    shape_rng, base_rng, arm_rng = rng.spawn(3)
    style = sample_style(shape_rng)
    turning = arm(arm_rng, style)
    y, z = style.hinge
    joint = Joint(
        name="hinge",
        kind="revolute",
        parent=0,
        axis=(-1.0, 0.0, 0.0),
        pivot=(0.0, y, z),
        limits=(0.0, _opening(style, turning)),
    )
    return assembled("stapler", {"base": base(base_rng, style), "arm": turning}, [joint])


def _opening(style: StaplerStyle, turning: Sequence[Surface]) -> float:
    """How far the arm opens (rad) before it meets the rear end of the base or the desk."""
    y, z = style.hinge
    points = np.concatenate([s.vertices for s in turning])
    up, front = points[:, 1] - y, points[:, 2] - z
    floor = style.base_height - y + 0.0004
    for opening in np.arange(style.opening, np.radians(25), -np.radians(4)):
        high = up * np.cos(opening) + front * np.sin(opening)
        deep = front * np.cos(opening) - up * np.sin(opening)
        meets = (high < floor) & (deep > -style.inset) & (deep < 0)
        if not meets.any() and high.min() > 0.002 - y:
            return float(opening)
    return float(np.radians(25))
