"""A `Model` as an `Instance`: parts that move as one, in r2art's root frame."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Joint
from r2art.core.errors import InputError, UsageError
from r2art.data.models.meshes import LARGEST, read_mesh
from r2art.data.models.model import Link, MeshFile, Model, ModelJoint, Patch, triple
from r2art.data.models.simplify import BUDGET, area, shares, simplified, surface
from r2art.data.models.skeleton import Skeleton, skeleton
from r2art.data.models.weld import as_joint, welded
from r2art.data.pose import root_T_part
from r2art.data.shape import Instance, Surface

FloatArray = NDArray[np.floating]
Parts = list[list[Patch]]

SMALLEST = 0.005
"""Metres across below which an object is taken to be in other units."""
MOST_PARTS = 16
"""Of an object: as many as `r2art.data.sample.Sample.amodal` has bits."""


@dataclass(frozen=True, kw_only=True)
class Reading:
    """How models are turned into objects.

    Attributes:
        fix: Joints to hold still, see `r2art.data.models.weld.welded`.
        root: Link that is (in) the root part; None: as the file has it.
        up: Direction of the model's base frame that is up, ``"+z"`` say ...
        front: ... and the one in which its front looks; None: as is usual for the format.
        scale: Metres in the model's unit of length.
        triangles: Of an object, about.
    """

    fix: tuple[str, ...] = ()
    root: str | None = None
    up: str | None = None
    front: str | None = None
    scale: float = 1.0
    triangles: int = BUDGET

    def __post_init__(self) -> None:
        if not (np.isfinite(self.scale) and self.scale > 0):
            raise UsageError(f"--scale must be positive, got {self.scale}")
        if self.triangles < 100:
            raise UsageError(f"an object needs at least 100 triangles, got {self.triangles}")


@dataclass(frozen=True, kw_only=True)
class Follows:
    """Joint ``follower``'s state is ``multiplier`` times that of ``leader``, plus ``offset``."""

    follower: int
    leader: int
    multiplier: float
    offset: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Built:
    """A model turned into an object.

    Attributes:
        instance: The object; joint states and limits are numbered as the model's file has them.
        base_T_root: (4, 4) r2art's root frame in the model's base frame, every joint at zero.
        links: By link, its part and ``root_T_link`` (4, 4) with every joint at zero.
        follows: Joints that mimic others.
    """

    instance: Instance
    base_T_root: FloatArray
    links: dict[str, tuple[int, FloatArray]]
    follows: tuple[Follows, ...] = ()

    def root_T_link(self, link: str, joint_state: FloatArray) -> FloatArray:
        """(4, 4) pose of one of the model's links in the root part's frame."""
        part, at_rest = self.links[link]
        return root_T_part(self.instance.joints, joint_state)[part] @ at_rest


def build(model: Model, reading: Reading = Reading()) -> Built:
    """Weld, choose the root, turn the axes, load and simplify the meshes.

    Raises:
        InputError: It has no joints or shapes to speak of, a mesh cannot be read, or its size
            cannot be meant.
    """
    frame = skeleton(welded(model, reading.fix), reading.root)
    root_R_base = turn(reading.up or model.up, reading.front or model.front)
    order = [frame.root, *(joint.child for joint in frame.joints)]
    if len(order) > MOST_PARTS:
        raise InputError(
            f"{model.files[0]} has {len(order)} parts that move, labels hold {MOST_PARTS}; hold "
            f"joints still: --fix {frame.joints[-1].name} ..."
        )
    parts = [_patches(model, frame.links[name], root_R_base, reading.scale) for name in order]
    _check_size(model, parts)
    if model.by_place:
        frame, parts = _by_place(frame, parts)
        order = [frame.root, *(joint.child for joint in frame.joints)]
    surfaces = _surfaces(parts, reading.triangles)
    center = _center(surfaces[0])
    moved = tuple(tuple(replace(s, vertices=s.vertices - center) for s in p) for p in surfaces)
    names = _names(model, frame, order)
    joints = tuple(
        _joint(model, joint, order.index(joint.parent), root_R_base, reading.scale, center)
        for joint in frame.joints
    )
    if model.by_place:
        joints = tuple(replace(j, name=n) for j, n in zip(joints, names[1:], strict=True))
    instance = Instance(category=model.name, part_names=names, parts=moved, joints=joints)
    root_T_base = np.eye(4)
    root_T_base[:3, :3], root_T_base[:3, 3] = root_R_base, -center
    return Built(
        instance=instance,
        base_T_root=np.linalg.inv(root_T_base),
        links=_link_poses(frame, order, root_T_base, reading.scale),
        follows=_follows(frame, joints, reading.scale),
    )


def turn(up: str, front: str) -> FloatArray:
    """(3, 3) ``root_R_base`` from the directions of the base frame that are up and front.

    Raises:
        UsageError: They are no directions, or lie on one line.
    """
    rows = []
    for name, text in (("up", up), ("front", front)):
        sign, letter = (text[0], text[1:]) if text[:1] in ("+", "-") else ("+", text)
        if letter not in ("x", "y", "z"):
            raise UsageError(f"--{name} {text}: give x, y, z, -x, -y or -z")
        rows.append((-1.0 if sign == "-" else 1.0) * np.eye(3)["xyz".index(letter)])
    if rows[0] @ rows[1]:
        raise UsageError(f"--up {up} and --front {front} lie on one line; give two axes")
    return np.stack([np.cross(rows[0], rows[1]), *rows])


