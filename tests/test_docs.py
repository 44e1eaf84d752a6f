"""README, docs and CI keep their word."""

import contextlib
import functools
import io
import os
import re
import shlex
from functools import cache
from pathlib import Path

import pytest
import tyro
from PIL import Image
from tyro.conf import DisallowNone, FlagCreatePairsOff

import r2art
from r2art.cli import COMMANDS, main
from r2art.cli.group import Group
from r2art.run.predictor import SHIPPED_MODEL

ROOT = Path(__file__).resolve().parent.parent
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]

# What is not run here as it stands, and why; who runs it, or the like of it. All is parsed.
NOT_RUN = {
    r"r2art (synth|train|export) ": "hours at full size; tests/test_own_object.py, small",
    r"r2art calibrate ": "minutes; tests/learn/test_calibrate.py, small",
    r"r2art prior .*(--out|examples/cabinet)": "tests/test_own_object.py",
    r"r2art predict photo.jpg --model cabinet": "tests/test_own_object.py",
    r"r2art eval ": "minutes; tests/learn/evaluation/test_evaluate.py, small",
    r"r2art benchmark ": "hours; tests/data/test_benchmark.py, small",
    r"r2art (view|serve)\b": "runs until it is stopped; tests/view and tests/serve",
    r"r2art predict (.*--video|--webcam|.*\.mp4)": "needs a film or a webcam; tests/run/video",
    r"r2art predict caltech101/": "needs the photos; they are photos in a folder",
    r"r2art predict IMAGE\.\.\. \[": "the form of all predict commands",
    r"r2art data \w+ (ArtImage|data/artimage)": "needs ArtImage; tests/data/adapters",
    r"r2art doctor": "tests/cli/test_doctor.py",
    r"accelerate |srun ": "several processes; tests/learn/test_processes.py starts two",
    r"curl ": "needs a server; tests/serve sends such requests",
    r"(python -m )?pip |python3 -m venv|source ": "needs a package index; .ci/run installs",
    r"\.ci/run|pytest ": "runs this test",
    r"python examples/": "tests/test_examples.py",
    r"python docs/make_pictures\.py": "minutes; it makes the pictures that the pages show",
    r"python benchmarks/import_parity\.py": "needs models; tests/data/models/test_parity.py",
    r"python -m r2art\.run\.selftest": "replaces a file of the package; tests/cli/test_doctor.py",
}
# Pages whose Python needs no more than a photo; it runs as it stands.
RUN = ("README", "index", "first_minutes", "camera", "api", "faq", "prediction")


def commands(page):
    """Lines of a page's shell blocks, without comments."""
    blocks = re.findall(r"```bash\n(.*?)```", page.read_text().replace("\\\n", " "), re.DOTALL)
    lines = [line.split("  #")[0].split(" # ")[0].strip() for b in blocks for line in b.split("\n")]
    return [line for line in lines if line and not line.startswith("[")]


