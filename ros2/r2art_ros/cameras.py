"""ROS camera_info to the camera of an image.

ROS puts the centre of the first pixel at (0, 0), r2art at (0.5, 0.5): the principal point moves
by half a pixel.
"""

from typing import Any

import numpy as np

from r2art.core.camera import Camera
from r2art.core.errors import InputError

FIRST_CENTRE = 0.5


def camera_of(info: Any, width: int, height: int, *, rectified: bool = False) -> Camera:
    """The camera of an image of ``width`` × ``height``.

    Args:
        info: A ``sensor_msgs/CameraInfo`` or anything with its fields. Its region of interest
            and binning are applied.
        width: Of the image (px).
        height: Of the image (px).
        rectified: Take the camera of the rectified image, ``P``, instead of ``K``.

    Raises:
        InputError: The camera is not calibrated, or the image is not of the size it tells.
    """
    name = "P" if rectified else "K"
    matrix = np.asarray(info.p if rectified else info.k, float)
    matrix = matrix.reshape(3, 4 if rectified else 3)
    fx, fy, cx, cy = matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]
    if not (np.all(np.isfinite(matrix)) and fx > 0 and fy > 0):
        raise InputError(
            f"the camera is not calibrated: {name} of camera_info has focal lengths {fx:g} and "
            f"{fy:g}; calibrate it (camera_calibration), or correct its camera_info_url"
        )
    shifted = (float(v) for v in (fx, fy, cx + FIRST_CENTRE, cy + FIRST_CENTRE))
    full = Camera(*shifted, width=int(info.width) or width, height=int(info.height) or height)
    seen = _binned(_region(full, info), info)
    if (seen.width, seen.height) != (width, height):
        raise InputError(
            f"the image has {width}×{height} px, but by camera_info it should have "
            f"{seen.width}×{seen.height}; use the camera_info published with this image"
        )
    return seen


def _region(camera: Camera, info: Any) -> Camera:
    roi = info.roi
    if not (roi.width and roi.height):  # ROS: 0 means the whole image
        return camera
    return camera.crop(roi.x_offset, roi.y_offset, int(roi.width), int(roi.height))


def _binned(camera: Camera, info: Any) -> Camera:
    x, y = max(int(info.binning_x), 1), max(int(info.binning_y), 1)
    return camera.resize(camera.width // x, camera.height // y)


def doubt_about_distortion(info: Any, *, rectified: bool) -> str | None:
    """Why an image is bent where the estimate thinks it straight, or None where it is not.

    Images are not undistorted here: image_proc does it well.
    """
    if rectified or not np.any(np.asarray(info.d, float)):
        return None
    return (
        f"the camera has a lens distortion ({info.distortion_model or 'of no named model'}) that "
        "is not corrected, so poses are off towards the corners; rectify with image_proc, "
        "subscribe to image_rect and set rectified:=true"
    )
