"""Commands of commands: `r2art data show`."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Group:
    """Subcommands under one name.

    Attributes:
        summary: One line for `r2art --help`.
        help: What the group's own --help prints, with ``{commands}`` where they are listed.
        commands: By name; each is a function as in `r2art.cli.COMMANDS`.
    """

    summary: str
    help: str
    commands: Mapping[str, Callable[..., int]]


def listed(commands: Mapping[str, Callable[..., int] | Group]) -> str:
    """Names and first lines of the docstrings, for a help text."""
    lines = []
    for name, command in commands.items():
        is_group = isinstance(command, Group)
        summary = command.summary if is_group else (command.__doc__ or "").splitlines()[0]
        lines.append(f"  {name:<9} {summary}")
    return "\n".join(lines)
