"""ReArtMix and ReArtVal: frames of the ReArt-48 objects (Liu et al., TIP 2022).

    urdf_metas.json, camera_intrinsic.json
    CATEGORY_train/, CATEGORY_val/ ...           sets, see `r2art.data.adapters.reart`

A set is of the split that its name tells; ``box_train_v2`` is of both, split at frame 5000. Where
a set has a train.txt or test.txt, these decide. See docs/datasets.md.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from r2art.core.errors import InputError
from r2art.data.adapters.convention import Convention, convention_of
from r2art.data.adapters.links import SPLITS, check_split
from r2art.data.adapters.reading import Node, read_json
from r2art.data.adapters.reart import ReArt, Shot, find_sets, frames, listed
from r2art.data.adapters.urdf_metas import FILE, Metas
from r2art.data.source import Fault

CATEGORIES = ("box", "stapler", "cutter", "drawer", "scissors")
"""By ``category_id``, from 1."""
FIRST_LABEL = {"box": 1, "stapler": 3, "cutter": 5, "drawer": 7, "scissors": 11}
"""The label of each category's first part where labels count over all categories."""
NAMES: dict[tuple[str, int], tuple[tuple[str, ...], tuple[str, ...]]] = {
    ("box", 2): (("box", "lid"), ("hinge",)),
    ("stapler", 2): (("base", "arm"), ("hinge",)),
    ("cutter", 2): (("handle", "blade"), ("slide",)),
    ("drawer", 2): (("cabinet", "drawer"), ("slide",)),
    ("drawer", 4): (
        ("cabinet", "drawer_1", "drawer_2", "drawer_3"),
        ("slide_1", "slide_2", "slide_3"),
    ),
    ("scissors", 2): (("blade_1", "blade_2"), ("pivot",)),
}
FOUR_PARTS = range(50, 56)  # objects: the drawers with three drawers
BOTH_SPLITS, FIRST_TEST = "box_train_v2", 5000


def open_reartmix(
    folder: Path,
    category: str | None = None,
    split: str | None = None,
    convention: Convention | None = None,
) -> ReArt:
    """Open the instances of a category.

    Args:
        folder: The dataset, or one set of it.
        category: Its name; needed if there are several.
        split: ``"train"``, ``"test"``, or None for both.
        convention: How to read it; default: what its ``r2art.json`` says.

    Raises:
        InputError: There is no such category, split or instance, or `Fault` if a file that all
            need is wrong.
    """
    check_split(split)
    sets = find_sets(folder)
    metas = _metas(folder, sets)
    name = _name(category) or _only_category(folder, sets)
    convention = convention or convention_of((folder, metas.parent), name)
    parts = convention.parts
    part_names, joint_names = _names(name, parts)
    convention.check(parts)
    shots = {s: [shot for home in sets for shot in _shots(home, s, name, parts)] for s in SPLITS}
    chosen = [shot for s in SPLITS if split in (s, None) for shot in shots[s]]
    if not chosen:
        found = f"{name} of {parts} parts in split {split or 'train or test'}"
        raise InputError(f"{folder} shows no {found}")
    order = convention.links(parts)
    first = FIRST_LABEL[name]
    return ReArt(
        name,
        part_names,
        (tuple(k + 1 for k in order), tuple(k + first for k in order)),
        Metas(metas, parts, joint_names, convention),
        tuple(chosen),
        tuple(shots["train"]),
        CATEGORIES.index(name) + 1,
    )


def _metas(folder: Path, sets: list[Path]) -> Path:
    places = [folder, *sets, folder.parent]
    path = next((p / FILE for p in places if (p / FILE).exists()), None)
    if path is None:
        raise Fault(str(folder / FILE), "", "is missing")
    return path


def _name(category: str | None) -> str | None:
    if category == "scissor":
        return "scissors"
    if category not in (None, *CATEGORIES):
        raise InputError(f"ReArt has no {category!r}; it has {', '.join(CATEGORIES)}")
    return category


def _only_category(folder: Path, sets: list[Path]) -> str:
    """The category of all instances of the first frame of each set."""
    seen: set[str] = set()
    for home in sets:
        for path in frames(home)[:1]:
            for instance in _instances(path) or ():
                seen |= {c for c in CATEGORIES if _is_of(instance, c)}
    if len(seen) != 1:
        known = ", ".join(sorted(seen) or CATEGORIES)
        raise InputError(f"{folder}: give one of its categories with --category: {known}")
    return seen.pop()


def _names(category: str, parts: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    if (category, parts) not in NAMES:
        known = ", ".join(str(p) for c, p in NAMES if c == category)
        raise InputError(f"a {category} of ReArt has {known} parts, not {parts}")
    return NAMES[category, parts]


def _shots(home: Path, split: str, category: str, parts: int) -> Iterator[Shot]:
    named = listed(home, split)
    if named is None and any((home / f"{s}.txt").exists() for s in SPLITS):
        return
    found = named if named is not None else [Shot(home, p) for p in _frames(home, split)]
    for shot in found:
        instances = _instances(shot.path)
        if instances is None:  # whatever is wrong with it is told when it is opened
            yield shot
        for place, instance in enumerate(instances or ()):
            wanted = named is None or place == shot.instance
            if wanted and _is_of(instance, category) and _has_parts(instance, category, parts):
                yield replace(shot, instance=place)


def _frames(home: Path, split: str) -> list[Path]:
    if home.name == BOTH_SPLITS:
        return [p for p in frames(home) if (split == "test") == _is_late(p)]
    is_test = any(word in home.name for word in ("val", "test"))
    return frames(home) if is_test == (split == "test") else []


def _is_late(path: Path) -> bool:
    return path.stem.isdecimal() and int(path.stem) >= FIRST_TEST


def _instances(path: Path) -> list[Node] | None:
    try:
        return read_json(path)["instances"].items()
    except Fault:
        return None


def _is_of(instance: Node, category: str) -> bool:
    """Whether an instance is of a category; yes if it cannot be told."""
    try:
        number = instance["category_id"].whole()
    except Fault:
        return True
    return not 1 <= number <= len(CATEGORIES) or CATEGORIES[number - 1] == category


def _has_parts(instance: Node, category: str, parts: int) -> bool:
    try:
        return category != "drawer" or (instance["urdf_id"].whole() in FOUR_PARTS) == (parts == 4)
    except Fault:
        return True
