"""Rotation matrices in the words of other programs: quaternions, and roll, pitch and yaw."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.floating]

GIMBAL_LOCK = 1e-9
"""Cosine of the pitch below which roll and yaw cannot be told apart."""


def quaternion(R: FloatArray) -> FloatArray:
    """(4,) unit quaternion w x y z of a (3, 3) rotation, w not negative."""
    # 4 q qᵀ from R (Shepperd 1978): its column with the largest diagonal element loses nothing.
    (a, b, c), (d, e, f), (g, h, i) = R
    outer = np.array(
        [
            [1 + a + e + i, h - f, c - g, d - b],
            [h - f, 1 + a - e - i, b + d, c + g],
            [c - g, b + d, 1 - a + e - i, f + h],
            [d - b, c + g, f + h, 1 - a - e + i],
        ]
    )
    q = outer[:, np.argmax(np.diag(outer))]
    q = q / np.linalg.norm(q)
    return -q if q[0] < 0 else q


def roll_pitch_yaw(R: FloatArray) -> FloatArray:
    """(3,) angles (rad) of URDF: ``R = Rz(yaw) @ Ry(pitch) @ Rx(roll)``."""
    cos_pitch = np.hypot(R[0, 0], R[1, 0])
    pitch = np.arctan2(-R[2, 0], cos_pitch)
    if cos_pitch < GIMBAL_LOCK:
        return np.array([np.arctan2(-R[1, 2], R[1, 1]), pitch, 0.0])
    return np.array([np.arctan2(R[2, 1], R[2, 2]), pitch, np.arctan2(R[1, 0], R[0, 0])])
