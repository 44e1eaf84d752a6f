"""Labelled photos on disk: Parquet shards, a category prior and a manifest in one folder.

A file is written whole or not at all (temporary name, then rename), so a killed run leaves
nothing broken behind. Any Parquet reader opens the shards; the columns are `SCHEMA`.
"""

import contextlib
import io
import json
import os
import secrets
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray
from PIL import Image

from r2art.core.camera import Camera
from r2art.core.category import Category
from r2art.core.errors import InputError, UsageError
from r2art.data.categories import with_symmetries
from r2art.data.sample import Sample
from r2art.data.source import Fault

FORMAT = "r2art/dataset/1"
MANIFEST = "manifest.json"
PRIOR = "category.npz"
SHARD_SIZE = 250
DEPTH_UNIT = 2e-4  # m per step of the 16-bit depth image
DEPTH_STEPS = 2**16 - 1  # what is farther (than 13 m) is not told
SHAPES = {
    "box": (4,),
    "cam_T_part": (-1, 4, 4),
    "joint_state": (-1,),
    "box_center": (-1, 3),
    "box_size": (-1, 3),
    "axis": (-1, 3),
    "pivot": (-1, 3),
    "visible": (-1,),
}

_floats = pa.list_(pa.float64())
SCHEMA = pa.schema(
    [
        ("index", pa.int64()),
        ("image", pa.binary()),  # JPEG
        ("mask", pa.binary()),  # 8-bit PNG, values of Sample.mask
        ("depth", pa.binary()),  # 16-bit PNG in steps of DEPTH_UNIT
        ("amodal", pa.binary()),  # 16-bit PNG, bits of Sample.amodal; null where unknown
        ("camera", _floats),  # fx fy cx cy
        *((name, _floats) for name in SHAPES),  # row-major
    ]
)


def _encoded(array: NDArray[Any], kind: str, **options: Any) -> bytes:
    out = io.BytesIO()
    Image.fromarray(array).save(out, kind, **options)
    return out.getvalue()


def to_row(index: int, sample: Sample) -> dict[str, Any]:
    """A sample as one row of a shard."""
    camera = sample.camera
    return {
        "index": index,
        "image": _encoded(sample.image, "JPEG", quality=93, subsampling=0),
        "mask": _encoded(sample.mask, "PNG", compress_level=3),
        "depth": _encoded(depth_steps(sample.depth), "PNG", compress_level=1),
        "amodal": None if (a := sample.amodal) is None else _encoded(a, "PNG", compress_level=3),
        "camera": [camera.fx, camera.fy, camera.cx, camera.cy],
        **{name: np.asarray(getattr(sample, name), float).ravel().tolist() for name in SHAPES},
    }


def depth_steps(depth: NDArray[np.floating]) -> NDArray[np.uint16]:
    """Depth (m) in steps of `DEPTH_UNIT`; 0, which is unknown, where it is too far for 16 bits."""
    steps = np.round(depth / DEPTH_UNIT)
    return np.where((steps >= 0) & (steps <= DEPTH_STEPS), steps, 0).astype(np.uint16)


def from_row(row: dict[str, Any], file: str = "row") -> Sample:
    """A row of a shard as the sample it was made from.

    Args:
        row: By column.
        file: Where it stands, for the error.

    Raises:
        Fault: A column is missing or does not hold what `SCHEMA` says.
    """
    fields: dict[str, Any] = {}
    for name in ("image", "mask", "depth", "amodal", "camera", *SHAPES):
        if row.get(name) is None:
            if name == "amodal":
                continue
            raise Fault(file, name, "is missing")
        try:
            fields[name] = _decoded(name, row[name])
        except Exception as error:  # decoders raise whatever damaged data make them trip over
            raise Fault(file, name, f"cannot be decoded ({' '.join(str(error).split())})") from None
    height, width = fields["image"].shape[:2]
    for name in ("mask", "depth", "amodal"):
        if name in fields and fields[name].shape != (height, width):
            h, w = fields[name].shape
            raise Fault(file, name, f"has {w}×{h} px, the image {width}×{height}")
    fx, fy, cx, cy = fields.pop("camera")
    try:
        camera = Camera(fx, fy, cx, cy, width, height)
    except UsageError as error:
        raise Fault(file, "camera", str(error)) from None
    return Sample(camera=camera, **fields)


