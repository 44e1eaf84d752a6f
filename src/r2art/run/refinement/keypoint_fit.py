"""From the keypoints of a known object in a photo to the pose and joint states that explain them.

Objects that are all the same have no sizes to be found, so where their keypoints are seen tells
all there is to know: a perspective-n-point problem of an articulated object. It is solved from the
network's estimate and from others round it, for joints that turn all the way have many minima.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from r2art.core.prediction import Prediction, Refinement
from r2art.run.model import KEYPOINT_OUTPUTS
from r2art.run.refinement.body import Body
from r2art.run.refinement.correspondences import Correspondences, correspondence_errors
from r2art.run.refinement.descent import Problem, descend
from r2art.run.refinement.errors import Errors
from r2art.run.refinement.mask_fit import with_pose
from r2art.run.refinement.pose import Pose, pose_of
from r2art.run.refinement.starts import spread
from r2art.run.refinement.uncertainty import Uncertainty

FloatArray = NDArray[np.floating]

# Of the network's estimate; not tuned, as no network has learned keypoints to its end yet.
OF_NETWORK = Uncertainty(rotation=0.4, place=0.03, log_depth=0.08, joint=0.2)
STARTS = 16
ROUNDS = 5
"""Steps of this fit for each that is asked for: they are cheap, and the way is long."""
REST = 0.01
"""A change of cost that is none."""


def fitted_to_keypoints(
    prediction: Prediction,
    body: Body,
    keypoints: FloatArray,
    outputs: Mapping[str, FloatArray],
    K: FloatArray,
    steps: int,
) -> Prediction:
    """The prediction, moved to where its keypoints are seen.

    Args:
        prediction: The network's.
        body: The category's object.
        keypoints: (P, N, 3) of each part, at rest in the root frame (m).
        outputs: Of `r2art.run.model.Model.pose`.
        K: (3, 3) intrinsics of the crop.
        steps: Each stands for `ROUNDS` of this fit's.
    """
    places = located(body, keypoints, outputs)
    state = np.array([joint.state for joint in prediction.joints])
    estimate = pose_of(body, prediction.parts[0].cam_T_part, state)
    tips = body.hollow()
    deviations = OF_NETWORK.deviations(tips, 1.0)
    free = np.arange(tips.freedom) != tips.border

    def measure(pose: Pose) -> Errors:
        return correspondence_errors(tips, pose, places, K, scale=False)

    problem = Problem(
        measure=measure, body=tips, estimate=estimate, precision=deviations**-2.0, free=free
    )
    starts = spread(tips, estimate, OF_NETWORK, STARTS)
    found, cost, taken, converged = descend(
        problem, starts, ROUNDS * steps, rest=REST, field=STARTS // 4
    )
    best = found.pick(np.array([cost.argmin()]))
    before, after = (_residual(measure(pose), places) for pose in (estimate, best))
    how = Refinement(steps=taken, start_residual=before, residual=after, converged=converged)
    return with_pose(prediction, body, best, how)


def located(
    body: Body, keypoints: FloatArray, outputs: Mapping[str, FloatArray]
) -> Correspondences:
    """The keypoints as correspondences, in pixels of the crop."""
    uv, deviation = (outputs[name] for name in KEYPOINT_OUTPUTS)
    share = (keypoints - body.center[:, None]) / body.size[:, None]
    return Correspondences(
        part=np.repeat(np.arange(len(share)), share.shape[1]),
        coordinates=share.reshape(-1, 3),
        uv=uv,
        deviation=deviation,
    )


def _residual(errors: Errors, places: Correspondences) -> float:
    """Root mean square of the distances from where keypoints are seen, far ones counting less, as
    a share of how far keypoints are apart.
    """
    apart = np.linalg.norm(np.ptp(places.uv, axis=0))
    off = errors.error[0].reshape(-1, 2) * places.deviation[:, None]
    return float(np.sqrt((off**2).sum(axis=-1).mean()) / max(apart, 1.0))
