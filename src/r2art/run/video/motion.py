"""From one frame to the next: things go on as they went, and slowly come to rest.

Rates are driven by white noise and decay within `REST` seconds; that bounds how far something
unseen is thought to have gone. How strong the noise must be is not known beforehand: hands move
things at any speed. So it grows while innovations keep pointing one way, which they never do while
a filter keeps up (`Agility`), and falls back to its floor afterwards.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from r2art.run.refinement.pose import rotation_of
from r2art.run.video.state import State, groups

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True)
class Spread:
    """Standard deviations of rotation, place and joints, or of their rates.

    Attributes:
        rotation: rad.
        place: Of the object's distance.
        joint: Of the joint's range.
    """

    rotation: float
    place: float
    joint: float

    def of(self, distance: float, spans: FloatArray) -> FloatArray:
        """(n,) for an object that far away (diagonals) with joints of these ranges, (J,)."""
        place = self.place * distance
        return np.array([*[self.rotation] * 3, *[place] * 3, *(self.joint * spans)])


REST = 0.7
"""Time constant (s) in which a rate that nothing drives decays."""
CALM = Spread(rotation=0.08, place=0.015, joint=0.25)
"""What changes the rates of a calm object within a second (per √s)."""
UNKNOWN = Spread(rotation=0.5, place=0.2, joint=0.7)
"""Rates (per s) of an object of which only one frame has been seen."""
MEMORY = 0.3
"""Weight of the newest innovation in their mean."""
PATIENCE = 5.0
"""Mean innovations this many times as large (squared) as chance makes them are still chance."""
LIVELIEST = 50.0
"""Most by which the variance of the driving noise grows."""


@dataclass(frozen=True, eq=False)
class Agility:
    """How much livelier than calm things are: the mean of whitened innovations.

    While the filter keeps up, their mean is zero but for chance, whatever the noise; while it
    lags, they all point the same way.

    Attributes:
        mean: (n,) exponential mean of the whitened innovations.
    """

    mean: FloatArray

    def after(self, whitened: FloatArray) -> "Agility":
        """With one more innovation, (n,); zeros where a frame said nothing."""
        return Agility((1 - MEMORY) * self.mean + MEMORY * whitened)

    @property
    def factors(self) -> FloatArray:
        """(n,) by which the variance of the driving noise grows, alike within a group."""
        n = len(self.mean)
        chance = MEMORY / (2 - MEMORY)
        result = np.ones(n)
        for group in groups(n)[:-1]:
            excess = float(np.mean(self.mean[group] ** 2)) / chance / PATIENCE
            result[group] = np.clip(excess**2, 1.0, LIVELIEST)
        return result


def predicted(state: State, seconds: float, drive: FloatArray) -> State:
    """The belief ``seconds`` later.

    Args:
        state: Now.
        seconds: Zero or more.
        drive: (n,) variance per second of what changes each rate.
    """
    n = state.moving
    decay = np.exp(-seconds / REST)
    reach = REST * (1 - decay)
    turn = rotation_of(reach * state.rates[:3])
    F = np.eye(2 * n + 1)
    F[:3, :3] = turn
    F[:n, n : 2 * n] = reach * np.eye(n)
    F[n : 2 * n, n : 2 * n] = decay * np.eye(n)
    Q = np.zeros_like(F)
    Q[:n, :n] = np.diag(drive * seconds**3 / 3)
    Q[:n, n : 2 * n] = Q[n : 2 * n, :n] = np.diag(drive * seconds**2 / 2)
    Q[n : 2 * n, n : 2 * n] = np.diag(drive * seconds)
    return replace(
        state,
        rotation=turn @ state.rotation,
        place=state.place + reach * state.rates[3:6],
        joints=state.joints + reach * state.rates[6:],
        rates=decay * state.rates,
        covariance=F @ state.covariance @ F.T + Q,
    )
