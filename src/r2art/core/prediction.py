"""What r2art says about one photo: the dataclasses behind the prediction JSON.

Metres and radians; camera frame x right, y down, z forward. docs/prediction.md explains every
field and `prediction.schema.json` beside this file is its JSON Schema.
"""

import json
import re
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.category import JointKind
from r2art.core.errors import InputError, UsageError
from r2art.core.image import Box, ImageLike, Photo, read_image

if TYPE_CHECKING:
    from PIL import Image

SCHEMA = "r2art/prediction/1"
SCHEMA_FILE = Path(__file__).with_name("prediction.schema.json")
FRAME = "opencv camera: x right, y down, z forward"
UNITS = {"length": "m", "angle": "rad"}

CameraSource = Literal["given", "exif", "guessed"]
ScaleSource = Literal["prior", "size", "depth"]
FloatArray = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True, eq=False)
class PartEstimate:
    """One rigid part.

    Attributes:
        name: For instance ``"lid"``.
        cam_T_part: (4, 4) pose of the part's frame in the camera's.
        box_center: (3,) centre of the part's box in the part's frame (m).
        box_size: (3,) full extents of that box (m), all positive.
        confidence: Probability that the part is right, its ADD (scale aligned) within 10 % of its
            diameter, calibrated on rendered photos; of models without a calibration what the
            network says. In [0, 1].
    """

    name: str
    cam_T_part: FloatArray
    box_center: FloatArray
    box_size: FloatArray
    confidence: float

    def corners(self) -> FloatArray:
        """(2, 2, 2, 3) corners of the box in the camera frame (m).

        The three indices choose the lower (0) or upper (1) side along the part's x (right),
        y (up) and z (front).
        """
        signs = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1], indexing="ij"), axis=-1)
        in_part = self.box_center + signs * self.box_size / 2
        return in_part @ self.cam_T_part[:3, :3].T + self.cam_T_part[:3, 3]


@dataclass(frozen=True, kw_only=True, eq=False)
class JointEstimate:
    """One joint, and how far it is open.

    Attributes:
        name: For instance ``"hinge"``.
        kind: ``"revolute"`` or ``"prismatic"``.
        parent: Name of the part it hangs on.
        child: Name of the part it moves.
        state: Angle (rad) or distance (m) from closed; positive opens.
        limits: The states the category knows, (closed, widest open).
        axis: (3,) unit direction in the camera frame, now.
        pivot: (3,) a point of the axis in the camera frame (m), now.
        confidence: Probability that the state is right, within a tenth of the limits' range (scale
            aligned), calibrated as those of parts are; None: of models that cannot tell.
    """

    name: str
    kind: JointKind
    parent: str
    child: str
    state: float
    limits: tuple[float, float]
    axis: FloatArray
    pivot: FloatArray
    confidence: float | None = None


@dataclass(frozen=True, kw_only=True)
class Scale:
    """Where the metres come from, which one photo cannot tell.

    Attributes:
        source: ``"prior"``: such objects are usually so large; ``"size"``, ``"depth"``: a length
            that the user has given.
        spread: Of the prior: standard deviation of the sizes of such objects, relative to their
            mean; None where it is not known or not meant.
    """

    source: ScaleSource = "prior"
    spread: float | None = None


