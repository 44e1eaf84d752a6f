"""`docs/results.md`: each command (re)writes its own section, between two comments."""

import os
from pathlib import Path

from r2art.core.errors import InputError, UsageError

HEADING = """# Results

Every section below was written by the command it names; none by hand. Run the command again
with `--results docs/results.md` and its section is replaced.
"""


def begin(name: str) -> str:
    """The comment before section ``name``."""
    return f"<!-- begin {name} -->"


def end(name: str) -> str:
    """The comment after section ``name``."""
    return f"<!-- end {name} -->"


def with_section(page: str, name: str, markdown: str) -> str:
    """The page with section ``name`` replaced, or added at the end where it has none.

    Raises:
        UsageError: The page holds one of the section's comments without the other, or twice.
    """
    section = f"{begin(name)}\n{markdown.strip()}\n{end(name)}"
    counts = page.count(begin(name)), page.count(end(name))
    if counts == (0, 0):
        return f"{page.rstrip() or HEADING.rstrip()}\n\n{section}\n"
    before, _, rest = page.partition(begin(name))
    _, found, after = rest.partition(end(name))
    if counts != (1, 1) or not found:
        raise UsageError(
            f"the comments around section {name!r} are broken; need one {begin(name)} and after "
            f"it one {end(name)}"
        )
    return before + section + after


def write_section(path: Path, name: str, markdown: str) -> None:
    """Replace one section of a page on disk, whole or not at all; the page is made if missing."""
    try:
        page = path.read_text(encoding="utf-8") if path.exists() else ""
        part = path.with_name(path.name + ".part")
        part.write_text(with_section(page, name, markdown), encoding="utf-8")
        os.replace(part, path)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from None
