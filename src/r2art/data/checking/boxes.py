"""Pixels against part boxes: the geometry by which labels must agree."""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera

FloatArray = NDArray[np.floating]
SIGNS = np.array(list(product((-1, 1), repeat=3)))


def corners(cam_T_part: FloatArray, center: FloatArray, size: FloatArray) -> FloatArray:
    """(8, 3) corners of a part's box in the camera frame; see `SIGNS` for their order."""
    return (center + SIGNS * size / 2) @ cam_T_part[:3, :3].T + cam_T_part[:3, 3]


def faces_in_image(camera: Camera, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least and greatest pixel, (F, 2) each, of every face of boxes.

    An object that touches each face of its boxes reaches at least from the least of the
    greatest to the greatest of the least, whatever its shape.

    Args:
        camera: Of the image.
        points: (P, 8, 3) corners, all before the camera.
    """
    pixels = camera.project(points)
    faces = [pixels[:, SIGNS[:, axis] == side] for axis in range(3) for side in (-1, 1)]
    each = np.concatenate(faces)
    return each.min(axis=1), each.max(axis=1)


def pixel_rays(camera: Camera, x: NDArray[np.integer], y: NDArray[np.integer]) -> FloatArray:
    """(N, 3) directions through the centres of pixels, with z = 1."""
    u = (x + 0.5 - camera.cx) / camera.fx
    v = (y + 0.5 - camera.cy) / camera.fy
    return np.stack([u, v, np.ones_like(u)], axis=-1)


def rays_meet_box(
    rays: FloatArray, cam_T_part: FloatArray, center: FloatArray, size: FloatArray
) -> NDArray[np.bool_]:
    """(N,) whether rays from the camera hit a part's box (slab method)."""
    R, t = cam_T_part[:3, :3], cam_T_part[:3, 3]
    direction = rays @ R
    direction = np.where(direction == 0, 1e-12, direction)
    start = -t @ R - center
    one, other = (-size / 2 - start) / direction, (size / 2 - start) / direction
    enter = np.minimum(one, other).max(axis=-1)
    leave = np.maximum(one, other).min(axis=-1)
    return (leave >= np.maximum(enter, 0)) & np.isfinite(leave)


def reach_outside_box(
    points: FloatArray, cam_T_part: FloatArray, center: FloatArray, size: FloatArray
) -> FloatArray:
    """(N,) how far (m, in the largest coordinate) points lie outside a part's box."""
    in_part = (points - cam_T_part[:3, 3]) @ cam_T_part[:3, :3]
    return np.maximum(np.abs(in_part - center) - size / 2, 0).max(axis=-1)
