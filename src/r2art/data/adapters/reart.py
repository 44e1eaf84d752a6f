"""Photos in the form of ReArt: JSON annotations with COCO polygons beside colour and depth.

    SET/annotations/SCENE/[VIDEO/]FRAME.json
    SET/color/SCENE/[VIDEO/]FRAME.jpg        or what the annotation's color_path says
    SET/depth/SCENE/[VIDEO/]FRAME.png        or its depth_path; millimetres
    camera_intrinsic.json                    in SET or above it, or
    SET/camera_intrinsic/SCENE/camera_intrinsic.json, one for each scene

A frame shows several instances; each makes a sample of its own.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.category import Category
from r2art.data.adapters.camera import read_camera
from r2art.data.adapters.convention import Convention
from r2art.data.adapters.gathering import Gathering, Glance, glances
from r2art.data.adapters.images import polygon_mask, read_color, read_depth
from r2art.data.adapters.labels import labelled, read_box
from r2art.data.adapters.links import check_size, leading_to, links_by_part, relative
from r2art.data.adapters.model import Model, measured_state
from r2art.data.adapters.prior import frontal_area
from r2art.data.adapters.reading import Node, exists, read_json, read_lines
from r2art.data.sample import Sample
from r2art.data.source import Fault

FloatArray = NDArray[np.floating]
CAMERA = "camera_intrinsic.json"
ANNOTATIONS = "annotations"


class Objects(Protocol):
    """Where the objects of annotations are described."""

    @property
    def path(self) -> Path:
        """The file."""
        ...

    @property
    def convention(self) -> Convention:
        """How the dataset is read."""
        ...

    def has(self, object_id: int) -> bool:
        """Whether an object is described.

        Raises:
            Fault: It cannot be told.
        """
        ...

    def model(self, object_id: int) -> Model:
        """An object at its rest, its joints as the dataset has them.

        Raises:
            Fault: It is described wrongly.
        """
        ...


@dataclass(frozen=True)
class Shot:
    """An instance in a frame.

    Attributes:
        folder: The set's.
        path: The annotation.
        instance: Its place among the annotation's instances.
        listed: The list that names it, if there is one.
    """

    folder: Path
    path: Path
    instance: int = 0
    listed: Path | None = None

    @property
    def scene(self) -> Path:
        """Folder of the frame below ``annotations``."""
        return self.path.parent.relative_to(self.folder / ANNOTATIONS)


@dataclass(frozen=True)
class ReArt:
    """A split of a category, a `r2art.data.source.Source`.

    Attributes:
        name: Of the category.
        part_names: P names.
        numberings: For each way in which annotations count links, the link of each of our parts.
        objects: The objects.
        shots: Of this split ...
        training: ... and of the training split.
        category_id: That every instance must have; None: any, or none.
    """

    name: str
    part_names: tuple[str, ...]
    numberings: tuple[tuple[int, ...], ...]
    objects: Objects
    shots: tuple[Shot, ...]
    training: tuple[Shot, ...]
    category_id: int | None = None

    def __len__(self) -> int:
        return len(self.shots)

    def file(self, index: int) -> str:
        """The annotation of a sample, and the place of the instance in it."""
        shot = self.shots[index]
        return f"{shot.path}, instance {shot.instance}"

    @property
    def category(self) -> Category:
        """The mean of the training objects.

        Raises:
            Fault: None of them can be read.
        """
        return self._category

    @cached_property
    def _category(self) -> Category:
        return self._gathering.category(self.name, self.part_names)

    def __getitem__(self, index: int) -> Sample:
        """One labelled photo.

        Raises:
            Fault: Its annotation, one of its images or its object's description is wrong.
        """
        shot = self.shots[index]
        node, instance, links = self._annotation(shot)
        camera = self._camera(shot, node)
        model = self._gathering.model(self._object(instance))
        cam_T_part = self._poses(links, model)
        mask = np.zeros((camera.height, camera.width), np.uint8)
        for part, link in enumerate(links):
            mask[polygon_mask(link["segmentation"], camera.height, camera.width)] = part + 1
        with self._image(shot, node, "color", (".jpg", ".png")) as path:
            image = read_color(path, camera)
        with self._image(shot, node, "depth", (".png",)) as path:
            depth = read_depth(path, camera)
        return labelled(
            model,
            image=image,
            mask=mask,
            depth=self.objects.convention.unit * depth,
            camera=camera,
            box=read_box(instance["bbox"], mask),
            cam_T_part=cam_T_part,
            joint_state=measured_state(model.joints, cam_T_part),
        )

    @contextmanager
    def _image(
        self, shot: Shot, node: Node, kind: str, suffixes: tuple[str, ...]
    ) -> Iterator[Path]:
        """Where an image is: as the annotation says, below the set or its folder of that kind."""
        home, named = shot.folder / kind, node.get(f"{kind}_path")
        if named is None:
            paths = [home / shot.scene / (shot.path.stem + suffix) for suffix in suffixes]
            yield next((path for path in paths if exists(path)), paths[0])
            return
        with leading_to(named):
            paths = [home / relative(named), shot.folder / relative(named)]
            yield next((path for path in paths if exists(path)), paths[0])

    @cached_property
    def _gathering(self) -> Gathering:
        train = glances(self.training, self._look)
        own = () if self.shots == self.training else glances(self.shots, self._look)
        return Gathering(self.objects.model, self.objects.convention, train, own)

    def _look(self, shot: Shot) -> Glance:
        node, instance, links = self._annotation(shot)
        object_id = self._object(instance)
        model = self.objects.model(object_id)
        poses = self._poses(links, model)
        box = instance["bbox"].array(4)
        area = frontal_area(self._camera(shot, node), box, poses[0, 2, 3])
        return Glance(object_id, measured_state(model.joints, poses), area)

    def _annotation(self, shot: Shot) -> tuple[Node, Node, list[Node]]:
        """All of an annotation, its instance and that one's links."""
        if shot.listed is not None and not exists(shot.path):
            name = f"{shot.scene.as_posix()}/{shot.path.stem}"
            raise Fault(str(shot.listed), name, f"is named, but {shot.path} is missing")
        node = read_json(shot.path)
        instances = node["instances"].items()
        if shot.instance >= len(instances):
            raise node["instances"].fault(f"has no entry {shot.instance}")
        instance = instances[shot.instance]
        if self.category_id is not None:
            number = instance["category_id"]
            if number.whole() != self.category_id:
                raise number.fault(f"is {number.value}, but a {self.name} is {self.category_id}")
        return node, instance, links_by_part(instance, self._part_of(instance))

    def _object(self, instance: Node) -> int:
        """The ``urdf_id`` of an instance; 0 where there is only one object and so none."""
        number = instance.get("urdf_id")
        if number is None and self.category_id is None:
            return 0
        number = instance["urdf_id"]
        if not self.objects.has(number.whole()):
            raise number.fault(f"is {number.value}, but {self.objects.path} has no such object")
        return number.whole()

    def _part_of(self, instance: Node) -> Mapping[int, int]:
        """Our part of every link, by the numbering that the instance's links are of."""
        numbers = {link["link_category_id"].whole() for link in instance["links"].items()}
        fitting = (n for n in self.numberings if numbers <= set(n))
        links = next(fitting, self.numberings[0])
        return {link: part for part, link in enumerate(links)}

    def _camera(self, shot: Shot, node: Node) -> Camera:
        scene = shot.folder / "camera_intrinsic" / shot.scene.parts[0] if shot.scene.parts else None
        places = [scene, shot.folder, shot.folder.parent]
        paths = [place / CAMERA for place in places if place is not None]
        path = next((p for p in paths if p.exists()), shot.folder.parent / CAMERA)
        camera = read_camera(path, first_center=0.0)
        check_size(node, camera)
        return camera

    def _poses(self, links: Sequence[Node], model: Model) -> FloatArray:
        cam_T_link = np.stack([link["transformation"].rigid() for link in links])
        cam_T_link[:, :3, 3] *= self.objects.convention.unit
        return cam_T_link @ np.linalg.inv(model.part_T_link)