def _patches(
    model: Model, links: tuple[Link, ...], root_R_base: FloatArray, scale: float
) -> list[Patch]:
    """What is seen of some links, turned and scaled, duplicates left out."""
    found: dict[bytes, Patch] = {}
    for link in links:
        for visual in link.visuals:
            T = link.base_T_link @ visual.link_T_visual
            R, t = root_R_base @ T[:3, :3], root_R_base @ T[:3, 3]
            shape, who = visual.shape, f"link {link.name!r} of {model.files[0]}"
            for patch in read_mesh(shape, who) if isinstance(shape, MeshFile) else shape:
                corners = scale * (patch.corners @ R.T + t)
                found.setdefault(corners.tobytes(), replace(patch, corners=corners))
    return list(found.values())


def _check_size(model: Model, parts: Parts) -> None:
    corners = np.concatenate([p.corners.reshape(-1, 3) for part in parts for p in part])
    size = float(np.ptp(corners, axis=0).max())
    if not SMALLEST < size < LARGEST:
        raise InputError(
            f"{model.files[0]}: the object is {size:.3g} m across; if its unit is not the metre, "
            "say how many metres it has: --scale 0.001 for millimetres"
        )


def _by_place(frame: Skeleton, parts: Parts) -> tuple[Skeleton, Parts]:
    """Siblings by what they are, from top to bottom, from left to right."""
    bodies = [frame.root, *(joint.child for joint in frame.joints)]
    corners = [np.concatenate([p.corners.reshape(-1, 3) for p in part]) for part in parts]
    center = np.stack([(c.min(axis=0) + c.max(axis=0)) / 2 for c in corners])
    extent = np.ptp(np.concatenate(corners), axis=0).max()
    rank = np.round(center / (0.02 * extent)).astype(int)

    def place(joint: ModelJoint) -> tuple[str, str, int, int]:
        x, y, _ = rank[bodies.index(joint.child)].tolist()
        return _label(frame.links[joint.child]), joint.kind, -y, x

    below = {
        body: sorted((j for j in frame.joints if j.parent == body), key=place) for body in bodies
    }
    joints, front = [], [frame.root]
    for body in front:  # grows while it is walked along
        joints += below[body]
        front += [joint.child for joint in below[body]]
    return replace(frame, joints=tuple(joints)), [parts[bodies.index(body)] for body in front]


def _label(links: tuple[Link, ...]) -> str:
    """What a body is called: by its first link that is seen."""
    link = next((link for link in links if link.visuals), links[0])
    return link.label or link.name


def _names(model: Model, frame: Skeleton, order: list[str]) -> tuple[str, ...]:
    labels = [_label(frame.links[body]) for body in order]
    if not model.by_place:
        return tuple(labels)
    count = {label: labels.count(label) for label in labels}
    return tuple(
        f"{label}_{labels[: k + 1].count(label)}" if count[label] > 1 else label
        for k, label in enumerate(labels)
    )


def _surfaces(parts: Parts, budget: int) -> list[list[Surface]]:
    patches = [patch for part in parts for patch in part]
    kept = iter(shares([area(p) for p in patches], [len(p.corners) for p in patches], budget))
    few = [[surface(simplified(patch, next(kept))) for patch in part] for part in parts]
    return [[s for s in part if s is not None] for part in few]


def _center(surfaces: list[Surface]) -> FloatArray:
    vertices = np.concatenate([s.vertices for s in surfaces])
    return (vertices.min(axis=0) + vertices.max(axis=0)) / 2


def _joint(
    model: Model,
    joint: ModelJoint,
    parent: int,
    root_R_base: FloatArray,
    scale: float,
    center: FloatArray,
) -> Joint:
    if joint.kind == "prismatic" and joint.limits is None:
        raise InputError(
            f"{model.files[0]}: joint {joint.name!r} slides without limits; give it some there, "
            f"or hold it still: --fix {joint.name}"
        )
    axis = root_R_base @ joint.axis
    pivot = scale * (root_R_base @ joint.pivot) - center
    lower, upper = as_joint(joint).limits
    per_state = scale if joint.kind == "prismatic" else 1.0
    return replace(
        as_joint(joint, parent),
        axis=triple(axis / np.linalg.norm(axis)),
        pivot=triple(pivot),
        limits=(lower * per_state, upper * per_state),
    )


def _link_poses(
    frame: Skeleton, order: list[str], root_T_base: FloatArray, scale: float
) -> dict[str, tuple[int, FloatArray]]:
    poses = {}
    for part, body in enumerate(order):
        for link in frame.links[body]:
            base_T_link = link.base_T_link.copy()
            base_T_link[:3, 3] *= scale
            poses[link.name] = (part, root_T_base @ base_T_link)
    return poses


def _follows(frame: Skeleton, joints: tuple[Joint, ...], scale: float) -> tuple[Follows, ...]:
    place = {joint.name: k for k, joint in enumerate(frame.joints)}
    unit = [scale if joint.kind == "prismatic" else 1.0 for joint in joints]
    return tuple(
        Follows(
            follower=k,
            leader=place[rule.leader],
            multiplier=rule.multiplier * unit[k] / unit[place[rule.leader]],
            offset=rule.offset * unit[k],
        )
        for k, rule in enumerate(joint.mimic for joint in frame.joints)
        if rule is not None and rule.leader in place
    )
