"""A server in a thread of the test, and what to send to it."""

import io
import socket
import threading
import time
from contextlib import contextmanager
from dataclasses import dataclass

import httpx
import jsonschema

from r2art.serve.problems import MEDIA_TYPE, SCHEMA
from r2art.serve.run import listening, make_server, url_of

PNG = {"Content-Type": "image/png"}


class SlowPredictor:
    """A predictor that takes as long as it is told to, and counts."""

    def __init__(self, predictor, seconds):
        self.predictor = predictor
        self.seconds = seconds
        self.begun = 0
        self.most = self._now = 0
        self._lock = threading.Lock()

    def __getattr__(self, name):
        return getattr(self.predictor, name)

    def predict(self, *arguments, **options):
        with self._lock:
            self.begun += 1
            self._now += 1
            self.most = max(self.most, self._now)
        try:
            time.sleep(self.seconds)
            return self.predictor.predict(*arguments, **options)
        finally:
            with self._lock:
                self._now -= 1


@dataclass
class Served:
    """A running server: a client of it, and its address."""

    client: httpx.Client
    address: tuple[str, int]
    server: object

    def taken(self):
        return self.client.get("/health").json()["taken"]

    def connect(self):
        return socket.create_connection(self.address, timeout=20)


@contextmanager
def running(predictor, limits):
    with listening("127.0.0.1", 0) as listener:
        server = make_server(predictor, limits)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()
        while not server.started:
            assert thread.is_alive()
            time.sleep(0.01)
        with httpx.Client(base_url=url_of(listener), timeout=30) as client:
            try:
                yield Served(client, listener.getsockname(), server)
            finally:
                client.close()
                server.should_exit = True
                thread.join(20)
                assert not thread.is_alive()


def encoded(image, kind="PNG", **options):
    file = io.BytesIO()
    image.save(file, kind, **options)
    return file.getvalue()


def is_problem(answer, status, slug):
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == MEDIA_TYPE
    problem = answer.json()
    jsonschema.validate(problem, SCHEMA)
    assert problem["type"] == f"urn:r2art:problem:{slug}"
    assert problem["status"] == status
    assert problem["instance"] == f"urn:uuid:{answer.headers['x-request-id']}"
    for key in ("title", "detail", "remedy"):
        assert "\n" not in problem[key].strip()
        assert len(problem[key]) > 8
    return problem
