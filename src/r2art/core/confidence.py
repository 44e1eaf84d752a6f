"""A part's confidence as a calibrated probability: the weights that a model file may hold.

The network was taught how sure to be on photos that it has learned by heart, and knows nothing of
the refinement that follows. What it says, as log odds, and how well the refined outline fits go
through a logistic regression, fitted on photos that it was not trained on (Platt, 1999,
"Probabilistic Outputs for Support Vector Machines"; Guo et al., ICML 2017,
"On Calibration of Modern Neural Networks").
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.floating]

EDGE = 1e-3
"""Least distance of the network's confidence from 0 and 1, whose log odds are infinite."""
USUAL_RESIDUAL = 0.03
"""Residual of a refinement that says nothing for or against the part; about the usual one."""
LEAST_RESIDUAL = 1e-3
"""Added to all residuals: finer differences mean nothing, and 0 has no logarithm."""
LARGEST_WEIGHT = 1e6


def log_odds(confidence: ArrayLike) -> FloatArray:
    """log(p / (1 − p)) of confidences, kept `EDGE` away from 0 and 1."""
    p = np.clip(np.asarray(confidence, float), EDGE, 1 - EDGE)
    return np.log(p) - np.log1p(-p)


def log_misfit(residual: ArrayLike) -> FloatArray:
    """Logarithm of residuals of refinement beside the usual one; 0 where a residual is usual."""
    residual = np.maximum(np.asarray(residual, float), 0) + LEAST_RESIDUAL
    return np.log(residual / (USUAL_RESIDUAL + LEAST_RESIDUAL))


@dataclass(frozen=True, kw_only=True)
class Weights:
    """Of a logistic regression; as they are by default, they leave a confidence as it is.

    Attributes:
        bias: Log odds of a part of which the network says 0.5, where the residual is usual.
        slope: Weight of `log_odds` of what the network says.
        misfit: Weight of `log_misfit` of the refinement's residual.

    Raises:
        ValueError: A weight is beyond `LARGEST_WEIGHT`, or no number.
    """

    bias: float = 0.0
    slope: float = 1.0
    misfit: float = 0.0

    def __post_init__(self) -> None:
        for weight in (self.bias, self.slope, self.misfit):
            if not abs(weight) <= LARGEST_WEIGHT:  # so that nan is refused, too
                raise ValueError(f"a weight of the calibration is {weight}")

    def probability(self, confidence: ArrayLike, residual: ArrayLike | None = None) -> FloatArray:
        """Calibrated probability, in [0, 1].

        Args:
            confidence: What the network says.
            residual: Of the refinement, as a share of the object's size in the photo; None: of
                parts that were not refined.
        """
        odds = self.bias + self.slope * log_odds(confidence)
        if residual is not None:
            odds = odds + self.misfit * log_misfit(residual)
        return 0.5 + 0.5 * np.tanh(odds / 2)  # the logistic function, without overflow


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """The weights of one category, of its parts or of its joints.

    Attributes:
        refined: For estimates refined to where the network itself sees the object.
        plain: For all others.
    """

    refined: Weights
    plain: Weights

    def to_dict(self) -> dict[str, dict[str, float]]:
        """As the metadata of a model file holds it."""
        refined, plain = self.refined, self.plain
        return {
            "refined": {"bias": refined.bias, "slope": refined.slope, "misfit": refined.misfit},
            "plain": {"bias": plain.bias, "slope": plain.slope},
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> "Calibration":
        """The inverse of :meth:`to_dict`.

        Raises:
            LookupError, TypeError, ValueError: A weight is missing, or no number.
        """
        refined, plain = data["refined"], data["plain"]
        return cls(
            refined=Weights(
                bias=float(refined["bias"]),
                slope=float(refined["slope"]),
                misfit=float(refined["misfit"]),
            ),
            plain=Weights(bias=float(plain["bias"]), slope=float(plain["slope"])),
        )
