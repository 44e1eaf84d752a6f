"""Objects brought to the size that objects of ArtImage have.

ArtImage's objects are not in physical size: its laptops are 2 m large, and so are its scissors.
The paper's millimetres (Table 1) are millimetres of that size. To give errors in the same unit,
each object is scaled, by one factor, until the box around it has the diagonal that boxes of its
category have in ArtImage on average.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from r2art.core.category import Category, Joint
from r2art.data.objects import Procedural
from r2art.data.pose import posed_vertices, root_T_part
from r2art.data.prior import category_prior
from r2art.data.shape import Instance
from r2art.data.staging import Framing, Staging


@dataclass(frozen=True, kw_only=True)
class Size:
    """How large the objects of a category are to be.

    Attributes:
        diagonal: Of the box around the object (m).
        opened: How far its joints then are open, as a share of their range.
    """

    diagonal: float
    opened: float = 0.0


ARTIMAGE = {
    "laptop": Size(diagonal=float(np.linalg.norm([1.32, 0.89, 1.17])), opened=0.8),
    "eyeglasses": Size(diagonal=float(np.linalg.norm([1.24, 0.39, 1.02])), opened=0.5),
    "dishwasher": Size(diagonal=float(np.linalg.norm([1.02, 1.41, 1.09]))),
    "drawer": Size(diagonal=float(np.linalg.norm([1.04, 1.47, 1.03]))),
    "scissors": Size(diagonal=float(np.linalg.norm([1.61, 0.08, 0.86])), opened=0.3),
}
"""Mean boxes of ArtImage, and the state in which ours have about their proportions."""
OTHERS = Size(diagonal=float(np.mean([size.diagonal for size in ARTIMAGE.values()])))
"""Of categories that ArtImage lacks: its mean, for no sizes of ReArtMix's objects are published."""
LENS = Framing(fov=float(2 * np.arctan(320 / 914)))
"""ArtImage's camera: 640 × 640 px, f = 914 px."""


@dataclass(frozen=True)
class Scaled:
    """A procedural category whose objects all have one size, under ArtImage's camera.

    Attributes:
        objects: Those to be scaled.
        size: Of every one of them.
    """

    objects: Procedural
    size: Size

    @property
    def name(self) -> str:
        """Of the category."""
        return self.objects.name

    @property
    def staging(self) -> Staging:
        """As the objects', through ArtImage's lens."""
        return replace(self.objects.staging, framing=LENS)

    def instance(self, seed: int, photos: Sequence[Path] = ()) -> Instance:
        """The object of a seed, scaled."""
        return self._scaled(self.objects.instance(seed, photos))

    def prior(self) -> Category:
        """The mean of the scaled typical objects."""
        return category_prior([self._scaled(i) for i in self.objects.typical()], self.staging)

    def about(self) -> dict[str, Any]:
        """What the objects say, and their size."""
        return {**self.objects.about(), "scaled_to": vars(self.size)}

    def _scaled(self, instance: Instance) -> Instance:
        return scaled(instance, self.size.diagonal / diagonal(instance, self.size.opened))


def diagonal(instance: Instance, opened: float = 0.0) -> float:
    """Diagonal (m) of the box around an object whose joints are open so far (share of range)."""
    limits = np.array([joint.limits for joint in instance.joints]).reshape(-1, 2)
    state = limits[:, 0] + opened * (limits[:, 1] - limits[:, 0])
    vertices = posed_vertices(instance, root_T_part(instance.joints, state))
    return float(np.linalg.norm(np.ptp(vertices, axis=0)))


def scaled(instance: Instance, factor: float) -> Instance:
    """The object, ``factor`` times as large in every direction."""
    parts = tuple(
        tuple(replace(s, vertices=factor * s.vertices) for s in part) for part in instance.parts
    )
    return replace(instance, parts=parts, joints=tuple(_larger(j, factor) for j in instance.joints))


def _larger(joint: Joint, factor: float) -> Joint:
    x, y, z = joint.pivot
    low, high = joint.limits
    per_state = factor if joint.kind == "prismatic" else 1.0
    return replace(
        joint,
        pivot=(factor * x, factor * y, factor * z),
        limits=(per_state * low, per_state * high),
    )
