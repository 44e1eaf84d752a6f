"""What is known of a category before any photo is seen. Data, never code.

Conventions, the same for every category (docs/conventions.md shows them in pictures):
part 0 is the root; the root frame's origin is the centre of the root part's box; x points
right, y up and z to the front, as a user standing before the object sees it. At rest (all
joint states 0: closed) every part frame is the root frame. Positive states open.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import BinaryIO, Literal

import numpy as np
from numpy.typing import NDArray

from r2art.core.mesh import Mesh

JointKind = Literal["revolute", "prismatic"]
FloatArray = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True)
class Joint:
    """One joint of the rest pose. Joint ``j`` of a category moves part ``j + 1``.

    ``axis`` (unit) and ``pivot`` (m) are given in the root frame at rest; ``limits`` are
    radians for a revolute joint and metres for a prismatic one.
    """

    name: str
    kind: JointKind
    parent: int
    axis: tuple[float, float, float]
    pivot: tuple[float, float, float]
    limits: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Exchange:
    """Parts that trade names in pairs.

    Attributes:
        swap: P part numbers, the inverse of itself: what was called ``swap[k]`` is now part k.
    """

    swap: tuple[int, ...]

    def joint_swap(self, parents: Sequence[int]) -> tuple[int, ...]:
        """J joint numbers: which joint's state joint j has afterwards.

        Args:
            parents: The part on which each joint hangs.

        Raises:
            ValueError: Parts that a joint connects would trade names with two that none does.
        """
        ends = [frozenset((j + 1, parent)) for j, parent in enumerate(parents)]
        traded = [frozenset(self.swap[part] for part in pair) for pair in ends]
        return tuple(ends.index(pair) for pair in traded)

    def maps(self, joints: Sequence[Joint], carried: Callable[[Joint, Joint], FloatArray]) -> bool:
        """Whether parts trade names in pairs, joined alike, and axes are carried to axes.

        Args:
            joints: Of the category.
            carried: Of a joint and the one it has traded with, where the axis of that comes to
                lie.
        """
        if sorted(self.swap) != list(range(len(joints) + 1)):
            return False
        if any(self.swap[self.swap[part]] != part for part in self.swap):
            return False
        try:
            others = self.joint_swap([joint.parent for joint in joints])
        except ValueError:
            return False
        for joint, j in zip(joints, others, strict=True):
            other = joints[j]
            if joint.kind != other.kind:
                return False
            if np.abs(carried(joint, other) - joint.axis).max() > PARALLEL:
                return False
        return True


@dataclass(frozen=True, kw_only=True)
class Symmetry(Exchange):
    """Another labelling of the parts under which an object looks the same.

    The parts trade names and the root frame is turned by half: what was called ``swap[k]`` is
    now part k. The new root frame's origin is the centre of the new root's box, so

        ``cam_T_part'[k] = cam_T_part[swap[k]] @ S``, ``S = [diag(signs) | box_center[swap[0]]]``,

    box centres are carried by ``inverse(S)``, box sizes stay with their parts (half a turn about
    a coordinate axis keeps extents) and joint states with their joints. That is exact for any
    shape and any pivots, which ``inverse(S)`` carries, too. Done twice it changes nothing.

    Attributes:
        swap: P part numbers; the inverse of itself.
        axis: Axis of the root frame about which half a turn is made.
    """

    axis: Literal["x", "y", "z"]

    @property
    def signs(self) -> tuple[int, int, int]:
        """The diagonal of the half turn's rotation matrix."""
        x, y, z = (1 if self.axis == name else -1 for name in "xyz")
        return x, y, z

    def fits(self, joints: Sequence[Joint]) -> bool:
        """Whether the joints of the category move alike under both labellings.

        The turned axes must be the joints' own, or their opposites where parent and child have
        traded places: then the child sees its parent turn the other way round.
        """

        def turned(joint: Joint, other: Joint) -> FloatArray:
            sense = 1 if self.swap[joint.parent] == other.parent else -1
            return sense * np.multiply(self.signs, other.axis)

        return self.maps(joints, turned)


@dataclass(frozen=True, kw_only=True)
class Mirror(Exchange):
    """What a photo of an object shows in a mirror: another object of the category.

    The root frame is reflected in its plane x = 0, and parts on the left trade names with those
    on the right. With M = diag(-1, 1, 1, 1) the mirrored photo shows

        ``cam_T_part'[k] = M @ cam_T_part[swap[k]] @ M``,

    box centres ``M @ box_center[swap[k]]``, box sizes and joint states of the parts and joints
    that traded names.

    Attributes:
        swap: P part numbers; the inverse of itself; the root keeps its name.
    """

    def fits(self, joints: Sequence[Joint]) -> bool:
        """Whether the joints of the category move in the mirror as joints of theirs do."""

        def reflected(joint: Joint, other: Joint) -> FloatArray:
            sense = 1 if joint.kind == "prismatic" else -1  # turns are seen to go the other way
            return sense * np.multiply((-1, 1, 1), other.axis)

        return self.swap[0] == 0 and self.maps(joints, reflected)


PARALLEL = 0.1
"""How far the ends of unit axes may be apart that are taken for one; a mean of many wavers."""


