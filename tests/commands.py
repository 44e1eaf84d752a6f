"""How tests call `r2art`."""

from r2art import cli


def run(*arguments: object) -> int | str | None:
    """Exit code of `r2art`, whether returned or raised by the argument parser."""
    try:
        return cli.main([str(a) for a in arguments])
    except SystemExit as stopped:
        return stopped.code
