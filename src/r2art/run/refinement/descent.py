"""Levenberg-Marquardt from several starts at once, with a prior and joint limits."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.run.refinement.body import IMAGE_FREEDOM, Body
from r2art.run.refinement.errors import Errors
from r2art.run.refinement.pose import Pose, difference, moved

FloatArray = NDArray[np.floating]
Measure = Callable[[Pose], Errors]

HEAT = 2
"""Steps after which hopeless starts are left behind."""
HIGH = 30.0
"""Of cost."""
LONGEST_STEP = 0.35
"""Radians, logarithms, or sizes of the root part."""


@dataclass(frozen=True, kw_only=True)
class Problem:
    """What is least where the body fits the masks and is not far from the estimate.

    Attributes:
        measure: Gives the errors of poses, in standard deviations.
        body: The object.
        estimate: Where to stay near, ...
        precision: (D,) ... as firmly as this says: one over the variance.
        free: (D,) which degrees of freedom move.
    """

    measure: Measure
    body: Body
    estimate: Pose
    precision: FloatArray
    free: NDArray[np.bool_]

    @property
    def units(self) -> FloatArray:
        """(D,) how much of each degree of freedom is much."""
        extent = np.linalg.norm(self.body.size[0])
        result = np.ones(len(self.precision))
        result[IMAGE_FREEDOM : self.body.border][self.body.prismatic] = extent
        return result

    def system(self, pose: Pose) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(S,) cost, (S, D) half its gradient and (S, D, D) half its Gauss-Newton Hessian."""
        measured = self.measure(pose)
        error, slopes = measured.error[:, measured.moving], measured.slopes
        scale = len(self.precision) > self.body.freedom
        away = difference(self.body, pose, self.estimate, scale=scale)
        held = away * self.precision
        cost = (measured.error**2).sum(axis=-1) + (away * held).sum(axis=-1)
        gradient = (slopes @ error[..., None])[..., 0] + held
        hessian = slopes @ slopes.transpose(0, 2, 1) + np.diag(self.precision)
        return cost, gradient, hessian


def descend(
    problem: Problem,
    pose: Pose,
    most: int,
    until: float = np.inf,
    *,
    rest: float = 0.0,
    field: int | None = None,
) -> tuple[Pose, FloatArray, int, bool]:
    """Levenberg-Marquardt, of every start by itself until it changes its cost no more.

    Args:
        problem: What to minimise.
        pose: The starts.
        most: Steps.
        until: When to stop, by `time.perf_counter`.
        rest: A change that is none of a low cost; of a high one, as much for each `HIGH`.
        field: How many may run on, if not all: of more, the worse half stays after every heat.

    Returns:
        Poses, their costs (S,), the steps taken, and whether the best start has converged.
    """
    cost, gradient, hessian = problem.system(pose)
    damping = np.full(len(cost), 1e-2)
    still = np.zeros(len(cost), bool)
    taken = 0
    while taken < most and not still.all() and time.perf_counter() < until:
        live = np.flatnonzero(~still)
        before = pose.pick(live)
        step = _step(problem, before, gradient[live], hessian[live], damping[live])
        trial = moved(problem.body, before, step)
        new_cost, new_gradient, new_hessian = problem.system(trial)
        better = new_cost < cost[live]
        still[live] = np.abs(new_cost - cost[live]) < rest * (1 + cost[live] / HIGH)
        gone = live[better]
        pose = pose.put(gone, trial.pick(np.flatnonzero(better)))
        cost[gone], gradient[gone] = new_cost[better], new_gradient[better]
        hessian[gone] = new_hessian[better]
        damping[live] = np.clip(damping[live] * np.where(better, 0.3, 5), 1e-6, 1e6)
        taken += 1
        live = np.flatnonzero(~still)
        if field is not None and taken % HEAT == 0 and len(live) > field:
            still[live[np.argsort(cost[live])[max(field, (len(live) + 1) // 2) :]]] = True
    return pose, cost, taken, bool(still[cost.argmin()])


def _step(
    problem: Problem, pose: Pose, gradient: FloatArray, hessian: FloatArray, damping: FloatArray
) -> FloatArray:
    """(S, D) the damped Gauss-Newton step; joints at a limit do not push against it."""
    joints = slice(IMAGE_FREEDOM, problem.body.border)
    low, high = problem.body.limits.T
    inward = np.sign(gradient[:, joints])
    stuck = (pose.joint_state <= low) & (inward > 0) | (pose.joint_state >= high) & (inward < 0)
    free = np.tile(problem.free.astype(float), (len(gradient), 1))
    free[:, joints] *= ~stuck
    diagonal = np.einsum("sdd->sd", hessian)
    system = hessian * (free[:, :, None] * free[:, None, :])
    index = np.arange(gradient.shape[1])
    system[:, index, index] += damping[:, None] * diagonal + (1 - free) + 1e-12
    step = -np.linalg.solve(system, (gradient * free)[..., None])[..., 0]
    size = np.abs(step / problem.units).max(axis=-1, keepdims=True)
    return step * np.minimum(1, LONGEST_STEP / np.maximum(size, 1e-12))
