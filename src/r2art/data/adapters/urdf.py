"""The joints of ArtImage's URDF files. (Whole URDF models are read by `r2art.data.models`.)"""

from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import JointKind
from r2art.data.adapters.reading import read_xml
from r2art.data.source import Fault

FloatArray = NDArray[np.floating]
KINDS: dict[str, JointKind] = {
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
}


@dataclass(frozen=True)
class UrdfJoint:
    """A joint that moves, as the file has it."""

    kind: JointKind
    origin: FloatArray
    axis: FloatArray


def read_joints(path: Path) -> dict[int, UrdfJoint]:
    """The joints that move, by the number of the link they move: the last word of their name.

    Raises:
        Fault: The file is missing or damaged, or two joints move one link.
    """
    joints: dict[int, UrdfJoint] = {}
    for element in read_xml(path).iter("joint"):
        name = element.get("name", "")
        kind = element.get("type", "")
        if kind in ("fixed", "0"):
            continue
        if kind not in KINDS:
            raise Fault(str(path), f"joint {name!r}", f"unknown type {kind!r}")
        child = _number(path, name, name.split("_")[-1])
        if child in joints:
            raise Fault(str(path), f"joint {name!r}", f"a second joint that moves link {child}")
        axis = _vector(path, name, element.find("axis"), "xyz")
        length = float(np.linalg.norm(axis))
        if length < 1e-9:
            raise Fault(str(path), f"joint {name!r}.axis", "is zero")
        origin = _vector(path, name, element.find("origin"), "xyz")
        joints[child] = UrdfJoint(KINDS[kind], origin, axis / length)
    return joints


def read_base(path: Path) -> tuple[FloatArray, FloatArray]:
    """(3,) ``xyz`` and (3,) ``rpy`` of joint 0, which carries the whole object.

    Raises:
        Fault: The file is missing or damaged, or has no joint 0.
    """
    for element in read_xml(path).iter("joint"):
        name = element.get("name", "")
        if name.split("_")[1:2] == ["0"]:
            origin = element.find("origin")
            both = [_vector(path, name, origin, key, "0 0 0") for key in ("xyz", "rpy")]
            return both[0], both[1]
    raise Fault(str(path), "joint", "there is no joint 0")


def _number(path: Path, name: str, text: str) -> int:
    if not (text.isdecimal() and len(text) < 9):
        raise Fault(str(path), f"joint {name!r}", "its name must hold the number of its link")
    return int(text)


def _vector(
    path: Path, name: str, element: Element | None, key: str, default: str | None = None
) -> FloatArray:
    text = element.get(key) if element is not None else None
    field = f"joint {name!r}.{'' if element is None else element.tag + '.'}{key}"
    if text is None:
        text = default
    if text is None:
        raise Fault(str(path), field, "is missing")
    try:
        vector = np.array(text.split(), np.float64)
    except ValueError:
        vector = np.array([np.nan])
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise Fault(str(path), field, f"must be three numbers, is {text!r}")
    return vector
