"""Plates, bowls, cups, glasses, pots: profiles for `curved.revolved`, from foot to foot."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.floating]

# Radius as a share of the rim's and height as a share of the whole; outside first, then inside.
_SHAPES = {
    "plate": [(0, 0), (0.55, 0), (1, 0.85), (0.985, 1), (0.55, 0.3), (0, 0.3)],
    "bowl": [(0, 0), (0.45, 0), (0.8, 0.4), (1, 1), (0.95, 1), (0.74, 0.4), (0, 0.12)],
    "cup": [(0, 0), (0.8, 0), (0.97, 0.4), (1, 1), (0.92, 1), (0.85, 0.1), (0, 0.1)],
    "glass": [(0, 0), (0.75, 0), (1, 1), (0.96, 1), (0.7, 0.08), (0, 0.08)],
    "pot": [(0, 0), (0.94, 0), (1, 0.08), (1, 1), (0.97, 1), (0.96, 0.06), (0, 0.06)],
}


def dish(kind: str, radius: float, height: float, *, upturned: bool = False) -> FloatArray:
    """(K, 2) radius and height (m) of a dish that stands on its foot, or on its rim.

    Where a sharp edge runs around, it comes twice.

    Args:
        kind: ``"plate"``, ``"bowl"``, ``"cup"``, ``"glass"`` or ``"pot"``.
        radius: Of its rim (m).
        height: Over all (m).
        upturned: Whether it stands on its rim.
    """
    profile = _creased(np.array(_SHAPES[kind]) * (radius, height))
    return (profile * (1, -1) + (0, height))[::-1] if upturned else profile


def _creased(profile: FloatArray) -> FloatArray:
    """Repeat the points at which it turns sharply: no normal is smoothed across them."""
    heading = np.arctan2(*np.diff(profile, axis=0).T[::-1])
    turn = np.abs((np.diff(heading) + np.pi) % (2 * np.pi) - np.pi)
    return np.repeat(profile, [1, *np.where(turn > 0.8, 2, 1), 1], axis=0)
