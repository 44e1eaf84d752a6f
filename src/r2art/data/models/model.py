"""A model as its file tells it, whatever the format: links that are seen, joints between.

Everything is given in the model's base frame (metres, radians) with every joint at zero, in the
file's own numbering, even where zero is beyond a joint's limits. Axes and pivots in that one
frame are all that forward kinematics needs (a product of exponentials).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from r2art.data.shape import Material

FloatArray = NDArray[np.floating]

MOVABLE = ("revolute", "prismatic")


@dataclass(frozen=True, kw_only=True, eq=False)
class Patch:
    """Triangles of one material.

    Attributes:
        corners: (F, 3, 3) corners, counter-clockwise seen from outside.
        uv: (F, 3, 2) texture coordinates.
        material: Its look.
    """

    corners: FloatArray
    uv: FloatArray
    material: Material


@dataclass(frozen=True, kw_only=True)
class MeshFile:
    """A mesh on disk, read only when it is needed.

    Attributes:
        path: The file.
        scale: Of its x, y and z; a negative product mirrors it.
        color: sRGB colour that the model gives it, if any.
    """

    path: Path
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    color: tuple[float, float, float] | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Visual:
    """Something seen of a link: a mesh file or triangles, in a frame of its own."""

    link_T_visual: FloatArray
    shape: MeshFile | tuple[Patch, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Link:
    """A rigid body.

    Attributes:
        name: Unique in its model.
        base_T_link: (4, 4) its frame, with every joint at zero.
        visuals: What is seen of it.
        label: What it is called as a part; default: its name.
    """

    name: str
    base_T_link: FloatArray
    visuals: tuple[Visual, ...] = ()
    label: str = ""


@dataclass(frozen=True, kw_only=True)
class Mimic:
    """A joint that follows another: its state is ``multiplier`` times the leader's + ``offset``."""

    leader: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, kw_only=True)
class ModelJoint:
    """What holds two links together.

    Attributes:
        name: Unique in its model.
        kind: ``"fixed"``, ``"revolute"``, ``"prismatic"``, ``"free"`` (nothing holds them
            together), or another kind, which cannot be estimated.
        parent: Name of a link ...
        child: ... and of the one that moves when the state grows.
        axis: Unit axis in the base frame.
        pivot: A point (m) on it.
        limits: Least and greatest state, rad or m; None where the file gives none.
        mimic: The joint that it follows.
    """

    name: str
    kind: str
    parent: str
    child: str
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    pivot: tuple[float, float, float] = (0.0, 0.0, 0.0)
    limits: tuple[float, float] | None = None
    mimic: Mimic | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Model:
    """One model.

    Attributes:
        name: Of the robot or object.
        links: All links.
        joints: All joints, parents before children.
        files: Every file that it is made of, the one that was read first.
        up: Direction of the base frame that is up, such as ``"+z"`` ...
        front: ... and the one in which its front looks.
        by_place: Name and order parts by their labels and places, not as the file has them:
            so objects of one category come out alike whoever numbered their links.
    """

    name: str
    links: tuple[Link, ...]
    joints: tuple[ModelJoint, ...]
    files: tuple[Path, ...]
    up: str = "+z"
    front: str = "+x"
    by_place: bool = False


def parents_first(joints: Sequence[ModelJoint], root: str) -> list[ModelJoint]:
    """The joints of the tree that hangs on link ``root``, breadth first, else as given."""
    below: dict[str, list[ModelJoint]] = {}
    for joint in joints:
        below.setdefault(joint.parent, []).append(joint)
    ordered, links = [], [root]
    for link in links:  # grows while it is walked along
        ordered += below.get(link, [])
        links += [joint.child for joint in below.get(link, [])]
    return ordered


def triple(values: Sequence[float] | FloatArray) -> tuple[float, float, float]:
    """Three numbers as a tuple of floats."""
    x, y, z = (float(v) for v in values)
    return x, y, z


def rigid(R: FloatArray, t: Sequence[float] | FloatArray) -> FloatArray:
    """(4, 4) pose of a rotation and a translation."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, t
    return T
