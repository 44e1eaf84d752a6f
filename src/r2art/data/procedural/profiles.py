"""Outlines that vary along an object: the rows from which sheets and lofts are made."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.floating]


def curve(at: ArrayLike, knots: ArrayLike) -> FloatArray:
    """Values of a smooth curve through (M, 2) knots of place and value; constant beyond.

    Cubic Hermite with the harmonic mean of neighbouring slopes, so that it never overshoots.
    """
    x, y = np.asarray(knots, dtype=np.float64).T
    step = np.diff(x)
    slope = np.diff(y) / step
    product = slope[:-1] * slope[1:]
    total = np.where(product > 0, slope[:-1] + slope[1:], 1.0)
    tangent = np.concatenate([slope[:1], np.where(product > 0, 2 * product / total, 0), slope[-1:]])
    place = np.clip(np.asarray(at, dtype=np.float64), x[0], x[-1])
    k = np.clip(np.searchsorted(x, place, side="right") - 1, 0, len(step) - 1)
    t, h = (place - x[k]) / step[k], step[k]
    ahead = 1 - t
    ends = y[k] * (1 + 2 * t) * ahead**2 + y[k + 1] * (3 - 2 * t) * t**2
    return ends + h * t * ahead * (tangent[k] * ahead - tangent[k + 1] * t)


def stations(
    low: float, high: float, spacing: float, ends: tuple[float, float] = (0.0, 0.0)
) -> FloatArray:
    """Increasing places from ``low`` to ``high``, denser where rounded ends need them.

    Args:
        low: First place (m).
        high: Last place (m).
        spacing: Greatest distance between places on the straight (m).
        ends: Lengths (m) of the rounded lower and upper end.
    """
    angle = np.linspace(0, np.pi / 2, 6)
    first, last = low + ends[0], high - ends[1]
    count = max(2, int(np.ceil((last - first) / spacing)) + 1)
    places = [np.linspace(first, last, count)]
    if ends[0] > 0:
        places.insert(0, low + ends[0] * (1 - np.cos(angle[:-1])))
    if ends[1] > 0:
        places.append(high - ends[1] * (1 - np.cos(angle[-2::-1])))
    return np.concatenate(places)


def rounded(at: ArrayLike, low: float, high: float, ends: tuple[float, float]) -> FloatArray:
    """How far (m) an outline of rounded ends retreats at each place: ``ends`` there, 0 between."""
    at = np.asarray(at, dtype=np.float64)
    retreat = np.zeros_like(at)
    for depth, distance in ((ends[0], at - low), (ends[1], high - at)):
        if depth > 0:
            share = np.clip(1 - distance / depth, 0, 1)
            retreat = retreat + depth * (1 - np.sqrt(1 - share**2))
    return retreat


def arch(
    z: ArrayLike,
    half: ArrayLike,
    bottom: ArrayLike,
    top: ArrayLike,
    radius: ArrayLike | tuple[ArrayLike, ArrayLike],
    segments: int = 5,
) -> FloatArray:
    """(K, 2 segments + 4, 3) rows across z, each an inverted U from right to left.

    Open they are the grid of a cover; as rings they are those of a slab with a flat underside.

    Args:
        z: (K,) or (K, N) place of each row (or of each point).
        half: Half the width.
        bottom: Lower end of both sides.
        top: Height of its middle.
        radius: Of both upper edges; a pair is measured across and upright.
        segments: Of each rounded edge.
    """
    z = np.asarray(z, dtype=np.float64)
    rows = len(z)
    half, bottom, top = (np.broadcast_to(np.asarray(v, float), rows) for v in (half, bottom, top))
    pair = radius if isinstance(radius, tuple) else (radius, radius)
    across = np.minimum(np.broadcast_to(np.asarray(pair[0], float), rows), 0.98 * half)
    upright = np.minimum(np.broadcast_to(np.asarray(pair[1], float), rows), 0.98 * (top - bottom))
    angle = np.linspace(0, np.pi / 2, segments + 1)
    x = (half - across)[:, None] + across[:, None] * np.cos(angle)
    y = (top - upright)[:, None] + upright[:, None] * np.sin(angle)
    right = np.stack([np.column_stack([half, x]), np.column_stack([bottom, y])], axis=-1)
    left = right[:, ::-1] * (-1, 1)
    flat = np.concatenate([right, left], axis=1)
    deep = np.broadcast_to(z[:, None] if z.ndim == 1 else z, flat.shape[:2])
    return np.concatenate([flat, deep[..., None]], axis=-1)
