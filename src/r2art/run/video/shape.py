"""The object's shape, which a clip does not change: the mean of what its frames say.

Sizes are kept relative to the root box's diagonal, which the filter's state holds.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.image import Box
from r2art.core.prediction import Prediction
from r2art.run.refinement.body import Body
from r2art.run.refinement.pose import Posed, pose_of, posed
from r2art.run.video.measure import size_of
from r2art.run.video.state import State

FloatArray = NDArray[np.floating]

MEMORY = 100.0
"""Frames after which an early one is forgotten."""
NEAR = 0.05
"""Least depth, as a share of the object's distance, of what is projected."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Shape:
    """Part boxes at rest, in diagonals of the root's.

    Attributes:
        center: (P, 3) ...
        log_size: (P, 3) logarithms of the extents.
        weight: How many frames it is the mean of, up to `MEMORY`.
    """

    center: FloatArray
    log_size: FloatArray
    weight: float = 1.0

    @classmethod
    def of(cls, prediction: Prediction) -> "Shape":
        """As one frame sees it."""
        size = size_of(prediction)
        return cls(
            center=np.array([p.box_center for p in prediction.parts]) / size,
            log_size=np.log([p.box_size for p in prediction.parts]) - np.log(size),
        )

    def after(self, prediction: Prediction) -> "Shape":
        """With one more frame."""
        new, weight = Shape.of(prediction), min(self.weight + 1, MEMORY)
        return Shape(
            center=self.center + (new.center - self.center) / weight,
            log_size=self.log_size + (new.log_size - self.log_size) / weight,
            weight=weight,
        )

    def body(self, mean: Body, size: float) -> Body:
        """The category's ``mean`` object with this shape, the root's diagonal ``size`` m."""
        extent = np.exp(self.log_size)
        return mean.stretched(size * self.center, size * extent)


def placed(body: Body, state: State) -> Posed:
    """The object where the filter believes it to be."""
    cam_T_root = np.eye(4)
    cam_T_root[:3, :3], cam_T_root[:3, 3] = state.rotation, state.position
    return posed(body, pose_of(body, cam_T_root, state.joints))


def box_around(at: Posed, camera: Camera) -> Box | None:
    """The 2D box (px) of a placed object; None if some of it is not before the camera."""
    points = at.points[0].transpose(0, 2, 1).reshape(-1, 3)
    if points[:, 2].min() <= NEAR * float(np.abs(points[:, 2]).max()):
        return None
    uv = camera.project(points)
    (x1, y1), (x2, y2) = uv.min(axis=0).tolist(), uv.max(axis=0).tolist()
    return x1, y1, x2, y2


def shown(prediction: Prediction, body: Body, at: Posed, state: State, box: Box) -> Prediction:
    """A frame's prediction with pose, joints, shape and box replaced by the filter's."""
    poses = np.tile(np.eye(4), (len(prediction.parts), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = at.rotation[0], at.translation[0]
    return replace(
        prediction,
        box=box,
        parts=tuple(
            replace(part, cam_T_part=pose, box_center=center, box_size=size)
            for part, pose, center, size in zip(
                prediction.parts, poses, body.center, body.size, strict=True
            )
        ),
        joints=tuple(
            replace(joint, state=float(q), axis=axis, pivot=pivot)
            for joint, q, axis, pivot in zip(
                prediction.joints, state.joints, at.axis[0], at.pivot[0], strict=True
            )
        ),
    )
