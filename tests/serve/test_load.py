"""Under load, with slow and vanishing clients, and at its end, the server stays itself."""

import io
import json
import logging
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import httpx
import pytest
from serving import PNG, SlowPredictor, is_problem, running

from r2art.serve import run
from r2art.serve.limits import Limits
from r2art.serve.log import LOGGER, JsonLines

HEAD = b"POST /predict HTTP/1.1\r\nHost: x\r\nContent-Type: image/png\r\n"


def wait_until(true, seconds=10):
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_full_server_says_when_to_come_back(predictor, photo):
    slow = SlowPredictor(predictor, 0.5)
    with running(slow, Limits(workers=1, queue=2)) as served:

        def ask(_):
            return served.client.post("/predict", content=photo, headers=PNG)

        with ThreadPoolExecutor(8) as clients:
            answers = list(clients.map(ask, range(8)))
        good = [a for a in answers if a.status_code == 200]
        assert len(good) == 3
        for answer in answers:
            if answer.status_code != 200:
                is_problem(answer, 503, "busy")
                assert int(answer.headers["retry-after"]) >= 1
        assert slow.begun == 3
        assert slow.most == 1
        assert served.taken() == 0
        assert ask(0).status_code == 200


def test_an_answer_that_takes_too_long_is_given_up(predictor, photo):
    slow = SlowPredictor(predictor, 1.0)
    with running(slow, Limits(workers=1, seconds=0.3)) as served:
        with ThreadPoolExecutor(3) as clients:
            answers = list(
                clients.map(
                    lambda _: served.client.post("/predict", content=photo, headers=PNG), range(3)
                )
            )
        for answer in answers:
            is_problem(answer, 503, "slow-answer")
            assert "retry-after" in answer.headers
        assert served.taken() == 0
    assert slow.begun == 1  # those that waited in vain were never begun


def test_a_body_that_trickles_is_given_up(predictor, photo):
    with running(predictor, Limits(seconds=1.0, workers=1, queue=0)) as served:
        with served.connect() as connection:
            connection.sendall(HEAD + b"Content-Length: 100000\r\n\r\n" + photo[:10])
            wait_until(lambda: served.taken() == 1)
            start = time.monotonic()
            answer = connection.recv(4000)
            assert answer.startswith(b"HTTP/1.1 408 ")
            assert b"connection: close" in answer.lower()
            assert time.monotonic() - start < 5
        assert served.taken() == 0
        assert served.client.post("/predict", content=photo, headers=PNG).status_code == 200


def test_a_head_that_trickles_is_given_up(predictor, monkeypatch):
    monkeypatch.setattr(run, "HEAD_SECONDS", 0.5)
    with running(predictor, Limits()) as served:
        for said in (b"", b"POST /pre", b"GET /health HTTP/1.1\r\nHost: x\r\n\r\nGET /he"):
            with served.connect() as connection:
                connection.sendall(said)
                start = time.monotonic()
                while connection.recv(4000):
                    pass
                assert time.monotonic() - start < 4
        assert served.client.get("/health").status_code == 200


def ask_in_vain(connection):
    """Announce a body where none is read, and hear so."""
    connection.sendall(b"POST /health HTTP/1.1\r\nHost: x\r\nContent-Length: 100\r\n\r\n")
    answer = b""
    while not answer.endswith(b"}\n"):
        answer += (piece := connection.recv(4000))
        assert piece
    assert answer.startswith(b"HTTP/1.1 405 ")


def test_a_body_that_nobody_reads_cannot_hold_its_connection(predictor, monkeypatch):
    monkeypatch.setattr(run, "LINGER", 0.5)
    with running(predictor, Limits()) as served, served.connect() as connection:
        ask_in_vain(connection)
        connection.sendall(b"x")  # which ends the server's own waiting
        start = time.monotonic()
        while connection.recv(4000):
            pass
        assert time.monotonic() - start < 4


def test_a_body_that_nobody_reads_but_ends_in_time_keeps_its_connection(predictor, monkeypatch):
    monkeypatch.setattr(run, "LINGER", 0.5)
    with running(predictor, Limits()) as served, served.connect() as connection:
        ask_in_vain(connection)
        connection.sendall(bytes(100))
        time.sleep(1.0)
        connection.sendall(b"GET /health HTTP/1.1\r\nHost: x\r\n\r\n")
        assert connection.recv(4000).startswith(b"HTTP/1.1 200 ")


