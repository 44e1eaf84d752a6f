"""Refine an estimate against a mask: the box first, then the outline, then silhouettes.

All three are least-squares problems with analytic derivatives, solved for several starts at once:

1. The object's *box* must be the mask's. Four numbers can only tell x, y and log z, so only these
   move; it brings the object home from where no pixel overlaps.
2. Its convex *outline* must be the mask's: all degrees of freedom, and still no rendering.
3. Its *silhouettes* must be the masks, coarse to fine; they see what the outline does not.

What the masks cannot tell is held by a prior: the estimate that refinement started from, each
quantity as firmly as its standard deviation says. NumPy alone; see docs/silhouettes.md.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Category
from r2art.core.errors import InputError, UsageError
from r2art.run.refinement.body import IMAGE_FREEDOM, Body, body_of
from r2art.run.refinement.coverage import coverage_errors
from r2art.run.refinement.descent import Measure, Problem, descend
from r2art.run.refinement.outline import Outline, outline, reach_errors
from r2art.run.refinement.pose import Pose, pose_of
from r2art.run.refinement.search import other_states, spread
from r2art.run.refinement.silhouettes import Level, pixel_errors, pyramid
from r2art.run.refinement.uncertainty import Uncertainty

FloatArray = NDArray[np.floating]

POINTS = {28: 128, 56: 512, 112: 2048}
"""Resolutions, coarse to fine, and how many points of the object serve each of them."""
STEPS = (3, 8, 4, 4, 0)
"""Most steps: for the box, for the outline, and at each resolution."""
DIRECTIONS = 32
"""Of the outline."""
STRETCHES = 16
"""Independent stretches of an outline: how often a mask measures how far off it is."""
EDGE = 0.35
"""Square residual of a silhouette that is a pixel off, per pixel of its outline."""
POOR = 2.0
"""Of the cost that a right pose may have: above it, other joint states are tried, ..."""
STATES = 5
"""... so many of each."""
BORDERS = 3
"""Pixels by which masks are made wider and narrower."""
GRAIN = 0.03
"""Standard deviation of a rendered outline, of points drawn at random (share of the size)."""


@dataclass(frozen=True, kw_only=True)
class Refined:
    """The best found so far.

    Attributes:
        cam_T_root: (4, 4).
        joint_state: (J,) rad, m.
        log_scale: (P, 3) of each part, relative to the body given.
        residual: Root mean square distance between the object's outline and the masks', as a
            share of its size in the image.
        start_residual: That of the estimate.
        steps: How many were taken.
        converged: Whether the last problem had come to rest before its steps or the time ran out.
    """

    cam_T_root: FloatArray
    joint_state: FloatArray
    log_scale: FloatArray
    residual: float
    start_residual: float
    steps: int
    converged: bool


def resolutions(category: Category) -> tuple[Body, ...]:
    """A category's mean object as each resolution needs it, see `body_of`. Slow; keep it."""
    body = body_of(category)
    if body.shell is not None:
        return (body.hollow(),) * len(POINTS)
    return tuple(body.thinned(count) for count in POINTS.values())


def refine(
    bodies: Sequence[Body],
    cam_T_root: FloatArray,
    joint_state: FloatArray,
    masks: FloatArray,
    K: FloatArray,
    *,
    known: FloatArray | None = None,
    uncertainty: Uncertainty | None = None,
    starts: int = 4,
    steps: Sequence[int] = STEPS,
    seconds: float = np.inf,
) -> Refined:
    """Move an estimate until its silhouettes are the masks.

    Args:
        bodies: The object by `resolutions`, each `Body.stretched` to the estimated part boxes.
        cam_T_root: (4, 4) the estimate ...
        joint_state: (J,) ... of pose and joints (rad, m).
        masks: (H, W) of the whole object, or (P, H, W) of every part, in [0, 1]. Those of parts
            are whole; where one part hides another, say so in ``known``.
        K: (3, 3) intrinsics of the masks.
        known: Like ``masks``; 0 where they may be wrong, else 1.
        uncertainty: Of the estimate and the masks.
        starts: Poses to start from: the estimate, and others around it within its uncertainty.
        steps: Most steps for the box, for the outline, and at each resolution.
        seconds: When to stop and return the best so far.

    Raises:
        InputError: A mask that is empty, or not finite.
        UsageError: Arrays that do not belong together.
    """
    until = time.perf_counter() + seconds
    sure = uncertainty or Uncertainty()
    masks, known = _checked(bodies[0], masks, known)
    estimate = pose_of(bodies[0], cam_T_root, joint_state)
    rendered = [k for k, most in enumerate(steps[2:]) if most > 0]
    box, around, *levels = _problems(bodies, rendered, estimate, masks, known, K, sure)
    left = [steps[k + 2] for k in rendered]
    several = spread(bodies[0], estimate, sure, starts)
    pose, cost, taken, converged = descend(box, several, steps[0], until)
    found = _narrowed([(around, steps[1]), *zip(levels, left, strict=True)], pose, cost, until)
    taken += found.steps
    poor = found.cost > POOR * STRETCHES * len(masks)
    if poor and starts > 1 and levels and time.perf_counter() < until:
        others = other_states(bodies[0], found.pose, STATES)
        others, cost = _best(others, levels[0].system(others)[0], starts)
        again = _narrowed(list(zip(levels, left, strict=True)), others, cost, until)
        taken += again.steps
        found = min(found, again, key=lambda f: f.cost)
    pose, converged = found.pose, found.converged or (converged and not found.steps)
    shares = [_distance(around, p, sure.outline) for p in (pose, estimate)]
    better = shares[0] <= shares[1]
    return _result(
        bodies[0],
        pose if better else estimate,
        residual=min(shares),
        start_residual=shares[1],
        steps=taken,
        converged=converged,
    )


