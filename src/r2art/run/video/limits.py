"""Joints have limits, and a belief about a joint knows them.

The Gaussian of the filter does not: its mean is moved to the nearest state within the limits, and
everything that goes with the joint moves along as far as the two are correlated (constrained Kalman
filtering by projection, Simon 2010). What is *reported* is that mean with the deviation of the
truncated Gaussian about it, which is never more than the range allows.
"""

from dataclasses import replace
from math import erf, exp, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from r2art.run.video.state import State

FloatArray = NDArray[np.floating]


def within(state: State, limits: FloatArray) -> State:
    """The likeliest state whose joints are within ``limits`` (J, 2), if these pull it alone.

    A joint that rests against a limit does not move on beyond it.
    """
    n = state.moving
    for j in range(len(limits)):
        wanted = float(np.clip(state.joints[j], *limits[j]))
        beyond = wanted - state.joints[j]
        k = 6 + j
        if beyond and state.covariance[k, k] > 0:
            pull = state.covariance[:, k] / state.covariance[k, k] * beyond
            state = state.moved(pull)
    joints = np.clip(state.joints, limits[:, 0], limits[:, 1])
    rates = state.rates.copy()
    outward = ((joints <= limits[:, 0]) & (rates[6:n] < 0)) | (
        (joints >= limits[:, 1]) & (rates[6:n] > 0)
    )
    rates[6:n][outward] = 0.0
    return replace(state, joints=joints, rates=rates)


def deviation(state: float, sigma: float, low: float, high: float) -> float:
    """Root mean square error to expect of ``state`` where the truth is normal about it, within
    limits.
    """
    if sigma <= 0 or high <= low:
        return 0.0
    sigma = min(sigma, 20 * (high - low))  # hardly different from uniform, and exact in floats
    a, b = (low - state) / sigma, (high - state) / sigma
    share = (erf(b / sqrt(2)) - erf(a / sqrt(2))) / 2
    if share <= 1e-12:
        return 0.0
    tails = a * exp(-a * a / 2) - b * exp(-b * b / 2)
    return sigma * sqrt(max(0.0, 1 + tails / sqrt(2 * pi) / share))
