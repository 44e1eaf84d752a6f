"""Handles of appliances: bars, rods and bows that stand before a front which faces +z."""

import numpy as np
from numpy.typing import ArrayLike

from r2art.data.procedural.curved import tube
from r2art.data.procedural.randomness import between, pick
from r2art.data.procedural.solids import box, cylinder, plate, xyz
from r2art.data.shape import Material, Surface


def grip(
    rng: np.random.Generator,
    at: ArrayLike,
    axis: int,
    length: float,
    reach: float,
    look: Material,
    kind: str = "",
) -> list[Surface]:
    """A handle that a hand fits behind.

    Args:
        rng: Decides what is not given.
        at: The point on the front behind its middle.
        axis: 0 for a horizontal, 1 for a vertical handle.
        length: From end to end (m).
        reach: How far it stands out (m).
        look: Its material.
        kind: ``"bar"`` (flat), ``"rod"`` (round) or ``"bow"``; by default any.
    """
    at = np.asarray(at, dtype=np.float64)
    kind = kind or pick(rng, ("bar", "rod", "bow"))
    along, thick = np.eye(3)[axis], between(rng, 0.005, 0.009)
    if kind == "bow":
        turn = np.linspace(0, np.pi, 17)
        bend = between(rng, 0.4, 0.8)
        path = np.outer(-length / 2 * np.sign(np.cos(turn)) * np.abs(np.cos(turn)) ** bend, along)
        path[:, 2] = (reach - thick) * np.sin(turn) ** bend
        return [tube(at + path, thick, look, up=np.eye(3)[1 - axis])]
    rod = at + xyz(0, 0, reach - thick)
    if kind == "rod":
        pieces = [*cylinder(rod, axis, thick, length, look, bevel=0.2 * thick)]
    else:
        half = np.where(along > 0, length / 2, 1.4 * thick) * (1, 1, 0) + xyz(0, 0, thick)
        pieces = [*plate(rod - half, rod + half, 2, look, radius=0.5 * thick, bevel=(0, 0.003))]
    stand = between(rng, 0.55, 0.95) * length / 2
    for post in (at - stand * along, at + stand * along):
        foot = np.where(along > 0, 0.006, 0.8 * thick) * (1, 1, 0)
        pieces.append(box(post - foot, post + foot + xyz(0, 0, reach - thick), look))
    return pieces
