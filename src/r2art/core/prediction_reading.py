"""From JSON back to a prediction, telling by field what is wrong with one that is none.

The rules are those of `prediction.schema.json`, and those it cannot say: rotations are rotations,
axes have length 1, names occur once, and joint j moves part j + 1. Fields of later versions are
passed over.
"""

import sys
from dataclasses import dataclass
from typing import Any, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.category import JointKind
from r2art.core.errors import InputError
from r2art.core.prediction import (
    FRAME,
    SCHEMA,
    UNITS,
    CameraSource,
    JointEstimate,
    PartEstimate,
    Prediction,
    Refinement,
    Scale,
    ScaleSource,
)

Word = TypeVar("Word")

RIGID = 1e-3
"""How far a rotation may be from one, and an axis from length 1: as far as digits get lost."""


@dataclass(frozen=True)
class Value:
    """A piece of a JSON document, and where in it: ``parts[1].box_size``."""

    content: Any
    place: str = ""

    def fault(self, rule: str) -> InputError:
        """What to raise where the content breaks a rule: "must be a number"."""
        shown = repr(self.content)
        shown = shown if len(shown) <= 60 else f"{shown[:57]}..."
        name = f"`{self.place}`" if self.place else "a prediction"
        return InputError(f"this is not a prediction JSON: {name} {rule}, got {shown}")

    def __getitem__(self, name: str) -> "Value":
        if not isinstance(self.content, dict):
            raise self.fault("must be an object")
        place = f"{self.place}.{name}" if self.place else name
        if name not in self.content:
            raise InputError(f"this is not a prediction JSON: the field `{place}` is missing")
        return Value(self.content[name], place)

    def has(self, name: str) -> bool:
        """Whether it is an object with such a field."""
        return isinstance(self.content, dict) and name in self.content

    def items(self, count: int | None = None) -> list["Value"]:
        """The elements of a list, which must be so many."""
        size = "a list" if count is None else f"a list of {count}"
        if not isinstance(self.content, list) or count not in (None, len(self.content)):
            raise self.fault(f"must be {size}")
        return [Value(item, f"{self.place}[{i}]") for i, item in enumerate(self.content)]

    def text(self) -> str:
        """A text."""
        if not isinstance(self.content, str):
            raise self.fault("must be a text")
        return self.content

    def name(self) -> str:
        """A text that is not empty."""
        if not self.text():
            raise self.fault("must not be empty")
        return self.content

    def one_of(self, words: tuple[Word, ...]) -> Word:
        """One of some words."""
        if self.content not in words:
            raise self.fault(f"must be one of {', '.join(map(str, words))}")
        return self.content

    def boolean(self) -> bool:
        """True or false."""
        if not isinstance(self.content, bool):
            raise self.fault("must be true or false")
        return self.content

    def whole(self, least: int) -> int:
        """A whole number, at least so large."""
        if not isinstance(self.content, int) or isinstance(self.content, bool):
            raise self.fault("must be a whole number")
        if self.content < least:
            raise self.fault(f"must be at least {least}")
        return self.content

    def number(self, least: float = -np.inf, most: float = np.inf) -> float:
        """A finite number between two bounds."""
        number = self.content
        if not isinstance(number, int | float) or isinstance(number, bool):
            raise self.fault("must be a number")
        if not abs(number) <= sys.float_info.max:
            raise self.fault("must be finite")
        if not least <= number <= most:
            bounds = f"at least {least:g}" if np.isinf(most) else f"between {least:g} and {most:g}"
            raise self.fault(f"must be {bounds}")
        return float(number)

    def number_or_null(self, least: float = -np.inf, most: float = np.inf) -> float | None:
        """Such a number, or None for null."""
        return None if self.content is None else self.number(least, most)

    def positive(self) -> float:
        """A number above 0."""
        if self.number() <= 0:
            raise self.fault("must be positive")
        return self.number()

    def vector(self, length: int = 3) -> NDArray[np.float64]:
        """(length,) numbers."""
        return np.array([item.number() for item in self.items(length)])

    def sizes(self) -> NDArray[np.float64]:
        """(3,) positive numbers."""
        return np.array([item.positive() for item in self.items(3)])

    def unit(self) -> NDArray[np.float64]:
        """(3,) a vector of length 1."""
        if abs(np.linalg.norm(self.vector()) - 1) > RIGID:
            raise self.fault("must have length 1")
        return self.vector()

    def pose(self) -> NDArray[np.float64]:
        """(4, 4) a rigid transform."""
        pose = np.stack([row.vector(4) for row in self.items(4)])
        R = pose[:3, :3]
        is_rotation = np.allclose(R @ R.T, np.eye(3), atol=RIGID) and np.linalg.det(R) > 0
        if not is_rotation or pose[3].tolist() != [0, 0, 0, 1]:
            raise self.fault("must be a rotation and a shift, the last row 0 0 0 1")
        return pose


