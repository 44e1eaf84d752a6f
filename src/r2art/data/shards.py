"""Labelled photos on disk: Parquet shards, a category prior and a manifest in one folder.

A shard is written whole or not at all (temporary name, then rename), so a killed run leaves
nothing broken behind. Any Parquet reader opens the shards; the columns are `SCHEMA`.
"""

import io
import json
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray
from PIL import Image

from r2art.core.camera import Camera
from r2art.core.category import Category
from r2art.core.errors import InputError
from r2art.data.sample import Sample

FORMAT = "r2art/dataset/1"
MANIFEST = "manifest.json"
PRIOR = "category.npz"
DEPTH_UNIT = 2e-4  # m per step of the 16-bit depth image: up to 13 m
FLOATS = ("box", "cam_T_part", "joint_state", "box_center", "box_size", "axis", "pivot", "visible")

_floats = pa.list_(pa.float64())
SCHEMA = pa.schema(
    [
        ("index", pa.int64()),
        ("image", pa.binary()),  # JPEG
        ("mask", pa.binary()),  # 8-bit PNG, values of Sample.mask
        ("depth", pa.binary()),  # 16-bit PNG in steps of DEPTH_UNIT
        ("camera", _floats),  # fx fy cx cy
        *((name, _floats) for name in FLOATS),  # row-major
    ]
)


def _encoded(array: NDArray[Any], kind: str, **options: Any) -> bytes:
    out = io.BytesIO()
    Image.fromarray(array).save(out, kind, **options)
    return out.getvalue()


def to_row(index: int, sample: Sample) -> dict[str, Any]:
    """A sample as one row of a shard."""
    depth = np.clip(np.round(sample.depth / DEPTH_UNIT), 0, 65535).astype(np.uint16)
    camera = sample.camera
    return {
        "index": index,
        "image": _encoded(sample.image, "JPEG", quality=93, subsampling=0),
        "mask": _encoded(sample.mask, "PNG", compress_level=3),
        "depth": _encoded(depth, "PNG", compress_level=1),
        "camera": [camera.fx, camera.fy, camera.cx, camera.cy],
        **{name: np.asarray(getattr(sample, name), float).ravel().tolist() for name in FLOATS},
    }


def from_row(row: dict[str, Any]) -> Sample:
    """A row of a shard as the sample it was made from."""
    image = np.asarray(Image.open(io.BytesIO(row["image"])).convert("RGB"))
    mask = np.asarray(Image.open(io.BytesIO(row["mask"])))
    depth = np.asarray(Image.open(io.BytesIO(row["depth"]))).astype(np.float32) * DEPTH_UNIT
    height, width = mask.shape
    fx, fy, cx, cy = row["camera"]
    shapes = {"cam_T_part": (-1, 4, 4), "box": (4,), "joint_state": (-1,), "visible": (-1,)}
    arrays = {name: np.asarray(row[name]).reshape(shapes.get(name, (-1, 3))) for name in FLOATS}
    camera = Camera(fx, fy, cx, cy, width, height)
    return Sample(image=image, mask=mask, depth=depth, camera=camera, **arrays)


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file so that it is there whole or not at all.

    Raises:
        InputError: It cannot be written there.
    """
    part = path.with_name(path.name + ".part")
    try:
        part.write_bytes(content)
        os.replace(part, path)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}; choose another place") from error


def shard_path(folder: Path, number: int) -> Path:
    """Where shard ``number`` of a dataset lies."""
    return folder / f"shard-{number:05d}.parquet"


def write_shard(path: Path, rows: Iterable[dict[str, Any]]) -> None:
    """Write rows as one shard, whole or not at all."""
    table = pa.Table.from_pylist(list(rows), schema=SCHEMA)
    out = io.BytesIO()
    pq.write_table(table, out, compression="none")
    write_atomically(path, out.getvalue())


def read_manifest(folder: Path) -> dict[str, Any]:
    """What a dataset says of itself.

    Raises:
        InputError: The folder holds no dataset of this format.
    """
    path = folder / MANIFEST
    try:
        manifest = json.loads(path.read_text())
    except OSError:
        raise InputError(f"{folder} holds no {MANIFEST}; make one with `r2art synth`") from None
    except ValueError as error:
        raise InputError(f"{path} is not JSON ({error}); remove it or choose a dataset") from None
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        raise InputError(f"{path} is not of a dataset in format {FORMAT}; choose another folder")
    return manifest


@dataclass(frozen=True)
class Dataset:
    """A folder of shards, opened for reading."""

    folder: Path
    manifest: dict[str, Any]
    category: Category
    shards: tuple[Path, ...]

    @classmethod
    def open(cls, folder: Path) -> "Dataset":
        """Open a folder that `r2art synth` has filled.

        Raises:
            InputError: It holds no dataset, or only a part of one.
        """
        manifest = read_manifest(folder)
        shards = tuple(sorted(folder.glob("shard-*.parquet")))
        if len(shards) < manifest["shards"]:
            raise InputError(
                f"{folder} holds {len(shards)} of {manifest['shards']} shards; "
                "run the same `r2art synth` command again to make the rest"
            )
        return cls(folder, manifest, Category.load(folder / PRIOR), shards)

    def __len__(self) -> int:
        return int(self.manifest["n"])

    def rows(self) -> Iterable[dict[str, Any]]:
        """All rows, in order."""
        for shard in self.shards:
            yield from pq.read_table(shard).to_pylist()
