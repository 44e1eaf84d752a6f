"""How far off an estimate and a mask may be."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.core.errors import UsageError
from r2art.run.refinement.body import Body

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True)
class Uncertainty:
    """Standard deviations of an estimate, and of the masks it is refined against.

    Attributes:
        rotation: Of the root (rad).
        place: Of the root's place in the image, x/z and y/z.
        log_depth: Of the logarithm of its distance.
        joint: Of each joint's state, as a share of its range.
        log_scale: Of the logarithm of each part's size along x, y, z; 0 holds the shape.
        outline: Of the masks' outline and of the object's (share of its size in the image).
        border: Of how far masks reach beyond the object, or fall short of it, by the same all
            round (share likewise); 0 where they are not wrong in this way.
    """

    rotation: float = 0.2
    place: float = 0.05
    log_depth: float = 0.12
    joint: float = 0.15
    log_scale: float = 0.0
    outline: float = 0.01
    border: float = 0.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (value > 0 or (name in ("log_scale", "border") and value == 0)):
                raise UsageError(f"the uncertainty of {name} is {value}; it must be positive")

    def deviations(self, body: Body, extent: float) -> FloatArray:
        """(D,) of every degree of freedom, of an object of ``extent`` in x/z."""
        span = np.maximum(body.limits[:, 1] - body.limits[:, 0], 1e-3)
        root = [self.rotation] * 3 + [self.place] * 2 + [self.log_depth]
        scale = [self.log_scale] * body.center.size if self.log_scale > 0 else []
        border = self.border * extent if self.border > 0 else 1.0
        return np.concatenate([root, self.joint * span, [border], scale])
