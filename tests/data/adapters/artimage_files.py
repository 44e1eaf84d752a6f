"""ArtImage's folder, written from scenes: the inverse of its specification, apart from r2art's."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from adapter_scenes import Truth, intrinsics, points_of, screw
from PIL import Image
from scipy.spatial.transform import Rotation


@dataclass(frozen=True, kw_only=True)
class Model:
    """How an object is stored: frames and numbers that are free to choose.

    Attributes:
        urdf_id: Its number.
        raw_R_ours: (3, 3) our axes in the dataset's object frame.
        shift: (3,) our origin there.
        rest: By joint, the annotated state (degrees, lengths) at our state 0.
        against: Whether the stored axes point the other way, so that states shrink on opening.
        base: New minus old xyz and rpy of joint 0, of scissors.
    """

    urdf_id: int
    raw_R_ours: np.ndarray
    shift: np.ndarray
    rest: tuple[float, ...]
    against: bool = False
    base: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None

    def rest_T_ours(self) -> np.ndarray:
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = self.raw_R_ours, self.shift
        return T

    def realigned(self) -> np.ndarray:
        """(4, 4) what the two URDFs' joints 0 differ by, as the loader composes it."""
        T = np.eye(4)
        if self.base is not None:
            (x, y, z), (r, p, w) = self.base
            T[:3, :3] = Rotation.from_euler("ZXY", [-r, w, -p]).as_matrix()
            T[:3, 3] = (-x, z, -y)
        return T

    def unity_joint(self, truth: Truth, j: int) -> tuple[np.ndarray, np.ndarray]:
        """Axis and a point on it in the raw frame; angles turn about the axis left-handed."""
        joint = truth.instance.joints[j]
        raw_T_ours = np.linalg.inv(self.realigned()) @ self.rest_T_ours()
        axis = raw_T_ours[:3, :3] @ joint.axis
        point = raw_T_ours[:3, :3] @ joint.pivot + raw_T_ours[:3, 3] + 0.07 * axis
        left_handed = joint.kind == "revolute"
        return axis * (-1 if left_handed != self.against else 1), point

    def annotated(self, truth: Truth, j: int) -> float:
        """The state of joint j as annotations have it: degrees or lengths."""
        state = float(truth.joint_state[j]) * (-1 if self.against else 1)
        turns = truth.instance.joints[j].kind == "revolute"
        return self.rest[j] + (np.degrees(state) if turns else state)

    def rest_T_raw(self, truth: Truth, part: int) -> np.ndarray:
        """(4, 4) D_k of the specification, with what aligns scissors before it."""
        if part == 0:
            return self.realigned()
        kind = truth.instance.joints[part - 1].kind
        axis, point = self.unity_joint(truth, part - 1)
        rest = self.rest[part - 1]
        turn = -np.radians(rest) if kind == "revolute" else rest
        return self.realigned() @ screw(kind, axis, point, turn)

    def cam_T_raw(self, truth: Truth, part: int) -> np.ndarray:
        rest_T_raw = self.rest_T_raw(truth, part)
        return truth.cam_T_part[part] @ np.linalg.inv(self.rest_T_ours()) @ rest_T_raw


def write(
    root: Path,
    category: str,
    photos: list[tuple[Model, Truth]],
    *,
    test: tuple[int, ...] = (),
    nested: bool = False,
    three_channels: bool = False,
) -> Path:
    """Write photos, those with a number in ``test`` into the test list; the category's folder."""
    home = root / category
    (home / "urdf").mkdir(parents=True)
    (root / "camera_intrinsic.json").write_text(json.dumps(intrinsics(photos[0][1].camera, 0.0)))
    rest_states = {}
    for model, truth in photos:
        rest_states[str(model.urdf_id)] = write_model(home / "urdf", model, truth)
    (home / "urdf" / "rest_state.json").write_text(json.dumps(rest_states))
    names: dict[str, list[str]] = {"train": [], "test": []}
    for number, (model, truth) in enumerate(photos):
        folder = home / "train" / f"{number:05d}" if nested else home / "train"
        name = f"{number:06d}"
        write_photo(folder, name, model, truth, three_channels)
        names["test" if number in test else "train"].append(f"{name}.json")
    for split, listed in names.items():
        (home / f"{split}.txt").write_text("\n".join(listed) + "\n")
    return home


