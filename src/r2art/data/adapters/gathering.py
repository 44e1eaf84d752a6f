"""What many photos of a dataset say together: which way joints open, how far, how large all is."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Category
from r2art.data.adapters.convention import Convention
from r2art.data.adapters.model import Model, flipped
from r2art.data.adapters.prior import dataset_category
from r2art.data.source import Fault

FloatArray = NDArray[np.floating]
T = TypeVar("T")
GLANCES = 1000  # photos of a split that are looked at


@dataclass(frozen=True)
class Glance:
    """What one annotation says, without its images.

    Attributes:
        object_id: Of its object.
        joint_state: (J,) by the axes that the dataset gives.
        area: See `r2art.data.adapters.prior.frontal_area`.
    """

    object_id: int
    joint_state: FloatArray
    area: float


@dataclass(frozen=True)
class Gathering:
    """Glances at a dataset, and what follows from them.

    Attributes:
        read_model: Reads an object by its number; its joints are as the dataset has them.
        convention: How the dataset is read.
        train: Glances at training photos, whose objects make the category.
        own: Glances at the photos of the split that was opened.
    """

    read_model: Callable[[int], Model]
    convention: Convention
    train: tuple[Glance, ...]
    own: tuple[Glance, ...]

    def model(self, object_id: int) -> Model:
        """An object, its joints turned so that positive states open them.

        Raises:
            Fault: Its files are wrong.
        """
        model = self.read_model(object_id)
        flip = self.flip(object_id, len(model.joints))
        return replace(model, joints=flipped(model.joints, flip), sign=np.where(flip, -1.0, 1.0))

    def flip(self, object_id: int, joints: int) -> tuple[bool, ...]:
        """For each joint of an object, whether it opens against the axis the dataset gives."""
        flip = self.convention.flip
        return (self._flips.get(object_id) if flip is None else flip) or (False,) * joints

    @cached_property
    def _flips(self) -> dict[int, tuple[bool, ...]]:
        """By object, the joints that most of its photos show at a negative state."""
        sums: dict[int, FloatArray] = {}
        for glance in (*self.train, *self.own):
            sums[glance.object_id] = sums.get(glance.object_id, 0.0) + np.sign(glance.joint_state)
        return {i: tuple((total < 0).tolist()) for i, total in sums.items()}

    def category(self, name: str, part_names: tuple[str, ...]) -> Category:
        """The mean of the training objects, or of all where there are none.

        Raises:
            Fault: No object can be read.
        """
        models: dict[int, Model] = {}
        fault = Fault(name, "", "no annotation can be read; nothing is known of its objects")
        for object_id in sorted({g.object_id for g in self.train or self.own}):
            try:
                models[object_id] = self.model(object_id)
            except Fault as found:
                fault = found
        if not models:
            raise fault
        joints = len(part_names) - 1
        states = [
            np.where(self.flip(g.object_id, joints), -1.0, 1.0) * g.joint_state
            for g in (*self.train, *self.own)
        ]
        return dataset_category(
            name,
            part_names,
            list(models.values()),
            np.reshape(states, (-1, joints)),
            [g.area for g in self.train or self.own],
        )


def glances(photos: Sequence[T], look: Callable[[T], Glance]) -> tuple[Glance, ...]:
    """Glances at some photos, evenly spread; those that cannot be read are left out.

    What is wrong with them is told when they are opened.
    """
    step = max(1, -(-len(photos) // GLANCES))
    return tuple(_readable(photos[::step], look))


def _readable(photos: Iterable[T], look: Callable[[T], Glance]) -> Iterable[Glance]:
    for photo in photos:
        try:
            yield look(photo)
        except Fault:
            continue
