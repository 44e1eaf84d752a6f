"""The objects of ReArt-48, as ``urdf_metas.json`` describes them: boxes and joints, no surfaces.

    {"urdf_metas": [{
        "id": ..., "norm_factors": K + 1 numbers (1 over the diagonal of a box),
        "corner_pts": K + 1 boxes, each its least and greatest corner; the whole object's first,
        "joint_types", "joint_parents", "joint_children", "joint_xyz", "joint_rpy": K - 1 entries
    }]}

All boxes are given in one frame, that of the whole object at rest, and annotations map it to the
camera, part by part. Joints are given in URDF axes, whose (X, Y, Z) is (Y, Z, X) in that frame;
``joint_rpy`` holds the axis.
"""

import re
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Joint
from r2art.data.adapters.convention import Convention
from r2art.data.adapters.model import Model, model, triple
from r2art.data.adapters.reading import Node, read_json
from r2art.data.adapters.urdf import KINDS

FloatArray = NDArray[np.floating]
FILE = "urdf_metas.json"
TO_FRAME = [1, 2, 0]  # (X, Y, Z) of a URDF to (Y, Z, X)
SAME_DIAGONAL = 0.02  # share by which a norm factor may miss its box


@dataclass(frozen=True)
class Metas:
    """The objects of a ``urdf_metas.json``.

    Attributes:
        path: It.
        parts: How many parts the category has.
        joint_names: One less.
        convention: How to read it.
    """

    path: Path
    parts: int
    joint_names: tuple[str, ...]
    convention: Convention
    _models: dict[int, Model] = field(default_factory=dict, repr=False, compare=False)

    def model(self, object_id: int) -> Model:
        """An object at its rest, its joints as the dataset has them.

        Raises:
            Fault: The file or its entry is wrong.
        """
        if object_id not in self._models:
            self._models[object_id] = self._read(self._entries[object_id])
        return self._models[object_id]

    def has(self, object_id: int) -> bool:
        """Whether the file describes an object.

        Raises:
            Fault: The file is wrong.
        """
        return object_id in self._entries

    @cached_property
    def _entries(self) -> dict[int, Node]:
        entries: dict[int, Node] = {}
        for node in read_json(self.path)["urdf_metas"].items():
            if node.value == []:
                continue
            number = node["id"]
            if number.whole() in entries:
                raise number.fault(f"{number.value} is the id of another object already")
            entries[number.whole()] = node
        return entries

    def _read(self, node: Node) -> Model:
        lower, upper = self._boxes(node)
        order = self.convention.links(self.parts)
        sides = np.stack([lower, upper], axis=1)[order]
        corners = [
            np.array([[box[i, 0], box[j, 1], box[k, 2]] for i, j, k in product((0, 1), repeat=3)])
            for box in sides
        ]
        still = np.tile(np.eye(4), (self.parts, 1, 1))
        return model(self._joints(node, order), still, corners, self.convention, only_boxes=True)

    def _boxes(self, node: Node) -> tuple[FloatArray, FloatArray]:
        """(K, 3) least and greatest corners of the parts' boxes."""
        boxes, count = node["corner_pts"], self.parts + 1
        if _depth(boxes.value) == 4:  # some files nest each corner once more
            corners = boxes.array(count, 2, 1, 3)[:, :, 0]
        else:
            corners = boxes.array(count, 2, 3)
        factors = node["norm_factors"].array(count)
        off = factors * np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1) - 1
        worst = int(np.abs(off).argmax())
        if abs(off[worst]) > SAME_DIAGONAL:
            raise boxes.fault(
                f"box {worst} has a diagonal {off[worst]:+.0%} off what norm_factors[{worst}] says"
            )
        ends = self.convention.unit * corners[1:]
        return ends.min(axis=1), ends.max(axis=1)

    def _joints(self, node: Node, order: list[int]) -> list[Joint]:
        count = self.parts - 1
        xyz, rpy = (node[key].array(count, 3)[:, TO_FRAME] for key in ("joint_xyz", "joint_rpy"))
        if self.convention.negate_second:
            rpy[:, 1] *= -1
        parents, children = self._ends(node)
        joints = []
        for part, link in enumerate(order[1:], start=1):
            if link not in children:
                raise node["joint_children"].fault(f"no joint moves part {link}")
            j = children.index(link)
            parent = order.index(parents[j])
            if parent >= part:
                raise node["joint_parents"].items()[j].fault("must come before its child")
            joints.append(self._joint(node, j, part, parent, xyz[j], rpy[j]))
        return joints

    def _joint(
        self, node: Node, j: int, part: int, parent: int, xyz: FloatArray, axis: FloatArray
    ) -> Joint:
        kind = node["joint_types"].items(self.parts - 1)[j]
        if kind.text() not in KINDS:
            raise kind.fault(f"is {kind.value!r}; must be revolute or prismatic")
        length = float(np.linalg.norm(axis))
        if length < 1e-6:
            raise node["joint_rpy"].fault(f"entry {j} is no direction: it is zero")
        return Joint(
            name=self.joint_names[part - 1],
            kind=KINDS[kind.text()],
            parent=parent,
            axis=triple(axis / length),
            pivot=triple(self.convention.unit * xyz),
            limits=(0.0, 0.0),
        )

    def _ends(self, node: Node) -> tuple[list[int], list[int]]:
        """Parent and child part of every joint, from 0, however the file counts or names them."""
        nodes = [node[key] for key in ("joint_parents", "joint_children")]
        numbers = [[_number(entry) for entry in side.items(self.parts - 1)] for side in nodes]
        first = min(min(side) for side in numbers)
        parents, children = ([n - first for n in side] for side in numbers)
        for side, found in zip(nodes, (parents, children), strict=True):
            if any(n >= self.parts for n in found):
                raise side.fault(f"names part {max(found)}; they are 0 to {self.parts - 1}")
        return parents, children


def _number(node: Node) -> int:
    """The number of a link: itself, or that at the end of its name; 0 of a base link."""
    if not isinstance(node.value, str):
        return node.whole()
    if digits := re.search(r"(\d{1,6})$", node.value):
        return int(digits[1])
    if node.value.startswith("base"):
        return 0
    raise node.fault(f"{node.value!r} is no number and ends in none")


def _depth(value: object) -> int:
    """How many lists lie in each other."""
    return 1 + _depth(value[0]) if isinstance(value, list) and value else 0
