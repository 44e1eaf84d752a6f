"""How wrong one prediction is: every measure of one image, and many images stacked."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Category
from r2art.core.prediction import JointEstimate, PartEstimate, Prediction
from r2art.data.sample import Sample
from r2art.learn.evaluation import metrics, overlap
from r2art.learn.evaluation.equivalent import nearer_labels

FloatArray = NDArray[np.floating]

CORRECT = 0.1
"""A part counts as right, for its confidence, within this share of its diameter (aligned) ..."""
STATE_CORRECT = 0.1
"""... and a joint's state within this share of the range of its limits (aligned)."""


@dataclass(frozen=True, kw_only=True)
class Scores:
    """Errors of predictions against the truth; with a leading dimension N, of N images.

    Metres and radians. An image without a usable prediction has errors inf and overlaps 0.
    What ends in ``_aligned`` is measured after the whole predicted scene was scaled about the
    camera by the image's ``scale``; angles and states of hinges do not feel it.

    Attributes:
        add: (*N, P) mean distance of model points.
        add_s: (*N, P) the same to the nearest point.
        rotation: (*N, P) geodesic angle.
        translation: (*N, P) displacement of the centre of the part's box.
        overlap: (*N, P) intersection over union of the part boxes in space.
        confidence: (*N, P) what the model said.
        state: (*N, J) error of the joint state (rad or m).
        state_confidence: (*N, J) what the model said of it; nan where it says nothing.
        axis: (*N, J) angle between the joint axes.
        pivot: (*N, J) distance of the pivot from the true axis; nan for prismatic joints.
        add_aligned: (*N, P) ...
        add_s_aligned: (*N, P) ...
        translation_aligned: (*N, P) ...
        overlap_aligned: (*N, P) ...
        state_aligned: (*N, J) ...
        pivot_aligned: (*N, J) ...
        depth: (*N,) relative error of the root's depth.
        scale: (*N,) the factor of the alignment, see `metrics.alignment_scale`.
        box: (*N,) intersection over union of the 2D boxes.
        category: (*N,) 1 where the category was recognised, else 0.
        relabelled: (*N,) 1 where the other labelling of a symmetric object was nearer, else 0.
        seconds: (*N,) that the prediction took.
        diameter: (*N, P) of the model points: no error, but what errors are compared with, as
            are all that follow.
        diagonal: (*N,) of the box around the true instance at rest.
        azimuth: (*N,) where the camera stood: 0 before the object, positive on its right.
        elevation: (*N,) the same: 0 level with the object's origin, π/2 straight above.
        visible: (*N, P) share of the part that nothing else hides.
        box_side: (*N,) longer side of the true 2D box (px).
        inside: (*N,) share of the true 2D box that is within the image.
        true_state: (*N, J) the true joint states.
        state_range: (*N, J) how far the limits of the category's joints are apart (rad or m).
    """

    add: FloatArray
    add_s: FloatArray
    rotation: FloatArray
    translation: FloatArray
    overlap: FloatArray
    confidence: FloatArray
    state: FloatArray
    state_confidence: FloatArray
    axis: FloatArray
    pivot: FloatArray
    add_aligned: FloatArray
    add_s_aligned: FloatArray
    translation_aligned: FloatArray
    overlap_aligned: FloatArray
    state_aligned: FloatArray
    pivot_aligned: FloatArray
    depth: FloatArray
    scale: FloatArray
    box: FloatArray
    category: FloatArray
    relabelled: FloatArray
    seconds: FloatArray
    diameter: FloatArray
    diagonal: FloatArray
    azimuth: FloatArray
    elevation: FloatArray
    visible: FloatArray
    box_side: FloatArray
    inside: FloatArray
    true_state: FloatArray
    state_range: FloatArray

    @property
    def failed(self) -> NDArray[np.bool_]:
        """(*N,) where there is no usable prediction."""
        return ~np.isfinite(self.depth)

    @property
    def right(self) -> NDArray[np.bool_]:
        """(*N, P) which parts are right, see `CORRECT`."""
        return self.add_aligned <= CORRECT * self.diameter

    @property
    def all_right(self) -> NDArray[np.bool_]:
        """(*N,) of which photos all parts are."""
        return np.asarray(self.right.all(axis=-1))

    @property
    def state_right(self) -> NDArray[np.bool_]:
        """(*N, J) which joints' states are right, see `STATE_CORRECT`."""
        return self.state_aligned <= STATE_CORRECT * self.state_range


