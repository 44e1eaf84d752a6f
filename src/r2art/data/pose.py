"""Labels: where the parts of an instance are when its joints are moved.

NumPy only, and written apart from `r2art.method.kinematics` on purpose: the data's labels must
not inherit a mistake of the method they teach. A test holds the two together.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Joint
from r2art.data.shape import Instance, Surface

FloatArray = NDArray[np.floating]


def joint_matrix(joint: Joint, state: float) -> FloatArray:
    """(4, 4) motion of a joint's child, in the frame of its parent."""
    axis, pivot = np.asarray(joint.axis), np.asarray(joint.pivot)
    motion = np.eye(4)
    if joint.kind == "prismatic":
        motion[:3, 3] = state * axis
        return motion
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    motion[:3, :3] += np.sin(state) * cross + (1 - np.cos(state)) * cross @ cross
    motion[:3, 3] = pivot - motion[:3, :3] @ pivot
    return motion


def root_T_part(joints: tuple[Joint, ...], joint_state: FloatArray) -> FloatArray:
    """(P, 4, 4) part poses of a kinematic tree at the given joint states (rad, m)."""
    poses = [np.eye(4)]
    for joint, state in zip(joints, joint_state, strict=True):
        poses.append(poses[joint.parent] @ joint_matrix(joint, float(state)))
    return np.stack(poses)


def transformed(surface: Surface, b_T_a: FloatArray) -> Surface:
    """The surface, rigidly moved."""
    R = b_T_a[:3, :3]
    return replace(
        surface,
        vertices=surface.vertices @ R.T + b_T_a[:3, 3],
        normals=surface.normals @ R.T,
    )


def posed_vertices(instance: Instance, a_T_part: FloatArray) -> FloatArray:
    """(V, 3) all vertices of an instance, each part under its own pose."""
    moved = [
        s.vertices @ T[:3, :3].T + T[:3, 3]
        for part, T in zip(instance.parts, a_T_part, strict=True)
        for s in part
    ]
    return np.concatenate(moved)
