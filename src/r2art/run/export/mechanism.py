"""A prediction as the joints of a mechanism: what URDF, MJCF and animations are made of.

A prediction says where everything *is*; a mechanism says how each part hangs on its parent when
its joint stands at zero. The zero pose is the present one with the joint's motion taken back, so
setting the predicted states gives back the predicted poses exactly, whatever rounding or model
they come from. Metres, radians, OpenCV camera axes.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import JointKind
from r2art.core.prediction import JointEstimate, Prediction
from r2art.run.refinement.pose import rotation_of

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True, eq=False)
class Link:
    """How part j + 1 hangs on its parent by joint j.

    Attributes:
        joint: The joint as predicted.
        parent: Index of the part it hangs on.
        child: Index of the part it moves.
        parent_T_rest: (4, 4) pose of the child in the parent's frame at state 0.
        axis: (3,) unit direction in the child's frame.
        pivot: (3,) a point of the axis in the child's frame (m).
    """

    joint: JointEstimate
    parent: int
    child: int
    parent_T_rest: FloatArray
    axis: FloatArray
    pivot: FloatArray

    def parent_T_child(self, state: float) -> FloatArray:
        """(4, 4) pose of the child in the parent's frame where the joint stands at ``state``."""
        return self.parent_T_rest @ joint_motion(self.joint.kind, self.axis, self.pivot, state)


def links(prediction: Prediction) -> tuple[Link, ...]:
    """How every part but the root hangs on its parent, in the order of the joints."""
    index = {part.name: p for p, part in enumerate(prediction.parts)}
    poses = [rigid(part.cam_T_part) for part in prediction.parts]
    return tuple(
        _link(joint, index[joint.parent], j + 1, poses) for j, joint in enumerate(prediction.joints)
    )


def _link(joint: JointEstimate, parent: int, child: int, poses: list[FloatArray]) -> Link:
    child_T_cam = inverse(poses[child])
    axis = child_T_cam[:3, :3] @ joint.axis
    axis = axis / np.linalg.norm(axis)
    pivot = child_T_cam[:3, :3] @ joint.pivot + child_T_cam[:3, 3]
    back = joint_motion(joint.kind, axis, pivot, -joint.state)
    rest = inverse(poses[parent]) @ poses[child] @ back
    return Link(joint=joint, parent=parent, child=child, parent_T_rest=rest, axis=axis, pivot=pivot)


def part_poses(prediction: Prediction, states: Mapping[str, float]) -> FloatArray:
    """(P, 4, 4) ``cam_T_part`` with some joints, by name, at other states; the root stands still.

    Joints that ``states`` leaves out stay as predicted.
    """
    poses = [rigid(prediction.parts[0].cam_T_part)]
    for link in links(prediction):
        state = states.get(link.joint.name, link.joint.state)
        poses.append(poses[link.parent] @ link.parent_T_child(state))
    return np.stack(poses)


def joint_motion(kind: JointKind, axis: FloatArray, pivot: FloatArray, state: float) -> FloatArray:
    """(4, 4) displacement of a joint: a turn about ``axis`` through ``pivot``, or a slide."""
    motion = np.eye(4)
    if kind == "prismatic":
        motion[:3, 3] = state * axis
    else:
        motion[:3, :3] = rotation_of(state * axis)
        motion[:3, 3] = pivot - motion[:3, :3] @ pivot
    return motion


def rigid(pose: FloatArray) -> FloatArray:
    """The (4, 4) pose with its rotation rounded to the nearest that is one exactly."""
    u, _, vt = np.linalg.svd(np.asarray(pose, float)[:3, :3])
    result = np.array(pose, float)
    result[:3, :3] = u @ vt
    return result


def inverse(pose: FloatArray) -> FloatArray:
    """The inverse of a rigid (4, 4) pose."""
    result = np.eye(4)
    result[:3, :3] = pose[:3, :3].T
    result[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return result


def translation(vector: FloatArray) -> FloatArray:
    """(4, 4) pose that only shifts."""
    pose = np.eye(4)
    pose[:3, 3] = vector
    return pose
