"""The paper's "off-line features": what frozen layers say of every crop and photo, found once."""

from collections.abc import Iterable, Mapping

import torch
from jaxtyping import Float
from torch import Tensor

from r2art.learn.augment import Crops, Views
from r2art.method.outputs import Network

Key = tuple[str, str, int]
"""Crop or photo; its category; its number there."""


class OfflineFeatures:
    """Keeps features in half precision: 0.2 MB for ViT-S/14 at 224², 0.1 for MobileNetV2 at 128².

    They are of pictures without augmentation, which are the same at every step. Also the first
    time a picture comes its features are rounded, so that a resumed run sees the same ones.
    """

    def __init__(self, network: Network) -> None:
        self._network = network
        self._known: dict[Key, Tensor] = {}

    def __call__(
        self, crops: Mapping[str, Crops], shown: Iterable[str], views: Views
    ) -> Float[Tensor, "BN ..."]:
        """Features of crops, then of photos.

        Args:
            crops: Not augmented, by category.
            shown: Category of every photo.
            views: Not augmented.
        """
        keys: list[Key] = [("crop", n, i) for n, c in crops.items() for i in c.index.tolist()]
        keys += [("photo", c, i) for c, i in zip(shown, views.index.tolist(), strict=True)]
        image = torch.cat([*(c.image for c in crops.values()), views.image])
        if missing := [row for row, key in enumerate(keys) if key not in self._known]:
            found = self._network.offline(image[missing]).half().cpu()
            self._known |= {keys[row]: f for row, f in zip(missing, found, strict=True)}
        return torch.stack([self._known[key] for key in keys]).to(image.device).float()