@dataclass(frozen=True, kw_only=True)
class Category:
    """A category's prior: its mean object, at rest, in the root frame (metres).

    Attributes:
        name: For instance ``"laptop"``.
        part_names: P names, the root first.
        joints: P - 1 joints, parents before children.
        box_center: (P, 3) centre of each part's box.
        box_size: (P, 3) full extents of each part's box.
        points: (P, M, 3) points on the surface of each part.
        normals: (P, M, 3) unit outward normals there.
        areas: (P,) surface of each part (m²); each point stands for ``areas[p] / M``.
        frontal_area: ``S_wld`` of Eq. 1: mean area (m²) of the 2D box around the object,
            carried to the root's depth.
        size_spread: Standard deviation of the logarithm of the objects' diagonals, about their
            relative spread; 0 where it is not known.
        shape_basis: (K, P, 6) the K main ways in which objects differ from the mean one, each as
            large as its standard deviation, largest first: of every part the logarithm of its
            scale along x, y, z, and the shift (m) of its centre from where the root's scale puts
            it (`r2art.method.shape.Deformation`). None where it is not known.
        mesh: The surface of the parts as few triangles, for their outlines. None where it is not
            known.
        symmetry: The labelling that is as good as the given one; None: every other is wrong.
        mirror: Of objects that are alike on both sides; None: mirrored photos show none of them.
        keypoints: (P, N, 3) points of each part (m) that a network may look for one by one, where
            all objects are the same but for their pose, as robot arms are. None: they differ.
    """

    name: str
    part_names: tuple[str, ...]
    joints: tuple[Joint, ...]
    box_center: FloatArray
    box_size: FloatArray
    points: FloatArray
    normals: FloatArray
    areas: FloatArray
    frontal_area: float
    size_spread: float = 0.0
    shape_basis: FloatArray | None = None
    mesh: Mesh | None = None
    symmetry: Symmetry | None = None
    mirror: Mirror | None = None
    keypoints: FloatArray | None = None

    def __post_init__(self) -> None:
        for j, joint in enumerate(self.joints):
            if not 0 <= joint.parent <= j:
                raise ValueError(
                    f"joint {j} of {self.name} hangs on part {joint.parent}, but only parts "
                    f"0..{j} exist by then; order the joints parents-first"
                )
        if self.symmetry is not None and not self.symmetry.fits(self.joints):
            raise ValueError(
                f"{self.symmetry} does not map the joints of {self.name} to each other; "
                "trade parts in pairs, joined alike, and turn joint axes into joint axes"
            )
        if self.mirror is not None and not self.mirror.fits(self.joints):
            raise ValueError(
                f"{self.mirror} does not map the joints of {self.name} to each other; trade left "
                "parts for right ones, joined alike, whose axes are reflections of each other"
            )

    @property
    def diagonal(self) -> float:
        """Diagonal (m) of the box around the whole mean object at rest."""
        lower = (self.box_center - self.box_size / 2).min(axis=0)
        upper = (self.box_center + self.box_size / 2).max(axis=0)
        return float(np.linalg.norm(upper - lower))

    def save(self, path: Path | BinaryIO) -> None:
        """Write the prior as one ``.npz`` file (arrays, and the rest as JSON)."""
        meta = {
            "name": self.name,
            "part_names": self.part_names,
            "joints": [asdict(j) for j in self.joints],
            "frontal_area": self.frontal_area,
            "size_spread": self.size_spread,
            "symmetry": self.symmetry and asdict(self.symmetry),
            "mirror": self.mirror and asdict(self.mirror),
        }
        names = ("box_center", "box_size", "points", "normals", "areas")
        names += ("shape_basis", "keypoints")
        arrays = {k: v for k in names if (v := getattr(self, k)) is not None}
        if self.mesh is not None:
            arrays |= {f"mesh_{k}": v for k, v in vars(self.mesh).items()}
        np.savez_compressed(path, allow_pickle=False, meta=json.dumps(meta), **arrays)

    @classmethod
    def load(cls, path: Path | BinaryIO) -> "Category":
        """Read a prior that :meth:`save` wrote."""
        with np.load(path, allow_pickle=False) as f:
            meta = json.loads(str(f["meta"]))
            joints = tuple(
                Joint(
                    name=j["name"],
                    kind=j["kind"],
                    parent=j["parent"],
                    axis=tuple(j["axis"]),
                    pivot=tuple(j["pivot"]),
                    limits=tuple(j["limits"]),
                )
                for j in meta["joints"]
            )
            symmetry, mirror = meta.get("symmetry"), meta.get("mirror")
            return cls(
                name=meta["name"],
                part_names=tuple(meta["part_names"]),
                joints=joints,
                box_center=f["box_center"],
                box_size=f["box_size"],
                points=f["points"],
                normals=f["normals"],
                areas=f["areas"],
                frontal_area=meta["frontal_area"],
                size_spread=meta.get("size_spread", 0.0),
                shape_basis=f.get("shape_basis"),
                keypoints=f.get("keypoints"),
                mesh=Mesh(vertices=f["mesh_vertices"], faces=f["mesh_faces"], part=f["mesh_part"])
                if "mesh_faces" in f
                else None,
                symmetry=symmetry and Symmetry(swap=tuple(symmetry["swap"]), axis=symmetry["axis"]),
                mirror=mirror and Mirror(swap=tuple(mirror["swap"])),
            )
