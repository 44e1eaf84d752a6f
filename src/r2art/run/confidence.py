"""What the network says of its parts, turned into the probability that they are right."""

from dataclasses import replace

from r2art.core.confidence import Calibration
from r2art.core.prediction import Prediction


def calibrated(
    prediction: Prediction, calibration: Calibration | None, *, own_mask: bool
) -> Prediction:
    """The prediction with calibrated confidences.

    Args:
        prediction: Its confidences are the network's.
        calibration: Of its category; None: confidences stay as they are.
        own_mask: Whether it was refined, if it was, to where the network itself sees the object.
            Residuals beside a user's mask are others, so they are not used.
    """
    if calibration is None:
        return prediction
    fit = prediction.refinement if own_mask else None
    weights, residual = (
        (calibration.plain, None) if fit is None else (calibration.refined, fit.residual)
    )
    parts = tuple(
        replace(part, confidence=float(weights.probability(part.confidence, residual)))
        for part in prediction.parts
    )
    return replace(prediction, parts=parts)
