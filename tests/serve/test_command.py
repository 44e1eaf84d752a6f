"""`r2art serve` tells what it cannot do before it listens, and what it is missing."""

import socket
import sys

import pytest
from commands import run


def test_help_shows_how_to_ask(capsys):
    assert run("serve", "--help") == 0
    out = capsys.readouterr().out
    assert "curl -F photo=@laptop.jpg http://127.0.0.1:8000/predict" in out


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (["--workers", "0"], 2, "workers=0"),
        (["--queue", "-1"], 2, "queue=-1"),
        (["--timeout", "nan"], 2, "seconds=nan"),
        (["--max-megapixels", "500"], 2, "100"),
        (["--model", "missing.onnx"], 4, "missing.onnx"),
        (["--host", "192.0.2.1"], 2, "--host"),
        (["--port", "99999"], 2, "--port"),
    ],
)
def test_what_cannot_be_served_is_told_in_one_line(capsys, arguments, code, says):
    assert run("serve", *arguments) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert says in err
    assert err.count("\n") == 1


def test_a_port_that_is_taken_is_told(capsys):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        assert run("serve", "--port", str(taken.getsockname()[1])) == 2
    assert "in use" in capsys.readouterr().err


@pytest.mark.parametrize("module", ["fastapi", "uvicorn", "python_multipart"])
def test_a_missing_extra_is_named(capsys, monkeypatch, module):
    for name in [n for n in sys.modules if n.startswith("r2art.serve")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, module, None)
    assert run("serve", "--model", "missing.onnx") == 2
    assert "pip install 'r2art[serve]'" in capsys.readouterr().err
