"""What a single-photo prediction is worth as a measurement.

Its errors are of two kinds. Some are new in every frame: the filter's white noise. Others are the
same in all of a clip, because the object looks the same in all of it: no averaging removes them, so
they are added to what is reported (`SYSTEMATIC`) and kept out of the filter. Both were measured on
rendered clips of unseen objects (`python benchmarks/video.py --noise`).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.core.prediction import Prediction
from r2art.run.video.state import Measurement

FloatArray = NDArray[np.floating]

LEAST_CONFIDENCE = 0.1
"""Below this confidence of its root, calibrated, the network has seen no object. Of 40 validation
photos of each category all have more (of eyeglasses nine in ten); of as many photos of other things
one in twenty at most has more and fits its mask as well."""
USUAL_RESIDUAL = 0.03
"""Outline residual up to which an estimate fits its mask as well as most do."""
WORST_RESIDUAL = 0.15
"""Outline residual beyond which it fits something else."""


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Standard deviations of an estimate.

    Attributes:
        rotation: rad, about each axis.
        across: Of the place across the viewing ray, as a share of the distance.
        along: Along it, likewise.
        joint: As a share of the joint's range.
        size: Of the logarithm of the object's size.
    """

    rotation: float
    across: float
    along: float
    joint: float
    size: float

    def covariance(self, place: FloatArray, spans: FloatArray, factors: FloatArray) -> FloatArray:
        """(n + 1, n + 1) as in `Measurement`.

        Args:
            place: (3,) of the object, in diagonals.
            spans: (J,) the joints' ranges.
            factors: (J + 1,) by which the deviations of the root and of each joint are larger.
        """
        J = len(spans)
        result = np.zeros((7 + J, 7 + J))
        distance = float(np.linalg.norm(place))
        ray = np.outer(place, place) / distance**2
        result[:3, :3] = self.rotation**2 * np.eye(3)
        result[3:6, 3:6] = distance**2 * (self.along**2 * ray + self.across**2 * (np.eye(3) - ray))
        result[:6, :6] *= factors[0] ** 2
        joints = (self.joint * spans * factors[1:]) ** 2
        result[range(6, 7 + J), range(6, 7 + J)] = [*joints, self.size**2]
        return result


WHITE = Noise(rotation=0.015, across=0.002, along=0.006, joint=0.02, size=0.006)
SYSTEMATIC = Noise(rotation=0.045, across=0.008, along=0.04, joint=0.08, size=0.1)


def usable(prediction: Prediction) -> bool:
    """Whether the network has seen the object at all; not so in a photo that it rejects."""
    fit = prediction.refinement
    fits = fit is None or fit.residual <= WORST_RESIDUAL
    sure = prediction.parts[0].confidence >= LEAST_CONFIDENCE
    return prediction.rejected is None and fits and sure


def size_of(prediction: Prediction) -> float:
    """The diagonal of the root part's box (m)."""
    return float(np.linalg.norm(prediction.parts[0].box_size))


def spans_of(prediction: Prediction) -> FloatArray:
    """(J,) the joints' ranges."""
    return np.array([joint.limits[1] - joint.limits[0] for joint in prediction.joints])


def limits_of(prediction: Prediction) -> FloatArray:
    """(J, 2) the joints' limits."""
    return np.array([joint.limits for joint in prediction.joints], float).reshape(-1, 2)


def measurement_of(prediction: Prediction, noise: Noise = WHITE) -> Measurement:
    """A prediction as the filter takes it, trusted by its confidence and its fit to the mask."""
    root = prediction.parts[0]
    size = size_of(prediction)
    place = np.asarray(root.cam_T_part, float)[:3, 3] / size
    trust = np.array([max(part.confidence, 0.05) for part in prediction.parts])
    fit = prediction.refinement
    misfit = 1.0 if fit is None else max(1.0, fit.residual / USUAL_RESIDUAL)
    return Measurement(
        rotation=np.asarray(root.cam_T_part, float)[:3, :3],
        place=place,
        joints=np.array([joint.state for joint in prediction.joints], float),
        log_size=float(np.log(size)),
        covariance=noise.covariance(place, spans_of(prediction), misfit / trust),
    )
