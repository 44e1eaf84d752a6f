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

from r2art.cli.learn import evaluate, export, synth, train
from r2art.cli.predict import predict
from r2art.core.errors import R2ArtError, UsageError
from r2art.run.report import say

USAGE, INTERRUPTED = 2, 130
TRAIN_EXTRA = frozenset(
    {
        *("accelerate", "jaxtyping", "matplotlib", "onnx", "onnxscript", "pyarrow"),
        *("safetensors", "scipy", "timm", "torch", "trimesh", "warp"),
    }
)

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
  r2art synth laptop -n 1000 --out data/laptop  a labelled dataset

exit codes: 0 all done; 2 an argument cannot be meant; 3 an image is unreadable or unusable (the
others are done); 4 no usable model

r2art COMMAND --help lists a command's options; r2art --version prints the version."""

COMMANDS: dict[str, Callable[..., int]] = {
    "predict": predict,
    "synth": synth,
    "train": train,
    "eval": evaluate,
    "export": export,
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
        if (error.name or "").split(".")[0] not in TRAIN_EXTRA:
            raise
        needs = f"r2art {arguments[0]} needs `pip install 'r2art[train]'` ({error.name} is missing)"
        say("error", needs)
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
        summaries = {name: (f.__doc__ or "").splitlines()[0] for name, f in COMMANDS.items()}
        print(HELP.format(commands="\n".join(f"  {n:<9} {s}" for n, s in summaries.items())))
        return 0 if arguments else USAGE
    if command == "--version":
        from r2art import __version__

        print(f"r2art {__version__}")
        return 0
    if command not in COMMANDS:
        hint = f"r2art predict {command}" if Path(command).exists() else "r2art --help"
        raise UsageError(f"no command {command!r}; try `{hint}`")
    return tyro.cli(
        COMMANDS[command],
        prog=f"r2art {command}",
        args=rest,
        config=(DisallowNone, FlagCreatePairsOff),
    )
