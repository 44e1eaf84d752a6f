"""ArtImage: Unity renderings of PartNet-Mobility objects, published with OMAD (BMVC 2021).

    camera_intrinsic.json
    CATEGORY/train.txt, test.txt              names of annotations, one a line
    CATEGORY/train/annotations/*.json         of both splits; or train/VIDEO/annotations/*.json
    CATEGORY/train/COLOR, DEPTH               as the annotation names them; or train/VIDEO/...
    CATEGORY/urdf/                            the objects, see `artimage_model`

A mask lies where its depth image does, "depth" in the path replaced by "category_mask". It holds
the link's number; the background is where the depth is 0. Depth counts millimetres of the
objects' own unit, which is not that of the real things. See docs/datasets.md.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.category import Category
from r2art.core.errors import InputError
from r2art.data.adapters.artimage_model import Objects, read_states
from r2art.data.adapters.camera import read_camera
from r2art.data.adapters.convention import Convention, convention_of
from r2art.data.adapters.gathering import Gathering, Glance, glances
from r2art.data.adapters.images import read_color, read_depth, read_labels
from r2art.data.adapters.labels import labelled, read_box
from r2art.data.adapters.links import check_size, check_split, leading_to, links_by_part, relative
from r2art.data.adapters.model import Model
from r2art.data.adapters.prior import frontal_area
from r2art.data.adapters.reading import Node, exists, read_json, read_lines
from r2art.data.sample import BACKDROP, Sample
from r2art.data.source import Fault

FloatArray = NDArray[np.floating]
CAMERA = "camera_intrinsic.json"
Names = tuple[tuple[str, ...], tuple[str, ...]]
NAMES: dict[str, Names] = {
    "laptop": (("base", "lid"), ("hinge",)),
    "eyeglasses": (("frame", "temple_1", "temple_2"), ("hinge_1", "hinge_2")),
    "dishwasher": (("body", "door"), ("hinge",)),
    "drawer": (("cabinet", "drawer_1", "drawer_2", "drawer_3"), ("slide_1", "slide_2", "slide_3")),
    "scissors": (("blade_1", "blade_2"), ("pivot",)),
}
"""Names of the parts and joints, in the order of the dataset's links."""
TEST_OBJECTS = {
    "laptop": {10040, 10885, 11242, 11030, 11156},
    "eyeglasses": {101300, 101859, 102586, 102590, 102596, 102612},
    "dishwasher": {11700, 12530, 12559, 12580},
    "drawer": {46123, 45841, 46440},
    "scissors": {10449, 10502, 10569, 10907},
}


@dataclass(frozen=True)
class Photo:
    """One annotated photo.

    Attributes:
        path: Its annotation.
        images: The folder from which the annotation names the images.
        listed: The list that names it.
    """

    path: Path
    images: Path
    listed: Path


@dataclass(frozen=True)
class ArtImage:
    """A split of a category, a `r2art.data.source.Source`; see `open_artimage`.

    Attributes:
        name: Of the category.
        part_names: P names.
        camera: Of all photos.
        objects: Its objects.
        photos: Of this split ...
        training: ... and of the training split.
    """

    name: str
    part_names: tuple[str, ...]
    camera: Camera
    objects: Objects
    photos: tuple[Photo, ...]
    training: tuple[Photo, ...]

    def __len__(self) -> int:
        return len(self.photos)

    def file(self, index: int) -> str:
        """The annotation of a sample."""
        return str(self.photos[index].path)

    @property
    def category(self) -> Category:
        """The mean of the training objects, its sizes in the dataset's unit.

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
            Fault: Its annotation, one of its images or its object's files are wrong.
        """
        photo = self.photos[index]
        urdf_id, instance, links, node = self._annotation(photo)
        model = self._gathering.model(urdf_id)
        color_path, depth_path = node["color_path"], node["depth_path"]
        with leading_to(color_path):
            image = read_color(photo.images / relative(color_path), self.camera)
        with leading_to(depth_path):
            depth = read_depth(photo.images / relative(depth_path), self.camera)
            mask = self._mask(photo, depth_path, depth)
        return labelled(
            model,
            image=image,
            mask=mask,
            depth=depth * self.objects.convention.unit,
            camera=self.camera,
            box=read_box(instance["bbox"], mask),
            cam_T_part=self._poses(links, model),
            joint_state=model.sign * self.objects.joint_state(urdf_id, read_states(links)),
        )

    @cached_property
    def _gathering(self) -> Gathering:
        train = glances(self.training, self._look)
        own = () if self.photos == self.training else glances(self.photos, self._look)
        return Gathering(self.objects.model, self.objects.convention, train, own)

    def _look(self, photo: Photo) -> Glance:
        urdf_id, instance, links, _ = self._annotation(photo)
        z = self._poses(links, self.objects.model(urdf_id))[0, 2, 3]
        area = frontal_area(self.camera, instance["bbox"].array(4), z)
        return Glance(urdf_id, self.objects.joint_state(urdf_id, read_states(links)), area)

    def _annotation(self, photo: Photo) -> tuple[int, Node, list[Node], Node]:
        """Object, instance and links of an annotation, and all of it."""
        if not exists(photo.path):
            raise Fault(str(photo.listed), photo.path.name, f"is named, but {photo.path} missing")
        node = read_json(photo.path)
        check_size(node, self.camera)
        (instance,) = node["instances"].items(1)
        number = instance["urdf_id"]
        folder = self.objects.of(number.whole())
        if not folder.is_dir():
            raise number.fault(f"there is no object {folder}")
        part_of = {link: part for part, link in enumerate(self._links)}
        return number.whole(), instance, links_by_part(instance, part_of), node

    @property
    def _links(self) -> list[int]:
        return self.objects.convention.links(len(self.part_names))

    def _poses(self, links: list[Node], model: Model) -> FloatArray:
        cam_T_link = np.stack([link["transformation"].rigid() for link in links])
        cam_T_link[:, :3, 3] *= self.objects.convention.unit
        return cam_T_link @ np.linalg.inv(model.part_T_link)

    def _mask(self, photo: Photo, depth_path: Node, depth: FloatArray) -> NDArray[np.uint8]:
        """Our mask: part + 1, or `BACKDROP` where there is no depth."""
        name = relative(depth_path).as_posix()
        if "depth" not in name:
            raise depth_path.fault('must contain "depth", which leads to the mask')
        path = photo.images / name.replace("depth", "category_mask")
        links = read_labels(path, self.camera)
        label = np.zeros(256, np.uint8)
        label[self._links] = np.arange(1, len(self._links) + 1)
        mask = np.where(depth > 0, label[links], BACKDROP).astype(np.uint8)
        if (odd := links[mask == 0]).size:
            raise Fault(str(path), "", f"holds link {odd[0]}; they are 0 to {len(self._links) - 1}")
        return mask


