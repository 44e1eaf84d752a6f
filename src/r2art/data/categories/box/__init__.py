"""Boxes with a hinged lid: of board, wood, metal and plastic, from 8 to 60 cm wide."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from r2art.core.category import Joint, Mirror
from r2art.data.categories.box import cardboard, chests, gifts, metal, plastic, travel, wooden
from r2art.data.procedural.assembly import assembled
from r2art.data.procedural.randomness import weighted
from r2art.data.shape import Instance
from r2art.data.staging import Spread, Staging

STAGING = Staging(
    azimuth=float(np.radians(50)),
    azimuth_limit=float(np.radians(150)),
    elevation=(float(np.radians(32)), float(np.radians(14))),
    joints={"hinge": Spread(closed=0.15, opened=0.1, typical=0.75, beta=(4.0, 2.5))},
)

MIRROR = Mirror(swap=(0, 1))
_KINDS = {
    cardboard.shoe_box: 1.5,
    cardboard.mailer: 1.8,
    cardboard.pizza_box: 0.7,
    gifts.gift_box: 1.6,
    chests.chest: 1.8,
    wooden.jewellery_box: 1.5,
    wooden.cigar_box: 0.9,
    wooden.case_with_window: 0.9,
    travel.trunk: 1.1,
    travel.suitcase: 1.1,
    metal.cash_box: 1.1,
    metal.tin: 1.5,
    metal.lunch_tin: 0.5,
    metal.steel_toolbox: 0.7,
    plastic.toolbox: 1.3,
    plastic.hard_case: 1.3,
    plastic.first_aid_kit: 0.9,
    plastic.food_box: 0.6,
    plastic.storage_box: 0.7,
}


def generate(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Instance:
    """A ``box`` and its ``lid``, closed at rest; ``photos`` may be printed on tins and gifts."""
    made = weighted(rng, _KINDS)(rng, photos)
    y, z = made.hinge
    joint = Joint(
        name="hinge",
        kind="revolute",
        parent=0,
        axis=(-1.0, 0.0, 0.0),
        pivot=(0.0, float(y), float(z)),
        limits=(0.0, float(made.opens)),
    )
    return assembled("box", {"box": made.pieces.base, "lid": made.pieces.lid}, [joint])
