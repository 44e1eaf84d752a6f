"""README, docs and CI keep their word."""

import contextlib
import io
import re
import shlex
from functools import cache
from pathlib import Path

import pytest

from r2art.cli import COMMANDS, main
from r2art.cli.group import Group

ROOT = Path(__file__).resolve().parent.parent
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]


def commands(page):
    """Lines of a page's shell blocks, without comments."""
    blocks = re.findall(r"```bash\n(.*?)```", page.read_text().replace("\\\n", " "), re.DOTALL)
    return [line.split("  #")[0].strip() for block in blocks for line in block.splitlines()]


def test_ci_runs_the_two_commands_of_the_readme():
    first, second = (c for c in commands(ROOT / "README.md") if c.startswith("python3 -m venv"))
    assert "r2art predict" in first
    assert second.endswith("pytest")
    lines = (ROOT / ".ci" / "run").read_text().splitlines()
    assert lines.count(first) == 1
    assert lines.count(second) == 1


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_every_command_in_the_docs_exists(page):
    named = {c.split()[1] for c in commands(page) if c.startswith("r2art ")}
    assert named <= set(COMMANDS)


@cache
def help_of(*command):
    """What a command's --help prints, or its group's if it has no such command."""
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.suppress(SystemExit):
        main([*command, "--help"])
    return out.getvalue()


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_every_option_in_the_docs_exists(page):
    for line in commands(page):
        words = shlex.split(line)
        if words[:1] != ["r2art"]:
            continue
        depth = 2 if isinstance(COMMANDS[words[1]], Group) else 1
        known = re.findall(r"(?<![\w-])--?[a-z][a-z-]*", help_of(*words[1 : 1 + depth]))
        options = {w.partition("=")[0] for w in words if re.match(r"--?[a-z]", w)}
        assert options <= set(known), (line, options - set(known))


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_every_link_between_pages_leads_somewhere(page):
    targets = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text())
    missing = [t for t in targets if not (page.parent / t).exists()]
    assert not missing
