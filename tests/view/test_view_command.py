"""`r2art view` as a process: it says where it is, serves, and ends cleanly."""

import re
import signal
import subprocess
import sys
import urllib.request

import pytest

pytest.importorskip("viser", reason="needs the extra `view`")

from viewer_tab import LAPTOP

from r2art.cli import main

VIEW = (sys.executable, "-m", "r2art", "view")


def test_it_serves_until_ctrl_c():
    command = [*VIEW, str(LAPTOP), "--port", "0", "--no-open"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        line = process.stdout.readline().decode()
        found = re.fullmatch(r"r2art view: (http://127\.0\.0\.1:\d+) \(Ctrl-C ends it\)\n", line)
        assert found, line
        with urllib.request.urlopen(found[1], timeout=30) as page:
            assert b"<html" in page.read()
        process.send_signal(signal.SIGINT)
        try:
            out, err = process.communicate(timeout=60)
        finally:
            process.kill()  # else the test would wait for what does not end
    assert (process.returncode, out, err) == (0, b"", b"")


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (["missing.png"], 3, "missing.png: no such file"),
        (["--host", "203.0.113.1"], 2, "cannot listen on 203.0.113.1"),
        (["--max-megabytes", "0"], 2, "--max-megabytes must be a positive number"),
        (["--model", "missing.onnx"], 4, "no model at missing.onnx"),
    ],
)
def test_what_cannot_be_meant_is_told_before_anything_is_served(arguments, code, told, capsys):
    assert main(["view", "--no-open", *arguments]) == code
    assert told in capsys.readouterr().err


def test_without_the_extra_one_line_names_it(monkeypatch, capsys):
    for name in [name for name in sys.modules if name.startswith("r2art.view")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "viser", None)
    assert main(["view", "--no-open"]) == 2
    err = capsys.readouterr().err
    assert "pip install 'r2art[view]'" in err
    assert err.count("\n") == 1
