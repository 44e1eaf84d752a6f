"""Does the shipped model say here what it said where it was released?

``weights/selftest.json`` holds the checksum of the model and its prediction of
``weights/selftest.png``, a rendered laptop (``examples/laptop.png`` as 320 × 240 px of 32 colours:
small, and every decoder gives the same pixels). Whoever replaces the model writes it anew:

    python -m r2art.run.selftest
"""

import hashlib
import json
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.errors import ModelError
from r2art.core.image import read_image
from r2art.core.prediction import Prediction
from r2art.run.export.mechanism import rigid
from r2art.run.predictor import SHIPPED_MODEL, Predictor, load
from r2art.run.refinement.pose import vector_of

FloatArray = NDArray[np.floating]

PHOTO = files("r2art") / "weights" / "selftest.png"
STORED = files("r2art") / "weights" / "selftest.json"
FOV = np.radians(60)

ANGLE = np.radians(0.5)
"""rad, of parts and revolute joints. CPUs round differently, which refinement may enlarge ..."""
LENGTH = 0.01
"""... and of the object's distance, for places, sizes and prismatic joints."""


@dataclass(frozen=True, kw_only=True)
class Expected:
    """What ``selftest.json`` holds."""

    model_sha256: str
    prediction: Prediction


@dataclass(frozen=True, kw_only=True)
class Difference:
    """Between two predictions of one photo, the largest over all parts and joints.

    Attributes:
        category: The found one ...
        same_category: ... and whether it is the wanted one; where not, nothing else is compared.
        rotation: rad.
        length: Of places, box sizes and prismatic joints, as a share of the distance.
        joint: rad, of revolute joints.
    """

    category: str
    same_category: bool
    rotation: float
    length: float
    joint: float

    @property
    def is_small(self) -> bool:
        """Whether both say the same but for rounding."""
        small = max(self.rotation, self.joint) < ANGLE and self.length < LENGTH
        return self.same_category and bool(small)


def model_sha256() -> str:
    """SHA-256 of the shipped model's file.

    Raises:
        ModelError: There is none.
    """
    try:
        return hashlib.sha256(SHIPPED_MODEL.read_bytes()).hexdigest()
    except OSError as error:
        raise ModelError(
            f"cannot read {SHIPPED_MODEL} ({error.strerror}); reinstall r2art"
        ) from None


def expected() -> Expected:
    """What the released model says of the photo.

    Raises:
        ModelError: The file is missing or damaged.
    """
    try:
        data = json.loads(STORED.read_text(encoding="utf-8"))
        return Expected(
            model_sha256=str(data["model_sha256"]),
            prediction=Prediction.from_dict(data["prediction"]),
        )
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise ModelError(f"cannot use {STORED} ({error}); reinstall r2art") from None


def predict(predictor: Predictor) -> Prediction:
    """The prediction of the photo, category and box found by the model."""
    photo = read_image(PHOTO.read_bytes())
    return predictor.predict(photo, Camera.from_fov(FOV, photo.width, photo.height))


def difference(found: Prediction, wanted: Prediction) -> Difference:
    """How far two predictions of one photo lie apart."""
    if found.category != wanted.category:
        return Difference(
            category=found.category, same_category=False, rotation=0.0, length=0.0, joint=0.0
        )
    distance = float(np.linalg.norm(wanted.parts[0].cam_T_part[:3, 3]))
    turns, lengths, angles = [0.0], [0.0], [0.0]
    for a, b in zip(found.parts, wanted.parts, strict=True):
        pose_a, pose_b = rigid(a.cam_T_part), rigid(b.cam_T_part)
        turns.append(float(np.linalg.norm(vector_of(pose_a[:3, :3] @ pose_b[:3, :3].T))))
        lengths.append(_apart(pose_a[:3, 3], pose_b[:3, 3]))
        lengths.append(_apart(a.box_size, b.box_size))
    for a, b in zip(found.joints, wanted.joints, strict=True):
        (angles if a.kind == "revolute" else lengths).append(abs(a.state - b.state))
    return Difference(
        category=found.category,
        same_category=True,
        rotation=max(turns),
        length=max(lengths) / distance,
        joint=max(angles),
    )


def _apart(a: FloatArray, b: FloatArray) -> float:
    return float(np.linalg.norm(a - b))


def record() -> Path:
    """Write ``selftest.json`` from what the model says now; returns where."""
    content = {"model_sha256": model_sha256(), "prediction": predict(load()).to_dict()}
    path = Path(str(STORED))
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return path


if __name__ == "__main__":
    print(record())
