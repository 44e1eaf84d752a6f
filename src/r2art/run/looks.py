"""What the looks at a photo say, and their votes on the category.

Every look at the object, the one that poses are estimated from and that in a mirror among them,
names the category as well. They err in different ways, so all have a vote.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.errors import InputError
from r2art.core.image import Box, Photo, crop_square, letterbox
from r2art.run.boxes import tightened, usable_box
from r2art.run.mirror import in_mirror
from r2art.run.model import MASK, SCORES, Model

Outputs = Mapping[str, NDArray[np.floating]]
Scores = NDArray[np.floating]
"""(C + 1,) of each category, and last that it is none; they add up to 1."""


@dataclass(frozen=True, kw_only=True)
class Found:
    """What looks at a whole photo, and at the crop round what they find there, say.

    Attributes:
        scores: Of every look.
        box: The object's, in the photo (px).
        doubts: What makes it doubtful.
    """

    scores: tuple[Scores, ...]
    box: Box
    doubts: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Posed:
    """What looks at a crop say of an object of some category.

    Attributes:
        outputs: The estimate, see `r2art.run.model.Model.pose`.
        camera: The photo's, through which it holds.
        scores: Of every look.
    """

    outputs: Outputs
    camera: Camera
    scores: tuple[Scores, ...]


def together(*scores: Scores) -> Scores:
    """Scores of several looks as one: their geometric mean, which adds up to 1 again."""
    mean = np.exp(np.mean(np.log(np.maximum(scores, 1e-6)), axis=0))
    return mean / mean.sum()


def find(model: Model, photo: Photo, camera: Camera, given: Box | None = None) -> Found:
    """Look at a photo and, where the box is not given, at the crop round what is found.

    Args:
        model: That looks.
        photo: Upright.
        camera: The photo's.
        given: The object's box, where it is known.

    Raises:
        InputError: No finite answer comes of it.
    """
    size = model.input_size
    view = letterbox(photo.pixels, camera, size)
    seen = finite(model.find(view))
    if given is not None:
        return Found(scores=(seen[SCORES],), box=given, doubts=())
    box, doubts = usable_box(view.to_photo(seen["found_box"].tolist()), photo)
    view = crop_square(photo.pixels, camera, box, size, model.crop_margin)
    again = finite(model.look(view))
    if MASK in again:
        box = tightened(box, again[MASK], view, photo)
    return Found(scores=(seen[SCORES], again[SCORES]), box=box, doubts=doubts)


def all_scores(model: Model, photo: Photo, camera: Camera) -> Scores:
    """What all looks together that `r2art.run.predictor.Predictor` takes say of the category.

    Raises:
        InputError: No finite answer comes of it.
    """
    found = find(model, photo, camera)
    view = crop_square(photo.pixels, camera, found.box, model.input_size, model.crop_margin)
    more = (view, in_mirror(view, found.box)[0])
    return together(*found.scores, *(finite(model.look(v))[SCORES] for v in more))


def finite(outputs: Outputs) -> Outputs:
    """The outputs themselves.

    Raises:
        InputError: A number is not finite.
    """
    if broken := [name for name, values in outputs.items() if not np.all(np.isfinite(values))]:
        raise InputError(
            f"the model gives no finite answer for this photo ({', '.join(broken)}); "
            "check camera and box"
        )
    return outputs