PER_JOINT = ("state", "axis", "pivot", "state_aligned", "pivot_aligned")
OF_JOINTS = (*PER_JOINT, "state_confidence", "true_state", "state_range")
"""Every field of `Scores` that has a value for each joint; of these, the first are errors."""
PER_PART = (
    *("add", "add_s", "rotation", "translation"),
    *("add_aligned", "add_s_aligned", "translation_aligned"),
)
OVERLAPS = ("overlap", "overlap_aligned")


def stack(scores: Sequence[Scores]) -> Scores:
    """Scores of single images as those of all."""
    return Scores(
        **{f.name: np.stack([getattr(s, f.name) for s in scores]) for f in fields(Scores)}
    )


def truth(sample: Sample, category: Category) -> Prediction:
    """The prediction that makes no error: a sample's labels."""
    parent = [joint.parent for joint in category.joints]
    cam_T_parent = sample.cam_T_part[parent]
    axis = (cam_T_parent[:, :3, :3] @ sample.axis[..., None])[..., 0]
    pivot = metrics.moved(cam_T_parent, sample.pivot[:, None])[:, 0]
    parts = tuple(
        PartEstimate(
            name=name,
            cam_T_part=sample.cam_T_part[p],
            box_center=sample.box_center[p],
            box_size=sample.box_size[p],
            confidence=1.0,
        )
        for p, name in enumerate(category.part_names)
    )
    joints = tuple(
        JointEstimate(
            name=joint.name,
            kind=joint.kind,
            parent=category.part_names[joint.parent],
            child=category.part_names[j + 1],
            state=float(sample.joint_state[j]),
            limits=joint.limits,
            axis=axis[j],
            pivot=pivot[j],
            confidence=1.0,
        )
        for j, joint in enumerate(category.joints)
    )
    x1, y1, x2, y2 = sample.box.tolist()
    return Prediction(
        image_path=None,
        category=category.name,
        category_score=None,
        box=(x1, y1, x2, y2),
        camera=sample.camera,
        camera_source="given",
        parts=parts,
        joints=joints,
    )


@dataclass(frozen=True)
class _Scene:
    """Parts and joints of one object as arrays, in the camera frame; see `Prediction`."""

    pose: FloatArray
    center: FloatArray
    size: FloatArray
    state: FloatArray
    axis: FloatArray
    pivot: FloatArray
    prismatic: NDArray[np.bool_]

    @classmethod
    def of(cls, prediction: Prediction) -> "_Scene":
        """What was predicted."""
        parts, joints = prediction.parts, prediction.joints
        return cls(
            pose=np.stack([p.cam_T_part for p in parts]),
            center=np.stack([p.box_center for p in parts]),
            size=np.stack([p.box_size for p in parts]),
            state=np.array([j.state for j in joints], float),
            axis=np.reshape([j.axis for j in joints], (-1, 3)),
            pivot=np.reshape([j.pivot for j in joints], (-1, 3)),
            prismatic=np.array([j.kind == "prismatic" for j in joints], bool),
        )

    @property
    def boxes(self) -> FloatArray:
        """(P, 4, 4) poses of frames at the centres of the part boxes, along their edges."""
        out = self.pose.copy()
        out[:, :3, 3] = metrics.moved(self.pose, self.center[:, None])[:, 0]
        return out


