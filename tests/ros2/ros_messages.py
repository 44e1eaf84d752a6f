"""Images and camera_info as drivers send them."""

from pathlib import Path

import numpy as np

PACKAGE = Path(__file__).resolve().parents[2] / "ros2"


def image(raw, header, pixels, encoding, *, padding=0, big=False):
    """A sensor_msgs/Image of (H, W, C) pixels, whose rows end in ``padding`` bytes of rubbish."""
    height, width = pixels.shape[:2]
    if pixels.dtype == np.uint16:
        pixels = pixels.astype(">u2" if big else "<u2")
    rows = np.frombuffer(pixels.tobytes(), np.uint8).reshape(height, -1)
    data = np.concatenate([rows, np.full((height, padding), 137, np.uint8)], axis=1)
    return raw["sensor_msgs/msg/Image"](
        header=header,
        height=height,
        width=width,
        encoding=encoding,
        is_bigendian=int(big),
        step=data.shape[1],
        data=data.ravel(),
    )


def camera_info(raw, header, K, width, height, *, d=(), P=None, roi=(0, 0, 0, 0), binning=(0, 0)):
    x, y, w, h = roi
    P = np.c_[K, np.zeros(3)] if P is None else P
    return raw["sensor_msgs/msg/CameraInfo"](
        header=header,
        height=height,
        width=width,
        distortion_model="plumb_bob" if d else "",
        d=np.array(d, float),
        k=np.array(K, float).ravel(),
        r=np.eye(3).ravel(),
        p=np.array(P, float).ravel(),
        binning_x=binning[0],
        binning_y=binning[1],
        roi=raw["sensor_msgs/msg/RegionOfInterest"](
            x_offset=x, y_offset=y, height=h, width=w, do_rectify=False
        ),
    )