@dataclass(frozen=True, kw_only=True)
class _Found:
    """The best start, its cost, the steps taken, and whether it has come to rest."""

    pose: Pose
    cost: float
    steps: int
    converged: bool


def _narrowed(
    problems: Sequence[tuple[Problem, int]], pose: Pose, cost: FloatArray, until: float
) -> _Found:
    """Solve problems in turn, each for the best quarter of the starts of the one before."""
    taken, converged = 0, False
    for problem, most in problems:
        if time.perf_counter() >= until or (most == 0 and len(cost) == 1):
            continue
        pose, cost, used, converged = descend(problem, pose, most, until)
        pose, cost = _best(pose, cost, max(1, len(cost) // 4))
        taken += used
    pose, cost = _best(pose, cost, 1)
    return _Found(pose=pose, cost=float(cost[0]), steps=taken, converged=converged)


def _best(pose: Pose, cost: FloatArray, count: int) -> tuple[Pose, FloatArray]:
    """The ``count`` starts that cost least, in this order."""
    best = np.argsort(cost, kind="stable")[:count]
    return pose.pick(best), cost[best]


def _problems(
    bodies: Sequence[Body],
    rendered: Sequence[int],
    estimate: Pose,
    masks: FloatArray,
    known: FloatArray,
    K: FloatArray,
    sure: Uncertainty,
) -> list[Problem]:
    """In their order: the box, the outline, and silhouettes at the resolutions wanted."""
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

        def measure(pose: Pose) -> tuple[FloatArray, FloatArray]:
            error, slopes = reach_errors(tips, pose, wanted, scale=scale)
            return firmness * error, firmness * slopes

        return measure

    def pixels(body: Body, level: Level) -> Measure:
        outlines = reach(around)
        if body.shell is not None:
            sharp = np.sqrt(STRETCHES / (4 * level.side)) / (sure.outline * level.side)

            def exact(pose: Pose) -> tuple[FloatArray, FloatArray]:
                error, slopes = coverage_errors(body, pose, level, scale=scale)
                return sharp * error, sharp * slopes

            return exact
        firmness = np.sqrt(STRETCHES / (EDGE * 4 * level.side)) / (GRAIN * level.side)

        def measure(pose: Pose) -> tuple[FloatArray, FloatArray]:
            seen = pixel_errors(body, pose, level, scale=scale)
            both = zip(seen, outlines(pose), strict=True)
            error, slopes = (np.concatenate([firmness * a, b], axis=-1) for a, b in both)
            return error, slopes

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
    return [
        problem(tips, reach(box), place),
        problem(tips, reach(around), whole),
        *(problem(body, pixels(body, level), whole) for body, level in silhouettes),
    ]


def _checked(
    body: Body, masks: FloatArray, known: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """Masks and what is known of them, both as (I, H, W)."""
    masks = np.asarray(masks, float)
    masks = masks[None] if masks.ndim == 2 else masks
    if masks.ndim != 3 or len(masks) not in (1, len(body.center)):
        raise UsageError(
            f"masks of shape {masks.shape} for an object of {len(body.center)} parts; give (H, W) "
            "of the whole object, or one such mask of every part"
        )
    if not np.isfinite(masks).all():
        raise InputError("the mask has values that are not finite; give numbers from 0 to 1")
    known = np.broadcast_to(1.0 if known is None else np.asarray(known, float), masks.shape)
    if not (masks * known > 0.5).any():
        raise InputError("the mask shows no object; there is nothing to refine against")
    return masks, known


def _independence(directions: int) -> float:
    """What each of so many neighbouring directions counts, as a share of its own deviation."""
    return min(1.0, STRETCHES / directions) ** 0.5


def _distance(around: Problem, pose: Pose, deviation: float) -> float:
    """Root mean square distance of the outlines, as a share of the object's size."""
    error, _ = around.measure(pose)
    told = max(1, np.count_nonzero(error))
    return float(np.sqrt((error**2).sum() / told)) * deviation / _independence(DIRECTIONS)


def _result(
    body: Body,
    pose: Pose,
    *,
    residual: float,
    start_residual: float,
    steps: int,
    converged: bool,
) -> Refined:
    cam_T_root = np.eye(4)
    cam_T_root[:3, :3] = pose.rotation[0]
    cam_T_root[:3, 3] = pose.anchor[0] - pose.rotation[0] @ body.anchor
    return Refined(
        cam_T_root=cam_T_root,
        joint_state=pose.joint_state[0],
        log_scale=pose.log_scale[0],
        residual=residual,
        start_residual=start_residual,
        steps=steps,
        converged=converged,
    )
