"""In which order the problems are solved, from which starts, and where else to look."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.run.refinement.descent import Problem, descend
from r2art.run.refinement.pose import Pose, difference
from r2art.run.refinement.problems import STRETCHES, Problems
from r2art.run.refinement.starts import other_states

FloatArray = NDArray[np.floating]

MORE = (4, 16)
"""Times as many starts, one after the other, while none fits."""
UNSURE = 2.0
"""Of the cost of a right pose: outlines that cost more are not followed before there are more."""
GRAINY = 3.0
"""Times as much a stretch costs where silhouettes are of points and the outline counts beside."""
STATES = 5
"""Other states of every joint, where silhouettes fit badly, ..."""
JOINTS = 3
"""... of objects of at most so many joints: more starts are cheaper for others."""
MARGIN = 16.0
"""Of cost: what is worse than the best outline by more, and twice as bad, is not followed."""
ALIKE = 0.3
"""Standard deviations of the estimate within which two poses are one."""
CANDIDATES = 8
"""Of later starts, for silhouettes."""
FIELD = 32
"""Starts that may run on along the outline without being the better half."""
COARSE, FINE = 0.3, 0.03
"""Changes of cost that are none: before the last resolution, and at it or of a start alone."""


@dataclass(frozen=True, kw_only=True)
class Found:
    """Starts, what they cost (S,), the steps taken, and whether the best has come to rest."""

    pose: Pose
    cost: FloatArray
    steps: int
    converged: bool

    def pick(self, which: Sequence[int] | NDArray[np.integer]) -> "Found":
        """Some of the starts."""
        which = np.asarray(which, np.intp)
        return Found(
            pose=self.pose.pick(which),
            cost=self.cost[which],
            steps=self.steps,
            converged=self.converged,
        )

    def best(self, count: int) -> "Found":
        """The starts that cost least, in this order."""
        return self.pick(np.argsort(self.cost, kind="stable")[:count])

    def beside(self, other: "Found") -> "Found":
        """The starts of both."""
        first = self.cost.min() <= other.cost.min()
        return Found(
            pose=self.pose.beside(other.pose),
            cost=np.concatenate([self.cost, other.cost]),
            steps=self.steps + other.steps,
            converged=self.converged if first else other.converged,
        )


@dataclass(frozen=True, kw_only=True)
class Search:
    """Problems to be solved in turn.

    Attributes:
        problems: The box, the outline, and silhouettes.
        steps: Most steps for each of them.
        images: I.
        until: When to stop, by `time.perf_counter`.
    """

    problems: Problems
    steps: Sequence[int]
    images: int
    until: float

    def run(self, several: Callable[[int], Pose], starts: int) -> Found:
        """The best start.

        Args:
            several: Gives so many poses, the estimate first.
            starts: How many to begin with. One goes its way alone, and where nothing is rendered,
                nothing says whether to look for others.
        """
        alone = starts == 1 or not self.problems.silhouettes
        rounds = iter(MORE)
        reached = self.outlines(several(starts), FINE if starts == 1 else COARSE)
        if not alone and self.poor(reached, UNSURE):
            reached = reached.beside(self.outlines(_others(several, next(rounds) * starts)))
        if not self.problems.silhouettes:
            return reached.best(1)
        found = self.coarse(self.distinct(reached, max(1, starts // 2)))
        if not alone and self.poor(found) and found.pose.joint_state.shape[1] <= JOINTS:
            states = other_states(self.problems.outline.body, found.pose, STATES)
            cost = self.problems.silhouettes[0].system(states)[0]
            others = Found(pose=states, cost=cost, steps=0, converged=False)
            found = found.beside(self.coarse(others.best(CANDIDATES))).best(1)
        for times in rounds:
            if alone or not self.poor(found):
                break
            reached = self.outlines(_others(several, times * starts))
            found = found.beside(self.coarse(self.distinct(reached, CANDIDATES))).best(1)
        return self.fine(found)

    @property
    def right(self) -> float:
        """What a right pose may cost: one for every stretch of the outline, and one for every
        degree of freedom by which it may be off the estimate.
        """
        grainy = any(problem.body.shell is None for problem in self.problems.silhouettes)
        stretches = (GRAINY if grainy else 1.0) * STRETCHES * self.images
        return stretches + len(self.problems.outline.precision)

    def poor(self, found: Found, times: float = 1.0) -> bool:
        """Whether no start fits, and there is time for others."""
        return bool(found.cost.min() > times * self.right) and time.perf_counter() < self.until

    def outlines(self, pose: Pose, rest: float = COARSE) -> Found:
        """Starts brought to the masks' box, then to their outline."""
        found = Found(pose=pose, cost=np.full(len(pose.rotation), np.inf), steps=0, converged=False)
        found = self._after(found, self.problems.box, self.steps[0], rest=rest)
        if self._skipped(self.steps[1], found):
            return found
        return self._after(found, self.problems.outline, self.steps[1], rest=rest, field=FIELD)

    def coarse(self, found: Found) -> Found:
        """The best start after the first silhouettes."""
        if self._skipped(self.steps[2], found):
            return found.best(1)
        rest = COARSE if len(self.problems.silhouettes) > 1 else FINE
        problem = self.problems.silhouettes[0]
        return self._after(found, problem, self.steps[2], rest=rest, field=1).best(1)

    def fine(self, found: Found) -> Found:
        """One start after all the others."""
        for problem, most in zip(self.problems.silhouettes[1:], self.steps[3:], strict=True):
            if not self._skipped(most, found):
                found = self._after(found, problem, most, rest=FINE)
        return found

    def _skipped(self, most: int, found: Found) -> bool:
        return time.perf_counter() >= self.until or (most == 0 and len(found.cost) == 1)

    def _after(
        self, found: Found, problem: Problem, most: int, *, rest: float, field: int | None = None
    ) -> Found:
        pose, cost, steps, converged = descend(
            problem, found.pose, most, self.until, rest=rest, field=field
        )
        return Found(pose=pose, cost=cost, steps=found.steps + steps, converged=converged)

    def distinct(self, found: Found, most: int) -> Found:
        """The best starts, not far from the best, and of those alike only one."""
        problem = self.problems.outline
        scale = len(problem.precision) > problem.body.freedom
        near = found.best(len(found.cost))
        chosen = [0]
        for k in range(1, int((near.cost <= near.cost[0] + max(MARGIN, near.cost[0])).sum())):
            if len(chosen) == most:
                break
            kept, again = near.pose.pick(np.array(chosen)), near.pose.pick(np.full(len(chosen), k))
            away = difference(problem.body, again, kept, scale=scale) ** 2 * problem.precision
            if away.max(axis=-1).min() > ALIKE**2:
                chosen.append(k)
        return near.pick(chosen)


def _others(several: Callable[[int], Pose], count: int) -> Pose:
    """All but the first, which is the estimate."""
    return several(count).pick(np.arange(1, count))
