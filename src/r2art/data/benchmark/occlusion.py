"""Something before an object that hides a wanted share of it, no more and no less."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.errors import UsageError
from r2art.data.rendering.render import render_labels
from r2art.data.scenes.surroundings import Surroundings, some_material
from r2art.data.scenes.things import ball, can, carton
from r2art.data.shape import Surface
from r2art.data.staging import about

FloatArray = NDArray[np.floating]
Mask = NDArray[np.bool_]

IN_THE_WAY = 0.02
"""Share of an object that its usual surroundings may hide; if they hide more, they are left out."""
MOST = 0.7
"""Share that a thing should be able to hide, whatever is wanted, so that it serves all levels."""
SOLIDS = (carton, can, ball)
HALVINGS, TRIES = 14, 8
NEAR, LARGEST = 0.5, 0.9
"""Distance of the thing over that of the object's nearest point, and its radius over its own."""


@dataclass(frozen=True)
class Occlusion:
    """One thing hides ``share`` (0 to 0.6) of the pixels in which the object would be seen.

    For the same random numbers it is the same thing before the same spot whatever the share: it
    only grows, so that what a lower level hides a higher one hides too. It is nearer than all of
    the object. Where the surroundings would hide much by themselves, there are none.
    """

    share: float

    def __post_init__(self) -> None:
        if not 0 <= self.share <= MOST - 0.1:
            raise UsageError(f"the hidden share is 0 to {MOST - 0.1:g}, got {self.share}")

    def about(self) -> dict[str, Any]:
        """For a dataset's manifest."""
        return {"hidden": self.share}

    def __call__(
        self,
        rng: np.random.Generator,
        parts: Sequence[Sequence[Surface]],
        around: Sequence[Surface],
        camera: Camera,
        files: Surroundings,
        /,
    ) -> list[Surface]:
        """See `r2art.data.scenes.scene.Arrange`."""
        own = [s for part in parts for s in part]
        whole = _seen(own, (), camera)
        if not whole.any():
            return []
        free = _seen(own, around, camera)
        kept = list(around)
        if free.sum() < (1 - IN_THE_WAY) * whole.sum():
            kept, free = [], whole
        if self.share == 0:
            return kept
        distance = NEAR * min(float(s.vertices[:, 2].min()) for s in own)
        largest = LARGEST * distance
        tried = list(islice(_things(rng, distance, whole, free, camera, files), TRIES))
        best = max(tried, key=lambda thing: min(thing.hidden(largest), MOST))
        return [*kept, best.hiding(self.share, largest)]


def _seen(own: Sequence[Surface], others: Sequence[Surface], camera: Camera) -> Mask:
    """(H, W) where the object is seen past the others."""
    labels = [1] * len(own) + [0] * len(others)
    return render_labels([*own, *others], labels, camera) == 1


@dataclass(frozen=True)
class _Grows:
    """A thing of any radius, and what is behind it."""

    unit: Surface
    center: FloatArray
    free: Mask
    pixels: int
    camera: Camera

    def sized(self, radius: float) -> Surface:
        return replace(self.unit, vertices=self.unit.vertices * radius + self.center)

    def hidden(self, radius: float) -> float:
        """Share of the object that is hidden: never less for a larger radius."""
        before = render_labels([self.sized(radius)], [1], self.camera) == 1
        return 1 - float(np.count_nonzero(self.free & ~before)) / self.pixels

    def hiding(self, share: float, largest: float) -> Surface:
        """The thing, just large enough."""
        low, high = 0.0, largest
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            low, high = (low, middle) if self.hidden(middle) > share else (middle, high)
        return self.sized(high)


def _things(
    rng: np.random.Generator,
    distance: float,
    whole: Mask,
    free: Mask,
    camera: Camera,
    files: Surroundings,
) -> Iterator[_Grows]:
    """Things before random spots of the object."""
    spots = np.argwhere(whole)
    while True:
        v, u = spots[rng.integers(len(spots))] + 0.5
        ray = np.array([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0])
        yield _Grows(_thing(rng, files), distance * ray, free, len(spots), camera)


def _thing(rng: np.random.Generator, files: Surroundings) -> Surface:
    """A convex thing of radius 1 about the origin, turned anyhow."""
    surface = SOLIDS[rng.integers(len(SOLIDS))](rng, some_material(rng, files))
    R = about(1, rng.uniform(-np.pi, np.pi)) @ about(0, rng.uniform(-np.pi, np.pi))
    vertices = surface.vertices
    around = (vertices - (vertices.min(axis=0) + vertices.max(axis=0)) / 2) @ R.T
    radius = np.linalg.norm(around, axis=1).max()
    return replace(surface, vertices=around / radius, normals=surface.normals @ R.T)
