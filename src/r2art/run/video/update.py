"""A frame corrects the belief: an error-state Kalman update that does not trust every frame alike.

Each group of quantities (rotation, place, each joint, size) is weighed by how surprising it is. Up
to `SURPRISE` standard deviations it counts fully; beyond, its noise is taken to be larger in
proportion (Huber's weights); beyond `ABSURD` it says nothing.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from r2art.run.video.limits import within
from r2art.run.video.state import Measurement, State, groups

FloatArray = NDArray[np.floating]

SURPRISE = 2.0
"""Root mean square innovation of a group (standard deviations) up to which it counts fully ..."""
ABSURD = 8.0
"""... and beyond which not at all."""


@dataclass(frozen=True, eq=False)
class Update:
    """The belief after a frame.

    Attributes:
        state: It.
        weights: (J + 3,) share in [0, 1] with which rotation, place, joints and size counted.
        whitened: (n,) innovations in standard deviations, shortened to `SURPRISE`; 0 where there
            was none.
    """

    state: State
    weights: FloatArray
    whitened: FloatArray

    @property
    def accepted(self) -> bool:
        """Whether the frame has said where the object is."""
        return bool(self.weights[0] > 0 and self.weights[1] > 0)


def begun(measurement: Measurement, limits: FloatArray, resting: FloatArray) -> State:
    """A belief from one frame alone.

    Args:
        measurement: It.
        limits: (J, 2) of the joints.
        resting: (n,) standard deviations of the rates.
    """
    n = len(resting)
    covariance = np.zeros((2 * n + 1, 2 * n + 1))
    seen = [*range(n), 2 * n]
    covariance[np.ix_(seen, seen)] = measurement.covariance
    covariance[range(n, 2 * n), range(n, 2 * n)] = resting**2
    state = State(
        rotation=measurement.rotation,
        place=measurement.place,
        joints=measurement.joints,
        rates=np.zeros(n),
        log_size=measurement.log_size,
        covariance=covariance,
    )
    return within(state, limits)


def updated(state: State, measurement: Measurement | None, limits: FloatArray) -> Update:
    """Correct the belief by a frame; one that says nothing, or nonsense, changes nothing.

    Args:
        state: Predicted to the frame's time.
        measurement: What the frame says; None: nothing.
        limits: (J, 2) that joints never leave.
    """
    n = state.moving
    if measurement is None or not measurement.finite:
        return Update(within(state, limits), np.zeros(n - 3), np.zeros(n))
    innovation = measurement.minus(state)
    seen = [*range(n), 2 * n]
    of_state = state.covariance[np.ix_(seen, seen)]
    weights, whitened = _judged(innovation, of_state + measurement.covariance)
    spread = np.repeat(weights, [len(innovation[g]) for g in groups(n)])
    heard = np.flatnonzero(spread > 0)
    if not len(heard):
        return Update(within(state, limits), weights, np.zeros(n))
    H = np.eye(2 * n + 1)[seen][heard]
    softer = 1 / np.sqrt(spread[heard])
    R = measurement.covariance[np.ix_(heard, heard)] * np.outer(softer, softer)
    P = state.covariance
    S = H @ P @ H.T + R
    gain = np.linalg.solve(S, H @ P).T
    keep = np.eye(2 * n + 1) - gain @ H
    covariance = keep @ P @ keep.T + gain @ R @ gain.T
    corrected = replace(
        state.moved(gain @ innovation[heard]), covariance=(covariance + covariance.T) / 2
    )
    return Update(within(corrected, limits), weights, whitened)


def _judged(innovation: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weight of every group, and the whitened innovations of what moves, shortened."""
    n = len(innovation) - 1
    weights, whitened = [], np.zeros(n + 1)
    for group in groups(n):
        values, vectors = np.linalg.eigh(covariance[group, group])
        # The symmetric root: turning the camera's axes turns what comes out, and nothing else.
        white = vectors @ ((vectors.T @ innovation[group]) / np.sqrt(values))
        surprise = float(np.sqrt(np.mean(white**2)))
        weight = min(1.0, SURPRISE / max(surprise, 1e-12))
        weights.append(0.0 if surprise > ABSURD else weight)
        whitened[group] = weight * white
    return np.array(weights), whitened[:n]
