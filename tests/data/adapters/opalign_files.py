"""OP-Align's files, written from scenes: the inverse of its description, apart from r2art's."""

from pathlib import Path

import numpy as np
from adapter_scenes import Truth


def arrays(
    truth: Truth,
    *,
    axes: tuple[float, float, float] = (1.0, 1.0, 1.0),
    ours_R_theirs: np.ndarray | None = None,
    scale: float = 1.0,
    direction_first: bool = False,
    bytes_of_color: bool = False,
) -> dict[str, np.ndarray]:
    """The arrays of a file.

    Args:
        truth: The scene; its parts' boxes are annotated where they are.
        axes: Signs of OpenCV's x, y, z in the file's camera frame.
        ours_R_theirs: (3, 3) their box axes in ours.
        scale: The file's units in a metre.
        direction_first: Whether joints have the direction before the point.
        bytes_of_color: Whether colour is 0 to 255.
    """
    camera, flip = truth.camera, np.array(axes)
    v, u = np.indices(truth.mask.shape)
    rays = np.stack(
        [(u + 0.5 - camera.cx) / camera.fx, (v + 0.5 - camera.cy) / camera.fy, np.ones(u.shape)],
        axis=-1,
    )
    pc = scale * flip * rays * truth.depth[..., None]
    center, size = truth.instance.part_boxes()
    turn = np.eye(3) if ours_R_theirs is None else ours_R_theirs
    parts = []
    for T, c, s in zip(truth.cam_T_part, center, size, strict=True):
        # A mirrored camera frame mirrors the box too; its own x then points the other way.
        R = flip[:, None] * T[:3, :3] @ turn * (np.prod(flip), 1, 1)
        t = scale * flip * (T[:3, :3] @ c + T[:3, 3])
        parts.append(np.concatenate([R.ravel(), t, scale * np.abs(turn.T) @ s]))
    joints = []
    root = truth.cam_T_part[0]
    for joint in truth.instance.joints:
        point = scale * flip * (root[:3, :3] @ joint.pivot + root[:3, 3])
        direction = flip * (root[:3, :3] @ joint.axis)
        joints.append(np.concatenate([direction, point] if direction_first else [point, direction]))
    color = truth.image.reshape(-1, 3)
    return {
        "pc": pc.reshape(-1, 3),
        "color": color if bytes_of_color else color / 255,
        "detection": (truth.mask > 0).ravel(),
        "segmentation": truth.mask.ravel(),
        "part": np.stack(parts),
        "joint": np.stack(joints),
    }


def write(path: Path, content: dict[str, np.ndarray], *, pickled: bool = True) -> None:
    """Write a file: a pickled dictionary, as published, or plain arrays."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if pickled:
        np.savez(path, np.array(content, dtype=object))
    else:
        np.savez(path, **content)