def read(content: Any) -> Prediction:
    """The prediction that decoded JSON describes.

    Raises:
        InputError: It describes none; the message names the field, the rule and what is there.
    """
    data = Value(content)
    schema = data["schema"].content
    if schema != SCHEMA:
        raise InputError(f"the prediction is of schema {schema!r}; this r2art reads {SCHEMA!r}")
    data["frame"].one_of((FRAME,))
    for quantity, unit in UNITS.items():
        data["units"][quantity].one_of((unit,))
    parts = data["parts"]
    if not parts.items():
        raise parts.fault("must hold at least the root")
    estimates = tuple(map(_part, parts.items()))
    names = [part.name for part in estimates]
    _distinct(names, parts, "name")
    joints = data["joints"]
    if len(joints.items()) != len(names) - 1:
        raise joints.fault(f"must be {len(names) - 1}, one for each part but the root")
    moves = tuple(_joint(value, names, j) for j, value in enumerate(joints.items()))
    _distinct([joint.name for joint in moves], joints, "name")
    camera, category, path = data["camera"], data["category"], data["image"]["path"]
    x1, y1, x2, y2 = data["box"].vector(4).tolist()
    return Prediction(
        image_path=_text_or_none(path),
        category=category["name"].name(),
        category_score=category["score"].number_or_null(0, 1),
        box=(x1, y1, x2, y2),
        camera=_camera(camera, data["image"]),
        camera_source=camera["source"].one_of(get_args(CameraSource)),
        parts=estimates,
        joints=moves,
        rejected=_text_or_none(data["rejected"]) if data.has("rejected") else None,
        warnings=tuple(item.text() for item in data["warnings"].items()),
        scale=_scale(data["scale"]) if data.has("scale") else Scale(),
        refinement=_refinement(data["refinement"]) if data.has("refinement") else None,
    )


def _text_or_none(value: Value) -> str | None:
    return None if value.content is None else value.text()


def _distinct(names: list[str], place: Value, field: str) -> None:
    for i, name in enumerate(names):
        if name in names[:i]:
            raise Value(name, f"{place.place}[{i}].{field}").fault("must not occur twice")


def _camera(camera: Value, image: Value) -> Camera:
    return Camera(
        fx=camera["fx"].positive(),
        fy=camera["fy"].positive(),
        cx=camera["cx"].number(),
        cy=camera["cy"].number(),
        width=image["width"].whole(1),
        height=image["height"].whole(1),
    )


def _part(part: Value) -> PartEstimate:
    return PartEstimate(
        name=part["name"].name(),
        cam_T_part=part["cam_T_part"].pose(),
        box_center=part["box_center"].vector(),
        box_size=part["box_size"].sizes(),
        confidence=part["confidence"].number(0, 1),
    )


def _joint(joint: Value, parts: list[str], number: int) -> JointEstimate:
    child = parts[number + 1]
    if joint["child"].text() != child:
        raise joint["child"].fault(f"must be {child!r}, the part after as many joints")
    low, high = joint["limits"].vector(2).tolist()
    if low > high:
        raise joint["limits"].fault("must not begin above their end")
    return JointEstimate(
        name=joint["name"].name(),
        kind=joint["kind"].one_of(get_args(JointKind)),
        parent=joint["parent"].one_of(tuple(parts[: number + 1])),
        child=child,
        state=joint["state"].number(),
        limits=(low, high),
        axis=joint["axis"].unit(),
        pivot=joint["pivot"].vector(),
        confidence=joint["confidence"].number_or_null(0, 1) if joint.has("confidence") else None,
    )


def _scale(scale: Value) -> Scale:
    return Scale(
        source=scale["source"].one_of(get_args(ScaleSource)),
        spread=scale["spread"].number_or_null(0),
    )


def _refinement(refinement: Value) -> Refinement | None:
    if refinement.content is None:
        return None
    return Refinement(
        steps=refinement["steps"].whole(0),
        start_residual=refinement["start_residual"].number(0),
        residual=refinement["residual"].number(0),
        converged=refinement["converged"].boolean(),
    )
