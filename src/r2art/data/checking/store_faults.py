"""What is wrong with a dataset's folder: its manifest, prior, shards and hashes."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

from r2art.core.category import Category
from r2art.core.errors import InputError
from r2art.data import filling, shards
from r2art.data.checking.agreement import Problem
from r2art.data.hashes import SUMS, file_hash, read_sums
from r2art.data.objects import SPLITS
from r2art.data.source import Fault

HASH = re.compile(r"sha256:[0-9a-f]{64}")


def store_faults(dataset: shards.Dataset) -> Iterator[Fault]:
    """What is wrong with the files of a dataset, but for its prior and samples."""
    folder = dataset.folder
    for field, problem in _manifest(dataset.manifest, dataset.category):
        yield Fault(str(folder / shards.MANIFEST), field, problem)
    yield from _row_counts(dataset)
    yield from hash_faults(folder)


def _manifest(manifest: dict[str, Any], category: Category) -> Iterator[Problem]:
    m = manifest
    if (name := m.get("category")) != category.name:
        yield "category", f"is {name!r}, the prior's is {category.name!r}"
    wanted = filling.counts(m["n"], shards.shard_size(m))
    if m["shards"] != wanted["shards"]:
        yield "shards", f"is {m['shards']}, but {m['n']} samples fill {wanted['shards']}"
    rules = {
        "seed": lambda v: type(v) is int and v >= 0,
        "split": lambda v: v in SPLITS or v is None,
        "size": lambda v: type(v) is int and v > 0,
        "backgrounds": lambda v: v in (True, False) or HASH.fullmatch(str(v)) is not None,
    }
    for name, rule in rules.items():
        if name in m and not rule(m[name]):
            yield name, f"cannot be {m[name]!r}"


def prior_faults(category: Category) -> Iterator[Problem]:
    """What is wrong with a category's prior: field, problem."""
    if found := list(_prior_shapes(category)):
        yield from found
        return
    with np.errstate(all="ignore"):
        yield from _prior_values(category)
        yield from _prior_joints(category)


def _prior_shapes(c: Category) -> Iterator[Problem]:
    parts, points = len(c.part_names), c.points.shape[1] if c.points.ndim == 3 else 0
    if len(c.joints) != parts - 1 or len(set(c.part_names)) != parts:
        yield (
            "meta",
            f"{parts} parts and {len(c.joints)} joints; P names and P - 1 joints are meant",
        )
    shapes = {
        "box_center": (parts, 3),
        "box_size": (parts, 3),
        "points": (parts, points, 3),
        "normals": (parts, points, 3),
        "areas": (parts,),
    }
    for name, shape in shapes.items():
        array = np.asarray(getattr(c, name))
        if array.shape != shape or 0 in shape:
            yield name, f"has shape {array.shape}, {shape} is meant"
        elif array.dtype.kind != "f" or not np.isfinite(array).all():
            yield name, "holds values that are not finite numbers"


def _prior_values(c: Category) -> Iterator[Problem]:
    for name in ("box_size", "areas"):
        if not getattr(c, name).min() > 0:
            yield name, "must be positive"
    if not np.abs(c.box_center[0]).max() <= 1e-3 * c.diagonal:
        yield "box_center", f"{c.part_names[0]}: must be the origin, is {c.box_center[0]}"
    outside = np.abs(c.points - c.box_center[:, None]) - c.box_size[:, None] / 2
    if not outside.max() <= 0.02 * c.diagonal:
        yield "points", f"lie up to {outside.max():.2g} m outside their part boxes"
    lengths = np.linalg.norm(c.normals, axis=-1)
    if not np.abs(lengths - 1).max() <= 0.01:
        yield "normals", f"have lengths {lengths.min():.2g} to {lengths.max():.2g}, not 1"
    if not 0 < c.frontal_area < np.inf:
        yield "frontal_area", f"{c.frontal_area} must be positive"


def _prior_joints(c: Category) -> Iterator[Problem]:
    for joint in c.joints:
        if joint.kind not in ("revolute", "prismatic"):
            yield "kind", f"{joint.name}: {joint.kind!r} is neither revolute nor prismatic"
        if not abs(np.linalg.norm(joint.axis) - 1) <= 1e-3:
            yield "axis", f"{joint.name}: {joint.axis} must be a unit vector"
        if not np.linalg.norm(joint.pivot) <= 20 * c.diagonal:
            yield "pivot", f"{joint.name}: {joint.pivot} is far from the object"
        low, high = joint.limits
        if not -np.inf < low < high < np.inf:
            yield "limits", f"{joint.name}: {low:g} to {high:g} is no range"


def _row_counts(dataset: shards.Dataset) -> Iterator[Fault]:
    """Shards that hold more rows than they should (fewer: their samples tell), and stray ones."""
    expected = {
        shards.shard_path(dataset.folder, k): len(filling.block(dataset.manifest, k))
        for k in range(dataset.manifest["shards"])
    }
    for path in sorted({*dataset.folder.glob("shard-*.parquet"), *expected}):
        if path not in expected:
            yield Fault(str(path), "", "is not among the shards that the manifest counts")
            continue
        try:
            rows = pq.read_metadata(path).num_rows
        except Exception:  # Arrow's have no common base but this; the samples tell what is wrong
            continue
        if rows > expected[path]:
            yield Fault(str(path), "", f"holds {rows} rows instead of {expected[path]}")


def hash_faults(folder: Path) -> Iterator[Fault]:
    """Files that are not what the dataset's hashes say, where it has any."""
    try:
        hashes = read_sums(folder)
    except Fault as fault:
        yield fault
        return
    for name, value in hashes.items():
        if not (path := folder / name).exists():
            yield Fault(str(path), "", f"is missing, but named in {SUMS}")
            continue
        try:
            same = file_hash(path) == value
        except InputError as error:
            yield Fault(str(path), "", str(error))
            continue
        if not same:
            yield Fault(str(path), "", f"is not the file that {SUMS} was made from")
    if hashes:
        named = {p.name for p in folder.glob("shard-*.parquet")} | {shards.MANIFEST, shards.PRIOR}
        for name in sorted(named - set(hashes)):
            yield Fault(str(folder / SUMS), name, "is not named; run `r2art data hash` again")
