"""Where the objects of a dataset come from: a procedural category, or models that a user has."""

import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np

from r2art.core.category import Category
from r2art.core.errors import UsageError
from r2art.data import categories
from r2art.data.prior import category_prior
from r2art.data.shape import Instance
from r2art.data.staging import Staging

Split = Literal["train", "val", "test"]
SPLITS: dict[str, int] = {"train": 0, "val": 1, "test": 2}
PRIOR_INSTANCES = 256


class Objects(Protocol):
    """Endless objects of one category."""

    @property
    def name(self) -> str:
        """Of the category."""
        ...

    @property
    def staging(self) -> Staging:
        """How they are photographed."""
        ...

    def instance(self, seed: int, photos: Sequence[Path] = ()) -> Instance:
        """The object of a seed, see `instance_seed`; ``photos`` may be printed on it."""
        ...

    def prior(self) -> Category:
        """The mean object."""
        ...

    def about(self) -> dict[str, Any]:
        """What a dataset's manifest says of them; JSON."""
        ...


def instance_seed(name: str, split: Split, seed: int, index: int) -> int:
    """Seed of one object. Splits never share one: the split is part of it."""
    key = [SPLITS[split], seed, index, zlib.crc32(name.encode())]
    return int(np.random.SeedSequence(key).generate_state(1, np.uint64)[0] >> 1)


@dataclass(frozen=True)
class Procedural:
    """A category of `r2art.data.categories`."""

    name: str

    def __post_init__(self) -> None:
        if self.name not in categories.CATEGORIES:
            known = ", ".join(categories.CATEGORIES)
            raise UsageError(f"no category {self.name!r} can be synthesised; known: {known}")

    @property
    def staging(self) -> Staging:
        """How people photograph such objects."""
        return categories.staging(self.name)

    def instance(self, seed: int, photos: Sequence[Path] = ()) -> Instance:
        """The object of a seed; ``photos`` may appear on screens and prints."""
        return categories.make_instance(self.name, seed, photos)

    def prior(self) -> Category:
        """The mean of the `typical` objects."""
        return _procedural_prior(self, PRIOR_INSTANCES)

    def typical(self) -> Iterator[Instance]:
        """The first training objects of seed 0."""
        seeds = (instance_seed(self.name, "train", 0, i) for i in range(PRIOR_INSTANCES))
        return map(self.instance, seeds)

    def about(self) -> dict[str, Any]:
        """The category's name says it all."""
        return {"category": self.name}


@lru_cache(maxsize=16)
def _procedural_prior(objects: Procedural, count: int) -> Category:
    """Kept, for a benchmark asks for it once per level; ``count`` is that of the objects."""
    return category_prior(list(objects.typical()), objects.staging)
