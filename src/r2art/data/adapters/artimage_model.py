"""The objects of ArtImage, read from their URDF files and point samples.

    urdf/rest_state.json                               {object: {link: {"state": degrees | length}}}
    urdf/OBJECT/mobility_for_unity_align.urdf          joints
    urdf/OBJECT/mobility_for_unity.urdf                of scissors: how they were before aligning
    urdf/OBJECT/part_point_sample/LINK.xyz             points on each link

Every link's points are given in one frame, that of the object with every joint at 0; annotations
map that frame to the camera, link by link. URDF vectors (X, Y, Z) are (Y, Z, X) there. The rest
pose is where ``rest_state.json`` says; a joint's angle turns by the left-hand rule (Unity).
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Joint
from r2art.data.adapters.convention import Convention
from r2art.data.adapters.model import Model, model, triple
from r2art.data.adapters.reading import Node, read_json, read_points
from r2art.data.adapters.urdf import UrdfJoint, read_base, read_joints
from r2art.data.pose import joint_matrix
from r2art.data.source import Fault
from r2art.data.staging import about

FloatArray = NDArray[np.floating]
REST = "rest_state.json"
ALIGNED, UNALIGNED = "mobility_for_unity_align.urdf", "mobility_for_unity.urdf"
POINTS = "part_point_sample"
REALIGNED = {"scissors"}  # whose points and photos are of the unaligned URDF

FARTHEST = {"revolute": 360.0, "prismatic": 1000.0}  # degrees, units of length
TO_FRAME = [1, 2, 0]  # (X, Y, Z) of a URDF to (Y, Z, X)
Kinematics = tuple[list[Joint], FloatArray]


@dataclass(frozen=True)
class Objects:
    """The ``urdf`` folder of a category.

    Attributes:
        folder: It.
        category: Its name.
        joint_names: J of them; joint j moves our part j + 1.
        convention: How to read it.
    """

    folder: Path
    category: str
    joint_names: tuple[str, ...]
    convention: Convention
    _kinematics: dict[int, Kinematics] = field(default_factory=dict, repr=False, compare=False)
    _models: dict[int, Model] = field(default_factory=dict, repr=False, compare=False)

    def of(self, urdf_id: int) -> Path:
        """The folder of an object."""
        return self.folder / str(urdf_id)

    def model(self, urdf_id: int) -> Model:
        """An object at its rest, its joints as the dataset has them.

        Raises:
            Fault: One of its files is missing or damaged.
        """
        if urdf_id not in self._models:
            self._models[urdf_id] = self._read_model(urdf_id)
        return self._models[urdf_id]

    def joint_state(self, urdf_id: int, annotated: FloatArray) -> FloatArray:
        """(J,) states (rad, m) from closed, of annotated ones (degrees, lengths).

        Raises:
            Fault: The object's files are wrong.
        """
        joints, rest = self.kinematics(urdf_id)
        closed = self.convention.closed_state(len(joints))
        return self._in_our_units(joints, annotated) - rest - closed

    def kinematics(self, urdf_id: int) -> Kinematics:
        """The joints in the object's raw frame, and the (J,) states (rad, m) of its rest.

        Raises:
            Fault: The object's files are wrong.
        """
        if urdf_id not in self._kinematics:
            self._kinematics[urdf_id] = self._read_kinematics(urdf_id)
        return self._kinematics[urdf_id]

    def _read_model(self, urdf_id: int) -> Model:
        joints, rest = self.kinematics(urdf_id)
        align = self._alignment(urdf_id)
        motions = [joint_matrix(j, float(s)) for j, s in zip(joints, rest, strict=True)]
        links = self.convention.links(len(joints) + 1)
        samples = [self.of(urdf_id) / POINTS / f"{k}.xyz" for k in links]
        return model(
            [_moved(joint, align) for joint in joints],
            align @ np.stack([np.eye(4), *motions]),
            [self.convention.unit * read_points(path) for path in samples],
            self.convention,
        )

    def _read_kinematics(self, urdf_id: int) -> Kinematics:
        path = self.of(urdf_id) / ALIGNED
        found = read_joints(path)
        links = self.convention.links(len(self.joint_names) + 1)[1:]
        if set(found) != set(links):
            moved = ", ".join(map(str, sorted(found))) or "none"
            raise Fault(str(path), "joint", f"links {sorted(links)} must move, {moved} do")
        joints = [
            self._joint(name, found[k]) for name, k in zip(self.joint_names, links, strict=True)
        ]
        rest = np.array([self._rest_state(urdf_id, k, found[k]) for k in links])
        return joints, self._in_our_units(joints, rest)

    def _joint(self, name: str, found: UrdfJoint) -> Joint:
        turns_left = found.kind == "revolute" and self.convention.left_handed
        return Joint(
            name=name,
            kind=found.kind,
            parent=0,
            axis=triple(found.axis[TO_FRAME] * (-1.0 if turns_left else 1.0)),
            pivot=triple(found.origin[TO_FRAME] * self.convention.unit),
            limits=(0.0, 0.0),
        )

    def _in_our_units(self, joints: list[Joint], states: FloatArray) -> FloatArray:
        turns = np.array([joint.kind == "revolute" for joint in joints])
        return np.where(turns, np.radians(states), self.convention.unit * states)

    @cached_property
    def _rest(self) -> Node:
        return read_json(self.folder / REST)

    def _rest_state(self, urdf_id: int, link: int, joint: UrdfJoint) -> float:
        if joint.kind == "revolute" and self._rest.get(str(urdf_id)) is None:
            return 0.0
        state = self._rest[str(urdf_id)][str(link)]["state"]
        if abs(state.number()) > FARTHEST[joint.kind]:
            raise state.fault(f"is {state.number():g}; no joint rests so far from 0")
        return state.number()

    def _alignment(self, urdf_id: int) -> FloatArray:
        """(4, 4) from the raw frame to the aligned one: the identity but for scissors."""
        align = np.eye(4)
        if self.category in REALIGNED:
            old, new = (read_base(self.of(urdf_id) / name) for name in (UNALIGNED, ALIGNED))
            xyz, rpy = ((b - a)[[0, 2, 1]] * (-1, 1, -1) for a, b in zip(old, new, strict=True))
            align[:3, :3] = about(2, rpy[0]) @ about(0, rpy[1]) @ about(1, rpy[2])
            align[:3, 3] = xyz * self.convention.unit
        return align


def _moved(joint: Joint, b_T_a: FloatArray) -> Joint:
    axis, pivot = b_T_a[:3, :3] @ joint.axis, b_T_a[:3, :3] @ joint.pivot + b_T_a[:3, 3]
    return replace(joint, axis=triple(axis), pivot=triple(pivot))


def read_states(links: list[Node]) -> FloatArray:
    """(J,) the annotated ``state`` of every link but the root, which has none.

    Raises:
        Fault: One is missing or no number, or the root has one.
    """
    state = links[0].get("state")
    if state is not None and state.number() != 0:
        raise state.fault("the root does not move; its link_category_id may be wrong")
    return np.array([link["state"].number() for link in links[1:]])
