"""A rendered dataset as tensors in memory, decoded once.

Cores that train cannot also decode: half a megabyte per 256² photo is the price.
"""

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from itertools import islice
from typing import TypeVar

import numpy as np
import torch
from jaxtyping import Float, Int, UInt8
from rich.console import Console
from rich.progress import track
from torch import Tensor

from r2art.core.category import Category
from r2art.core.errors import InputError
from r2art.data.sample import Sample
from r2art.data.shards import Dataset, from_row
from r2art.learn.coordinates import part_coordinates

DECODED_AT_ONCE = 128
LABELS = ("box", "cam_T_part", "joint_state", "box_center", "box_size")


Some = TypeVar("Some")


def joined(parts: Sequence[Some]) -> Some:
    """Data classes of tensors as one, along the first axis."""
    names = [f.name for f in fields(parts[0])]  # pyright: ignore[reportArgumentType]
    return type(parts[0])(**{n: torch.cat([getattr(p, n) for p in parts]) for n in names})


@dataclass(frozen=True, kw_only=True)
class Picked:
    """Some photos as pictures alone, of one or several categories; ``index`` as in `Photos`."""

    index: Int[Tensor, " N"]
    image: UInt8[Tensor, "N 3 H W"]
    mask: UInt8[Tensor, "N H W"]
    coordinates: UInt8[Tensor, "N 3 H W"]
    box: Float[Tensor, "N 4"]


@dataclass(frozen=True, kw_only=True)
class Photos:
    """N samples of one category; `r2art.data.sample.Sample` explains the fields.

    ``coordinates`` are those of `r2art.learn.coordinates`.
    """

    category: Category
    image: UInt8[Tensor, "N 3 H W"]
    mask: UInt8[Tensor, "N H W"]
    coordinates: UInt8[Tensor, "N 3 H W"]
    K: Float[Tensor, "N 3 3"]
    box: Float[Tensor, "N 4"]
    cam_T_part: Float[Tensor, "N P 4 4"]
    joint_state: Float[Tensor, "N J"]
    box_center: Float[Tensor, "N P 3"]
    box_size: Float[Tensor, "N P 3"]

    def __len__(self) -> int:
        return len(self.image)

    @classmethod
    def from_dataset(cls, dataset: Dataset) -> "Photos":
        """Decode every shard of a dataset, with a progress bar."""
        title, console = f"reading {dataset.folder.name}", Console(stderr=True)
        samples = track(_decoded(dataset), title, total=len(dataset), console=console)
        return cls.from_samples(dataset.category, samples, len(dataset))

    def pick(self, index: Int[Tensor, " N"], device: torch.device) -> "Picked":
        """The pictures of some of them, on the device."""
        return Picked(
            index=index,
            image=self.image[index].to(device),
            mask=self.mask[index].to(device),
            coordinates=self.coordinates[index].to(device),
            box=self.box[index].to(device),
        )

    def labels(self, index: Int[Tensor, " N"], device: torch.device) -> dict[str, Tensor]:
        """What is known of the objects in some of them, on the device."""
        names = ("cam_T_part", "joint_state", "box_center", "box_size")
        return {name: getattr(self, name)[index].to(device) for name in names}

    def to(self, device: torch.device) -> "Photos":
        """The same on a device that has room for them."""
        tensors = {f.name: getattr(self, f.name) for f in fields(self)}
        moved = {k: v.to(device) for k, v in tensors.items() if isinstance(v, Tensor)}
        return replace(self, **moved)

    @classmethod
    def from_samples(cls, category: Category, samples: Iterable[Sample], n: int) -> "Photos":
        """Stack ``n`` samples; all images must have one size."""
        image = mask = coordinates = None
        K = np.empty((n, 3, 3), np.float32)
        labels: dict[str, list[np.ndarray]] = {name: [] for name in LABELS}
        for i, sample in enumerate(samples):
            if image is None or mask is None or coordinates is None:
                image = np.empty((n, 3, *sample.mask.shape), np.uint8)
                mask = np.empty((n, *sample.mask.shape), np.uint8)
                coordinates = np.empty_like(image)
            if sample.mask.shape != mask.shape[1:]:
                raise InputError(
                    f"sample {i} is {sample.mask.shape} px, others are {mask.shape[1:]}; "
                    "train on images of one size"
                )
            image[i] = sample.image.transpose(2, 0, 1)
            mask[i] = sample.mask
            coordinates[i] = part_coordinates(sample)
            K[i] = sample.camera.K
            for name in LABELS:
                labels[name].append(getattr(sample, name).astype(np.float32))
        if image is None or mask is None or coordinates is None:
            raise InputError(f"the dataset of {category.name} is empty; run `r2art synth`")
        return cls(
            category=category,
            image=torch.from_numpy(image),
            mask=torch.from_numpy(mask),
            coordinates=torch.from_numpy(coordinates),
            K=torch.from_numpy(K),
            **{name: torch.from_numpy(np.stack(v)) for name, v in labels.items()},
        )


def _decoded(dataset: Dataset) -> Iterator[Sample]:
    """All samples in order; decoders let other threads run, so every core decodes."""
    with ThreadPoolExecutor() as pool:
        rows = iter(dataset.rows())
        while block := list(islice(rows, DECODED_AT_ONCE)):
            yield from pool.map(from_row, block)
