"""What refinement makes least: errors against the masks, beside what the estimate says."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.run.refinement.body import IMAGE_FREEDOM, Body
from r2art.run.refinement.coverage import coverage_errors
from r2art.run.refinement.descent import Measure, Problem
from r2art.run.refinement.errors import Errors
from r2art.run.refinement.outline import Outline, outline, reach_errors
from r2art.run.refinement.pose import Pose
from r2art.run.refinement.silhouettes import Level, pixel_errors, pyramid
from r2art.run.refinement.uncertainty import Uncertainty

FloatArray = NDArray[np.floating]

POINTS = {28: 128, 56: 512, 112: 2048}
"""Resolutions, coarse to fine, and how many points of the object serve each of them."""
DIRECTIONS = 32
"""Of the outline."""
STRETCHES = 16
"""Independent stretches of an outline: how often a mask measures how far off it is."""
EDGE = 0.35
"""Square residual of a silhouette that is a pixel off, per pixel of its outline."""
BORDERS = 3
"""Pixels by which masks are made wider and narrower."""
GRAIN = 0.03
"""Standard deviation of a rendered outline, of points drawn at random (share of the size)."""


@dataclass(frozen=True, kw_only=True)
class Problems:
    """In their order: the box, the outline, and silhouettes at the resolutions wanted."""

    box: Problem
    outline: Problem
    silhouettes: Sequence[Problem]

    def distance(self, pose: Pose, deviation: float) -> float:
        """Root mean square distance of the outlines of one start and of the masks, as a share of
        the object's size, if ``deviation`` is the outline's.
        """
        error = self.outline.measure(pose).error
        told = max(1, np.count_nonzero(error))
        return float(np.sqrt((error**2).sum() / told)) * deviation / _independence(DIRECTIONS)


def problems(
    bodies: Sequence[Body],
    rendered: Sequence[int],
    estimate: Pose,
    masks: FloatArray,
    known: FloatArray,
    K: FloatArray,
    sure: Uncertainty,
) -> Problems:
    """What moves an estimate to masks.

    Args:
        bodies: By `r2art.run.refinement.refine.resolutions`.
        rendered: Which of them are compared by their silhouettes.
        estimate: One start.
        masks: (I, H, W) ...
        known: ... and what of them is known.
        K: (3, 3) intrinsics of the masks.
        sure: How far off the estimate and the masks may be.
    """
    scale = sure.log_scale > 0
    tips = bodies[0].outlined()
    box = outline(masks.max(axis=0)[None], known.min(axis=0)[None], K, 4)
    around = outline(masks, known, K, DIRECTIONS)
    soft = bodies[0].shell is None
    sizes = tuple(list(POINTS)[k] for k in rendered)
    borders = BORDERS if sure.border > 0 else 0
    levels = pyramid(masks, known, K, box.corners, sizes, soft=soft, borders=borders)
    deviations = sure.deviations(tips, box.extent)
    whole = np.ones(len(deviations), bool)
    whole[tips.border] = sure.border > 0
    place = np.zeros(len(deviations), bool)
    place[3:IMAGE_FREEDOM] = True

    def reach(wanted: Outline) -> Measure:
        firmness = _independence(wanted.reach.shape[-1]) / (sure.outline * wanted.extent)

        return lambda pose: reach_errors(tips, pose, wanted, scale=scale).times(firmness)

    def pixels(body: Body, level: Level) -> Measure:
        outlines = reach(around)
        if body.shell is not None:
            sharp = np.sqrt(STRETCHES / (4 * level.side)) / (sure.outline * level.side)

            return lambda pose: coverage_errors(body, pose, level, scale=scale).times(sharp)
        firmness = np.sqrt(STRETCHES / (EDGE * 4 * level.side)) / (GRAIN * level.side)

        def measure(pose: Pose) -> Errors:
            seen = pixel_errors(body, pose, level, scale=scale).times(firmness)
            return seen.beside(outlines(pose))

        return measure

    def problem(body: Body, measure: Measure, free: NDArray[np.bool_]) -> Problem:
        return Problem(
            measure=measure,
            body=body,
            estimate=estimate,
            precision=deviations**-2.0,
            free=free,
        )

    silhouettes = zip((bodies[k] for k in rendered), levels, strict=True)
    return Problems(
        box=problem(tips, reach(box), place),
        outline=problem(tips, reach(around), whole),
        silhouettes=tuple(problem(b, pixels(b, level), whole) for b, level in silhouettes),
    )


def _independence(directions: int) -> float:
    """What each of so many neighbouring directions counts, as a share of its own deviation."""
    return min(1.0, STRETCHES / directions) ** 0.5
