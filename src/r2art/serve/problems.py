"""What goes wrong, as problem JSON (RFC 9457): what, why, and what to do about it."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from http import HTTPStatus
from typing import Any

from fastapi import Response

from r2art.core.errors import InputError, R2ArtError, UsageError

MEDIA_TYPE = "application/problem+json"


class Kind(Enum):
    """The kinds of problems: HTTP status and title of each, its name being the slug."""

    MALFORMED_REQUEST = (400, "The request cannot be understood")
    NO_SUCH_PAGE = (404, "There is nothing here")
    WRONG_METHOD = (405, "This page does not take this method")
    SLOW_UPLOAD = (408, "The upload took too long")
    TOO_LARGE = (413, "The upload is too large")
    WRONG_MEDIA_TYPE = (415, "The body is of a type that is not read")
    UNUSABLE_OPTION = (422, "An option cannot be meant")
    UNUSABLE_IMAGE = (422, "An image cannot be used")
    FAULT = (500, "The server has a fault")
    BUSY = (503, "All places are taken")
    SLOW_ANSWER = (503, "The answer took too long")

    def __init__(self, status: int, title: str) -> None:
        self.status = status
        self.title = title

    @property
    def uri(self) -> str:
        """The ``type`` of such a problem."""
        return f"urn:r2art:problem:{self.name.lower().replace('_', '-')}"


@dataclass
class ProblemError(Exception):
    """A request that gets no prediction.

    Attributes:
        kind: Its kind.
        detail: What is wrong, and why.
        remedy: What to do about it.
        headers: Of the response.
    """

    kind: Kind
    detail: str
    remedy: str
    headers: Mapping[str, str] = field(default_factory=dict)

    def response(self, instance: str) -> Response:
        """The problem as a response to the request of that name."""
        body = {
            "type": self.kind.uri,
            "title": self.kind.title,
            "status": self.kind.status,
            "detail": self.detail,
            "remedy": self.remedy,
            "instance": instance,
        }
        text = json.dumps(body, ensure_ascii=False) + "\n"
        return Response(text, self.kind.status, dict(self.headers), MEDIA_TYPE)


def from_error(error: R2ArtError) -> ProblemError:
    """The problem behind an error of r2art, whose message ends in the remedy."""
    kind, otherwise = Kind.FAULT, "report it"
    if isinstance(error, UsageError):
        kind, otherwise = Kind.UNUSABLE_OPTION, "see /openapi.json for what can be given"
    elif isinstance(error, InputError):
        kind, otherwise = Kind.UNUSABLE_IMAGE, "send another image"
    detail, _, remedy = str(error).rpartition("; ")
    return ProblemError(kind, detail, remedy) if detail else ProblemError(kind, remedy, otherwise)


def from_status(status: int, path: str) -> ProblemError:
    """The problem behind a status that the router gives."""
    pages = "see /openapi.json for the pages there are"
    if status == HTTPStatus.NOT_FOUND:
        return ProblemError(Kind.NO_SUCH_PAGE, f"there is no page {path}", pages)
    if status == HTTPStatus.METHOD_NOT_ALLOWED:
        return ProblemError(Kind.WRONG_METHOD, f"{path} does not take this method", pages)
    return ProblemError(Kind.MALFORMED_REQUEST, HTTPStatus(status).phrase, pages)


SCHEMA: dict[str, Any] = {
    "title": "Problem",
    "description": "What went wrong (RFC 9457).",
    "type": "object",
    "required": ["type", "title", "status", "detail", "remedy", "instance"],
    "additionalProperties": False,
    "properties": {
        "type": {"enum": [kind.uri for kind in Kind]},
        "title": {"type": "string", "description": "What is wrong, the same for all of a type."},
        "status": {"type": "integer", "minimum": 400, "maximum": 599},
        "detail": {"type": "string", "description": "What is wrong with this request, and why."},
        "remedy": {"type": "string", "description": "What to do about it."},
        "instance": {
            "type": "string",
            "description": "This request, as in the header X-Request-Id and in the server's log.",
        },
    },
}