def test_a_client_that_leaves_frees_its_place(predictor, photo):
    slow = SlowPredictor(predictor, 0.5)
    with running(slow, Limits(workers=1)) as served:
        whole = HEAD + f"Content-Length: {len(photo)}\r\n\r\n".encode() + photo
        connections = [served.connect() for _ in range(4)]
        for connection in connections[:3]:
            connection.sendall(whole)
        connections[3].sendall(HEAD + b"Content-Length: 9000\r\n\r\n" + photo[:10])
        wait_until(lambda: served.taken() == 4)
        for connection in connections:
            connection.close()
        wait_until(lambda: served.taken() == 0)
        assert served.client.post("/predict", content=photo, headers=PNG).status_code == 200
        assert slow.begun == 2  # the first, and the one that stayed


def test_every_request_is_one_line_of_the_log(predictor, photo):
    stream = io.StringIO()
    handler = logging.StreamHandler(stream)
    handler.setFormatter(JsonLines())
    LOGGER.addHandler(handler)
    LOGGER.setLevel(logging.INFO)
    try:
        with running(predictor, Limits()) as served:
            good = served.client.post("/predict?size=0.3", content=photo, headers=PNG)
            bad = served.client.post("/predict?fov=0", content=photo, headers=PNG)
    finally:
        LOGGER.removeHandler(handler)
    first, second = map(json.loads, stream.getvalue().splitlines())
    assert first["status"] == 200
    assert first["bytes"] == len(photo)
    assert first["category"] == good.json()["category"]["name"]
    assert second["problem"] == "urn:r2art:problem:unusable-option"
    for line, answer in ((first, good), (second, bad)):
        assert line["id"] == answer.headers["x-request-id"]
        assert line["ms"] > 0
        assert line["client"] == "127.0.0.1"
        assert "0.3" not in line["path"]


def test_a_fault_is_a_problem_too_and_is_logged(predictor, photo):
    class Broken(SlowPredictor):
        def predict(self, *arguments, **options):
            raise RuntimeError("secret of the house")

    stream = io.StringIO()
    handler = logging.StreamHandler(stream)
    handler.setFormatter(JsonLines())
    LOGGER.addHandler(handler)
    try:
        with running(Broken(predictor, 0), Limits()) as served:
            answer = served.client.post("/predict", content=photo, headers=PNG)
            is_problem(answer, 500, "fault")
            assert "secret" not in answer.text
            assert served.taken() == 0
    finally:
        LOGGER.removeHandler(handler)
    assert "secret of the house" in json.loads(stream.getvalue().splitlines()[0])["traceback"]


@pytest.mark.parametrize("stop", [signal.SIGTERM, signal.SIGINT])
def test_r2art_serve_finishes_what_it_has_begun(photo, stop):
    command = [sys.executable, "-m", "r2art", "serve", "--port", "0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        line = process.stderr.readline()
        assert line.startswith("{"), line + process.stderr.read()
        told = json.loads(line)
        assert told["message"] == "listening"
        host, _, port = told["url"].removeprefix("http://").partition(":")
        assert host == "127.0.0.1"
        half = len(photo) // 2
        with socket.create_connection((host, int(port)), timeout=20) as connection:
            wait_until(lambda: httpx.get(told["url"] + "/health").status_code == 200)
            head = HEAD + f"Content-Length: {len(photo)}\r\n\r\n".encode()
            connection.sendall(head + photo[:half])
            wait_until(lambda: httpx.get(told["url"] + "/health").json()["taken"] == 1)
            process.send_signal(stop)
            wait_until(lambda: not accepts(host, int(port)))
            connection.sendall(photo[half:])
            assert connection.recv(100).startswith(b"HTTP/1.1 200 ")
        rest = process.stderr.read().splitlines()
        assert process.wait(20) == 0
    assert json.loads(rest[-1])["message"] == "stopped"
    assert sum(json.loads(line).get("path") == "/predict" for line in rest) == 1


def accepts(host, port):
    try:
        socket.create_connection((host, port), timeout=1).close()
    except OSError:
        return False
    return True
