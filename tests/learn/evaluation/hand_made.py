"""A category and labels made by hand, and a dataset of them on disk."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from r2art.core.camera import Camera
from r2art.core.category import Category, Joint
from r2art.core.prediction import Prediction
from r2art.data import shards
from r2art.data.pose import root_T_part
from r2art.data.sample import Sample

CENTER = np.array([[0, 0, 0], [0, 0.02, 0], [0, 0, 0.1]])
SIZE = np.array([[0.3, 0.02, 0.2], [0.3, 0.01, 0.2], [0.2, 0.01, 0.1]])


def make_category() -> Category:
    """A body with a hinged lid and a tray that slides out."""
    points = CENTER[:, None] + SIZE[:, None] * np.random.default_rng(0).uniform(
        -0.5, 0.5, (3, 64, 3)
    )
    lid = Joint(
        name="hinge",
        kind="revolute",
        parent=0,
        axis=(-1, 0, 0),
        pivot=(0, 0.01, -0.1),
        limits=(0, 2),
    )
    tray = Joint(
        name="slide", kind="prismatic", parent=0, axis=(0, 0, 1), pivot=(0, 0, 0.1), limits=(0, 0.1)
    )
    return Category(
        name="box",
        part_names=("body", "lid", "tray"),
        joints=(lid, tray),
        box_center=CENTER,
        box_size=SIZE,
        points=points,
        normals=np.zeros_like(points),
        areas=np.ones(3),
        frontal_area=0.05,
    )


def make_arm(parts: int = 7) -> Category:
    """A chain of equal parts."""
    size = np.tile([0.1, 0.3, 0.1], (parts, 1))
    center = 0.3 * np.arange(parts)[:, None] * [0.0, 1, 0]
    points = np.random.default_rng(1).uniform(-0.5, 0.5, (parts, 32, 3))
    joints = tuple(
        Joint(
            name=f"joint_{j + 1}",
            kind="revolute",
            parent=j,
            axis=(0, 0, 1),
            pivot=(0, 0.3 * j + 0.15, 0),
            limits=(0, 0.2),
        )
        for j in range(parts - 1)
    )
    return Category(
        name="robot_arm",
        part_names=tuple(f"link_{p}" for p in range(parts)),
        joints=joints,
        box_center=center,
        box_size=size,
        points=center[:, None] + size[:, None] * points,
        normals=np.zeros_like(points),
        areas=np.ones(parts),
        frontal_area=0.2,
    )


def sample_of(category: Category, seed: int) -> Sample:
    """The mean object, somewhere before the camera; the photo shows nothing."""
    rng = np.random.default_rng(seed)
    low, high = np.array([j.limits for j in category.joints]).T
    joint_state = rng.uniform(low, high)
    cam_T_root = np.eye(4)
    cam_T_root[:3, :3] = np.diag([1, -1, -1]) @ Rotation.random(rng=rng).as_matrix()
    cam_T_root[:3, 3] = [*rng.normal(0, 0.05, 2), rng.uniform(0.6, 1.2)]
    return Sample(
        image=np.full((48, 64, 3), 200, np.uint8),
        mask=np.zeros((48, 64), np.uint8),
        depth=np.zeros((48, 64), np.float32),
        camera=Camera(60, 60, 32, 24, 64, 48),
        box=np.array([10.0, 8, 50, 40]),
        cam_T_part=cam_T_root @ root_T_part(category.joints, joint_state),
        joint_state=joint_state,
        box_center=category.box_center,
        box_size=category.box_size,
        axis=np.array([j.axis for j in category.joints]),
        pivot=np.array([j.pivot for j in category.joints]),
        visible=rng.uniform(0.2, 1, len(category.part_names)),
    )


def make_laptop() -> Category:
    """Parts and joints as the shipped model's laptop has them."""
    whole = make_category()
    return replace(
        whole,
        name="laptop",
        part_names=("base", "lid"),
        joints=whole.joints[:1],
        **{
            name: getattr(whole, name)[:2]
            for name in ("box_center", "box_size", "points", "normals", "areas")
        },
    )


def write_dataset(folder: Path, category: Category, samples: list[Sample]) -> Path:
    """A folder as `r2art synth` would leave it."""
    folder.mkdir(parents=True)
    category.save(folder / shards.PRIOR)
    manifest = {
        **{"format": shards.FORMAT, "category": category.name, "n": len(samples), "seed": 0},
        **{"split": "test", "size": 64, "backgrounds": False, "shards": 1},
    }
    (folder / shards.MANIFEST).write_text(json.dumps(manifest))
    rows = [shards.to_row(i, sample) for i, sample in enumerate(samples)]
    shards.write_shard(shards.shard_path(folder, 0), rows)
    return folder


def disturbed(prediction: Prediction, rng: np.random.Generator) -> Prediction:
    """A prediction that errs in everything."""
    parts = []
    for part in prediction.parts:
        pose = part.cam_T_part.copy()
        turn = rng.normal(0, 0.3, 3)
        pose[:3, :3] = pose[:3, :3] @ Rotation.from_rotvec(turn).as_matrix()
        pose[:3, 3] = 1.1 * pose[:3, 3] + rng.normal(0, 0.03, 3)
        parts.append(
            replace(
                part,
                cam_T_part=pose,
                box_center=part.box_center + rng.normal(0, 0.01, 3),
                box_size=part.box_size * rng.uniform(0.7, 1.4, 3),
                confidence=float(rng.uniform()),
            )
        )
    joints = []
    for joint in prediction.joints:
        axis = joint.axis + rng.normal(0, 0.2, 3)
        joints.append(
            replace(
                joint,
                state=joint.state + float(rng.normal(0, 0.1)),
                axis=axis / np.linalg.norm(axis),
                pivot=joint.pivot + rng.normal(0, 0.05, 3),
            )
        )
    x1, y1, x2, y2 = prediction.box
    box = (x1 + 3, y1 - 2, x2 + 1, y2 + 5)
    return replace(prediction, parts=tuple(parts), joints=tuple(joints), box=box)
