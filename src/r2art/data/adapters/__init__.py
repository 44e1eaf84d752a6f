"""Other people's datasets, opened as `r2art.data.source.Source`.

Each adapter reads one format as its authors publish it, carries everything to r2art's
conventions, and names file and field of whatever is wrong; docs/datasets.md tells where to get
them, how their conventions map to ours, and what could not be settled from outside.
"""

from collections.abc import Callable
from pathlib import Path

from r2art.core.errors import InputError
from r2art.data.adapters import artimage, opalign, reart, reartmix, robotarm, urdf_metas
from r2art.data.shards import MANIFEST, Dataset
from r2art.data.source import Fault, Source

Opener = Callable[[Path, str | None, str | None], Source]


def open_source(
    path: Path, category: str | None = None, split: str | None = None, *, whole: bool = True
) -> Source:
    """Open a dataset, whichever of the known ones it is; its files tell.

    Args:
        path: A folder of `r2art synth`, or of ArtImage, ReArtMix, a robot arm or OP-Align.
        category: Which to open; needed where there are several.
        split: ``"train"``, ``"test"``, or None for all that there is.
        whole: Whether to refuse a folder of `r2art synth` whose shards are not all there.

    Raises:
        InputError: It is none of them (`Fault` if one that is incomplete), or has no such category
            or split.
    """
    if not path.is_dir():
        raise InputError(f"there is no folder {path}")
    if (path / MANIFEST).exists():
        return _own(path, category, split, whole)
    for is_one, open_one in READERS.values():
        if is_one(path):
            return open_one(path, category, split)
    if reart.find_sets(path):
        problem = (
            "is missing, and nothing else tells whose format these annotations are in: a robot "
            "arm has a .urdf file, a category of ArtImage has train.txt or test.txt beside its "
            "folders train and urdf; see docs/datasets.md"
        )
        raise Fault(str(path / urdf_metas.FILE), "", problem)
    known = ", ".join(READERS)
    raise InputError(
        f"{path} is no dataset that r2art knows: neither its own (a {MANIFEST}) nor laid out "
        f"like {known}; see docs/datasets.md"
    )


def _own(path: Path, category: str | None, split: str | None, whole: bool) -> Source:
    dataset = Dataset.open(path, whole=whole)
    found = {"category": dataset.category.name, "split": dataset.manifest.get("split")}
    for name, wanted in (("category", category), ("split", split)):
        if wanted is not None and found[name] not in (wanted, None):
            raise InputError(f"{path} is of {name} {found[name]}, not {wanted}")
    return dataset


def _is_artimage(path: Path) -> bool:
    return any(map(artimage.is_category, (path, *path.iterdir())))


def _is_robotarm(path: Path) -> bool:
    urdf = any(next(path.glob(p), None) for p in ("*.urdf", "urdf/*.urdf"))
    return urdf and bool(reart.find_sets(path))


def _is_reartmix(path: Path) -> bool:
    metas = any((p / urdf_metas.FILE).exists() for p in (path, path.parent, *path.iterdir()))
    return metas and bool(reart.find_sets(path))


def _is_opalign(path: Path) -> bool:
    return any(map(opalign.is_category, (path, *path.iterdir())))


READERS: dict[str, tuple[Callable[[Path], bool], Opener]] = {
    "ArtImage": (_is_artimage, artimage.open_artimage),
    "RobotArm": (_is_robotarm, robotarm.open_robotarm),
    "ReArtMix": (_is_reartmix, reartmix.open_reartmix),
    "OP-Align": (_is_opalign, opalign.open_opalign),
}
"""By name of a dataset: how its folder is known, and what opens it."""
