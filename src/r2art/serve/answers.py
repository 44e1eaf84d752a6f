"""What a prediction is sent as."""

from collections.abc import Callable
from dataclasses import dataclass

from r2art.core.prediction import Prediction
from r2art.run.export import FORMATS
from r2art.run.files import OVERLAY, png_bytes
from r2art.serve.problems import Kind, ProblemError


@dataclass(frozen=True)
class Answer:
    """One way to send a prediction.

    Attributes:
        about: What it is, in a few words.
        media_type: Its Content-Type.
        suffix: How its files end, with the dot.
        encode: The bytes of a prediction.
    """

    about: str
    media_type: str
    suffix: str
    encode: Callable[[Prediction], bytes]


def _line(prediction: Prediction) -> bytes:
    return (prediction.to_json() + "\n").encode()


def _overlay(prediction: Prediction) -> bytes:
    return png_bytes(prediction.draw())


ANSWERS = {
    name: Answer(f.about, f.media_type, f.suffix, f.encode) for name, f in FORMATS.items()
} | {
    "json": Answer(
        "the prediction, one line as `r2art predict --json` prints it",
        "application/json",
        ".json",
        _line,
    ),
    "overlay": Answer("the photo, drawn upon", "image/png", OVERLAY, _overlay),
}


def answer(name: str) -> Answer:
    """The answer of that name.

    Raises:
        ProblemError: There is none.
    """
    if name not in ANSWERS:
        raise ProblemError(
            Kind.UNUSABLE_OPTION,
            f"there is no format {name[:40]!r}",
            f"formats are {', '.join(ANSWERS)}",
        )
    return ANSWERS[name]
