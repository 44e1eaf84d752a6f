"""Objects built from models, kept on disk: meshes are read and simplified once.

One file for each object, named by a hash of everything that it depends on; written whole or not
at all, so that any number of processes may share the folder. A damaged file is made again. The
folder may be removed at any time.
"""

import io
import json
import os
import sys
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from r2art.core.category import Joint
from r2art.data.models.build import Built, Follows
from r2art.data.shape import Instance, Material, Surface

VERSION = "2"  # of what `build` makes of a model; a new one when that changes


def folder() -> Path:
    """Where built objects are kept: the user's cache folder."""
    if home := os.environ.get("XDG_CACHE_HOME"):
        return Path(home) / "r2art"
    if sys.platform == "win32" and (local := os.environ.get("LOCALAPPDATA")):
        return Path(local) / "r2art" / "cache"
    base = "Library/Caches" if sys.platform == "darwin" else ".cache"
    return Path.home() / base / "r2art"


def kept(key: str, make: Callable[[], Built]) -> Built:
    """The object under ``key`` (a hash), made and kept if it is not there or is damaged."""
    path = folder() / "models" / f"{key}.npz"
    try:
        return _decoded(path.read_bytes())
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
        built = make()
    _write(path, _encoded(built))
    return built


def _write(path: Path, content: bytes) -> None:
    """Under a name of its own first, so that no reader or other writer meets a part of it."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, part = tempfile.mkstemp(dir=path.parent, prefix=path.stem, suffix=".part")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content)
            os.replace(part, path)
        except OSError:
            os.unlink(part)
            raise
    except OSError:
        pass  # no place to keep it: it is made again next time


def _encoded(built: Built) -> bytes:
    arrays: dict[str, Any] = {"base_T_root": built.base_T_root}
    parts = []
    for p, part in enumerate(built.instance.parts):
        looks = []
        for s, surface in enumerate(part):
            for name in ("vertices", "faces", "normals", "uv"):
                arrays[f"{p}.{s}.{name}"] = getattr(surface, name)
            if surface.material.texture is not None:
                arrays[f"{p}.{s}.texture"] = surface.material.texture
            looks.append(asdict(replace(surface.material, texture=None)))
        parts.append(looks)
    meta = {
        "category": built.instance.category,
        "part_names": built.instance.part_names,
        "joints": [asdict(joint) for joint in built.instance.joints],
        "materials": parts,
        "links": {name: [part, T.tolist()] for name, (part, T) in built.links.items()},
        "follows": [asdict(rule) for rule in built.follows],
    }
    out = io.BytesIO()
    np.savez(out, meta=json.dumps(meta), **arrays)
    return out.getvalue()


def _decoded(content: bytes) -> Built:
    with np.load(io.BytesIO(content), allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}  # reads all: checks all sums
    meta = json.loads(str(arrays["meta"]))
    parts = tuple(
        tuple(_surface(arrays, f"{p}.{s}", look) for s, look in enumerate(looks))
        for p, looks in enumerate(meta["materials"])
    )
    instance = Instance(
        category=meta["category"],
        part_names=tuple(meta["part_names"]),
        parts=parts,
        joints=tuple(Joint(**_with_tuples(joint)) for joint in meta["joints"]),
    )
    return Built(
        instance=instance,
        base_T_root=arrays["base_T_root"],
        links={name: (part, np.array(T)) for name, (part, T) in meta["links"].items()},
        follows=tuple(Follows(**rule) for rule in meta["follows"]),
    )


def _surface(arrays: dict[str, Any], place: str, look: dict[str, Any]) -> Surface:
    material = Material(**{**_with_tuples(look), "texture": arrays.get(f"{place}.texture")})
    geometry = {name: arrays[f"{place}.{name}"] for name in ("vertices", "faces", "normals", "uv")}
    return Surface(**geometry, material=material)


def _with_tuples(values: dict[str, Any]) -> dict[str, Any]:
    return {k: tuple(v) if isinstance(v, list) else v for k, v in values.items()}
