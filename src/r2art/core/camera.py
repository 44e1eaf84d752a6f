"""The pinhole camera, and what cropping and resizing an image does to it.

Pixels: the image covers [0, width] × [0, height]; the first pixel's centre is (0.5, 0.5).
Axes: OpenCV (x right, y down, z forward).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from r2art.core.errors import UsageError


@dataclass(frozen=True)
class Camera:
    """Focal lengths and principal point (px) of an image of ``width`` × ``height``."""

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    def __post_init__(self) -> None:
        values = (self.fx, self.fy, self.cx, self.cy)
        if not np.all(np.isfinite(values)):
            raise UsageError(f"camera {values} is not finite; give FX FY CX CY in pixels")
        if self.fx <= 0 or self.fy <= 0:
            raise UsageError(
                f"focal lengths must be positive, got fx={self.fx:g} fy={self.fy:g}; "
                "give them in pixels of this image"
            )
        if self.width < 1 or self.height < 1:
            raise UsageError(f"an image of {self.width}×{self.height} px has no camera")

    @classmethod
    def from_fov(cls, fov: float, width: int, height: int) -> "Camera":
        """Camera whose longer image side spans ``fov`` radians, centred, square pixels."""
        if not 0 < fov < np.pi:
            raise UsageError(
                f"field of view must lie between 0° and 180°, got {np.degrees(fov):g}°"
            )
        f = max(width, height) / 2 / np.tan(fov / 2)
        return cls(f, f, width / 2, height / 2, width, height)

    @cached_property
    def K(self) -> NDArray[np.float64]:
        """(3, 3) intrinsics."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1]], np.float64)

    @property
    def fov_y(self) -> float:
        """Field of view from top to bottom (rad), as if the principal point were the middle."""
        return 2 * float(np.arctan(self.height / 2 / self.fy))

    @property
    def aspect(self) -> float:
        """Width by height of what is seen at unit distance; of square pixels, the image's own."""
        return float(self.width / self.height * self.fy / self.fx)

    def crop(self, x: float, y: float, width: int, height: int) -> "Camera":
        """Camera of the window whose top left corner is (x, y); it may leave the image."""
        return Camera(self.fx, self.fy, self.cx - x, self.cy - y, width, height)

    def resize(self, width: int, height: int) -> "Camera":
        """Camera of the same view sampled to ``width`` × ``height``."""
        sx, sy = width / self.width, height / self.height
        return Camera(self.fx * sx, self.fy * sy, self.cx * sx, self.cy * sy, width, height)

    def project(self, points: NDArray[np.floating]) -> NDArray[np.floating]:
        """(..., 3) points in the camera frame (m) to (..., 2) pixels; z must be positive."""
        xy = points[..., :2] / points[..., 2:]
        return xy * (self.fx, self.fy) + (self.cx, self.cy)
