"""A camera that nobody told: the field of view through which the pose fits the photo best.

Perspective tells a long lens from a wide one, if faintly. So the pose is estimated through a few
likely cameras, and the one is kept whose part boxes, projected, best fill the object's 2D box.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.image import Box, View
from r2art.run.boxes import overlap

Outputs = Mapping[str, NDArray[np.floating]]

GUESSED_FOVS = tuple(float(np.radians(degrees)) for degrees in (60, 45, 35))
"""Across the longer side; the first, a phone's, is preferred."""
LEAST_GAIN = 0.01
"""By so much (IoU) another must fit better to be preferred to the first."""

_CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])


def cameras(width: int, height: int) -> Iterator[Camera]:
    """The cameras to try for a photo of this size, the preferred one first."""
    return (Camera.from_fov(fov, width, height) for fov in GUESSED_FOVS)


def best_camera(
    view: View,
    width: int,
    height: int,
    box: Box,
    poses: Callable[[Sequence[Camera]], Sequence[Outputs]],
) -> tuple[Camera, Outputs]:
    """The likeliest camera of a photo, and the pose through it.

    Args:
        view: The crop, with any camera.
        width: Of the photo (px) ...
        height: ... likewise.
        box: The object's box in pixels of the crop.
        poses: Estimates the crop's parts through each of several cameras of the crop.
    """
    tried = list(cameras(width, height))
    seen = [view.through(camera).camera for camera in tried]
    found = []
    for rank, (camera, own, outputs) in enumerate(zip(tried, seen, poses(seen), strict=True)):
        preference = 0.0 if rank else LEAST_GAIN
        found.append((fit(outputs, own, box) + preference, -rank, camera, outputs))
    _, _, camera, outputs = max(found, key=lambda item: item[:2])
    return camera, outputs


def fit(outputs: Outputs, camera: Camera, box: Box) -> float:
    """IoU of the object's box and the box round its projected part boxes; 0 if behind."""
    corners = outputs["box_center"][:, None] + outputs["box_size"][:, None] * _CORNERS
    R, t = outputs["cam_T_part"][:, :3, :3], outputs["cam_T_part"][:, :3, 3]
    points = corners @ R.transpose(0, 2, 1) + t[:, None]
    if not np.all(np.isfinite(points)) or np.any(points[..., 2] < 1e-3):
        return 0.0
    uv = camera.project(points).reshape(-1, 2)
    lower, upper = uv.min(axis=0), uv.max(axis=0)
    x1, y1, x2, y2 = *lower.tolist(), *upper.tolist()
    return overlap((x1, y1, x2, y2), box)
