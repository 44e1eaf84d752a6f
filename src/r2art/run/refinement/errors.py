"""What every comparison of a body with a mask gives: errors, and how they move with the pose."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Errors of S starts, R each, of which A move with the D degrees of freedom.

    Attributes:
        error: (S, R).
        slopes: (S, D, A) derivatives.
        moving: (A,) which of the errors they belong to; the others have none.
    """

    error: FloatArray
    slopes: FloatArray
    moving: NDArray[np.integer]

    def times(self, factor: float) -> "Errors":
        """In other units."""
        return Errors(error=factor * self.error, slopes=factor * self.slopes, moving=self.moving)

    def beside(self, other: "Errors") -> "Errors":
        """Both."""
        return Errors(
            error=np.concatenate([self.error, other.error], axis=-1),
            slopes=np.concatenate([self.slopes, other.slopes], axis=-1),
            moving=np.concatenate([self.moving, other.moving + self.error.shape[-1]]),
        )
