"""A request that gets no prediction is told what, why and the remedy, and harms nobody else."""

import json
import struct
import zlib

import numpy as np
import pytest
from PIL import Image
from serving import PNG, encoded, is_problem

FORM_OF_OLD = "application/x-www-form-urlencoded"


def still_serves(served, photo):
    return served.client.post("/predict", content=photo, headers=PNG).status_code == 200


@pytest.mark.parametrize(
    ("query", "status", "slug", "says"),
    [
        ("box=1,2,3", 400, "malformed-request", "X1,Y1,X2,Y2"),
        ("fov=wide", 400, "malformed-request", "'wide'"),
        ("refine=2.5", 400, "malformed-request", "whole number"),
        ("fov=60&fov=70", 400, "malformed-request", "twice"),
        ("url=http://example.com/a.jpg", 400, "malformed-request", "'url'"),
        ("path=/etc/passwd", 400, "malformed-request", "'path'"),
        ("category=giraffe", 422, "unusable-option", "giraffe"),
        ("fov=0", 422, "unusable-option", "180"),
        ("fov=60&camera=9,9,9,9", 422, "unusable-option", "one of them"),
        ("camera=-5,5,1,1", 422, "unusable-option", "positive"),
        ("camera=nan,5,1,1", 422, "unusable-option", "finite"),
        ("size=-1", 422, "unusable-option", "positive"),
        ("size=1&depth=1", 422, "unusable-option", "scale"),
        ("refine=-1", 422, "unusable-option", "-1"),
        ("refine=1000000", 422, "unusable-option", "100"),
        ("box=900,0,990,50", 422, "unusable-option", "outside"),
        ("box=9,9,5,5", 422, "unusable-option", "empty"),
        ("format=docx", 422, "unusable-option", "glb"),
    ],
)
def test_options_that_cannot_be_meant(served, photo, query, status, slug, says):
    answer = served.client.post(f"/predict?{query}", content=photo, headers=PNG)
    problem = is_problem(answer, status, slug)
    assert says in problem["detail"] + problem["remedy"]


def damaged(photo):
    return photo[: len(photo) // 2]


def bomb(width, height):
    """A PNG that says it has so many pixels, and holds none."""

    def chunk(kind, data):
        check = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", check)

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + body


@pytest.mark.parametrize(
    ("content", "headers", "status", "slug", "says"),
    [
        (b"", PNG, 400, "malformed-request", "empty"),
        (b"dear diary " * 50, PNG, 422, "unusable-image", "the photo is not an image"),
        (damaged, PNG, 422, "unusable-image", "damaged"),
        (b"\0\0\0\x18ftypheic" + bytes(50), PNG, 422, "unusable-image", "HEIC"),
        (b"%!PS-Adobe-3.0 EPSF-3.0\n", PNG, 422, "unusable-image", "not an image"),
        (bomb(400, 300), PNG, 413, "too-large", "megapixels"),
        (bomb(2**31 - 1, 2**31 - 1), PNG, 413, "too-large", "megapixels"),
        (b"x" * 300_000, PNG, 413, "too-large", "0.2 MB"),
        (b"{}", {"Content-Type": "application/json"}, 415, "wrong-media-type", "curl"),
        (
            b"a=b",
            {"Content-Type": "application/x-www-form-urlencoded"},
            415,
            "wrong-media-type",
            "",
        ),
        (b"x", {}, 415, "wrong-media-type", "no type"),
        (b"x", {"Content-Type": "multipart/form-data"}, 400, "malformed-request", "boundary"),
        (
            b"no form at all",
            {"Content-Type": "multipart/form-data; boundary=x"},
            400,
            "malformed-request",
            "form",
        ),
    ],
)
def test_bodies_that_cannot_be_used(served, photo, content, headers, status, slug, says):
    content = content(photo) if callable(content) else content
    answer = served.client.post("/predict", content=content, headers=headers)
    problem = is_problem(answer, status, slug)
    assert says in problem["detail"] + problem["remedy"]
    assert still_serves(served, photo)


def test_forms_that_cannot_be_used(served, photo, image):
    def post(files, data=None):
        return served.client.post("/predict", files=files, data=data or {})

    is_problem(post({"mask": photo}), 400, "malformed-request")
    is_problem(post({"photo": b""}), 400, "malformed-request")
    is_problem(post([("photo", photo), ("photo", photo)]), 400, "malformed-request")
    is_problem(post({"photo": photo, "other": photo}), 400, "malformed-request")
    is_problem(post({"photo": photo}, {"url": "file:///etc/passwd"}), 400, "malformed-request")
    is_problem(post({"photo": photo}, {"mask": "/etc/passwd"}), 400, "malformed-request")
    is_problem(post({"photo": photo}, {"category": "x" * 5000}), 400, "malformed-request")
    is_problem(post({"photo": photo, "mask": b"no mask"}), 422, "unusable-image")
    black = encoded(Image.fromarray(np.zeros((120, 160), np.uint8)))
    problem = is_problem(post({"photo": photo, "mask": black}), 422, "unusable-image")
    assert "black" in problem["detail"]
    other = encoded(image.resize((80, 60)))
    problem = is_problem(post({"photo": photo, "mask": other}), 422, "unusable-image")
    assert "80×60" in problem["detail"]
    twice = served.client.post("/predict?fov=60", files={"photo": photo}, data={"fov": "60"})
    is_problem(twice, 400, "malformed-request")


def test_a_file_name_is_only_a_name(served, photo):
    files = {"photo": ("../../etc/passwd", photo, "text/plain")}
    answer = served.client.post("/predict", files=files)
    assert answer.status_code == 200
    assert answer.json()["image"]["path"] is None


def test_pages_and_methods_that_are_not_there(served):
    is_problem(served.client.get("/nothing"), 404, "no-such-page")
    answer = served.client.get("/predict")
    is_problem(answer, 405, "wrong-method")
    assert answer.headers["allow"] == "POST"


def test_an_endless_body_is_cut_off_while_it_comes(served, photo):
    """The server takes in little more than its limit of what a client would send for ever."""
    head = b"POST /predict HTTP/1.1\r\nHost: x\r\nContent-Type: image/png\r\n"
    with served.connect() as connection:
        connection.sendall(head + b"Transfer-Encoding: chunked\r\n\r\n")
        sent, answer = 0, b""
        chunk = b"10000\r\n" + bytes(65536) + b"\r\n"
        connection.setblocking(True)
        try:
            while sent < 200e6:
                connection.sendall(chunk)
                sent += 65536
        except OSError:
            pass
        assert sent < 20e6  # the limit is 0.2 MB; the rest is what sockets hold
        try:
            answer = connection.recv(4000)
        except ConnectionResetError:
            answer = b""
        assert not answer or answer.startswith(b"HTTP/1.1 413 ")
    assert still_serves(served, photo)


def test_a_large_body_is_refused_before_it_is_sent(served):
    head = (
        b"POST /predict HTTP/1.1\r\nHost: x\r\nContent-Type: image/png\r\n"
        b"Content-Length: 900000000\r\nExpect: 100-continue\r\n\r\n"
    )
    with served.connect() as connection:
        connection.sendall(head)
        answer = b""
        while piece := connection.recv(4000):
            answer += piece
    assert answer.startswith(b"HTTP/1.1 413 ")
    assert json.loads(answer.partition(b"\r\n\r\n")[2])["remedy"]
