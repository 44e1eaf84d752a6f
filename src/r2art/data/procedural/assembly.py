"""From surfaces per part to an `Instance` whose root frame is where it must be."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Joint
from r2art.data.procedural.solids import merged
from r2art.data.shape import Instance, Surface
from r2art.data.staging import Rest

FloatArray = NDArray[np.floating]


def bounds(surfaces: Iterable[Surface]) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corner (m) of the box around some surfaces."""
    vertices = [s.vertices for s in surfaces]
    lower = np.min([v.min(axis=0) for v in vertices], axis=0)
    upper = np.max([v.max(axis=0) for v in vertices], axis=0)
    return lower, upper


def assembled(
    category: str,
    parts: Mapping[str, Sequence[Surface]],
    joints: Sequence[Joint],
    rests: tuple[Rest, ...] = (),
) -> Instance:
    """The instance, moved so that the centre of its root part's box is the origin."""
    lower, upper = bounds(next(iter(parts.values())))
    shift = -(lower + upper) / 2
    moved = [
        tuple(replace(s, vertices=s.vertices + shift) for s in merged(surfaces))
        for surfaces in parts.values()
    ]
    return Instance(
        category=category,
        part_names=tuple(parts),
        parts=tuple(moved),
        joints=tuple(replace(j, pivot=_shifted(j.pivot, shift)) for j in joints),
        rests=rests,
    )


def _shifted(point: tuple[float, float, float], shift: FloatArray) -> tuple[float, float, float]:
    x, y, z = (np.asarray(point) + shift).tolist()
    return x, y, z
