"""What a step is trained on: datasets, backdrops, and the batch of every step."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Int
from torch import Tensor
from torch.nn import functional as F

from r2art.core.errors import InputError
from r2art.data.scenes.surroundings import Surroundings, read_picture
from r2art.data.shards import Dataset
from r2art.learn import augment
from r2art.learn.chance import Chance
from r2art.learn.memory import Photos, Picked, joined
from r2art.learn.mirror import some_mirrored, some_views_mirrored
from r2art.learn.recipes import Recipe

OTHERS_HELD_OUT = 5
"""Of so many backdrops, in the order of their names, the first never stands for other objects."""


def open_datasets(folders: Sequence[Path]) -> dict[str, Dataset]:
    """The datasets by category, in the categories' alphabetical order.

    Raises:
        InputError: Two are of one category, or one cannot be opened.
    """
    found: dict[str, Dataset] = {}
    for dataset in map(Dataset.open, folders):
        name = dataset.category.name
        if name in found:
            raise InputError(f"two datasets of {name}; render one larger one instead")
        found[name] = dataset
    return dict(sorted(found.items()))


def load_photos(folders: Sequence[Path]) -> dict[str, Photos]:
    """All datasets in memory, by category."""
    return {name: Photos.from_dataset(d) for name, d in open_datasets(folders).items()}


def placed(photos: dict[str, Photos], device: torch.device) -> dict[str, Photos]:
    """The photos on a GPU that has three times the room for them, else where they are."""
    if device.type != "cuda":
        return photos
    pictures = [t for p in photos.values() for t in (p.image, p.mask, p.coordinates)]
    needed = sum(t.nbytes for t in pictures)
    free, _ = torch.cuda.mem_get_info(device)
    return {k: p.to(device) for k, p in photos.items()} if 3 * needed < free else photos


def load_backdrops(folder: Path | None, size: int = 224) -> Tensor | None:
    """(N, 3, size, size) uint8 photos to stand behind objects."""
    pictures = []
    for path in Surroundings.from_folder(folder).photos:
        photo = torch.from_numpy(read_picture(path).copy()).permute(2, 0, 1)[None].float()
        side = min(photo.shape[-2:])
        square = photo[..., :side, :side]
        pictures.append(F.interpolate(square, (size, size), mode="area")[0].byte())
    return torch.stack(pictures) if pictures else None


@dataclass(frozen=True, kw_only=True)
class Batch:
    """What one step sees.

    Attributes:
        crops: Equally many of each of some categories.
        views: Whole photos.
        category: What those show: a category, by its number, or last, none.
    """

    crops: Mapping[str, augment.Crops]
    views: augment.Views
    category: Int[Tensor, " N"]

    @property
    def names(self) -> tuple[str, ...]:
        """The crops' categories."""
        return tuple(self.crops)

    def inputs(self) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """What a network's training pass takes beside `names`: crops, boxes, intrinsics, photos."""
        crops = self.crops.values()
        image, box, K = (torch.cat([getattr(c, k) for c in crops]) for k in ("image", "box", "K"))
        return image, box, K, self.views.image


@dataclass(frozen=True)
class Batches:
    """Makes the batch of any step from that step's number.

    A batch is made of shares, each from a random stream of its own. Process ``rank`` takes
    ``recipe.shares`` of them; so however many processes there are, the same number of shares
    in all is the same batch.
    """

    recipe: Recipe
    photos: dict[str, Photos]
    backdrops: Tensor | None
    device: torch.device
    rank: int

    def __call__(self, step: int) -> Batch:
        """The batch of a step, counted from 0."""
        names, n = self.turn(step), self.recipe.shares
        shares = [self._share(step, names, k) for k in range(self.rank * n, (self.rank + 1) * n)]
        return Batch(
            crops={name: joined([s.crops[name] for s in shares]) for name in names},
            views=joined([s.views for s in shares]),
            category=torch.cat([s.category for s in shares]),
        )

    def _share(self, step: int, names: tuple[str, ...], k: int) -> Batch:
        key = np.random.SeedSequence((self.recipe.seed, step, k))
        chance = Chance(int(key.generate_state(1, np.uint64)[0] >> 1), self.device)
        size, varied = self.recipe.input_size, not self.recipe.offline_features
        crops: list[augment.Crops] = []
        photos = [self.photos[name] for name in names]
        for _, of_one_size in groupby(photos, key=lambda p: p.mask.shape[1:]):
            chosen = [(p, chance.choice(len(p), self.recipe.crops)) for p in of_one_size]
            crops += augment.crops_of(chosen, size, chance, self.backdrops, augment=varied)
        picked, category = self._picked(step, chance)
        if varied:
            crops = [
                some_mirrored(c, p.category, chance) for c, p in zip(crops, photos, strict=True)
            ]
        views = [augment.views(p, size, chance, self.backdrops, augment=varied) for p in picked]
        if (n := self.recipe.others) > 0:
            views.append(augment.empty_views(n, size, chance, self._others))
            category += [len(self.photos)] * n
        shown = some_views_mirrored(joined(views), chance) if varied else joined(views)
        return Batch(
            crops=dict(zip(names, crops, strict=True)),
            views=shown,
            category=torch.tensor(category, device=self.device),
        )

    def _picked(self, step: int, chance: Chance) -> tuple[list[Picked], list[int]]:
        """Whole photos of all categories in turn, those of one size together; and of which each."""
        picked: list[Picked] = []
        category: list[int] = []
        for c, photos in enumerate(self.photos.values()):
            n = (self.recipe.photos + (c + step) % len(self.photos)) // len(self.photos)
            if n > 0:  # with many categories not all have a turn
                picked.append(photos.pick(chance.choice(len(photos), n), self.device))
                category += [c] * n
        of_one_size = groupby(picked, key=lambda p: p.mask.shape[1:])
        return [joined(list(group)) for _, group in of_one_size], category

    @cached_property
    def _others(self) -> Tensor | None:
        """Backdrops that also stand for other objects: every fifth never does, for evaluation."""
        if self.backdrops is None:
            return None
        shown = torch.arange(len(self.backdrops)) % OTHERS_HELD_OUT != 0
        return self.backdrops[shown] if shown.any() else None

    def turn(self, step: int) -> tuple[str, ...]:
        """Whose crops a step sees: by the recipe, or in proportion to a category's parts."""
        given = self.recipe.turns
        turns = [given.get(n, len(p.category.part_names)) for n, p in self.photos.items()]
        key = np.random.SeedSequence((self.recipe.seed, step, 1 << 32))
        size = min(self.recipe.groups, np.count_nonzero(turns))
        share = np.divide(turns, sum(turns))
        names = np.random.default_rng(key).choice(list(self.photos), size, replace=False, p=share)
        return tuple(name for name in self.photos if name in names)


class Ahead:
    """`Batches`, each made by a thread while the step before is taken: a GPU's CPU has the time."""

    def __init__(self, batches: Batches) -> None:
        self.recipe, self.photos, self._batches = batches.recipe, batches.photos, batches
        self._pool = ThreadPoolExecutor(1)
        self._made: dict[int, Future[Batch]] = {}

    def __call__(self, step: int) -> Batch:
        """The batch of a step; that of the next is begun."""
        made = self._made.pop(step, None) or self._pool.submit(self._batches, step)
        self._made = {step + 1: self._pool.submit(self._batches, step + 1)}
        return made.result()

    def rest(self) -> None:
        """Wait until what was begun is made."""
        for made in self._made.values():
            made.result()
