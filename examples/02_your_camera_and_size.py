"""What you know about camera and object, and what each piece of it changes.

python examples/02_your_camera_and_size.py
"""

from pathlib import Path

import numpy as np
from PIL import Image

import r2art
from r2art.core.prediction import Prediction

HERE = Path(__file__).parent
# A calibration, as OpenCV's calibrateCamera gives it (px of the picture it was made with).
K = np.array([[1480.0, 0.0, 640.0], [0.0, 1480.0, 480.0], [0.0, 0.0, 1.0]])
CALIBRATED_AT = (1280, 960)


def calibrated(width: int, height: int) -> r2art.Camera:
    """The camera of photos that were made smaller after they were taken."""
    full = r2art.Camera(K[0, 0], K[1, 1], K[0, 2], K[1, 2], *CALIBRATED_AT)
    return full.resize(width, height)


def told(what: str, prediction: Prediction) -> None:
    """One line of what depends on camera and scale, and what does not."""
    base = prediction.part("base")
    print(
        f"{what:28} distance {base.cam_T_part[2, 3]:.3f} m, "
        f"width {100 * base.box_size[0]:.1f} cm, "
        f"lid at {np.degrees(prediction.joint('hinge').state):.0f}° "
        f"(camera {prediction.camera_source}, scale {prediction.scale.source})"
    )


def main() -> None:
    """The same photo with more and more known."""
    predictor = r2art.load()
    photo = Image.open(HERE / "laptop.png")  # its EXIF data know the focal length
    pixels = np.asarray(photo.convert("RGB"))  # bare pixels know nothing
    camera = calibrated(*photo.size)
    told("nothing known", predictor.predict(pixels, category="laptop"))
    told("EXIF", predictor.predict(photo, category="laptop"))
    told("a calibration", predictor.predict(photo, camera, "laptop"))
    wider = r2art.Camera.from_fov(np.radians(60), *photo.size)
    told("a field of view of 60°", predictor.predict(photo, wider, "laptop"))
    told("it is 31 cm wide", predictor.predict(photo, camera, "laptop", size=0.31))
    told("it is 0.8 m away", predictor.predict(photo, camera, "laptop", depth=0.8))


if __name__ == "__main__":
    main()
