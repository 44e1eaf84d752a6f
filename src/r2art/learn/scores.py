"""How wrong one prediction is: every measure of one image, and many images stacked."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Category
from r2art.core.prediction import JointEstimate, PartEstimate, Prediction
from r2art.data.sample import Sample
from r2art.learn import metrics, overlap

FloatArray = NDArray[np.floating]

CORRECT = 0.1
"""A part counts as right, for its confidence, within this share of its diameter (aligned)."""


@dataclass(frozen=True, kw_only=True)
class Scores:
    """Errors of predictions against the truth; with a leading dimension N, of N images.

    Metres and radians. An image without a usable prediction has errors inf and overlaps 0.

    Attributes:
        add: (*N, P) mean distance of model points.
        add_s: (*N, P) the same to the nearest point.
        aligned: (*N, P) ``add`` after one factor on all translations of the image.
        rotation: (*N, P) geodesic angle.
        translation: (*N, P) displacement of the centre of the part's box.
        overlap: (*N, P) intersection over union of the part boxes in space.
        confidence: (*N, P) what the model said.
        state: (*N, J) error of the joint state (rad or m).
        axis: (*N, J) angle between the joint axes.
        pivot: (*N, J) distance of the pivot from the true axis; nan for prismatic joints.
        depth: (*N,) relative error of the root's depth.
        scale: (*N,) the factor behind ``aligned``.
        box: (*N,) intersection over union of the 2D boxes.
        category: (*N,) 1 where the category was recognised, else 0.
        diameter: (*N, P) of the model points: not an error, but what errors are compared with.
        diagonal: (*N,) of the box around the true instance at rest.
        azimuth: (*N,) where the camera stood: 0 before the object, positive on its right.
        true_state: (*N, J) the true joint states.
    """

    add: FloatArray
    add_s: FloatArray
    aligned: FloatArray
    rotation: FloatArray
    translation: FloatArray
    overlap: FloatArray
    confidence: FloatArray
    state: FloatArray
    axis: FloatArray
    pivot: FloatArray
    depth: FloatArray
    scale: FloatArray
    box: FloatArray
    category: FloatArray
    diameter: FloatArray
    diagonal: FloatArray
    azimuth: FloatArray
    true_state: FloatArray

    @property
    def failed(self) -> NDArray[np.bool_]:
        """(*N,) where there is no usable prediction."""
        return ~np.isfinite(self.depth)


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


def score(sample: Sample, category: Category, prediction: Prediction | None) -> Scores:
    """Compare a prediction with a sample's labels.

    Args:
        sample: The truth.
        category: Its prior, whose points are the model points (see `metrics.model_points`).
        prediction: What was predicted; None, or an object of another category, is a failure.
    """
    points = metrics.model_points(category, sample.box_center, sample.box_size)
    true_pose = sample.cam_T_part
    facts = {
        "diameter": metrics.diameter(points),
        "diagonal": np.asarray(_diagonal(sample)),
        "azimuth": np.asarray(_azimuth(sample)),
        "true_state": sample.joint_state,
        "box": np.asarray(
            overlap.image_box_iou(np.asarray(prediction.box), sample.box) if prediction else 0.0
        ),
    }
    if prediction is None or prediction.category != category.name:
        return _failure(len(category.part_names), facts)
    pose = np.stack([p.cam_T_part for p in prediction.parts])
    scale = metrics.alignment_scale(points, pose, true_pose)
    depth = true_pose[0, 2, 3]
    return Scores(
        add=metrics.add(points, pose, true_pose),
        add_s=metrics.add_s(points, pose, true_pose),
        aligned=metrics.add(points, metrics.rescaled(pose, scale), true_pose),
        rotation=metrics.rotation_error(pose[:, :3, :3], true_pose[:, :3, :3]),
        translation=metrics.translation_error(sample.box_center, pose, true_pose),
        overlap=_box_overlap(sample, prediction.parts),
        confidence=np.array([p.confidence for p in prediction.parts]),
        **_joint_errors(prediction.joints, truth(sample, category).joints),
        depth=np.asarray(abs(pose[0, 2, 3] - depth) / depth),
        scale=np.asarray(scale),
        category=np.asarray(1.0),
        **facts,
    )


def _joint_errors(
    joints: Sequence[JointEstimate], true_joints: Sequence[JointEstimate]
) -> dict[str, FloatArray]:
    axis, true_axis = (np.reshape([j.axis for j in js], (-1, 3)) for js in (joints, true_joints))
    pivot, true_pivot = (np.reshape([j.pivot for j in js], (-1, 3)) for js in (joints, true_joints))
    revolute = np.array([j.kind == "revolute" for j in true_joints], bool)
    off_axis = metrics.pivot_error(pivot, true_pivot, true_axis)
    return {
        "state": np.abs([j.state - t.state for j, t in zip(joints, true_joints, strict=True)]),
        "axis": metrics.axis_error(axis, true_axis),
        "pivot": np.where(revolute, off_axis, np.nan),
    }


def _box_overlap(sample: Sample, parts: Sequence[PartEstimate]) -> FloatArray:
    labels = zip(parts, sample.cam_T_part, sample.box_center, sample.box_size, strict=True)
    return np.array(
        [
            overlap.box_iou(
                _at(part.cam_T_part, part.box_center), part.box_size, _at(pose, center), size
            )
            for part, pose, center, size in labels
        ]
    )


def _at(cam_T_part: FloatArray, center: FloatArray) -> FloatArray:
    """(4, 4) pose of the frame at ``center`` with the part's axes."""
    out = cam_T_part.copy()
    out[:3, 3] += cam_T_part[:3, :3] @ center
    return out


def _diagonal(sample: Sample) -> float:
    lower = (sample.box_center - sample.box_size / 2).min(axis=0)
    upper = (sample.box_center + sample.box_size / 2).max(axis=0)
    return float(np.linalg.norm(upper - lower))


def _azimuth(sample: Sample) -> float:
    x, _, z = -sample.cam_T_part[0, :3, :3].T @ sample.cam_T_part[0, :3, 3]
    return float(np.arctan2(x, z))


def _failure(num_parts: int, facts: dict[str, FloatArray]) -> Scores:
    part, joint = np.full(num_parts, np.inf), np.full(num_parts - 1, np.inf)
    return Scores(
        add=part,
        add_s=part,
        aligned=part,
        rotation=part,
        translation=part,
        overlap=np.zeros(num_parts),
        confidence=np.zeros(num_parts),
        state=joint,
        axis=joint,
        pivot=joint,
        depth=np.asarray(np.inf),
        scale=np.asarray(np.nan),
        category=np.asarray(0.0),
        **facts,
    )
