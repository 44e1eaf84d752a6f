"""The real photos of OP-Align (Che et al., ECCV 2024): one ``.npz`` a frame.

    CATEGORY_output/SPLIT/OBJECT/SCENE/.../*.npz, each with
        pc            (480 * 640, 3) what every pixel sees, in the camera's frame; 0 0 0: nothing
        color         (480 * 640, 3) RGB, 0 to 1 (or 0 to 255)
        segmentation  (480 * 640,) 0 background, k + 1 part k
        part          (P, 15) of each part's box: rotation (row-major), centre, extents
        joint         (J, 6) a point on the axis and the direction, or the other way round

Each file is a pickled dictionary; it is read without running anything that a pickle may hold.
Intrinsics are not stored: they are recovered from the points. Joint states are not stored: they
are measured between the boxes, whose axes agree at state 0. See docs/datasets.md.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Category, Joint, JointKind
from r2art.core.errors import InputError
from r2art.data.adapters.convention import Convention, convention_of
from r2art.data.adapters.gathering import Gathering, Glance, glances
from r2art.data.adapters.labels import labelled
from r2art.data.adapters.links import SPLITS, check_split
from r2art.data.adapters.model import Model, flipped, measured_state, triple
from r2art.data.adapters.opalign_frame import Frame, read_frame
from r2art.data.adapters.prior import frontal_area
from r2art.data.pose import root_T_part
from r2art.data.sample import Sample
from r2art.data.source import Fault

FloatArray = NDArray[np.floating]
SUFFIX = "_output"
Names = tuple[tuple[str, ...], tuple[str, ...], JointKind]
NAMES: dict[str, Names] = {
    "laptop": (("base", "lid"), ("hinge",), "revolute"),
    "drawer": (("cabinet", "drawer"), ("slide",), "prismatic"),
    "suitcase": (("base", "lid"), ("hinge",), "revolute"),
    "scissor": (("blade_1", "blade_2"), ("pivot",), "revolute"),
    "basket": (("basket", "handle_1", "handle_2"), ("hinge_1", "hinge_2"), "revolute"),
}
OFF_AXIS = np.radians(20)  # by which a part may be turned otherwise than about its joint's axis


@dataclass(frozen=True)
class OPAlign:
    """A split of a category, a `r2art.data.source.Source`; see `open_opalign`.

    Attributes:
        name: Of the category.
        convention: How it is read.
        files: Of this split ...
        training: ... and of the training split.
    """

    name: str
    convention: Convention
    files: tuple[Path, ...]
    training: tuple[Path, ...]

    def __len__(self) -> int:
        return len(self.files)

    def file(self, index: int) -> str:
        """The file of a sample."""
        return str(self.files[index])

    @property
    def category(self) -> Category:
        """The mean of the training photos' boxes.

        Raises:
            Fault: None of them can be read.
        """
        return self._category

    @cached_property
    def _category(self) -> Category:
        return self._gathering.category(self.name, NAMES[self.name][0])

    def __getitem__(self, index: int) -> Sample:
        """One labelled photo.

        Raises:
            Fault: Its file is wrong.
        """
        path = self.files[index]
        frame, order = self._frame(path)
        flip = self._gathering.flip(self._object(path), len(order) - 1)
        cam_T_part, joint_state, model = self._posed(path, frame, flip)
        label = np.zeros(len(order) + 1, np.uint8)
        label[np.array(order) + 1] = np.arange(1, len(order) + 1)
        mask = label[frame.labels]
        v, u = np.nonzero(mask)
        return labelled(
            model,
            image=frame.image,
            mask=mask,
            depth=frame.depth * self.convention.unit,
            camera=frame.camera,
            box=np.array([u.min(), v.min(), u.max() + 1, v.max() + 1], float),
            cam_T_part=cam_T_part,
            joint_state=joint_state,
        )

    @cached_property
    def _gathering(self) -> Gathering:
        train = glances(self.training, self._look)
        own = () if self.files == self.training else glances(self.files, self._look)
        return Gathering(self._any_of, self.convention, train, own)

    @cached_property
    def _folders(self) -> list[Path]:
        return list(dict.fromkeys(path.parent for path in (*self.training, *self.files)))

    def _object(self, path: Path) -> int:
        """Objects are told apart by folder."""
        return self._folders.index(path.parent)

    def _any_of(self, object_id: int) -> Model:
        """The object of a folder, from the first of its files that can be read."""
        fault = None
        for path in (*self.training, *self.files):
            if path.parent == self._folders[object_id]:
                try:
                    frame, order = self._frame(path)
                    return self._posed(path, frame, (False,) * (len(order) - 1))[2]
                except Fault as found:
                    fault = found
        raise fault or Fault(str(self._folders[object_id]), "", "holds no frame")

    def _look(self, path: Path) -> Glance:
        frame, order = self._frame(path)
        poses, state, _ = self._posed(path, frame, (False,) * (len(order) - 1))
        v, u = np.nonzero(frame.labels)
        box = np.array([u.min(), v.min(), u.max() + 1, v.max() + 1])
        return Glance(self._object(path), state, frontal_area(frame.camera, box, poses[0, 2, 3]))

    def _frame(self, path: Path) -> tuple[Frame, list[int]]:
        parts = len(NAMES[self.name][0])
        return read_frame(path, parts), self.convention.links(parts)

    def _posed(
        self, path: Path, frame: Frame, flip: tuple[bool, ...]
    ) -> tuple[FloatArray, FloatArray, Model]:
        """Part poses, joint states, and the object as this frame has it."""
        order = self.convention.links(len(frame.size))
        R = self.convention.rotation()
        cam_T_box = frame.cam_T_box[order]
        cam_T_box[:, :3, :3] = cam_T_box[:, :3, :3] @ R.T
        cam_T_box[:, :3, 3] *= self.convention.unit
        joints = flipped(self._joints(frame, order, cam_T_box[0]), flip)
        sign = np.where(flip, -1.0, 1.0)
        closed = sign * self.convention.closed_state(len(joints))
        joint_state = measured_state(joints, cam_T_box) - closed
        cam_T_part = cam_T_box[0] @ root_T_part(joints, joint_state)
        part_T_box = np.linalg.inv(cam_T_part) @ cam_T_box
        self._check(path, joints, order, cam_T_box)
        size = frame.size[order] * self.convention.unit @ np.abs(R).T
        model = Model(
            joints=joints,
            part_T_link=part_T_box,
            points=None,
            box_center=part_T_box[:, :3, 3],
            box_size=np.stack([_extent(T, s) for T, s in zip(part_T_box, size, strict=True)]),
            sign=sign,
        )
        return cam_T_part, joint_state, model

    def _joints(self, frame: Frame, order: list[int], cam_T_root: FloatArray) -> tuple[Joint, ...]:
        """Joint j of a file moves its part j + 1 against its part 0."""
        _, names, kind = NAMES[self.name]
        R, t = cam_T_root[:3, :3], cam_T_root[:3, 3]
        row = [max(link, order[0]) - 1 for link in order[1:]]
        return tuple(
            Joint(
                name=name,
                kind=kind,
                parent=0,
                axis=triple(R.T @ frame.direction[j]),
                pivot=triple(R.T @ (self.convention.unit * frame.point[j] - t)),
                limits=(0.0, 0.0),
            )
            for name, j in zip(names, row, strict=True)
        )

    def _check(
        self, path: Path, joints: tuple[Joint, ...], order: list[int], cam_T_box: FloatArray
    ) -> None:
        expected = root_T_part(joints, measured_state(joints, cam_T_box))[1:, :3, :3]
        found = cam_T_box[0, :3, :3].T @ cam_T_box[1:, :3, :3]
        cosine = (np.einsum("jab,jab->j", expected, found) - 1) / 2
        for j, angle in enumerate(np.arccos(np.clip(cosine, -1, 1))):
            if angle > OFF_AXIS:
                problem = f"is turned {np.degrees(angle):.0f}° otherwise than about its joint"
                raise Fault(str(path), f"part[{order[j + 1]}]", problem)


def _extent(part_T_box: FloatArray, size: FloatArray) -> FloatArray:
    """(3,) extents along the part's axes of a box that is turned a little, or by right angles."""
    turn = np.abs(part_T_box[:3, :3])
    straight = np.round(turn)
    if (straight.sum(axis=0) == 1).all() and np.abs(turn - straight).max() < 0.3:
        turn = straight
    return turn @ size


