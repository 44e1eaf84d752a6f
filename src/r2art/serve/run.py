"""The server around the application: one process, until it is told to stop."""

import asyncio
import logging
import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager

import h11
import python_multipart  # noqa: F401  (needed to read forms; better missed now than then)
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle

from r2art.core.errors import UsageError
from r2art.run.predictor import Predictor
from r2art.serve.app import build_app
from r2art.serve.limits import Limits
from r2art.serve.log import LOGGER, logged_to_stderr
from r2art.serve.upload import LINGER

HEAD_SECONDS = 10.0
KEEP_ALIVE_SECONDS = 5
MOST_PORT = 65535
CONNECTIONS = 1000  # open at a time; more are told 503 by the server itself


class ImpatientProtocol(H11Protocol):
    """HTTP that closes a connection on which a request does not arrive in time.

    That is its head, and what is left of its body once it is answered (while it is not, the route
    says how long). uvicorn itself would wait for ever, and a few idle clients could take all
    connections.
    """

    _patience: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """A client is there: it has so long to say what it wants."""
        super().connection_made(transport)
        self._wait_for_head()

    def data_received(self, data: bytes) -> None:
        """A piece of a request has come."""
        super().data_received(data)
        self._wait_for_head()

    def on_response_complete(self) -> None:
        """An answer is out: the next request may begin, or has begun already."""
        super().on_response_complete()
        self._wait_for_head()
        if self.conn.their_state is h11.SEND_BODY:
            self.loop.call_later(LINGER, self._give_up_body, self.cycle)

    def connection_lost(self, exc: Exception | None) -> None:
        """The client has left."""
        self._stop_waiting()
        super().connection_lost(exc)

    def _wait_for_head(self) -> None:
        if self.conn.their_state is not h11.IDLE:
            self._stop_waiting()
        elif self._patience is None:
            self._patience = self.loop.call_later(HEAD_SECONDS, self._give_up)

    def _stop_waiting(self) -> None:
        if self._patience is not None:
            self._patience.cancel()
            self._patience = None

    def _give_up(self) -> None:
        self._patience = None
        if self.conn.their_state is h11.IDLE:
            self.transport.close()

    def _give_up_body(self, answered: RequestResponseCycle) -> None:
        if self.cycle is answered and self.conn.their_state is h11.SEND_BODY:
            self.transport.close()


def serve(predictor: Predictor, host: str, port: int, limits: Limits) -> None:
    """Serve until SIGTERM or Ctrl-C; requests inside are answered first.

    Raises:
        UsageError: The address cannot be listened on.
    """
    with logged_to_stderr():
        with listening(host, port) as listener, stopped_by_signals():
            LOGGER.info("listening", extra={"facts": {"url": url_of(listener), **vars(limits)}})
            make_server(predictor, limits).run(sockets=[listener])
        LOGGER.info("stopped")


def make_server(predictor: Predictor, limits: Limits) -> uvicorn.Server:
    """The server, not yet running."""
    config = uvicorn.Config(
        build_app(predictor, limits),
        http=ImpatientProtocol,
        ws="none",
        log_config=None,
        log_level=logging.WARNING,
        access_log=False,
        server_header=False,
        proxy_headers=False,
        limit_concurrency=CONNECTIONS,
        timeout_keep_alive=KEEP_ALIVE_SECONDS,
        timeout_graceful_shutdown=int(limits.seconds) + 5,
    )
    return uvicorn.Server(config)


@contextmanager
def listening(host: str, port: int) -> Iterator[socket.socket]:
    """A socket that listens on an address; port 0 is any that is free."""
    if not 0 <= port <= MOST_PORT:  # else the system takes its last 16 bits
        raise UsageError(f"port {port} is not one of 0 to {MOST_PORT}; choose another --port")
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        family, *_, address = found[0]
        listener = socket.create_server(address[:2], family=family, backlog=512)
    except OSError as error:
        reason = error.strerror or error
        raise UsageError(
            f"cannot listen on {host} port {port}: {reason}; choose another --host or --port"
        ) from None
    with listener:
        yield listener


def url_of(listener: socket.socket) -> str:
    """Where a client finds the server."""
    host, port = listener.getsockname()[:2]
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"


@contextmanager
def stopped_by_signals() -> Iterator[None]:
    """Let SIGTERM and Ctrl-C mean: done.

    uvicorn shuts down at either and then raises it once more, which would end the process as if
    it had failed.
    """
    kept = {s: signal.signal(s, lambda *_: None) for s in (signal.SIGTERM, signal.SIGINT)}
    try:
        yield
    finally:
        for number, handler in kept.items():
            signal.signal(number, handler)
