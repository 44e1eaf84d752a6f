"""What a request may say besides the photo: the options of `r2art predict`, and the format.

They come in the address (`?fov=65`) or as fields of a form, and one table serves for reading
and for documenting them.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from r2art.core.camera import Camera
from r2art.core.errors import UsageError
from r2art.core.image import Photo
from r2art.run.predictor import Predictor, check_lengths
from r2art.run.refinement.mask_fit import STEPS, check_steps
from r2art.serve.problems import Kind, ProblemError

Numbers = tuple[float, float, float, float]

MAX_STEPS = 100
"""More steps of refinement than ever helped; a request must not occupy a thread for hours."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """What was asked for; see `r2art.run.predictor.Predictor.predict`.

    Attributes:
        category: Name of the category.
        box: x1 y1 x2 y2 (px).
        camera: fx fy cx cy (px).
        fov: Degrees across the longer side.
        size: Longest side of the root part (m).
        depth: Distance of the root part's centre (m).
        refine: Most steps of refinement.
        format: What the answer is: a key of `r2art.serve.answers.ANSWERS`.
    """

    category: str | None = None
    box: Numbers | None = None
    camera: Numbers | None = None
    fov: float | None = None
    size: float | None = None
    depth: float | None = None
    refine: int = STEPS
    format: str = "json"

    def check(self, predictor: Predictor) -> None:
        """Refuse what cannot be meant for any photo, before one is looked at.

        Raises:
            UsageError: So it is.
        """
        if self.category is not None:
            predictor.category(self.category)
        if self.camera is not None and self.fov is not None:
            raise UsageError("camera and fov say the same thing; give one of them")
        self._camera(1, 1)
        check_lengths(self.size, self.depth)
        check_steps(self.refine)
        if self.refine > MAX_STEPS:
            raise UsageError(f"refine={self.refine} is more than {MAX_STEPS} steps; give fewer")

    def camera_of(self, photo: Photo) -> Camera | None:
        """The camera of a photo, if one was given."""
        return self._camera(photo.width, photo.height)

    def _camera(self, width: int, height: int) -> Camera | None:
        if self.camera is not None:
            return Camera(*self.camera, width=width, height=height)
        if self.fov is not None:
            return Camera.from_fov(np.radians(self.fov), width, height)
        return None


@dataclass(frozen=True)
class Parameter:
    """An option as a request writes it.

    Attributes:
        read: Makes a value of its text, or raises ValueError.
        form: What the text must look like.
        description: What it means.
        example: For instance.
        schema: Its JSON Schema.
    """

    read: Callable[[str], Any]
    form: str
    description: str
    example: Any
    schema: dict[str, Any]


def _four(text: str) -> Numbers:
    a, b, c, d = map(float, text.split(","))
    return a, b, c, d


FOUR = {"type": "string", "pattern": r"^[^,]+(,[^,]+){3}$"}
POSITIVE = {"type": "number", "exclusiveMinimum": 0}

PARAMETERS = {
    "category": Parameter(
        str,
        "a name",
        "What the object is, one of `/categories`; else the model says.",
        "laptop",
        {"type": "string"},
    ),
    "box": Parameter(
        _four,
        "X1,Y1,X2,Y2",
        "A box around the whole object, in pixels of the upright photo; else the model finds it.",
        "80,40,520,460",
        FOUR,
    ),
    "camera": Parameter(
        _four,
        "FX,FY,CX,CY",
        "Focal lengths and principal point, in pixels of the upright photo; else EXIF, else a "
        "guess.",
        "554,554,320,240",
        FOUR,
    ),
    "fov": Parameter(
        float,
        "a number",
        "Field of view across the photo's longer side in degrees, instead of a camera.",
        65,
        {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 180},
    ),
    "size": Parameter(
        float,
        "a number",
        "Longest side of the root part in metres (a laptop's width), which fixes all lengths.",
        0.34,
        POSITIVE,
    ),
    "depth": Parameter(
        float,
        "a number",
        "Distance of the root part's centre along the viewing axis in metres, instead of a size.",
        0.8,
        POSITIVE,
    ),
    "refine": Parameter(
        int,
        "a whole number",
        "Most steps to fit the estimate to a mask of the object; 0 for none.",
        STEPS,
        {"type": "integer", "minimum": 0, "maximum": MAX_STEPS, "default": STEPS},
    ),
    "format": Parameter(
        str,
        "a name",
        "What the answer is.",
        "json",
        {"type": "string", "default": "json"},
    ),
}


def read_options(pairs: Iterable[tuple[str, str]]) -> Options:
    """Options from names and texts, however they came.

    Raises:
        ProblemError: A name is unknown or comes twice, or a text is not of its form.
    """
    found: dict[str, Any] = {}
    for name, text in pairs:
        if name not in PARAMETERS:
            raise ProblemError(
                Kind.MALFORMED_REQUEST,
                f"there is no option {name[:40]!r}",
                f"options are {', '.join(PARAMETERS)}; photo and mask are files in the body",
            )
        if name in found:
            raise ProblemError(
                Kind.MALFORMED_REQUEST, f"the option {name} is given twice", "give it once"
            )
        parameter = PARAMETERS[name]
        try:
            found[name] = parameter.read(text)
        except ValueError:
            raise ProblemError(
                Kind.MALFORMED_REQUEST,
                f"{name}={text[:40]!r} is not {parameter.form}",
                f"write for instance {name}={parameter.example}",
            ) from None
    return Options(**found)
