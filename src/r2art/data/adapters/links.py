"""What the annotations of ArtImage and of ReArt share: links of an instance, sizes, splits."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from r2art.core.camera import Camera
from r2art.core.errors import InputError
from r2art.data.adapters.reading import Node
from r2art.data.source import Fault

SPLITS = ("train", "test")


def links_by_part(instance: Node, part_of: Mapping[int, int]) -> list[Node]:
    """The ``links`` of an instance in the order of our parts.

    Args:
        instance: Of an annotation.
        part_of: Our part of every ``link_category_id``.

    Raises:
        Fault: A link is missing, of an unknown id, or there twice.
    """
    found: dict[int, Node] = {}
    links = instance["links"]
    for link in links.items():
        number = link["link_category_id"]
        if (part := part_of.get(number.whole())) is None:
            known = ", ".join(map(str, sorted(part_of)))
            raise number.fault(f"is {number.value}; links here are {known}")
        if part in found:
            raise number.fault(f"is {number.value}, which another link has already")
        found[part] = link
    for number, part in part_of.items():
        if part not in found:
            raise links.fault(f"has no link with link_category_id {number}")
    return [found[part] for part in range(len(part_of))]


def check_size(annotation: Node, camera: Camera) -> None:
    """Hold the size of an annotation against its camera.

    Raises:
        Fault: They differ.
    """
    for name, wanted in (("width", camera.width), ("height", camera.height)):
        size = annotation[name]
        if size.whole() != wanted:
            raise size.fault(f"is {size.value}, but the camera's image has {wanted} px")


def relative(node: Node) -> Path:
    """A path in an annotation, whichever way its slashes lean.

    Raises:
        Fault: It is none, or leads out of the dataset.
    """
    path = Path(node.text().replace("\\", "/"))
    if path.is_absolute() or ".." in path.parts:
        raise node.fault(f"must be a path inside the dataset, is {node.value!r}")
    return path


@contextmanager
def leading_to(node: Node) -> Iterator[None]:
    """Whatever is wrong with a file is told of the annotation's field that leads to it."""
    try:
        yield
    except Fault as fault:
        if fault.file == str(node.file):
            raise
        problem = f"{fault.field}: {fault.problem}" if fault.field else fault.problem
        raise node.fault(f"leads to {fault.file}, which {problem}") from None


def check_split(split: str | None, known: Sequence[str] = SPLITS) -> None:
    """Refuse a split that a dataset does not have.

    Raises:
        InputError: It is none of the known ones, nor None for all.
    """
    if split is not None and split not in known:
        raise InputError(f"there is no split {split!r}; there are {', '.join(known)}")
