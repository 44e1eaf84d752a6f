"""A laptop that is known exactly, as a prediction."""

import numpy as np
import pytest

from r2art.core.camera import Camera
from r2art.core.prediction import JointEstimate, PartEstimate, Prediction


def turned(axis, angle):
    """(4, 4) rotation about a coordinate axis."""
    i, j = (k for k in range(3) if k != axis)
    pose = np.eye(4)
    pose[[i, j], [i, j]] = np.cos(angle)
    pose[i, j], pose[j, i] = -np.sin(angle), np.sin(angle)
    return pose


@pytest.fixture
def laptop():
    """An open laptop 0.6 m in front of a 640 × 480 camera."""
    cam_T_base = turned(0, np.pi + 0.5) @ turned(1, 0.4)
    cam_T_base[2, 3] = 0.6
    base_T_lid = turned(0, -1.9)
    pivot = np.array([0, 0.01, -0.11])
    base_T_lid[:3, 3] = pivot - base_T_lid[:3, :3] @ pivot
    part = {"box_size": np.array([0.34, 0.02, 0.22]), "confidence": 0.9}
    return Prediction(
        image_path="laptop.jpg",
        category="laptop",
        category_score=0.97,
        box=(101.5, 40.0, 520.0, 460.25),
        camera=Camera(600, 600, 320, 240, 640, 480),
        camera_source="exif",
        parts=(
            PartEstimate(name="base", cam_T_part=cam_T_base, box_center=np.zeros(3), **part),
            PartEstimate(
                name="lid",
                cam_T_part=cam_T_base @ base_T_lid,
                box_center=np.array([0, 0.02, 0]),
                **part,
            ),
        ),
        joints=(
            JointEstimate(
                name="hinge",
                kind="revolute",
                parent="base",
                child="lid",
                state=1.9,
                limits=(0.0, 2.3),
                axis=-cam_T_base[:3, 0],
                pivot=cam_T_base[:3, :3] @ pivot + cam_T_base[:3, 3],
                confidence=0.625,
            ),
        ),
        warnings=("a [ 1 ] warning: ünïcode\nand a new line",),
    )
