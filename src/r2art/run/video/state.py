"""What the filter believes: where the object is, how fast it moves, and how sure that is.

Letters: J joints, n = 6 + J quantities that move, D = 2 n + 1 degrees of freedom. Their errors, in
this order, are what the covariance is of:

    rotation (3, rad, camera axes) | place (3) | joints (J) | rates of all these (n) | log size (1)

The *place* is the root's origin in the camera frame in units of the root box's diagonal, and the
*log size* is the logarithm of that diagonal (m). One photo shows the first far better than metres;
the second is constant, so that it settles over a clip. Poses live on SO(3) × R³: an error turns the
object about its own origin, as the network's errors do, and moves it along the camera's axes.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from r2art.run.refinement.pose import rotation_of, vector_of

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True, eq=False)
class State:
    """A Gaussian belief.

    Attributes:
        rotation: (3, 3) of the root, into the camera frame.
        place: (3,) of the root's origin, in units of its box's diagonal.
        joints: (J,) rad or m.
        rates: (n,) of rotation (rad/s, camera axes), place (1/s) and joints (rad/s or m/s).
        log_size: Logarithm of the diagonal of the root's box in m.
        covariance: (D, D) of the errors above.
    """

    rotation: FloatArray
    place: FloatArray
    joints: FloatArray
    rates: FloatArray
    log_size: float
    covariance: FloatArray

    @property
    def moving(self) -> int:
        """n: how many quantities move."""
        return 6 + len(self.joints)

    @property
    def position(self) -> FloatArray:
        """(3,) of the root's origin in the camera frame (m)."""
        return np.exp(self.log_size) * self.place

    def moved(self, error: FloatArray) -> "State":
        """The state an error of (D,) away; the covariance stays."""
        n = self.moving
        return replace(
            self,
            rotation=rotation_of(error[:3]) @ self.rotation,
            place=self.place + error[3:6],
            joints=self.joints + error[6:n],
            rates=self.rates + error[n : 2 * n],
            log_size=self.log_size + float(error[2 * n]),
        )

    def minus(self, other: "State") -> FloatArray:
        """(D,) the error that leads from ``other`` to this state."""
        return np.concatenate(
            [
                vector_of(self.rotation @ other.rotation.T),
                self.place - other.place,
                self.joints - other.joints,
                self.rates - other.rates,
                [self.log_size - other.log_size],
            ]
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Measurement:
    """What one frame says, with white noise.

    Attributes:
        rotation: (3, 3) as in `State` ...
        place: (3,) ...
        joints: (J,) ...
        log_size: ... likewise.
        covariance: (n + 1, n + 1) of the errors of rotation, place, joints and log size.
    """

    rotation: FloatArray
    place: FloatArray
    joints: FloatArray
    log_size: float
    covariance: FloatArray

    @property
    def finite(self) -> bool:
        """Whether all of it is."""
        values = (self.rotation, self.place, self.joints, self.log_size, self.covariance)
        return all(bool(np.all(np.isfinite(v))) for v in values)

    def minus(self, state: State) -> FloatArray:
        """(n + 1,) the innovation: by how much it differs from what a state would show."""
        return np.concatenate(
            [
                vector_of(self.rotation @ state.rotation.T),
                self.place - state.place,
                self.joints - state.joints,
                [self.log_size - state.log_size],
            ]
        )


def groups(moving: int) -> list[slice]:
    """The quantities of a measurement that are right or wrong together, of ``moving`` = n.

    Rotation; place; each joint; log size.
    """
    single = [slice(k, k + 1) for k in range(6, moving + 1)]
    return [slice(0, 3), slice(3, 6), *single]