def python(page):
    """A page's Python blocks."""
    return re.findall(r"^```python\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE)


def why_not_run(line):
    return next((why for pattern, why in NOT_RUN.items() if re.match(pattern, line)), None)


EVERY = sorted({line for page in PAGES for line in commands(page)})
OURS = [line for line in EVERY if re.search(r"^r2art |-m r2art ", line) and "[--" not in line]


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


def parsed(line):
    """Read a command with the command line's own parser, and do nothing."""
    line = line.removesuffix("'") if line.startswith("srun") else line
    name, *rest = shlex.split(re.search(r"(?:^|-m )r2art (.*)", line)[1])
    command = COMMANDS[name]
    if isinstance(command, Group):
        command, rest = command.commands[rest[0]], rest[1:]
    idle = functools.wraps(command)(lambda *values, **options: 0)
    return tyro.cli(idle, args=rest, config=(DisallowNone, FlagCreatePairsOff))


@pytest.mark.parametrize("line", OURS)
def test_every_command_in_the_docs_can_be_read(line):
    assert parsed(line) == 0


@pytest.mark.parametrize("line", [line for line in EVERY if line.startswith("accelerate ")])
def test_accelerate_knows_its_options(line):
    launch = pytest.importorskip("accelerate.commands.launch", reason="needs the extra `train`")
    read = launch.launch_command_parser().parse_args(shlex.split(line)[2:])
    assert read.module
    assert read.training_script == "r2art"
    assert read.training_script_args[0] == "train"


def test_what_cannot_be_read_is_noticed(capsys):
    with pytest.raises(SystemExit):
        parsed("r2art predict photo.jpg --fov wide")
    assert "fov" in capsys.readouterr().err


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    """A folder in which lies what the pages speak of."""
    desk = tmp_path_factory.mktemp("desk")
    (desk / "examples").symlink_to(ROOT / "examples")
    with Image.open(ROOT / "examples" / "laptop.png") as image:
        photo = image.convert("RGB")
    for name in ("photo.jpg", "photos/a.jpg", "photos/b.jpg", "more/c.jpg"):
        (desk / name).parent.mkdir(exist_ok=True)
        photo.save(desk / name)
    mask = Image.new("L", photo.size)
    mask.paste(255, (180, 80, 530, 430))
    for name in ("photo.mask.png", "masks/a.png", "masks/b.png"):
        (desk / name).parent.mkdir(exist_ok=True)
        mask.save(desk / name)
    for line in EVERY:
        for name in re.findall(r"--model (\S+\.onnx)", line):
            if not (desk / name).exists():
                (desk / name).symlink_to(str(SHIPPED_MODEL))
        for name in re.findall(r"\b\w+\.urdf", line):
            if not (desk / name).exists():
                (desk / name).symlink_to(ROOT / "examples" / "cabinet.urdf")
    with contextlib.chdir(desk), contextlib.redirect_stdout(io.StringIO()):
        assert main(["predict", "examples/laptop.png", "--out", "out"]) == 0
        assert main(["predict", "examples/laptop.png"]) == 0
        shown = {n for line in EVERY for n in re.findall(r"data (?:show|check) (data/\S+)", line)}
        synth = "synth laptop -n 2 --size 64 --workers 1 --out data/made"
        assert main(synth.split()) == 0
        for name in shown:
            if not os.path.lexists(name):
                Path(name).symlink_to("made")
    return desk


QUICK = [line for line in EVERY if why_not_run(line) is None]


@pytest.mark.parametrize("line", QUICK)
def test_quick_commands_run_as_they_stand(line, desk, monkeypatch, capsys):
    monkeypatch.chdir(desk)
    program, *arguments = shlex.split(line)
    assert program == "r2art", f"who runs {line}? Say so in NOT_RUN"
    assert main(arguments) == 0
    assert "error" not in capsys.readouterr().err


def test_whatever_is_not_run_has_a_reason_that_is_true():
    assert len(QUICK) >= 10
    for pattern, why in NOT_RUN.items():
        assert any(re.match(pattern, line) for line in EVERY), f"no page has {pattern} any more"
        for path in re.findall(r"tests/[\w/.]*\w", why):
            assert (ROOT / path).exists(), path


@pytest.mark.parametrize("page", [p for p in PAGES if p.stem in RUN], ids=lambda p: p.name)
def test_python_that_needs_only_a_photo_runs_as_it_stands(page, desk, monkeypatch):
    monkeypatch.chdir(desk)
    found = {"r2art": r2art, "detections": [("laptop", (180, 80, 530, 430))]}
    blocks = python(page)
    assert blocks
    for block in blocks:
        exec(compile(block, page.name, "exec"), found)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_all_python_of_the_docs_is_python(page):
    for block in python(page):
        compile(block, page.name, "exec")


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_every_link_between_pages_leads_somewhere(page):
    targets = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text())
    missing = [t for t in targets if not (page.parent / t).exists()]
    assert not missing
