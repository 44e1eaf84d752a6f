"""What a step is trained on: datasets, backdrops, and the batch of every step."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TypeVar

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from r2art.core.errors import InputError
from r2art.data.scenes.surroundings import Surroundings, read_picture
from r2art.data.shards import Dataset
from r2art.learn import augment
from r2art.learn.chance import Chance
from r2art.learn.memory import Photos
from r2art.learn.recipes import Recipe

OTHERS_HELD_OUT = 5
"""Of so many backdrops, in the order of their names, the first never stands for other objects."""

Some = TypeVar("Some", augment.Crops, augment.Views)


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


def load_backdrops(folder: Path | None, size: int = 224) -> Tensor | None:
    """(N, 3, size, size) uint8 photos to stand behind objects."""
    pictures = []
    for path in Surroundings.from_folder(folder).photos:
        photo = torch.from_numpy(read_picture(path).copy()).permute(2, 0, 1)[None].float()
        side = min(photo.shape[-2:])
        square = photo[..., :side, :side]
        pictures.append(F.interpolate(square, (size, size), mode="area")[0].byte())
    return torch.stack(pictures) if pictures else None


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

    def __call__(self, step: int) -> tuple[str, augment.Crops, augment.Views, Tensor]:
        """Category, its crops, whole photos, and what those show: a category, or last, none."""
        name, n = self.turn(step), self.recipe.shares
        shares = [self._share(step, name, k) for k in range(self.rank * n, (self.rank + 1) * n)]
        crops, views, category = zip(*shares, strict=True)
        return name, _joined(crops), _joined(views), torch.cat(category)

    def _share(self, step: int, name: str, k: int) -> tuple[augment.Crops, augment.Views, Tensor]:
        key = np.random.SeedSequence((self.recipe.seed, step, k))
        chance = Chance(int(key.generate_state(1, np.uint64)[0] >> 1), self.device)
        size, source = self.recipe.input_size, self.photos[name]
        varied = not self.recipe.offline_features
        index = chance.choice(len(source), self.recipe.crops)
        crops = augment.crops(source, index, size, chance, self.backdrops, augment=varied)
        views, category = [], []
        for c, photos in enumerate(self.photos.values()):
            n = (self.recipe.photos + (c + step) % len(self.photos)) // len(self.photos)
            if n == 0:  # with many categories not all have a turn
                continue
            chosen = chance.choice(len(photos), n)
            views.append(
                augment.views(photos, chosen, size, chance, self.backdrops, augment=varied)
            )
            category += [c] * n
        if (n := self.recipe.others) > 0:
            views.append(augment.empty_views(n, size, chance, self._others()))
            category += [len(self.photos)] * n
        return crops, _joined(views), torch.tensor(category, device=self.device)

    def _others(self) -> Tensor | None:
        """Backdrops that also stand for other objects: every fifth never does, for evaluation."""
        if self.backdrops is None:
            return None
        shown = torch.arange(len(self.backdrops)) % OTHERS_HELD_OUT != 0
        return self.backdrops[shown] if shown.any() else None

    def turn(self, step: int) -> str:
        """Whose crops a step sees: by the recipe, or in proportion to a category's parts."""
        given = self.recipe.turns
        turns = [given.get(n, len(p.category.part_names)) for n, p in self.photos.items()]
        key = np.random.SeedSequence((self.recipe.seed, step, 1 << 32))
        name = np.random.default_rng(key).choice(list(self.photos), p=np.divide(turns, sum(turns)))
        return str(name)


def _joined(parts: Sequence[Some]) -> Some:
    return type(parts[0])(
        **{f.name: torch.cat([getattr(p, f.name) for p in parts]) for f in fields(parts[0])}
    )
