"""What file names, folders and globs on the command line stand for."""

from collections.abc import Callable, Sequence
from pathlib import Path

from r2art.core.errors import InputError
from r2art.run.report import say


def expand(patterns: Sequence[str], find: Callable[[str], list[Path]]) -> tuple[list[Path], int]:
    """Every file meant, once each, and the exit code so far; what stands for none is told.

    Args:
        patterns: As given.
        find: The files one of them stands for; InputError if there are none.
    """
    found: dict[Path, Path] = {}
    exit_code = 0
    for pattern in patterns:
        try:
            for path in find(pattern):
                found.setdefault(path.absolute(), path)
        except InputError as error:
            say("error", str(error))
            exit_code = error.exit_code
    return list(found.values()), exit_code
