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
from r2art.run.refinement.body import Body, body_of
from r2art.run.refinement.pose import Pose, pose_of
from r2art.run.refinement.problems import POINTS, problems
from r2art.run.refinement.search import Search
from r2art.run.refinement.starts import spread
from r2art.run.refinement.uncertainty import Uncertainty

FloatArray = NDArray[np.floating]

STEPS = (3, 16, 10, 4, 0)
"""Most steps: for the box, for the outline, and at each resolution."""


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
            Where none of several fits, there are more.
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
    search = Search(
        problems=problems(bodies, rendered, estimate, masks, known, K, sure),
        steps=(*steps[:2], *(steps[k + 2] for k in rendered)),
        images=len(masks),
        until=until,
    )
    found = search.run(lambda count: spread(bodies[0], estimate, sure, count), starts)
    shares = [search.problems.distance(p, sure.outline) for p in (found.pose, estimate)]
    better = shares[0] <= shares[1]
    return _result(
        bodies[0],
        found.pose if better else estimate,
        residual=min(shares),
        start_residual=shares[1],
        steps=found.steps,
        converged=found.converged,
    )


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