def open_opalign(
    folder: Path,
    category: str | None = None,
    split: str | None = None,
    convention: Convention | None = None,
) -> OPAlign:
    """Open a category of OP-Align.

    Args:
        folder: The dataset, or the folder of one category.
        category: Its name; needed if the dataset holds several.
        split: ``"train"``, ``"test"``, or None for both.
        convention: How to read it; default: what its ``r2art.json`` says.

    Raises:
        InputError: There is no such category, split or photo.
    """
    check_split(split)
    home = _home(folder, category)
    name = home.name.removesuffix(SUFFIX)
    convention = convention or convention_of((home, home.parent), name)
    convention.check(len(NAMES[name][0]))
    train, test = (tuple(sorted((home / s).rglob("*.npz"))) for s in SPLITS)
    chosen = {"train": train, "test": test, None: (*train, *test)}[split]
    if not chosen:
        raise InputError(f"{home} holds no .npz file of split {split or 'train or test'}")
    return OPAlign(name, convention, chosen, train)


def is_category(folder: Path) -> bool:
    """Whether a folder looks like a category of OP-Align."""
    known = folder.name.removesuffix(SUFFIX) in NAMES
    return known and any((folder / s).is_dir() for s in SPLITS) and _has_frames(folder)


def _has_frames(folder: Path) -> bool:
    return next((path for s in SPLITS for path in (folder / s).rglob("*.npz")), None) is not None


def _home(folder: Path, category: str | None) -> Path:
    name = folder.name.removesuffix(SUFFIX)
    if is_category(folder) and category in (None, name):
        return folder
    homes = {p.name.removesuffix(SUFFIX): p for p in sorted(folder.glob("*")) if is_category(p)}
    if category is None and len(homes) == 1:
        return next(iter(homes.values()))
    if category not in homes:
        known = ", ".join(homes) or "none"
        raise InputError(f"{folder}: give one of its categories with --category: {known}")
    return homes[category]
