"""One line of JSON on stderr for every request, and for what the server itself has to say.

Nothing of a photo is logged, and of the options only category, format, and what a problem names.
"""

import json
import logging
import sys
import time
import traceback
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from r2art.serve.problems import Kind, ProblemError

LOGGER = logging.getLogger("r2art.serve")


class JsonLines(logging.Formatter):
    """A record as one line of JSON: time, level, message, and the ``facts`` it carries."""

    def format(self, record: logging.LogRecord) -> str:
        """The line."""
        at = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(record.created))
        line: dict[str, Any] = {
            "time": f"{at}.{int(record.msecs):03d}Z",
            "level": record.levelname.lower(),
            "message": record.getMessage(),
            **getattr(record, "facts", {}),
        }
        if record.exc_info:
            line["traceback"] = "".join(traceback.format_exception(*record.exc_info))
        return json.dumps(line, ensure_ascii=False)


@contextmanager
def logged_to_stderr() -> Iterator[None]:
    """Send what this package and uvicorn log, and Python's warnings, to stderr as lines of JSON."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonLines())
    loggers = [logging.getLogger(n) for n in (LOGGER.name, "uvicorn.error", "py.warnings")]
    kept = [(logger, logger.handlers, logger.level, logger.propagate) for logger in loggers]
    for logger in loggers:
        logger.handlers = [handler]
        logger.setLevel(logging.INFO)
        logger.propagate = False
    logging.captureWarnings(True)
    try:
        yield
    finally:
        logging.captureWarnings(False)
        for logger, handlers, level, propagate in kept:
            logger.handlers, logger.propagate = handlers, propagate
            logger.setLevel(level)


def instance(request: Request) -> str:
    """The name of a request, which its answer and its line in the log share."""
    return f"urn:uuid:{request.scope['state']['id']}"


def note(request: Request, **facts: Any) -> None:
    """Add to a request's line in the log."""
    request.scope["state"]["facts"].update(facts)


class RequestLog:
    """Names each request, logs it when it has been answered, and answers where all else failed."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request, or the life of the server."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        name = str(uuid.uuid4())
        facts: dict[str, Any] = {}
        scope["state"] = {**scope.get("state", {}), "id": name, "facts": facts}
        status = 0
        start = time.perf_counter()

        async def send_named(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                headers = [*message.get("headers", []), (b"x-request-id", name.encode())]
                message = {**message, "headers": headers}
            await send(message)

        failure = None
        try:
            await self._app(scope, receive, send_named)
        except Exception as error:  # a bug: log it, keep serving
            failure = error
            if status == 0:
                problem = ProblemError(
                    Kind.FAULT,
                    "the server has failed at this request, and logged why",
                    "report it with the lines of the log that name this instance",
                    {"Connection": "close"},
                )
                response = problem.response(f"urn:uuid:{name}")
                await response(scope, receive, send_named)
        LOGGER.log(
            logging.INFO if failure is None else logging.ERROR,
            "request",
            exc_info=failure,
            extra={
                "facts": {
                    "id": name,
                    "client": (scope.get("client") or ("",))[0],
                    "method": scope["method"],
                    "path": scope["path"][:200],
                    "status": status,
                    "ms": round(1e3 * (time.perf_counter() - start), 1),
                    **facts,
                }
            },
        )
