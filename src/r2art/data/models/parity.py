"""An importer held against another reader: where MuJoCo puts every link of the same file.

MuJoCo's own URDF parser and kinematics know nothing of ours. It reads no DAE or GLB meshes, so
it gets URDFs with a box for each link; where links are does not depend on their shapes.
"""

# pyright: reportAttributeAccessIssue=false
# mujoco's names come from a compiled module that type checkers cannot see into.

import tempfile
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from r2art.data.models.build import Built, Reading, build
from r2art.data.models.mjcf import body_name, joint_name, read_mjcf
from r2art.data.models.model import Model
from r2art.data.models.urdf import read_urdf

FloatArray = NDArray[np.floating]

_ONE_STATE = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
SETTINGS = {"fusestatic": "false", "boundmass": "1", "boundinertia": "1"}


@dataclass(frozen=True, kw_only=True)
class Parity:
    """How far two readings of a model are apart.

    Attributes:
        built: Our reading.
        links: How many links were compared, at every state.
        deviation: Greatest difference of any number of their poses (m, or of a unit vector),
            relative to the root part.
        limits: Greatest difference of any limit (rad, m).
    """

    built: Built
    links: int
    deviation: float
    limits: float


def parity(
    path: Path,
    format: Literal["urdf", "mjcf"],
    *,
    states: int = 20,
    reading: Reading = Reading(),  # noqa: B008 (frozen)
    shapes: bool = True,
) -> Parity:
    """Compare link by link, at random joint states within limits.

    Args:
        path: The model's file.
        format: Of it.
        states: How many.
        reading: How it is read; joints to ``fix`` must be held at zero.
        shapes: False: read a box in place of every shape, if the model's meshes are missing.

    Raises:
        InputError: It cannot be read.
    """
    if format == "mjcf":
        model, m = read_mjcf(path), mujoco.MjModel.from_xml_path(str(path))
    else:
        boxes = _with_boxes(path)
        model, m = _read(path, boxes, shapes), mujoco.MjModel.from_xml_string(boxes)
    ours = build(model, reading)
    joints, rng = ours.instance.joints, np.random.default_rng(0)
    limits = np.array([joint.limits for joint in joints])
    theirs = np.array([_range(m, joint.name) for joint in joints])
    bodies = {body_name(m, b): b for b in range(m.nbody)}
    names = [name for name in ours.links if name in bodies]
    root = next(name for name in names if ours.links[name][0] == 0)
    greatest = 0.0
    for _ in range(states):
        state = rng.uniform(*limits.T)
        placed = _kinematics(m, {j.name: s for j, s in zip(joints, state, strict=True)})
        for name in names:
            here = np.linalg.inv(ours.root_T_link(root, state)) @ ours.root_T_link(name, state)
            there = np.linalg.inv(placed[bodies[root]]) @ placed[bodies[name]]
            greatest = max(greatest, float(np.abs(here - there).max()))
    return Parity(
        built=ours,
        links=len(names),
        deviation=greatest,
        limits=float(np.abs(limits - theirs).max()),
    )


def _read(path: Path, boxes: str, shapes: bool) -> Model:
    if shapes:
        return read_urdf(path)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / path.name
        file.write_text(boxes)
        return read_urdf(file)


def _with_boxes(path: Path) -> str:
    """A URDF with a box in place of everything that is seen, for MuJoCo to read."""
    robot = ET.parse(path).getroot()
    for link in robot.findall("link"):
        for child in list(link):
            link.remove(child)
        visual = ET.SubElement(ET.SubElement(link, "visual"), "geometry")
        ET.SubElement(visual, "box", size="0.1 0.1 0.1")
    compiler = ET.SubElement(ET.SubElement(robot, "mujoco"), "compiler")
    compiler.attrib.update(SETTINGS)
    return ET.tostring(robot, encoding="unicode")


def _kinematics(m: mujoco.MjModel, state: dict[str, float]) -> FloatArray:
    """(B, 4, 4) poses of all bodies; joints without a state stay at zero."""
    data = mujoco.MjData(m)
    for j in range(m.njnt):
        if int(m.jnt_type[j]) in _ONE_STATE:
            data.qpos[m.jnt_qposadr[j]] = state.get(joint_name(m, j), 0.0)
    mujoco.mj_kinematics(m, data)
    poses = np.tile(np.eye(4), (m.nbody, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = data.xmat.reshape(-1, 3, 3), data.xpos
    return poses


def _range(m: mujoco.MjModel, joint: str) -> tuple[float, float]:
    j = next(j for j in range(m.njnt) if joint_name(m, j) == joint)
    lower, upper = m.jnt_range[j].tolist()
    return (lower, upper) if m.jnt_limited[j] else (-np.pi, np.pi)
