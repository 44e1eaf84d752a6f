"""One labelled photo: what every source of data yields."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera

FloatArray = NDArray[np.floating]

BACKDROP = 255
"""Mask value of pixels that show only the backdrop and may be replaced by another."""


@dataclass(frozen=True, kw_only=True)
class Sample:
    """A photo of one object and everything known about it.

    Attributes:
        image: (H, W, 3) uint8 RGB.
        mask: (H, W) uint8: k + 1 where part k is seen, 0 surroundings, `BACKDROP` behind all.
        depth: (H, W) float32, z in metres; 0 where unknown.
        camera: Intrinsics of the image.
        box: (4,) x1 y1 x2 y2 px around the whole object, hidden parts included; may leave
            the image.
        cam_T_part: (P, 4, 4) part poses.
        joint_state: (J,) rad or m.
        box_center: (P, 3) part boxes at rest, in the root frame (m).
        box_size: (P, 3) their extents (m).
        axis: (J, 3) unit joint axes at rest, in the root frame.
        pivot: (J, 3) points on the axes (m).
        visible: (P,) share of each part's silhouette that nothing else hides, 0 to 1.
        amodal: (H, W) uint16: bit k where part k would be seen if it were alone; None: unknown.
    """

    image: NDArray[np.uint8]
    mask: NDArray[np.uint8]
    depth: FloatArray
    camera: Camera
    box: FloatArray
    cam_T_part: FloatArray
    joint_state: FloatArray
    box_center: FloatArray
    box_size: FloatArray
    axis: FloatArray
    pivot: FloatArray
    visible: FloatArray
    amodal: NDArray[np.uint16] | None = None
