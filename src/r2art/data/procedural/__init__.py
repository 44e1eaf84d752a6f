"""Procedural objects: endless instances of a category, each fixed by one integer."""

import zlib
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from r2art.core.errors import UsageError
from r2art.data.procedural.drawer import drawer
from r2art.data.procedural.laptop import laptop
from r2art.data.shape import Instance

GENERATORS: dict[str, Callable[..., Instance]] = {"laptop": laptop, "drawer": drawer}


def make_instance(category: str, seed: int, photos: Sequence[Path] = ()) -> Instance:
    """Instance number ``seed`` of a category; the same to the byte for the same ``photos``."""
    if category not in GENERATORS:
        raise UsageError(f"no generator for {category!r}; there are {', '.join(GENERATORS)}")
    rng = np.random.default_rng([zlib.crc32(category.encode()), seed])
    return GENERATORS[category](rng, photos)
