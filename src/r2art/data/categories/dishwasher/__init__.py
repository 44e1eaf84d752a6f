"""Dishwashers: freestanding, behind furniture fronts, under American counters, on tabletops."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from r2art.core.category import Joint, Mirror
from r2art.data.categories.dishwasher.body import body
from r2art.data.categories.dishwasher.door import door
from r2art.data.categories.dishwasher.style import GAP, DishwasherStyle, sample_style
from r2art.data.pose import joint_matrix, transformed
from r2art.data.procedural.assembly import assembled, bounds
from r2art.data.shape import Instance, Surface
from r2art.data.staging import Spread, Staging

STAGING = Staging(
    azimuth=float(np.radians(35)),
    azimuth_limit=float(np.radians(80)),
    elevation=(float(np.radians(24)), float(np.radians(9))),
    elevation_limits=(float(np.radians(3)), float(np.radians(55))),
    joints={"hinge": Spread(closed=0.2, opened=0.2)},
)

MIRROR = Mirror(swap=(0, 1))


def generate(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Instance:
    """A dishwasher: ``body`` with its racks, and ``door``, which falls open towards the user."""
    del photos  # nothing on it shows one
    style_rng, body_rng, door_rng, joint_rng = rng.spawn(4)
    style = sample_style(style_rng)
    front = door(door_rng, style)
    parts = {"body": body(body_rng, style), "door": front}
    return assembled("dishwasher", parts, [_hinge(joint_rng, style, front)])


def _hinge(rng: np.random.Generator, style: DishwasherStyle, front: Sequence[Surface]) -> Joint:
    """The joint along the door's lower inner edge; it ends before the door hits the floor."""
    degrees = float(np.clip(rng.normal(90, 2), 85, 95))
    while True:
        joint = Joint(
            name="hinge",
            kind="revolute",
            parent=0,
            axis=(1.0, 0.0, 0.0),
            pivot=(0.0, style.door_span[0], GAP),
            limits=(0.0, float(np.radians(degrees))),
        )
        opened = joint_matrix(joint, joint.limits[1])
        lowest = bounds([transformed(surface, opened) for surface in front])[0][1]
        if lowest > 0.004 or degrees <= 80:
            return joint
        degrees -= 0.5
