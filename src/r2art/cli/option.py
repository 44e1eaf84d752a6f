"""How an option without a plain default looks in a help text."""

from typing import Any

from tyro.conf import arg


def option(metavar: str, default: str) -> Any:
    """An option of that metavar, whose default is told in words."""
    return arg(metavar=metavar, help_behavior_hint=f"(default: {default})")
