"""Procedural categories, one module each: endless instances, each fixed by one integer.

A module (or package) in this folder is a category. It has

- ``generate(rng, photos=()) -> Instance``: an object with real dimensions, closed at rest;
- ``STAGING``, a `r2art.data.staging.Staging`: how people photograph such objects;
- ``SYMMETRY``, a `r2art.core.category.Symmetry`, where two labellings of one object look alike;
- ``MIRROR``, a `r2art.core.category.Mirror`, where objects are alike on both sides.

Nothing else needs to know of it; docs/new_category.md shows how to add one.
"""

import pkgutil
import zlib
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np

from r2art.core.category import Category, Mirror, Symmetry
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


def symmetry(category: str) -> Symmetry | None:
    """The labelling under which objects of a category look the same, if there is one."""
    return getattr(_module(category), "SYMMETRY", None)


def mirror(category: str) -> Mirror | None:
    """What objects of a category are in a mirror, if they are of the category there."""
    return getattr(_module(category), "MIRROR", None)


def with_symmetries(category: Category) -> Category:
    """A prior with the symmetry and the mirror that the generator of its name declares.

    Args:
        category: Keeps those that it has; gets none where no generator makes such objects or
            declares one, or its parts are joined in another way.
    """
    if category.name not in CATEGORIES:
        return category
    turned, reflected = symmetry(category.name), mirror(category.name)
    if category.symmetry is None and turned is not None and turned.fits(category.joints):
        category = replace(category, symmetry=turned)
    if category.mirror is None and reflected is not None and reflected.fits(category.joints):
        category = replace(category, mirror=reflected)
    return category


def _module(category: str) -> ModuleType:
    if category not in CATEGORIES:
        raise UsageError(f"no generator for {category!r}; there are {', '.join(CATEGORIES)}")
    return import_module(f"{__name__}.{category}")