def find_sets(folder: Path) -> list[Path]:
    """The folders with ``annotations``: the folder itself, or those up to two levels below."""
    for pattern in (ANNOTATIONS, f"*/{ANNOTATIONS}", f"*/*/{ANNOTATIONS}"):
        if found := sorted(p.parent for p in folder.glob(pattern) if p.is_dir()):
            return found
    return []


def frames(home: Path) -> list[Path]:
    """All annotations of a set."""
    return sorted((home / ANNOTATIONS).rglob("*.json"))


def listed(home: Path, split: str) -> list[Shot] | None:
    """The shots that ``SPLIT.txt`` names, ``SCENE/[VIDEO/]FRAME_INSTANCE.h5`` a line; or None.

    Raises:
        Fault: The list holds anything else.
    """
    path = home / f"{split}.txt"
    if not path.exists():
        return None
    shots = []
    for number, line in enumerate(read_lines(path), start=1):
        place, _, instance = line.rpartition(".")[0].rpartition("_")
        if not (place and instance.isdecimal()) or ".." in line:
            raise Fault(str(path), f"line {number}", f"must be SCENE/FRAME_INSTANCE.h5, is {line}")
        annotation = home / ANNOTATIONS / f"{place}.json"
        shots.append(Shot(home, annotation, int(instance), path))
    return shots
