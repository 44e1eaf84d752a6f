"""How far from the truth the reported numbers may be: one standard deviation of each."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from r2art.run.video.limits import deviation
from r2art.run.video.measure import SYSTEMATIC, Noise
from r2art.run.video.state import State

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True, eq=False)
class Deviations:
    """Standard deviations of a tracked state.

    Attributes:
        rotation: (3,) of the root, about the camera's x, y and z (rad).
        position: (3,) of the root's origin along the camera's axes (m), if the size were right.
        size: Of all lengths and distances together, as a share of themselves.
        joints: (J,) of the joints' states (rad, m).
        rates: (J,) of their rates (rad/s, m/s).
    """

    rotation: FloatArray
    position: FloatArray
    size: float
    joints: FloatArray
    rates: FloatArray

    def scaled(self, factor: float, sliding: FloatArray) -> "Deviations":
        """Of the same object whose size is known to be ``factor`` times as large.

        Args:
            factor: Of lengths.
            sliding: (J,) the same for sliding joints, 1 for turning ones.
        """
        return replace(
            self,
            position=factor * self.position,
            size=0.0,
            joints=sliding * self.joints,
            rates=sliding * self.rates,
        )

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        return {k: np.asarray(v).tolist() for k, v in vars(self).items()}


def deviations_of(
    state: State, limits: FloatArray, size_spread: float | None, noise: Noise = SYSTEMATIC
) -> Deviations:
    """The filter's own deviations, and with them the errors that averaging does not remove.

    Args:
        state: The belief.
        limits: (J, 2) of the joints.
        size_spread: Standard deviation of the logarithm of such objects' sizes; None: as usual.
        noise: Errors that are the same in all of a clip.
    """
    n = state.moving
    spans = limits[:, 1] - limits[:, 0]
    systematic = noise.covariance(state.place, spans, np.ones(len(spans) + 1))
    variance = np.diag(state.covariance)
    total = variance[:n] + np.diag(systematic)[:n]
    joints = [
        deviation(q, s, low, high)
        for q, s, (low, high) in zip(
            state.joints.tolist(), np.sqrt(total[6:]).tolist(), limits.tolist(), strict=True
        )
    ]
    spread = noise.size if size_spread is None else size_spread
    return Deviations(
        rotation=np.sqrt(total[:3]),
        position=float(np.exp(state.log_size)) * np.sqrt(total[3:6]),
        size=float(np.hypot(spread, np.sqrt(variance[2 * n]))),
        joints=np.array(joints),
        rates=np.sqrt(variance[n + 6 : 2 * n]),
    )