def score(
    sample: Sample,
    category: Category,
    prediction: Prediction | None,
    seconds: float = float("nan"),
) -> Scores:
    """Compare a prediction with a sample's labels, or their equivalent that it is nearer to.

    Args:
        sample: The truth.
        category: Its prior, whose points are the model points (see `metrics.model_points`).
        prediction: What was predicted; None, or an object of another category, is a failure.
        seconds: How long that took.
    """
    box = np.asarray(
        overlap.image_box_iou(np.asarray(prediction.box), sample.box) if prediction else 0.0
    )
    known = {"box": box, "seconds": np.asarray(seconds)}
    if prediction is None or prediction.category != category.name:
        known |= _facts(sample, category, _model_points(sample, category))
        return _failure(len(category.part_names), len(category.joints), known)
    labels = nearer_labels(sample, category, prediction)
    points = _model_points(labels, category)
    known |= _facts(labels, category, points)
    true, said = _Scene.of(truth(labels, category)), _Scene.of(prediction)
    scale = metrics.alignment_scale(points, said.pose, true.pose)
    aligned = _Scene.of(prediction.scaled(scale, "prior"))
    plain_errors, aligned_errors = (_lengths(points, s, true) for s in (said, aligned))
    iou = overlap.box_iou(
        *(np.stack([getattr(s, name) for s in (said, aligned)]) for name in ("boxes", "size")),
        *(np.stack([getattr(true, name)] * 2) for name in ("boxes", "size")),
    )
    return Scores(
        **plain_errors,
        **{f"{name}_aligned": error for name, error in aligned_errors.items()},
        rotation=metrics.rotation_error(said.pose[:, :3, :3], true.pose[:, :3, :3]),
        overlap=iou[0],
        overlap_aligned=iou[1],
        axis=metrics.axis_error(said.axis, true.axis),
        confidence=np.array([p.confidence for p in prediction.parts]),
        state_confidence=np.array(
            [np.nan if j.confidence is None else j.confidence for j in prediction.joints], float
        ),
        depth=np.asarray(abs(said.pose[0, 2, 3] / true.pose[0, 2, 3] - 1)),
        scale=np.asarray(scale),
        category=np.asarray(1.0),
        relabelled=np.asarray(float(labels is not sample)),
        **known,
    )


def _model_points(sample: Sample, category: Category) -> FloatArray:
    return metrics.model_points(category, sample.box_center, sample.box_size)


def _lengths(points: FloatArray, said: _Scene, true: _Scene) -> dict[str, FloatArray]:
    """The errors that the scale of the scene has a part in; overlaps are computed together."""
    off_axis = metrics.pivot_error(said.pivot, true.pivot, true.axis)
    return {
        "add": metrics.add(points, said.pose, true.pose),
        "add_s": metrics.add_s(points, said.pose, true.pose),
        "translation": metrics.translation_error(true.center, said.pose, true.pose),
        "state": np.abs(said.state - true.state),
        "pivot": np.where(true.prismatic, np.nan, off_axis),
    }


def _facts(sample: Sample, category: Category, points: FloatArray) -> dict[str, FloatArray]:
    """What errors are compared with, or may depend on."""
    lower = (sample.box_center - sample.box_size / 2).min(axis=0)
    upper = (sample.box_center + sample.box_size / 2).max(axis=0)
    x, y, z = -sample.cam_T_part[0, :3, :3].T @ sample.cam_T_part[0, :3, 3]
    extent = sample.box[2:] - sample.box[:2]
    end = (sample.camera.width, sample.camera.height)
    within = np.minimum(sample.box[2:], end) - np.maximum(sample.box[:2], 0)
    return {
        "diameter": metrics.diameter(points),
        "diagonal": np.asarray(np.linalg.norm(upper - lower)),
        "azimuth": np.asarray(np.arctan2(x, z)),
        "elevation": np.asarray(np.arctan2(y, np.hypot(x, z))),
        "visible": sample.visible,
        "box_side": np.asarray(extent.max()),
        "inside": np.asarray(np.maximum(within, 0).prod() / extent.prod()),
        "true_state": sample.joint_state,
        "state_range": np.array([high - low for low, high in (j.limits for j in category.joints)]),
    }


def _failure(parts: int, joints: int, known: dict[str, FloatArray]) -> Scores:
    errors: dict[str, Any] = dict.fromkeys(PER_PART, np.full(parts, np.inf))
    errors |= dict.fromkeys(PER_JOINT, np.full(joints, np.inf))
    errors |= dict.fromkeys((*OVERLAPS, "confidence"), np.zeros(parts))
    errors["state_confidence"] = np.zeros(joints)
    return Scores(
        **errors,
        depth=np.asarray(np.inf),
        scale=np.asarray(np.nan),
        category=np.asarray(0.0),
        relabelled=np.asarray(0.0),
        **known,
    )
