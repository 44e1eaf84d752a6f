"""One frame of OP-Align: its arrays, with the camera that they imply, in OpenCV axes."""

from dataclasses import dataclass
from math import isqrt
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.errors import UsageError
from r2art.data.adapters.npz import read_arrays
from r2art.data.adapters.reading import exactly_rigid
from r2art.data.source import Fault

FloatArray = NDArray[np.floating]
ARRAYS = ("pc", "color", "segmentation", "part", "joint")
ENOUGH = 100  # pixels with a point, to find the camera
WORST = 1.0  # px by which points may miss their pixels


@dataclass(frozen=True, kw_only=True)
class Frame:
    """What a file holds, in the camera's frame and the file's unit of length.

    Attributes:
        image: (H, W, 3) uint8 RGB.
        depth: (H, W) z, 0 where nothing was measured.
        labels: (H, W) 0, or k + 1 for the file's part k.
        camera: Found from the points.
        cam_T_box: (P, 4, 4) of the file's part boxes, their centres as origins.
        size: (P, 3) extents of these boxes.
        point: (J, 3) on the joint axes.
        direction: (J, 3) unit, along them.
    """

    image: NDArray[np.uint8]
    depth: FloatArray
    labels: NDArray[np.integer]
    camera: Camera
    cam_T_box: FloatArray
    size: FloatArray
    point: FloatArray
    direction: FloatArray


def read_frame(path: Path, parts: int) -> Frame:
    """Read a file of a category with so many parts.

    Raises:
        Fault: It is missing or damaged, or an array of it is not what it must be.
    """
    arrays = read_arrays(path, ARRAYS)
    height, width = _size(path, arrays["pc"])
    pixels = height * width
    shapes = {
        **{"pc": (pixels, 3), "color": (pixels, 3), "segmentation": (pixels,)},
        **{"part": (parts, 15), "joint": (parts - 1, 6)},
    }
    for name, shape in shapes.items():
        if name == "segmentation":
            arrays[name] = arrays[name].reshape(-1)
        if arrays[name].shape != shape:
            raise Fault(str(path), name, f"must be {shape}, is {arrays[name].shape}")
    camera, flip = _camera(path, arrays["pc"].astype(float), height, width)
    cam_T_box, size = _boxes(path, arrays["part"].astype(float), flip)
    point, direction = _joints(path, arrays["joint"].astype(float), flip)
    labels = arrays["segmentation"].reshape(height, width)
    if not np.isin(labels, range(parts + 1)).all():
        odd = labels[~np.isin(labels, range(parts + 1))][0]
        raise Fault(str(path), "segmentation", f"holds {odd}; labels are 0 to {parts}")
    if not (labels > 0).any():
        raise Fault(str(path), "segmentation", "no pixel of the object is labelled")
    return Frame(
        image=_picture(path, arrays["color"]).reshape(height, width, 3),
        depth=(flip[2] * arrays["pc"][:, 2]).reshape(height, width).astype(np.float32),
        labels=labels.astype(int),
        camera=camera,
        cam_T_box=cam_T_box,
        size=size,
        point=point,
        direction=direction,
    )


def _size(path: Path, pc: NDArray[np.generic]) -> tuple[int, int]:
    """Height and width of the 4:3 image that so many points are of."""
    height = isqrt(3 * len(pc) // 4) if pc.ndim else 0
    width = 4 * height // 3
    if pc.ndim != 2 or height * width != len(pc) or len(pc) == 0:
        raise Fault(str(path), "pc", f"must be (480 * 640, 3), is {pc.shape}")
    return height, width


def _camera(path: Path, pc: FloatArray, height: int, width: int) -> tuple[Camera, FloatArray]:
    """The camera, and the (3,) signs that turn the file's axes to OpenCV's."""
    known = np.flatnonzero(np.abs(pc).sum(axis=1) > 0)
    if len(known) < ENOUGH:
        raise Fault(str(path), "pc", f"only {len(known)} pixels hold a point")
    x, y, z = pc[known].T
    front = np.sign(np.median(z))
    if (front * z).min() <= 0:
        raise Fault(str(path), "pc", "has points on both sides of the camera")
    v, u = np.divmod(known, width)
    fx, cx = _line(x / (front * z), u + 0.5)
    fy, cy = _line(y / (front * z), v + 0.5)
    miss_u, miss_v = (fx * x / (front * z) + cx - u - 0.5), (fy * y / (front * z) + cy - v - 0.5)
    if not np.quantile(np.hypot(miss_u, miss_v), 0.95) < WORST:
        raise Fault(str(path), "pc", "is not what one camera sees on a grid of pixels")
    try:
        camera = Camera(abs(fx), abs(fy), cx, cy, width, height)
    except UsageError as error:
        raise Fault(str(path), "pc", str(error)) from None
    return camera, np.array([np.sign(fx), np.sign(fy), front])


def _line(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Slope and offset of the straight line nearest to some points; slope 0 if it is steep."""
    spread = x - x.mean()
    variance = float(spread @ spread)
    slope = float(spread @ y) / variance if variance > 0 else 0.0
    return slope, float(y.mean() - slope * x.mean())


def _boxes(path: Path, part: FloatArray, flip: FloatArray) -> tuple[FloatArray, FloatArray]:
    # Of a mirrored cloud the boxes' own x axes are turned round too, so that frames stay right
    # handed: a box is the same either way.
    own = np.array([np.prod(flip), 1.0, 1.0])
    poses = np.tile(np.eye(4), (len(part), 1, 1))
    for p, row in enumerate(part):
        poses[p, :3, :3], poses[p, :3, 3] = row[:9].reshape(3, 3), row[9:12]
        poses[p] = exactly_rigid(poses[p], str(path), f"part[{p}]")
        if not (row[12:] > 0).all():
            raise Fault(str(path), f"part[{p}]", "its extents (last three) must be positive")
        poses[p, :3, :3] = flip[:, None] * poses[p, :3, :3] * own
        poses[p, :3, 3] *= flip
        if poses[p, 2, 3] <= 0:
            raise Fault(str(path), f"part[{p}]", "lies behind the camera")
    return poses, part[:, 12:]


def _joints(path: Path, joint: FloatArray, flip: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points and directions, whichever half of the rows holds them: directions have length 1."""
    first, second = joint[:, :3], joint[:, 3:]
    is_unit = [bool(np.allclose(np.linalg.norm(h, axis=1), 1, atol=0.01)) for h in (first, second)]
    if is_unit == [True, False]:
        first, second = second, first
    length = np.linalg.norm(second, axis=1, keepdims=True)
    if length.min() < 1e-6:
        raise Fault(str(path), "joint", "holds a direction of length 0")
    return first * flip, second / length * flip


def _picture(path: Path, color: NDArray[np.generic]) -> NDArray[np.uint8]:
    values = color.astype(np.float64)
    if values.max() <= 1.0 and color.dtype.kind == "f":
        values = values * 255
    if values.min() < 0 or values.max() > 256:
        raise Fault(str(path), "color", "must be between 0 and 1, or 0 and 255")
    return np.clip(np.round(values), 0, 255).astype(np.uint8)
