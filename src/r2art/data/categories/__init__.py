"""Procedural categories, one module each: endless instances, each fixed by one integer.

A module (or package) in this folder is a category. It has

- ``generate(rng, photos=()) -> Instance``: an object with real dimensions, closed at rest;
- ``STAGING``, a `r2art.data.staging.Staging`: how people photograph such objects.

Nothing else needs to know of it; docs/new_category.md shows how to add one.
"""

import pkgutil
import zlib
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np

from r2art.core.errors import UsageError
from r2art.data.shape import Instance
from r2art.data.staging import Staging

CATEGORIES = tuple(sorted(module.name for module in pkgutil.iter_modules(__path__)))


def make_instance(category: str, seed: int, photos: Sequence[Path] = ()) -> Instance:
    """Instance number ``seed`` of a category; the same to the byte for the same ``photos``."""
    rng = np.random.default_rng([zlib.crc32(category.encode()), seed])
    return _module(category).generate(rng, photos)


def staging(category: str) -> Staging:
    """How photos of a category are taken."""
    return _module(category).STAGING


def _module(category: str) -> ModuleType:
    if category not in CATEGORIES:
        raise UsageError(f"no generator for {category!r}; there are {', '.join(CATEGORIES)}")
    return import_module(f"{__name__}.{category}")
