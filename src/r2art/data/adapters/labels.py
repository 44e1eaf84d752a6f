"""From what an adapter has read of a photo to a `Sample`."""

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.data.adapters.model import Model
from r2art.data.adapters.reading import Node
from r2art.data.sample import BACKDROP, Sample
from r2art.data.source import Fault

FloatArray = NDArray[np.floating]


def labelled(
    model: Model,
    *,
    image: NDArray[np.uint8],
    mask: NDArray[np.uint8],
    depth: FloatArray,
    camera: Camera,
    box: FloatArray,
    cam_T_part: FloatArray,
    joint_state: FloatArray,
) -> Sample:
    """A sample of a model's object; the arguments are fields of `Sample`.

    Where points on the object are known, its box grows to hold them, seen or not.
    """
    seen = [_pixels(model.surface(p), T, camera) for p, T in enumerate(cam_T_part)]
    if model.points is not None and all(map(len, seen)):
        uv = np.concatenate(seen)
        box = np.concatenate(
            [np.minimum(box[:2], uv.min(axis=0)), np.maximum(box[2:], uv.max(axis=0))]
        )
    return Sample(
        image=image,
        mask=mask,
        depth=depth.astype(np.float32),
        camera=camera,
        box=box,
        cam_T_part=cam_T_part,
        joint_state=joint_state,
        box_center=model.box_center,
        box_size=model.box_size,
        axis=np.array([j.axis for j in model.joints]).reshape(-1, 3),
        pivot=np.array([j.pivot for j in model.joints]).reshape(-1, 3),
        visible=np.array([_visible(uv, mask, p + 1) for p, uv in enumerate(seen)]),
    )


def _pixels(points: FloatArray, cam_T_part: FloatArray, camera: Camera) -> FloatArray:
    """(N, 2) where points of a part are seen; none if any is behind the camera."""
    in_camera = points @ cam_T_part[:3, :3].T + cam_T_part[:3, 3]
    if in_camera[:, 2].min() <= 0:
        return np.zeros((0, 2))
    return camera.project(in_camera)


def _visible(uv: FloatArray, mask: NDArray[np.uint8], label: int) -> float:
    """Share of the pixels that a part's points fall on which the mask gives to that part.

    At least 1 % where the mask shows it at all, for the points may be few.
    """
    count = np.count_nonzero(mask == label)
    if count == 0:
        return 0.0
    pixels = np.unique(np.floor(uv).astype(int), axis=0)
    u, v = pixels[((pixels >= 0) & (pixels < mask.shape[::-1])).all(axis=1)].T
    return max(0.01, np.count_nonzero(mask[v, u] == label) / max(len(pixels), 1))


def read_box(node: Node, mask: NDArray[np.uint8]) -> FloatArray:
    """(4,) an annotated 2D box x1 y1 x2 y2, held against the pixels of the object.

    Raises:
        Fault: It is no box, does not hold the object's pixels, or is far too large; or no pixel
            is labelled.
    """
    box = node.array(4)
    if not (box[2] > box[0] and box[3] > box[1]):
        raise node.fault(f"must be x1 y1 x2 y2 with x1 < x2 and y1 < y2, is {_row(box)}")
    v, u = np.nonzero((mask > 0) & (mask < BACKDROP))
    if len(v) == 0:
        raise Fault(str(node.file), node.field, "no pixel of the object is labelled")
    seen = np.array([u.min(), v.min(), u.max() + 1, v.max() + 1], float)
    extent = seen[2:] - seen[:2]
    slack = 3 + 0.1 * extent
    if (box[:2] > seen[:2] + slack).any() or (box[2:] < seen[2:] - slack).any():
        raise node.fault(f"{_row(box)} does not hold the object's pixels {_row(seen)}")
    if np.prod(box[2:] - box[:2]) > 9 * np.prod(extent + 8):
        raise node.fault(f"{_row(box)} is far larger than the object's pixels {_row(seen)}")
    return box


def _row(box: FloatArray) -> str:
    return " ".join(f"{x:g}" for x in box)
