"""What is installed beside r2art: versions, and which extras are complete."""

import platform
import re
from importlib import metadata

# "torch>=2.10; extra == 'train'", as metadata writes requirements.
REQUIREMENT = re.compile(
    r"""(?P<name>[\w.-]+)[^;]*(?:;.*extra\s*==\s*['"](?P<extra>[\w.-]+)['"])?"""
)


def versions() -> dict[str, str]:
    """Versions of r2art, Python, the system, and of every package that predicting needs."""
    needed = sorted(name for name, extra in _requirements() if extra is None)
    return {
        "r2art": metadata.version("r2art"),
        "python": platform.python_version(),
        "system": platform.platform(),
        **{name: _version(name) or "missing" for name in needed},
    }


def extras() -> dict[str, list[str]]:
    """The packages that each extra lacks here; none where it is complete."""
    lacking: dict[str, list[str]] = {}
    for name, extra in _requirements():
        if extra is not None:
            missing = lacking.setdefault(extra, [])
            if _version(name) is None:
                missing.append(name)
    return lacking


def requirement(text: str) -> tuple[str, str | None]:
    """The package that a line of metadata asks for, and the extra that does so, if one does."""
    match = REQUIREMENT.match(text)
    assert match is not None, text
    return match["name"], match["extra"]


def _requirements() -> list[tuple[str, str | None]]:
    return [requirement(text) for text in metadata.requires("r2art") or []]


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None
