"""Photos of one robot arm, in the form of ReArt, its arm as a URDF file.

    ARM.urdf (or urdf/ARM.urdf), with its meshes
    camera_intrinsic.json, annotations/, color/, depth/     see `r2art.data.adapters.reart`

The RobotArm set of the paper is not public; this reads any set in this form. Links that no joint
moves against each other are one part; an annotation's ``transformation`` is the pose of the first
of them that is seen. ``link_category_id`` counts parts in the order of the
URDF's tree, from 0 or from 1. See docs/datasets.md.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from r2art.core.errors import InputError
from r2art.data.adapters.convention import Convention, convention_of
from r2art.data.adapters.links import SPLITS, check_split
from r2art.data.adapters.model import Model, model
from r2art.data.adapters.reart import ReArt, Shot, find_sets, frames, listed
from r2art.data.models.build import Built, Reading, build
from r2art.data.models.model import Model as UrdfModel
from r2art.data.models.urdf import read_urdf
from r2art.data.shape import Surface
from r2art.data.source import Fault

FloatArray = NDArray[np.floating]
NAME = "robot_arm"
ROS = Convention(up="+z", front="+x", flip=())
POINTS = 4096  # on each part


@dataclass(frozen=True)
class Arm:
    """The arm of a URDF file."""

    path: Path
    convention: Convention

    @cached_property
    def built(self) -> Built:
        """The arm in our root frame, every joint at zero.

        Raises:
            Fault: The file, or a mesh of it, is missing or damaged.
        """
        c = self.convention
        reading = Reading(fix=c.fix, up=c.up, front=c.front, scale=c.unit)
        try:
            return build(self._urdf, reading)
        except InputError as error:
            raise Fault(str(self.path), "", str(error)) from None

    @cached_property
    def _urdf(self) -> UrdfModel:
        try:
            return read_urdf(self.path)
        except InputError as error:
            raise Fault(str(self.path), "", str(error)) from None

    @cached_property
    def _model(self) -> Model:
        instance = self.built.instance
        seen = {link.name for link in self._urdf.links if link.visuals}
        poses = [pose for name, pose in self.built.links.items() if name in seen]
        first = dict(reversed(poses))  # by part, of its first link
        links = [first[part] for part in range(len(instance.parts))]
        return model(
            instance.joints,
            np.stack(links),
            [_to_link(T, _sampled(p)) for T, p in zip(links, instance.parts, strict=True)],
            replace(self.convention, up="+y", front="+z"),
        )

    def has(self, object_id: int) -> bool:
        """It is the one arm, whatever number annotations give it."""
        return True

    def model(self, object_id: int) -> Model:
        """The arm at rest, whatever number annotations give it.

        Raises:
            Fault: The file, or a mesh of it, is missing or damaged.
        """
        return self._model


def open_robotarm(
    folder: Path,
    category: str | None = None,
    split: str | None = None,
    convention: Convention | None = None,
) -> ReArt:
    """Open the photos of a robot arm.

    Args:
        folder: With a URDF file and one or more sets of photos.
        category: What to call the arm; ``"robot_arm"``.
        split: ``"train"``, ``"test"``, or None for all; told by the names of the sets or by
            their lists.
        convention: How to read it; default: what its ``r2art.json`` says.

    Raises:
        InputError: There is no such split or photo, or `Fault` if a file that all need is wrong.
    """
    check_split(split)
    name = category or NAME
    convention = convention or convention_of((folder,), name, ROS)
    if convention.order:
        raise InputError("a robot arm's parts are in the order of its joints; leave out order")
    arm = Arm(find_urdf(folder), convention)
    names = arm.built.instance.part_names
    convention.check(len(names))
    sets = find_sets(folder)
    train, test = (tuple(s for home in sets for s in _shots(home, split)) for split in SPLITS)
    chosen = {"train": train, "test": test, None: (*train, *test)}[split]
    if not chosen:
        raise InputError(f"{folder} shows no photo of split {split or 'train or test'}")
    counts = tuple(range(1, len(names) + 1)), tuple(range(len(names)))
    return ReArt(name, names, counts, arm, chosen, train)


def find_urdf(folder: Path) -> Path:
    """The one URDF file of a folder, or of its folder ``urdf``.

    Raises:
        InputError: There is none, or several.
    """
    for pattern in ("*.urdf", "urdf/*.urdf"):
        found = sorted(folder.glob(pattern))
        if len(found) == 1:
            return found[0]
        if found:
            names = ", ".join(path.name for path in found)
            raise InputError(f"{folder} holds several arms ({names}); leave one")
    raise InputError(f"{folder} holds no URDF file")


def _shots(home: Path, split: str) -> list[Shot]:
    if any((home / f"{s}.txt").exists() for s in SPLITS):
        return listed(home, split) or []
    is_test = any(word in home.name for word in ("val", "test"))
    return [Shot(home, path) for path in frames(home)] if is_test == (split == "test") else []


def _sampled(surfaces: tuple[Surface, ...]) -> FloatArray:
    """(N, 3) the vertices of a part, and points spread evenly over its triangles."""
    rng = np.random.default_rng(0)
    corners = np.concatenate([s.vertices[s.faces] for s in surfaces])
    edges = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.linalg.norm(np.cross(*edges), axis=1)
    chosen = rng.choice(len(corners), POINTS, p=area / area.sum())
    weights = rng.dirichlet((1, 1, 1), POINTS)
    on_faces = (weights[:, :, None] * corners[chosen]).sum(axis=1)
    vertices = np.unique(np.concatenate([s.vertices for s in surfaces]), axis=0)
    return np.concatenate([vertices, on_faces])


def _to_link(root_T_link: FloatArray, points: FloatArray) -> FloatArray:
    return (points - root_T_link[:3, 3]) @ root_T_link[:3, :3]
