"""ReArt's folder, written from scenes: the inverse of its specification, apart from r2art's."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from adapter_scenes import Truth, intrinsics, polygons
from PIL import Image


@dataclass(frozen=True, kw_only=True)
class Model:
    """How an object is stored.

    Attributes:
        urdf_id: Its number.
        theirs_R_ours: (3, 3) our axes in their frame; right angles only, for boxes must stay so.
        shift: (3,) our origin there.
        against: Whether stored axes point the other way.
    """

    urdf_id: int
    theirs_R_ours: np.ndarray
    shift: np.ndarray
    against: bool = False

    def theirs_T_ours(self) -> np.ndarray:
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = self.theirs_R_ours, self.shift
        return T


def entry(model: Model, truth: Truth, *, nested: bool = True, named: bool = False) -> dict:
    """An object in urdf_metas.json."""
    center, size = truth.instance.part_boxes()
    T = model.theirs_T_ours()
    ends = np.stack([center - size / 2, center + size / 2], axis=1) @ T[:3, :3].T + T[:3, 3]
    boxes = [[ends.min(axis=(0, 1)), ends.max(axis=(0, 1))]]
    boxes += [[e.min(axis=0), e.max(axis=0)] for e in ends]
    corners = np.array(boxes)
    joints = truth.instance.joints
    axis = [T[:3, :3] @ j.axis * (-2.0 if model.against else 2.0) for j in joints]
    point = [T[:3, :3] @ j.pivot + T[:3, 3] + 0.05 * a for j, a in zip(joints, axis, strict=True)]
    children = range(2, len(joints) + 2)
    return {
        "id": model.urdf_id,
        "object_name": "thing",
        "norm_factors": (1 / np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)).tolist(),
        "corner_pts": (corners[:, :, None] if nested else corners).tolist(),
        "joint_types": [j.kind for j in joints],
        "joint_parents": ["base_link" if named else j.parent + 1 for j in joints],
        "joint_children": [f"link{k - 1}" if named else k for k in children],
        "joint_xyz": [_to_urdf(p) for p in point],
        "joint_rpy": [_to_urdf(a) for a in axis],
    }


def _to_urdf(vector: np.ndarray) -> list[float]:
    """Their frame's (Y, Z, X) as a URDF's X Y Z."""
    return [float(vector[2]), float(vector[0]), float(vector[1])]


def write_metas(root: Path, entries: list[dict]) -> None:
    root.mkdir(parents=True, exist_ok=True)
    (root / "urdf_metas.json").write_text(json.dumps({"urdf_metas": [[], *entries]}))


def instance(
    model: Model, truth: Truth, category_id: int, first_label: int = 1, number: int = 0
) -> dict:
    """An instance of an annotation."""
    links = [
        {
            "link_category_id": first_label + part,
            "segmentation": polygons(truth.mask == part + 1),
            "transformation": (T @ np.linalg.inv(model.theirs_T_ours())).tolist(),
        }
        for part, T in enumerate(truth.cam_T_part)
    ]
    return {
        "id": number,
        "urdf_id": model.urdf_id,
        "category_id": category_id,
        "bbox": truth.box,
        "links": links[::-1],
    }


def write_frame(
    home: Path, frame: str, truth: Truth, instances: list[dict], *, paths: bool = True
) -> None:
    """Write SCENE/FRAME: an annotation, colour and depth."""
    annotation = {
        "width": truth.camera.width,
        "height": truth.camera.height,
        "instances": instances,
    }
    if paths:
        annotation |= {"color_path": f"{frame}.jpg", "depth_path": f"{frame}.png"}
    for kind in ("annotations", "color", "depth"):
        (home / kind / frame).parent.mkdir(parents=True, exist_ok=True)
    (home / "annotations" / f"{frame}.json").write_text(json.dumps(annotation))
    Image.fromarray(truth.image).save(home / "color" / f"{frame}.jpg", quality=95)
    millimetres = np.round(truth.depth * 1000).astype(np.uint16)
    Image.fromarray(millimetres).save(home / "depth" / f"{frame}.png")


def write_camera(folder: Path, truth: Truth) -> None:
    """Their first pixel's centre is at 0, ours at a half."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "camera_intrinsic.json").write_text(json.dumps(intrinsics(truth.camera, 0.5)))
