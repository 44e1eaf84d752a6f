"""Predictions from files: one, or one on each line as `r2art predict --json` prints them."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from r2art.core.errors import InputError
from r2art.core.prediction import Prediction

BLANKS = re.compile(r"\s+")


def read_predictions(path: Path) -> list[Prediction]:
    """All predictions in a file, in their order; lines of a clip that hold none are passed over.

    Raises:
        InputError: It is unreadable, holds none, or one of them is broken.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path} is not a prediction JSON: it is no text") from None
    found = []
    for number, content in enumerate(_values(text, path)):
        content = _of_clip(content)
        if content is not None:
            try:
                found.append(Prediction.from_dict(content))
            except InputError as error:
                which = f", value {number + 1}" if number else ""
                raise InputError(f"{path}{which}: {error}") from None
    if not found:
        raise InputError(f"{path} holds no prediction; give what `r2art predict` wrote")
    return found


def _values(text: str, path: Path) -> Iterator[Any]:
    """JSON values that follow one another, whatever blanks lie between."""
    decoder, at = json.JSONDecoder(), _after_blanks(text, 0)
    while at < len(text):
        try:
            value, at = decoder.raw_decode(text, at)
        except (ValueError, RecursionError) as error:
            raise InputError(f"{path} is not a prediction JSON: {error}") from None
        yield value
        at = _after_blanks(text, at)


def _after_blanks(text: str, at: int) -> int:
    found = BLANKS.match(text, at)
    return at if found is None else found.end()


def _of_clip(content: Any) -> Any:
    """The prediction of a line about a clip's frame (docs/video.md), else the value itself."""
    if isinstance(content, dict) and "frame_index" in content and "prediction" in content:
        return content["prediction"]
    return content