def open_artimage(
    folder: Path,
    category: str | None = None,
    split: str | None = None,
    convention: Convention | None = None,
) -> ArtImage:
    """Open a category of ArtImage.

    Args:
        folder: The dataset, or the folder of one category.
        category: Its name; needed if the dataset holds several.
        split: ``"train"``, ``"test"``, or None for both.
        convention: How to read it; default: what its ``r2art.json`` says.

    Raises:
        InputError: There is no such category, split or photo, or `Fault` if a file that all
            photos need is wrong.
    """
    check_split(split)
    home = _category_folder(folder, category)
    camera_file = next((f for f in (home / CAMERA, home.parent / CAMERA) if f.exists()), None)
    camera = read_camera(camera_file or home.parent / CAMERA, first_center=0.5)
    convention = convention or convention_of((home, home.parent), home.name)
    part_names, joint_names = NAMES.get(home.name) or _plain_names(home / "urdf")
    convention.check(len(part_names))
    lists = {s: _photos(home, s) for s in ("train", "test") if (home / f"{s}.txt").exists()}
    photos = [p for s, listed in lists.items() if split in (s, None) for p in listed]
    if not photos:
        raise InputError(f"{home}: no photo of split {split or 'train or test'} is listed")
    objects = Objects(home / "urdf", home.name, joint_names, convention)
    training = tuple(lists.get("train", ()))
    return ArtImage(home.name, part_names, camera, objects, tuple(photos), training)


def _category_folder(folder: Path, category: str | None) -> Path:
    if is_category(folder) and category in (None, folder.name):
        return folder
    found = sorted(p.name for p in folder.iterdir() if is_category(p)) if folder.is_dir() else []
    if category is None and len(found) == 1:
        return folder / found[0]
    if category not in found:
        known = ", ".join(found) or "none"
        raise InputError(f"{folder}: give one of its categories with --category: {known}")
    return folder / category


def is_category(folder: Path) -> bool:
    """Whether a folder looks like a category of ArtImage."""
    listed = (folder / "train.txt").exists() or (folder / "test.txt").exists()
    return listed and (folder / "train").is_dir() and (folder / "urdf").is_dir()


def _plain_names(urdf: Path) -> Names:
    """Names for a category that is not of the published ones, by the number of its links."""
    objects = sorted(p for p in urdf.iterdir() if p.is_dir())
    parts = len(list((objects[0] / "part_point_sample").glob("*.xyz"))) if objects else 0
    if parts < 2:
        raise InputError(f"{urdf}: no object with a part_point_sample of two links or more")
    return tuple(f"part_{k}" for k in range(parts)), tuple(f"joint_{k}" for k in range(1, parts))


def _photos(home: Path, split: str) -> list[Photo]:
    """The photos that a list names and whose objects are of its split."""
    listed = home / f"{split}.txt"
    flat = home / "train" / "annotations"
    videos = [flat.parent] if flat.is_dir() else sorted(p for p in flat.parent.iterdir())
    photos = []
    for name in dict.fromkeys(read_lines(listed)):
        file = name if name.endswith(".json") else f"{name}.json"
        found = [Photo(v / "annotations" / file, v, listed) for v in videos]
        there = [p for p in found if exists(p.path)]
        photos += there or found[:1]
    return [p for p in photos if _is_of(p, home.name, split)]


def _is_of(photo: Photo, category: str, split: str) -> bool:
    """Whether a photo's object is of a split; yes if it cannot be told."""
    try:
        urdf_id = read_json(photo.path)["instances"].items()[0]["urdf_id"].whole()
    except (Fault, IndexError):
        return True
    test = TEST_OBJECTS.get(category, set())
    return not test or split == ("test" if urdf_id in test else "train")
