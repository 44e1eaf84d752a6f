"""Intrinsics in Open3D's JSON form."""

from pathlib import Path

from r2art.core.camera import Camera
from r2art.core.errors import UsageError
from r2art.data.adapters.reading import read_json


def read_camera(path: Path, *, first_center: float) -> Camera:
    """A ``camera_intrinsic.json``: width, height and a column-major ``intrinsic_matrix``.

    Args:
        path: The file.
        first_center: Where its author puts the centre of the first pixel: 0.5 as r2art does and
            as renderers do, or 0 as camera calibrations do.

    Raises:
        Fault: It is missing, or its matrix is singular or of another form.
    """
    node = read_json(path)
    width, height = node["width"].whole(), node["height"].whole()
    matrix = node["intrinsic_matrix"]
    K = matrix.array(9).reshape(3, 3).T
    fx, fy, shift = K[0, 0], K[1, 1], 0.5 - first_center
    if abs(fx * fy) < 1e-9:
        raise matrix.fault(f"is singular: focal lengths {fx:g} and {fy:g}")
    if not (K[2] == (0, 0, 1)).all() or K[1, 0] != 0 or K[0, 1] != 0:
        raise matrix.fault("must be fx 0 0 0 fy 0 cx cy 1, column by column and without skew")
    try:
        return Camera(fx, fy, K[0, 2] + shift, K[1, 2] + shift, width, height)
    except UsageError as error:
        raise matrix.fault(str(error)) from None