@dataclass(frozen=True, kw_only=True)
class Refinement:
    """How far refinement against a mask has come.

    Attributes:
        steps: How many it took.
        start_residual: Distance between the outlines of estimate and mask, root mean square, as
            a share of the object's size in the photo, ...
        residual: ... and what has become of it.
        converged: Whether it had come to rest.
    """

    steps: int
    start_residual: float
    residual: float
    converged: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class Prediction:
    """The poses of all parts and the states of all joints of one object in one photo.

    Attributes:
        image_path: File the photo came from, or None.
        category: Name of the category.
        category_score: The model's probability of that category, or None where it was not asked
            (category and box both given).
        box: The object's box in the photo (px); it may leave the photo where the object does.
        camera: The camera used, of the photo's size.
        camera_source: Whether the camera was given, read from EXIF, or guessed.
        parts: P parts, the root first.
        joints: P - 1 joints; joint j moves part j + 1.
        rejected: Why the photo should be taken to show no such object; None: there is no reason.
        warnings: What the user should know before trusting this.
        scale: Where all lengths come from; see :meth:`scaled`.
        refinement: How it was refined against a mask; None: it was not.
        photo: The photo itself where no file holds it; :meth:`draw` uses it, JSON omits it.
    """

    image_path: str | None
    category: str
    category_score: float | None
    box: Box
    camera: Camera
    camera_source: CameraSource
    parts: tuple[PartEstimate, ...]
    joints: tuple[JointEstimate, ...]
    rejected: str | None = None
    warnings: tuple[str, ...] = ()
    scale: Scale = Scale()
    refinement: Refinement | None = None
    photo: Photo | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if not _is_finite(self.to_dict()):
            raise InputError("a prediction must hold finite numbers only, this one does not")

    def part(self, name: str) -> PartEstimate:
        """The part called ``name``; KeyError where there is none."""
        return {p.name: p for p in self.parts}[name]

    def joint(self, name: str) -> JointEstimate:
        """The joint called ``name``; KeyError where there is none."""
        return {j.name: j for j in self.joints}[name]

    def scaled(self, factor: float, source: ScaleSource) -> "Prediction":
        """The same photo of an object ``factor`` times as large and as far away.

        It looks the same: only lengths change, no angle and no pixel.

        Raises:
            UsageError: The factor is not a positive number.
        """
        if not (np.isfinite(factor) and factor > 0):
            raise UsageError(f"lengths can only be scaled by a positive number, not {factor:g}")
        return replace(
            self,
            parts=tuple(_scaled_part(p, factor) for p in self.parts),
            joints=tuple(_scaled_joint(j, factor) for j in self.joints),
            scale=Scale(source=source),
        )

    def to_dict(self) -> dict[str, Any]:
        """The prediction as JSON types, as docs/prediction.md documents them."""
        camera = self.camera
        return {
            "schema": SCHEMA,
            "frame": FRAME,
            "units": dict(UNITS),
            "image": {
                "path": self.image_path,
                "width": camera.width,
                "height": camera.height,
            },
            "category": {"name": self.category, "score": self.category_score},
            "box": [float(v) for v in self.box],
            "camera": {
                "fx": float(camera.fx),
                "fy": float(camera.fy),
                "cx": float(camera.cx),
                "cy": float(camera.cy),
                "source": self.camera_source,
            },
            "parts": [
                {
                    "name": p.name,
                    "cam_T_part": np.asarray(p.cam_T_part).tolist(),
                    "box_center": np.asarray(p.box_center).tolist(),
                    "box_size": np.asarray(p.box_size).tolist(),
                    "confidence": float(p.confidence),
                }
                for p in self.parts
            ],
            "joints": [
                {
                    "name": j.name,
                    "kind": j.kind,
                    "parent": j.parent,
                    "child": j.child,
                    "state": float(j.state),
                    "limits": [float(v) for v in j.limits],
                    "axis": np.asarray(j.axis).tolist(),
                    "pivot": np.asarray(j.pivot).tolist(),
                    "confidence": None if j.confidence is None else float(j.confidence),
                }
                for j in self.joints
            ],
            "scale": {"source": self.scale.source, "spread": self.scale.spread},
            "refinement": None if self.refinement is None else asdict(self.refinement),
            "rejected": self.rejected,
            "warnings": list(self.warnings),
        }

    def to_json(self, *, indent: int | None = None) -> str:
        """The prediction as JSON text: one line, or indented with every vector on its line."""
        text = json.dumps(self.to_dict(), indent=indent, ensure_ascii=False, allow_nan=False)
        if indent is None:
            return text
        # Real line breaks never occur inside JSON strings, so only lists of numbers match.
        return re.sub(
            r"\[\n\s+([-+.\deE,\s]+?)\n\s+\]", lambda m: f"[{' '.join(m[1].split())}]", text
        )

    @classmethod
    def from_json(cls, text: str | bytes) -> "Prediction":
        """Read what :meth:`to_json` wrote: the same prediction, to the last digit.

        Raises:
            InputError: It is no JSON, or breaks a rule of :meth:`from_dict`.
        """
        try:
            data = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise InputError(f"this is not a prediction JSON: {error}") from None
        return cls.from_dict(data)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> "Prediction":
        """The inverse of :meth:`to_dict`.

        Raises:
            InputError: A field is missing or cannot be meant (the message names it, the rule and
                what is there), or the prediction is of another schema version.
        """
        from r2art.core.prediction_reading import read

        return read(data)

    def draw(self, image: ImageLike | None = None) -> "Image.Image":
        """The photo with part boxes, joint axes and the root frame drawn on it.

        Args:
            image: The photo; where it is left out, the one predicted from (its file is read
                again).
        """
        from r2art.core.draw import draw

        source = next((s for s in (image, self.photo, self.image_path) if s is not None), None)
        if source is None:
            raise InputError("this prediction knows no image file; call draw(image)")
        return draw(self, read_image(source))


def _scaled_part(part: PartEstimate, factor: float) -> PartEstimate:
    pose = np.array(part.cam_T_part, float)
    pose[:3, 3] *= factor
    center, size = factor * part.box_center, factor * part.box_size
    return replace(part, cam_T_part=pose, box_center=center, box_size=size)


def _scaled_joint(joint: JointEstimate, factor: float) -> JointEstimate:
    along = factor if joint.kind == "prismatic" else 1.0
    low, high = joint.limits
    return replace(
        joint,
        state=along * joint.state,
        limits=(along * low, along * high),
        pivot=factor * joint.pivot,
    )


def _is_finite(value: Any) -> bool:
    if isinstance(value, dict):
        return all(map(_is_finite, value.values()))
    if isinstance(value, list):
        return all(map(_is_finite, value))
    return not isinstance(value, float) or bool(np.isfinite(value))
