"""What the network says of its parts, turned into the probability that they are right."""

from dataclasses import replace

from r2art.core.confidence import Calibration
from r2art.core.prediction import Prediction
from r2art.run.model import ModelCategory


def calibrated(prediction: Prediction, known: ModelCategory, *, own_mask: bool) -> Prediction:
    """The prediction with calibrated confidences.

    A joint's is read off what the network says of the part that it moves.

    Args:
        prediction: Its confidences are the network's.
        known: Its category; where that holds no calibration, parts keep what they have, and joints
            get none.
        own_mask: Whether it was refined, if it was, to where the network itself sees the object.
            Residuals beside a user's mask are others, so they are not used.
    """
    fit = prediction.refinement if own_mask else None
    said = {part.name: part.confidence for part in prediction.parts}

    def probability(calibration: Calibration, part: str) -> float:
        weights, residual = (
            (calibration.plain, None) if fit is None else (calibration.refined, fit.residual)
        )
        return float(weights.probability(said[part], residual))

    of_parts, of_joints = known.calibration, known.joint_calibration
    parts, joints = prediction.parts, prediction.joints
    if of_parts is not None:
        parts = tuple(replace(p, confidence=probability(of_parts, p.name)) for p in parts)
    if of_joints is not None:
        joints = tuple(replace(j, confidence=probability(of_joints, j.child)) for j in joints)
    return replace(prediction, parts=parts, joints=joints)
