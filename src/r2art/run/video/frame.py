"""A frame of a clip, and what tracking says about it."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from r2art.core.image import ImageLike, Photo
from r2art.core.prediction import Prediction
from r2art.run.video.deviations import Deviations

FloatArray = NDArray[np.floating]

SCHEMA = "r2art/track/1"
TRACK_SCHEMA_FILE = Path(__file__).with_name("track.schema.json")

Status = Literal["tracked", "coasting", "lost"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame:
    """A picture and when it was taken.

    Attributes:
        time: s, from any beginning.
        image: Whatever `r2art.core.image.read_image` reads; None: nothing came of it.
        fault: Why not.
    """

    time: float
    image: ImageLike | None = field(repr=False)
    fault: str | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Tracked:
    """One frame, and the object in it.

    Attributes:
        index: Of the frame, from 0.
        time: s, as the frame says.
        status: ``"tracked"``: the frame shows the object; ``"coasting"``: it does not, and the
            object is supposed to have gone on as it went; ``"lost"``: it has not for too long, or
            was never found.
        prediction: Smoothed; None where lost.
        deviations: Its standard deviations; None where lost.
        rates: (J,) of the joints (rad/s, m/s); None where lost.
        measured: What the frame alone says, None where it says nothing.
        photo: The frame's picture.
        fault: Why there is none.
    """

    index: int
    time: float
    status: Status
    prediction: Prediction | None = None
    deviations: Deviations | None = None
    rates: FloatArray | None = None
    measured: Prediction | None = field(default=None, repr=False)
    photo: Photo | None = field(default=None, repr=False)
    fault: str | None = None

    def to_dict(self, source: str | None = None) -> dict[str, Any]:
        """As docs/video.md documents it; ``source`` names the clip."""
        return {
            "schema": SCHEMA,
            "source": source,
            "frame_index": self.index,
            "time": float(self.time),
            "status": self.status,
            "prediction": None if self.prediction is None else self.prediction.to_dict(),
            "rates": None if self.rates is None else self.rates.tolist(),
            "std": None if self.deviations is None else self.deviations.to_dict(),
        }
