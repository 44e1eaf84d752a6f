"""Objects that look the same under another labelling of their parts: which label to compare with.

NumPy only, and written apart from `r2art.learn.equivalent` on purpose: what measures a network
must not inherit a mistake of what taught it. A test holds the two together.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Category
from r2art.core.prediction import Prediction
from r2art.data.sample import Sample
from r2art.learn.evaluation import metrics

FloatArray = NDArray[np.floating]


def nearer_labels(sample: Sample, category: Category, prediction: Prediction) -> Sample:
    """The sample under that of its equivalent labellings which has the smaller ADD.

    Scales are aligned before, for one photo does not tell them, and ADD is the mean over all
    parts. The sample itself is returned where that is its own labelling, as it always is for a
    category without a symmetry.

    Args:
        sample: The truth.
        category: Its prior.
        prediction: Of an object of this category.
    """
    if category.symmetry is None:
        return sample
    pose = np.stack([part.cam_T_part for part in prediction.parts])
    return min((sample, relabelled(sample, category)), key=lambda s: _add(s, category, pose))


def _add(sample: Sample, category: Category, pose: FloatArray) -> float:
    points = metrics.model_points(category, sample.box_center, sample.box_size)
    scale = metrics.alignment_scale(points, pose, sample.cam_T_part)
    errors = metrics.add(points, metrics.rescaled(pose, scale), sample.cam_T_part)
    return float(errors.mean())


def relabelled(sample: Sample, category: Category) -> Sample:
    """The sample with the other labelling of its parts, see `r2art.core.category.Symmetry`.

    Raises:
        ValueError: The category has none.
    """
    symmetry = category.symmetry
    if symmetry is None:
        raise ValueError(f"{category.name} has one labelling only")
    swap = list(symmetry.swap)
    parents = [joint.parent for joint in category.joints]
    joints = list(symmetry.joint_swap(parents))
    old_T_new = np.diag([*symmetry.signs, 1.0])
    old_T_new[:3, 3] = sample.box_center[swap[0]]
    new_T_old = np.linalg.inv(old_T_new)
    sense = [1 if swap[p] == parents[j] else -1 for p, j in zip(parents, joints, strict=True)]
    axis = sample.axis[joints] @ new_T_old[:3, :3].T
    amodal = sample.amodal
    return replace(
        sample,
        mask=_masks(swap)[sample.mask],
        cam_T_part=sample.cam_T_part[swap] @ old_T_new,
        joint_state=sample.joint_state[joints],
        box_center=metrics.moved(new_T_old, sample.box_center[swap]),
        box_size=sample.box_size[swap],
        axis=np.reshape(sense, (-1, 1)) * axis,
        pivot=metrics.moved(new_T_old, sample.pivot[joints]),
        visible=sample.visible[swap],
        amodal=None if amodal is None else _amodal(amodal, swap),
    )


def _masks(swap: list[int]) -> NDArray[np.uint8]:
    """(256,) the new mask value of each old one."""
    values = np.arange(256, dtype=np.uint8)
    values[1 + np.array(swap)] = 1 + np.arange(len(swap))
    return values


def _amodal(bits: NDArray[np.uint16], swap: list[int]) -> NDArray[np.uint16]:
    alone = [(bits >> old & 1) << new for new, old in enumerate(swap)]
    return np.bitwise_or.reduce(alone).astype(np.uint16)
