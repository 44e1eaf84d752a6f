"""Where on its part every pixel lies: the label of a dense head.

Coordinates of a part's box, from -0.5 to 0.5 along each of its axes, as in ANCSH (Li et al.,
2020), though there along one diagonal. They are the same whatever the camera, the joints and the
size of the object. In memory they are bytes, a 250th of a box each.
"""

import numpy as np
from jaxtyping import Bool, Float, UInt8
from numpy.typing import NDArray
from torch import Tensor

from r2art.data.checking.boxes import pixel_rays
from r2art.data.sample import Sample

UNKNOWN = 0
MIDDLE, STEP = 128.0, 1 / 250
BEYOND = 0.505
"""Greatest coordinate, but for rounding of depths: beyond it there is nothing of the part."""
DEPTH_SLACK = 4e-3
"""Of the distance, by which a stored depth may be off."""


def part_coordinates(sample: Sample) -> UInt8[np.ndarray, "3 H W"]:
    """Coordinates of all pixels that show a part at a known depth; elsewhere `UNKNOWN`."""
    found = np.full((3, *sample.mask.shape), UNKNOWN, np.uint8)
    for k, (pose, center, size) in enumerate(
        zip(sample.cam_T_part, sample.box_center, sample.box_size, strict=True)
    ):
        v, u = np.nonzero((sample.mask == k + 1) & (sample.depth > 0))
        z = sample.depth[v, u, None]
        in_camera = pixel_rays(sample.camera, u, v) * z
        from_center = (in_camera - pose[:3, 3]) @ pose[:3, :3] - center
        inside = (np.abs(from_center) <= BEYOND * size + DEPTH_SLACK * z).all(axis=1)
        found[:, v[inside], u[inside]] = _bytes(from_center[inside] / size).T
    return found


def _bytes(share: NDArray[np.floating]) -> NDArray[np.uint8]:
    return np.clip(np.round(share / STEP + MIDDLE), 1, 255).astype(np.uint8)


def shares_of(stored: Float[Tensor, "*B"]) -> Float[Tensor, "*B"]:
    """Coordinates from their bytes."""
    return (stored - MIDDLE) * STEP


def is_known(coordinates: Float[Tensor, "*B 3"]) -> Bool[Tensor, "*B"]:
    """Where coordinates are those of a point; their signs may have changed."""
    return (coordinates.abs() < (MIDDLE - UNKNOWN - 0.5) * STEP).all(dim=-1)
