"""The same objects, photographed with something held fixed."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from r2art.core.category import Category
from r2art.data.objects import Objects
from r2art.data.shape import Instance
from r2art.data.staging import Framing, Staging


@dataclass(frozen=True)
class Framed:
    """Objects under a `Framing`; their prior is the one that they have without.

    Attributes:
        objects: Which.
        framing: What all their photos share.
    """

    objects: Objects
    framing: Framing

    @property
    def name(self) -> str:
        """Of the category."""
        return self.objects.name

    @property
    def staging(self) -> Staging:
        """As the objects', but for the framing."""
        return replace(self.objects.staging, framing=self.framing)

    def instance(self, seed: int, photos: Sequence[Path] = ()) -> Instance:
        """The object of a seed."""
        return self.objects.instance(seed, photos)

    def prior(self) -> Category:
        """That of the objects."""
        return self.objects.prior()

    def about(self) -> dict[str, Any]:
        """What the objects say, and the framing as far as it holds anything fixed."""
        fixed = {k: v for k, v in asdict(self.framing).items() if v not in (None, False)}
        return {**self.objects.about(), "framing": fixed}
