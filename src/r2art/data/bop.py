"""Export in the scene-wise format of BOP, the benchmark of 6D object pose estimation.

https://github.com/thodan/bop_toolkit/blob/master/docs/bop_datasets_format.md. Every part is an
object of its own: part k has ``obj_id`` k + 1. Lengths are millimetres. A pixel's centre has
whole coordinates there, so the principal point is half a pixel less than in `Camera`.

What that format cannot say (how far joints are open, and how large this instance is: its models
are those of the category's mean object) stands in ``scene_articulation.json`` of each scene.
"""

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial.distance import pdist

from r2art.core.camera import Camera
from r2art.core.category import Category
from r2art.core.errors import InputError, UsageError
from r2art.data.checking.boxes import corners
from r2art.data.sample import Sample
from r2art.data.shards import DEPTH_UNIT, depth_steps
from r2art.data.source import Source

FloatArray = NDArray[np.floating]
MM = 1e3
PER_SCENE = 1000
DEPTH_SCALE = DEPTH_UNIT * MM
"""mm per step of the depth images."""
TARGET_VISIBLE = 0.1
"""Share of a part that must be seen for it to be a test target, as in the BOP challenge."""


def export_bop(
    source: Source,
    out: Path,
    split: str = "test",
    limit: int | None = None,
    advance: Callable[[int], None] = lambda done: None,
) -> int:
    """Write a source as a BOP dataset.

    Args:
        source: Where the samples come from.
        out: A new or empty folder.
        split: Name of the folder of scenes in it: train, val or test.
        limit: Only the first so many samples.
        advance: Called with the number of samples done since the last call.

    Returns:
        The number of samples.

    Raises:
        InputError: A sample is broken (see `Fault`), or the folder cannot be written.
        UsageError: The folder is not empty.
    """
    n = len(source) if limit is None else min(limit, len(source))
    _make_folder(out)
    write_models(source.category, out / "models")
    targets: list[dict[str, int]] = []
    for first in range(0, n, PER_SCENE):
        scene = _Scene(out / split, first // PER_SCENE, source.category)
        for image, index in enumerate(range(first, min(n, first + PER_SCENE))):
            sample = source[index]
            if index == 0:
                _write_json(out / "camera.json", _sensor(sample.camera))
            targets += scene.add(image, sample)
            advance(1)
        scene.finish()
    _write_json(out / "test_targets_bop19.json", targets)
    return n


def write_models(category: Category, folder: Path) -> None:
    """``obj_000001.ply`` … and ``models_info.json``: the parts of the mean object.

    They are points with normals, in the part's own frame (at rest: the root's).
    """
    folder.mkdir()
    info = {}
    for part, (points, normals) in enumerate(zip(category.points, category.normals, strict=True)):
        _write(folder / f"obj_{part + 1:06d}.ply", _ply(MM * points, normals))
        lower, extent = MM * points.min(axis=0), MM * np.ptp(points, axis=0)
        info[str(part + 1)] = {
            "diameter": MM * float(pdist(points).max()),
            **{f"min_{axis}": float(v) for axis, v in zip("xyz", lower, strict=True)},
            **{f"size_{axis}": float(v) for axis, v in zip("xyz", extent, strict=True)},
            "name": category.part_names[part],
        }
    _write_json(folder / "models_info.json", info)


def _ply(points: FloatArray, normals: FloatArray) -> bytes:
    names = ("x", "y", "z", "nx", "ny", "nz")
    header = ["ply", "format ascii 1.0", f"element vertex {len(points)}"]
    header += [f"property float {name}" for name in names] + ["end_header"]
    rows = np.concatenate([points, normals], axis=1)
    lines = [" ".join(f"{v:.6g}" for v in row) for row in rows]
    return "\n".join([*header, *lines, ""]).encode()


class _Scene:
    """One folder of images, and the JSON files that describe them all."""

    def __init__(self, split: Path, number: int, category: Category) -> None:
        self.number = number
        self.category = category
        self.folder = split / f"{number:06d}"
        self.tables: dict[str, dict[str, Any]] = {
            name: {} for name in ("scene_camera", "scene_gt", "scene_gt_info", "scene_articulation")
        }
        for name in ("rgb", "depth", "mask", "mask_visib"):
            (self.folder / name).mkdir(parents=True)

    def add(self, image: int, sample: Sample) -> list[dict[str, int]]:
        """Write one image; what it adds to the test targets."""
        key = str(image)
        self._write_image("rgb", f"{image:06d}", sample.image)
        self._write_image("depth", f"{image:06d}", depth_steps(sample.depth))
        self.tables["scene_camera"][key] = {
            "cam_K": _rounded(bop_K(sample.camera)),
            "depth_scale": DEPTH_SCALE,
        }
        self.tables["scene_gt"][key] = [
            {
                "cam_R_m2c": _rounded(T[:3, :3], 9),
                "cam_t_m2c": _rounded(MM * T[:3, 3]),
                "obj_id": part + 1,
            }
            for part, T in enumerate(sample.cam_T_part)
        ]
        info = [self._part(image, part, sample) for part in range(len(sample.cam_T_part))]
        self.tables["scene_gt_info"][key] = info
        self.tables["scene_articulation"][key] = articulation(sample, self.category)
        return [
            {"im_id": image, "inst_count": 1, "obj_id": part + 1, "scene_id": self.number}
            for part, facts in enumerate(info)
            if facts["visib_fract"] >= TARGET_VISIBLE
        ]

    def _part(self, image: int, part: int, sample: Sample) -> dict[str, Any]:
        """Write the masks of a part; its entry in scene_gt_info.json."""
        seen = sample.mask == part + 1
        whole = silhouette(sample, part)
        name = f"{image:06d}_{part:06d}"
        self._write_image("mask_visib", name, 255 * seen.astype(np.uint8))
        if whole is not None:
            self._write_image("mask", name, 255 * whole.astype(np.uint8))
        return part_info(sample, part, seen, whole)

    def _write_image(self, kind: str, name: str, pixels: NDArray[Any]) -> None:
        out = io.BytesIO()
        Image.fromarray(pixels).save(out, "PNG", compress_level=3)
        _write(self.folder / kind / f"{name}.png", out.getvalue())

    def finish(self) -> None:
        """Write what is known of all images."""
        if not any((self.folder / "mask").iterdir()):
            (self.folder / "mask").rmdir()
        for name, table in self.tables.items():
            _write_json(self.folder / f"{name}.json", table)


def bop_K(camera: Camera) -> FloatArray:
    """(3, 3) intrinsics for pixels whose centres have whole coordinates."""
    return camera.crop(0.5, 0.5, camera.width, camera.height).K


def silhouette(sample: Sample, part: int) -> NDArray[np.bool_] | None:
    """(H, W) where a part would be seen if nothing stood before it; None if that is unknown."""
    if sample.amodal is None:
        return None
    return (sample.amodal >> part) & 1 == 1


def part_info(
    sample: Sample, part: int, seen: NDArray[np.bool_], whole: NDArray[np.bool_] | None
) -> dict[str, Any]:
    """One entry of scene_gt_info.json: boxes x y width height, and numbers of pixels.

    They are of the image as it is; what lies beyond its border is not counted. Where the whole
    silhouette is unknown, its size follows from the visible share, and its box from the part's.
    """
    share, count = float(sample.visible[part]), int(seen.sum())
    if whole is None:
        total = round(count / share) if share > 0 else 0
        box, valid = _part_box(sample, part), int((sample.depth[seen] > 0).sum())
    else:
        total, box = int(whole.sum()), _pixel_box(whole)
        valid = int((sample.depth[whole] > 0).sum())
    return {
        "bbox_obj": box,
        "bbox_visib": _pixel_box(seen),
        "px_count_all": total,
        "px_count_valid": valid,
        "px_count_visib": count,
        "visib_fract": share,
    }


def _pixel_box(mask: NDArray[np.bool_]) -> list[int]:
    """First pixel and distance to the last, x y w h, as the BOP toolkit reckons."""
    ys, xs = np.nonzero(mask)
    if not len(xs):
        return [-1, -1, -1, -1]
    return [int(v) for v in (xs.min(), ys.min(), np.ptp(xs), np.ptp(ys))]


def _part_box(sample: Sample, part: int) -> list[int]:
    points = corners(sample.cam_T_part[part], sample.box_center[part], sample.box_size[part])
    if points[:, 2].min() <= 0:
        return [-1, -1, -1, -1]
    pixels = np.floor(sample.camera.project(points)).astype(int)
    return [int(v) for v in (*pixels.min(axis=0), *np.ptp(pixels, axis=0))]


def articulation(sample: Sample, category: Category) -> dict[str, Any]:
    """Joint states (rad or mm), and what the models must be stretched to for this instance (mm)."""
    unit = [1.0 if joint.kind == "revolute" else MM for joint in category.joints]
    return {
        "joint_state": _rounded(sample.joint_state * unit, 9),
        "axis": np.round(sample.axis, 9).tolist(),
        "pivot": np.round(MM * sample.pivot, 6).tolist(),
        "box_center": np.round(MM * sample.box_center, 6).tolist(),
        "box_size": np.round(MM * sample.box_size, 6).tolist(),
    }


def _sensor(camera: Camera) -> dict[str, float]:
    K = bop_K(camera)
    return {
        "cx": K[0, 2],
        "cy": K[1, 2],
        "depth_scale": DEPTH_SCALE,
        "fx": K[0, 0],
        "fy": K[1, 1],
        "height": camera.height,
        "width": camera.width,
    }


def _rounded(values: FloatArray, digits: int = 6) -> list[float]:
    return np.round(values, digits).ravel().tolist()


def _write_json(path: Path, content: Any) -> None:
    _write(path, json.dumps(content, indent=1).encode())


def _write(path: Path, content: bytes) -> None:
    try:
        path.write_bytes(content)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror or error}; make room") from None


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
        if any(out.iterdir()):
            raise UsageError(f"{out} is not empty; choose another --out")
    except OSError as error:
        raise InputError(f"cannot write to {out}: {error.strerror}; choose another --out") from None
