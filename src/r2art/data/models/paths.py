"""Where the files are that a model names."""

import os
import re
from collections.abc import Iterator
from pathlib import Path

from r2art.core.errors import InputError

_NAMED = re.compile(rb"^[ \t]*(?:mtllib|map_\w+)[ \t]+(.+?)[ \t\r]*$", re.MULTILINE)
_COLLADA = re.compile(rb"<init_from>\s*(?:file://)?([^<]+?)\s*</init_from>")


def model_file(path: Path, suffix: str) -> Path:
    """The model file that is meant: the file itself, or the only one in a folder.

    Raises:
        InputError: There is none, or more than one.
    """
    if not path.is_dir():
        if not path.exists():
            raise InputError(f"no such file or folder: {path}")
        return path
    found = sorted(path.glob(f"*{suffix}")) or sorted(path.glob(f"*/*{suffix}"))
    if not found:
        raise InputError(f"{path} holds no {suffix} file; give the file itself")
    if len(found) > 1:
        names = ", ".join(str(f.relative_to(path)) for f in found)
        raise InputError(f"{path} holds {len(found)} {suffix} files ({names}); give one of them")
    return found[0]


def resolve(uri: str, model: Path, who: str) -> Path:
    """The file that a model means by a path, ``package://`` or ``file://`` address.

    A package is looked for in the folders above the model and in ``ROS_PACKAGE_PATH``; where
    the model lies inside it under another name, its files are found all the same.

    Raises:
        InputError: There is no such file.
    """
    scheme, found, rest = uri.partition("://")
    if not found or scheme == "file":
        path = Path(rest if found else uri)
        homes = (model.parent, model.resolve().parent)  # a link to the file, or to its folder
        places = [path] if path.is_absolute() else [home / path for home in homes]
        rest = "" if path.is_absolute() else uri
    elif scheme in ("package", "model"):
        places = list(_in_packages(rest, model))
    else:
        raise InputError(f"{model}: {who} is at {uri}; only files can be read: save it as one")
    above = [folder / rest for folder in model.absolute().parents] if rest else []
    for place in (*places, *above):
        if place.is_file():
            return place
    raise InputError(
        f"{model}: {who} needs {uri}, which is not there (looked for {places[0]}); "
        "put the file there or correct its path"
    )


def _in_packages(rest: str, model: Path) -> Iterator[Path]:
    roots = [Path(p) for p in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if p]
    inside = rest.partition("/")[2]
    above = list(model.absolute().parents)
    for folder in (*above, *roots):
        yield folder / rest
    for folder in above:
        yield folder / inside


def companions(path: Path) -> list[Path]:
    """Files that a mesh file names in turn, as far as they exist: materials and pictures."""
    suffix = path.suffix.lower()
    if suffix not in (".obj", ".mtl", ".dae") or not path.is_file():
        return []
    pattern = _COLLADA if suffix == ".dae" else _NAMED
    names = [name.decode(errors="replace") for name in pattern.findall(path.read_bytes())]
    # A map may have options before its file's name.
    places = [path.parent / n for name in names for n in (name, name.split()[-1])]
    found = list(dict.fromkeys(p for p in places if p.is_file() and p != path))
    return [file for f in found for file in (f, *companions(f))]