def _decoded(name: str, value: Any) -> Any:
    if name == "camera":
        return [float(v) for v in np.reshape(np.asarray(value, float), 4)]
    if name in SHAPES:
        return np.asarray(value, float).reshape(SHAPES[name])
    formats = ("JPEG", "PNG", "WEBP") if name == "image" else ("PNG",)
    with Image.open(io.BytesIO(value), formats=formats) as image:
        pixels = np.asarray(image.convert("RGB") if name == "image" else image)
    kind = np.uint8 if name in ("image", "mask") else np.uint16
    if pixels.dtype != kind or pixels.ndim != (3 if name == "image" else 2):
        raise ValueError(f"pixels of type {image.mode}")
    return pixels.astype(np.float32) * DEPTH_UNIT if name == "depth" else pixels


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file so that it is there whole or not at all.

    Raises:
        InputError: It cannot be written there; what was there before still is.
    """
    part = path.with_name(f"{path.name}.{secrets.token_hex(4)}.part")
    try:
        with part.open("xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())  # or a power cut could leave the name without the content
        os.replace(part, path)
    except OSError as error:
        reason = error.strerror or error
        raise InputError(
            f"cannot write {path}: {reason}; make room or choose another place"
        ) from error
    finally:
        with contextlib.suppress(OSError):
            part.unlink()


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
        raise Fault(str(path), "", f"is not JSON ({error}); remove it") from None
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        problem = f"is not of a dataset in format {FORMAT}; choose another folder"
        raise Fault(str(path), "format", problem)
    for name in ("n", "shards", "shard_size"):
        value = manifest.get(name, SHARD_SIZE if name == "shard_size" else None)
        if not isinstance(value, int) or value < 1:
            raise Fault(str(path), name, f"must be a whole number above 0, is {value!r}")
    return manifest


def shard_size(manifest: dict[str, Any]) -> int:
    """Rows of every shard of a dataset but the last."""
    return int(manifest.get("shard_size", SHARD_SIZE))


def read_prior(folder: Path) -> Category:
    """The category prior of a dataset, with the symmetry that older ones did not store.

    Raises:
        Fault: It is missing or damaged.
    """
    path = folder / PRIOR
    try:
        content = io.BytesIO(path.read_bytes())  # NumPy forgets to close bad files
        return with_symmetries(Category.load(content))
    except FileNotFoundError:
        raise Fault(str(path), "", "is missing") from None
    except KeyError as error:
        name = next(iter(str(a).split()[0] for a in error.args), "")
        raise Fault(str(path), name, "is missing") from None
    except Exception as error:  # zip, npy and JSON decoders raise whatever they trip over
        raise Fault(str(path), "", f"is no category prior ({error})") from None


@dataclass(frozen=True)
class Dataset:
    """A folder of shards, opened for reading: a `Source` with random access."""

    folder: Path
    manifest: dict[str, Any]
    category: Category
    _last: dict[int, pa.Table | Fault] = field(default_factory=dict, repr=False, compare=False)

    @classmethod
    def open(cls, folder: Path, *, whole: bool = True) -> "Dataset":
        """Open a folder that `r2art synth` has filled.

        Args:
            folder: The dataset.
            whole: Whether to refuse one whose shards are not all there.

        Raises:
            InputError: It holds no dataset, or only a part of one.
        """
        manifest = read_manifest(folder)
        count = sum(shard_path(folder, k).exists() for k in range(manifest["shards"]))
        if whole and count < manifest["shards"]:
            raise InputError(
                f"{folder} holds {count} of {manifest['shards']} shards; "
                "run the same `r2art synth` command again to make the rest"
            )
        return cls(folder, manifest, read_prior(folder))

    def __len__(self) -> int:
        return int(self.manifest["n"])

    def __getitem__(self, index: int) -> Sample:
        """Sample ``index``; neighbours are cheap, for the last shard is kept.

        Raises:
            Fault: Its row is broken.
            IndexError: There is none.
        """
        return from_row(self.row(index), self.file(index))

    def file(self, index: int) -> str:
        """Shard and row of a sample."""
        number, row = divmod(index, shard_size(self.manifest))
        return f"{shard_path(self.folder, number)} row {row}"

    def row(self, index: int) -> dict[str, Any]:
        """The row of a sample, still encoded; see `from_row`."""
        if not 0 <= index < len(self):
            raise IndexError(f"there are samples 0 to {len(self) - 1}, not {index}")
        number, place = divmod(index, shard_size(self.manifest))
        table = self._shard(number)
        if place >= len(table):
            raise Fault(str(shard_path(self.folder, number)), "", f"holds only {len(table)} rows")
        row = table.slice(place, 1).to_pylist()[0]
        if row.get("index") != index:
            raise Fault(self.file(index), "index", f"is {row.get('index')}, not {index}")
        return row

    def rows(self) -> Iterable[dict[str, Any]]:
        """All rows, in order."""
        return map(self.row, range(len(self)))

    def _shard(self, number: int) -> pa.Table:
        if number not in self._last:
            self._last.clear()
            self._last[number] = _read_shard(shard_path(self.folder, number))
        if isinstance(shard := self._last[number], Fault):
            raise shard
        return shard


def _read_shard(path: Path) -> pa.Table | Fault:
    """The table, or why there is none: told for each of its samples, but found only once."""
    try:
        with pq.ParquetFile(path) as file:
            return file.read()
    except FileNotFoundError:
        return Fault(str(path), "", "is missing")
    except Exception as error:  # Arrow's exceptions have no common base but this
        return Fault(str(path), "", f"is no readable Parquet file ({error})")