def write_model(urdf: Path, model: Model, truth: Truth) -> dict:
    """Write an object; its entry in rest_state.json."""
    home = urdf / str(model.urdf_id)
    (home / "part_point_sample").mkdir(parents=True, exist_ok=True)
    joints = ['<joint name="joint_0" type="fixed">{}<parent link="base"/><child link="0"/></joint>']
    for j, joint in enumerate(truth.instance.joints):
        axis, point = model.unity_joint(truth, j)
        joints.append(
            f'<joint name="joint_{j + 1}" type="{joint.kind}">'
            f'<origin xyz="{_to_urdf(point)}"/><axis xyz="{_to_urdf(3 * axis)}"/>'
            f'<parent link="0"/><child link="{j + 1}"/><limit lower="-9" upper="9"/></joint>'
        )
    text = f'<?xml version="1.0"?>\n<robot name="x"><link name="base"/>{"".join(joints)}</robot>'
    old_xyz, old_rpy = np.array([0.3, -0.2, 0.1]), np.array([1.4, 0.2, -0.7])
    new_xyz, new_rpy = (
        (old_xyz, old_rpy) if model.base is None else np.array([old_xyz, old_rpy]) + model.base
    )
    for name, xyz, rpy in (
        ("mobility_for_unity.urdf", old_xyz, old_rpy),
        ("mobility_for_unity_align.urdf", new_xyz, new_rpy),
    ):
        origin = f'<origin xyz="{_numbers(xyz)}" rpy="{_numbers(rpy)}"/>'
        (home / name).write_text(text.replace("{}", origin))
    for part in range(len(truth.instance.parts)):
        raw_T_ours = np.linalg.inv(model.rest_T_raw(truth, part)) @ model.rest_T_ours()
        points = points_of(truth.instance, part) @ raw_T_ours[:3, :3].T + raw_T_ours[:3, 3]
        np.savetxt(home / "part_point_sample" / f"{part}.xyz", points, fmt="%.12g")
    return {str(j + 1): {"state": state} for j, state in enumerate(model.rest)}


def write_photo(
    folder: Path, name: str, model: Model, truth: Truth, three_channels: bool = False
) -> None:
    """Write an annotation and its three images."""
    for kind in ("annotations", "color", "depth", "category_mask"):
        (folder / kind).mkdir(parents=True, exist_ok=True)
    links = []
    for part in range(len(truth.instance.parts)):
        link = {
            "link_category_id": part,
            "transformation": model.cam_T_raw(truth, part).tolist(),
            "segmentation": [[1.0, 1.0, 5.0, 1.0, 5.0, 5.0]],
        }
        if part:
            link["state"] = model.annotated(truth, part - 1)
        links.append(link)
    instance = {"urdf_id": model.urdf_id, "bbox": truth.box, "links": links[::-1]}
    annotation = {
        "width": truth.camera.width,
        "height": truth.camera.height,
        "color_path": f"color/{name}.jpg",
        "depth_path": f"depth/{name}.png",
        "instances": [instance],
    }
    (folder / "annotations" / f"{name}.json").write_text(json.dumps(annotation))
    Image.fromarray(truth.image).save(folder / "color" / f"{name}.jpg", quality=95)
    millimetres = np.round(truth.depth * 1000).astype(np.uint16)
    if three_channels:
        high, low = (millimetres // 256).astype(np.uint8), (millimetres % 256).astype(np.uint8)
        pixels = np.stack([low, high, np.zeros_like(low)], axis=-1)
    else:
        pixels = millimetres
    Image.fromarray(pixels).save(folder / "depth" / f"{name}.png")
    index = np.where(truth.mask > 0, truth.mask - 1, 0).astype(np.uint8)
    Image.fromarray(index).save(folder / "category_mask" / f"{name}.png")


def _to_urdf(raw: np.ndarray) -> str:
    """The frame's (Y, Z, X) as a URDF's X Y Z."""
    return _numbers([raw[2], raw[0], raw[1]])


def _numbers(values) -> str:
    return " ".join(f"{v:.12g}" for v in values)
