"""The exported model file: one ONNX graph, and what its metadata says it knows."""

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime as ort
from numpy.typing import NDArray

from r2art.core import prior_text
from r2art.core.camera import Camera
from r2art.core.category import Category, JointKind
from r2art.core.confidence import Calibration
from r2art.core.errors import ModelError
from r2art.core.image import Box, View

MODEL_FORMAT = "r2art/model/1"
MAX_THREADS = 4  # a small network gains nothing from more

SCORES = "category_scores"
PHOTO_OUTPUTS = ("found_box", SCORES)
PART_OUTPUTS = ("cam_T_part", "box_center", "box_size", "confidence")
JOINT_OUTPUTS = ("joint_state", "axis", "pivot")
KEYPOINT_OUTPUTS = ("keypoint", "keypoint_deviation")
"""Besides, of categories of known objects."""
MASK = "object_mask"
ASKED = "asked"
"""Optional input: whether to compute what it says of each category, and the mask."""


@dataclass(frozen=True)
class ModelJoint:
    """A joint as the metadata lists it; ``limits`` in rad or m."""

    name: str
    kind: JointKind
    parent: int
    limits: tuple[float, float]


@dataclass(frozen=True)
class ModelCategory:
    """A category the model knows: its parts, the root first, and its joints.

    ``size_spread`` is the relative spread of such objects' sizes, None where the file does not
    say; ``embedded`` is its prior as `r2art export` writes it, see :meth:`prior`;
    ``calibration`` is what `r2art calibrate` has found, None where nobody has asked it, and
    ``joint_calibration`` likewise, of the joints' states. ``has_keypoints`` tells whether its
    objects are all the same, so that their keypoints are looked for.
    """

    name: str
    parts: tuple[str, ...]
    joints: tuple[ModelJoint, ...]
    size_spread: float | None = None
    embedded: str | None = field(default=None, repr=False)
    calibration: Calibration | None = None
    joint_calibration: Calibration | None = None
    has_keypoints: bool = False

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs that speak of this category."""
        fields = PART_OUTPUTS + (JOINT_OUTPUTS if self.joints else ())
        fields += KEYPOINT_OUTPUTS if self.has_keypoints else ()
        return tuple(f"{self.name}.{name}" for name in fields)

    def prior(self) -> Category:
        """The mean object of the category, with points on its surface.

        Raises:
            ModelError: The model was exported before models held it, or is damaged.
        """
        if self.embedded is None:
            raise ModelError(
                f"the model does not hold the shape of a {self.name}; export it again with this "
                "r2art"
            )
        try:
            return prior_text.from_text(self.embedded)
        except Exception as error:  # zip, npy and JSON decoders raise whatever they trip over
            raise ModelError(f"the model's {self.name} is damaged ({error})") from None


class Model:
    """An opened model file.

    Attributes:
        input_size: Side (px) of the square images it takes.
        crop_margin: Side of a crop in units of the longer side of the object's box.
        categories: What it knows.

    Raises:
        ModelError: There is no such file, or it is not a model of r2art's present format.
    """

    def __init__(self, path: Path) -> None:
        self._session = _open(path)
        self._outputs = {o.name for o in self._session.get_outputs()}
        of_cameras = [i.shape[0] for i in self._session.get_inputs() if i.name == "K"]
        self._takes_cameras = of_cameras != [1]  # older files look through one at a time
        # Older files compute everything, whatever is asked for.
        optional = {i.name for i in self._session.get_overridable_initializers()}
        self._computes_what_is_asked = ASKED in optional
        try:
            metadata = json.loads(self._session.get_modelmeta().custom_metadata_map["r2art"])
            found = metadata["format"]
        except (LookupError, TypeError, ValueError):
            raise ModelError(
                f"{path} is an ONNX model, but not one of r2art's (it has no r2art metadata); "
                "make one with `r2art export`"
            ) from None
        if found != MODEL_FORMAT:
            raise ModelError(
                f"{path} has format {found!r}, this r2art reads {MODEL_FORMAT!r}; "
                "export the model again, or install the r2art that made it"
            )
        try:
            self.input_size = int(metadata["input_size"])
            self.crop_margin = float(metadata["crop_margin"])
            self.categories = tuple(_category(c) for c in metadata["categories"])
        except (LookupError, TypeError, ValueError) as error:
            raise ModelError(f"the r2art metadata of {path} is damaged: {error!r}") from None
        self._check_outputs(path)

    def _check_outputs(self, path: Path) -> None:
        promised = {*PHOTO_OUTPUTS, *(name for c in self.categories for name in c.outputs)}
        if missing := sorted(promised - self._outputs):
            raise ModelError(f"{path} lacks the outputs {', '.join(missing)}; export it again")

    def find(self, view: View) -> dict[str, NDArray[np.floating]]:
        """What the letterboxed whole photo shows: ``found_box`` (4,), ``category_scores`` (C,)."""
        return self._first(view, PHOTO_OUTPUTS)

    def look(self, view: View) -> dict[str, NDArray[np.floating]]:
        """What a crop shows, as if it were a whole photo: ``category_scores`` (C,).

        And ``object_mask`` (h, w), where the model `segments`.
        """
        return self._first(view, (SCORES, *self._mask))

    @property
    def segments(self) -> bool:
        """Whether it can tell where the object is seen."""
        return MASK in self._outputs

    @property
    def _mask(self) -> tuple[str, ...]:
        return (MASK,) if self.segments else ()

    def pose(
        self, view: View, box: Box, category: ModelCategory
    ) -> dict[str, NDArray[np.floating]]:
        """The object in a crop: part and joint outputs by their names without the category's.

        ``object_mask`` (h, w), where the model `segments`: the share of each of h × w places in
        the crop that shows the object. Of known objects, ``keypoint`` (N, 2): where in the crop
        (px) each of the prior's keypoints is, and ``keypoint_deviation`` (N,): how far off. And
        ``category_scores`` (C,), as of `look`.
        """
        return self.poses(view, box, category, (view.camera,))[0]

    def poses(
        self, view: View, box: Box, category: ModelCategory, cameras: Sequence[Camera]
    ) -> list[dict[str, NDArray[np.floating]]]:
        """`pose` through each of several cameras of the crop; hardly dearer than through one."""
        if len(cameras) > 1 and not self._takes_cameras:
            return [self.poses(view, box, category, (camera,))[0] for camera in cameras]
        names = (*category.outputs, SCORES, *self._mask)
        found = self._run(view, box, cameras, names)
        own = {name.removeprefix(f"{category.name}."): v for name, v in found.items()}
        of_all = {k: own.pop(k)[0] for k in (MASK, SCORES, *KEYPOINT_OUTPUTS) if k in own}
        return [{name: v[k] for name, v in own.items()} | of_all for k in range(len(cameras))]

    def _first(self, view: View, names: tuple[str, ...]) -> dict[str, NDArray[np.floating]]:
        whole = (0.0, 0.0, float(self.input_size), float(self.input_size))
        return {k: v[0] for k, v in self._run(view, whole, (view.camera,), names).items()}

    def _run(
        self, view: View, box: Box, cameras: Sequence[Camera], names: tuple[str, ...]
    ) -> dict[str, NDArray[np.floating]]:
        inputs = {
            "image": view.pixels[None],
            "K": np.stack([camera.K for camera in cameras]).astype(np.float32),
            "box": np.tile(np.asarray(box, np.float32), (len(cameras), 1)),
        }
        if self._computes_what_is_asked:
            asked = [not set(names).isdisjoint(c.outputs) for c in self.categories]
            inputs[ASKED] = np.array(asked + [MASK in names] * self.segments)
        found = zip(names, map(np.asarray, self._session.run(list(names), inputs)), strict=True)
        return {n: v if n == MASK else _decimal(v) for n, v in found}


def _open(path: Path) -> ort.InferenceSession:
    if not path.is_file():
        raise ModelError(f"no model at {path}; give one with --model, or reinstall r2art")
    options = ort.SessionOptions()
    options.log_severity_level = 3  # errors reach the user as exceptions
    options.intra_op_num_threads = min(_usable_cpus(), MAX_THREADS)
    try:
        return ort.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # ONNX Runtime has no base class of its own
        reason = " ".join(str(error).split())[:200]
        raise ModelError(f"{path} is not a model ONNX Runtime can open ({reason})") from None


def _usable_cpus() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _category(data: dict[str, Any]) -> ModelCategory:
    joints = tuple(
        ModelJoint(j["name"], j["kind"], int(j["parent"]), (j["limits"][0], j["limits"][1]))
        for j in data["joints"]
    )
    spread = float(data.get("size_spread", 0.0)) or None
    of_parts, of_joints = (
        None if found is None else Calibration.from_dict(found)
        for found in (data.get("calibration"), data.get("joint_calibration"))
    )
    return ModelCategory(
        name=data["name"],
        parts=tuple(data["parts"]),
        joints=joints,
        size_spread=spread,
        embedded=data.get("prior"),
        calibration=of_parts,
        joint_calibration=of_joints,
        has_keypoints=bool(data.get("has_keypoints", False)),
    )


def _decimal(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """float32 as the shortest decimals that mean them: 0.1, not 0.10000000149011612."""
    return np.array([float(str(v)) for v in values.ravel()]).reshape(values.shape)
