"""The command line: the only place that parses arguments, prints, and knows exit codes.

A subcommand is one function listed in `COMMANDS`: its parameters are its options, its docstring
is its help, and it returns the exit code. It imports what it needs when it runs, so that
`r2art predict` neither waits for torch nor needs it.
"""

import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import tyro
from tyro.conf import DisallowNone, FlagCreatePairsOff

from r2art.cli.benchmark import BENCHMARK
from r2art.cli.calibrate import calibrate
from r2art.cli.convert import convert
from r2art.cli.data import DATA
from r2art.cli.doctor import doctor
from r2art.cli.group import Group, listed
from r2art.cli.learn import evaluate, export, prior, synth, train
from r2art.cli.predict import predict
from r2art.cli.serve import serve
from r2art.cli.view import view
from r2art.core.errors import R2ArtError, UsageError
from r2art.run.report import say

USAGE, INTERRUPTED = 2, 130
# Modules that `pip install 'r2art[EXTRA]'` brings, by extra.
EXTRAS = {
    "train": (
        *("accelerate", "collada", "fast_simplification", "jaxtyping", "matplotlib", "mujoco"),
        *("onnx", "onnxscript", "pyarrow", "safetensors", "scipy", "timm", "torch", "trimesh"),
        "warp",
    ),
    "video": ("av",),
    "view": ("viser",),
    "serve": ("fastapi", "h11", "python_multipart", "starlette", "uvicorn"),
}

HELP = """usage: r2art COMMAND ...

Pose of every part and state of every joint of an articulated object, from one photo.

commands:
{commands}

examples:
  r2art predict laptop.jpg                      overlay, JSON and 3D scene into r2art_out/
  r2art predict photos/ "more/**/*.jpg"         folders and globs
  r2art predict laptop.jpg --fov 65             the camera's field of view, in degrees
  r2art predict drawer.png --category drawer --box 80 40 520 460
  r2art predict laptop.jpg --json               JSON on stdout, no files
  r2art predict clip.mp4                        a film; --webcam follows what a camera sees
  r2art convert r2art_out/ --to urdf            what was predicted, for other programs
  r2art synth laptop -n 1000 --out data/laptop  a labelled dataset
  r2art synth --urdf arm.urdf -n 1000 --out data/arm   of a robot, or object, of your own
  r2art data show data/laptop                   look at it

exit codes: 0 all done; 1 `data check`, `benchmark verify` or `doctor` has found faults; 2 an
argument cannot be meant; 3 an image or dataset is unreadable or unusable (the others are done);
4 no usable model

r2art COMMAND --help lists a command's options; r2art --version prints the version."""

COMMANDS: dict[str, Callable[..., int] | Group] = {
    "predict": predict,
    "convert": convert,
    "view": view,
    "serve": serve,
    "synth": synth,
    "prior": prior,
    "data": DATA,
    "benchmark": BENCHMARK,
    "train": train,
    "eval": evaluate,
    "export": export,
    "calibrate": calibrate,
    "doctor": doctor,
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run `r2art` with these arguments (else the process's) and return its exit code."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    try:
        return _dispatch(arguments)
    except R2ArtError as error:
        say("error", str(error))
        return error.exit_code
    except ModuleNotFoundError as error:
        module = (error.name or "").split(".")[0]
        extra = next((name for name, modules in EXTRAS.items() if module in modules), None)
        if extra is None:
            raise
        install = f"pip install 'r2art[{extra}]'"
        say("error", f"r2art {arguments[0]} needs `{install}` ({error.name} is missing)")
        return USAGE
    except KeyboardInterrupt:
        say("error", "interrupted")
        return INTERRUPTED
    except BrokenPipeError:  # the reader of our stdout has left, as `| head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


def _dispatch(arguments: list[str]) -> int:
    command, *rest = arguments or ["--help"]
    if command in ("-h", "--help"):
        print(HELP.format(commands=listed(COMMANDS)))
        return 0 if arguments else USAGE
    if command == "--version":
        from r2art import __version__

        print(f"r2art {__version__}")
        return 0
    if command not in COMMANDS:
        hint = f"r2art predict {command}" if Path(command).exists() else "r2art --help"
        raise UsageError(f"no command {command!r}; try `{hint}`")
    found = COMMANDS[command]
    if isinstance(found, Group):
        return _dispatch_in(found, f"r2art {command}", rest)
    return _call(found, f"r2art {command}", rest)


def _dispatch_in(group: Group, name: str, arguments: list[str]) -> int:
    command, *rest = arguments or ["--help"]
    if command in ("-h", "--help"):
        print(group.help.format(commands=listed(group.commands)))
        return 0 if arguments else USAGE
    if command not in group.commands:
        raise UsageError(f"no command {command!r} in `{name}`; try `{name} --help`")
    return _call(group.commands[command], f"{name} {command}", rest)


def _call(command: Callable[..., int], name: str, arguments: list[str]) -> int:
    config = (DisallowNone, FlagCreatePairsOff)
    return tyro.cli(command, prog=name, args=arguments, config=config)
