"""Any timm backbone by its name, as a feature map or as one vector.

Images are in [-1, 1] here; each backbone gets them with the mean and deviation it was
pre-trained with. The backbone itself is the attribute ``body``: its parameters have the names
of timm's files, so that these can be loaded into it.
"""

from typing import Any

import timm
import torch
from jaxtyping import Float
from torch import Tensor, nn


class Backbone(nn.Module):
    """A timm model without its classifier, for square images of one size.

    Args:
        name: In timm; whatever comes after a dot names weights and is nothing to the structure.
        input_size: Side (px) of the images.
        fitted: Whether it suits that size already; before, it takes timm's files as they are.
    """

    def __init__(self, name: str, input_size: int, *, fitted: bool = True) -> None:
        super().__init__()
        self.body: Any = timm.create_model(name, num_classes=0)
        self.input_size = input_size
        config = self.body.pretrained_cfg
        self.mean: tuple[float, ...] = config["mean"]
        self.std: tuple[float, ...] = config["std"]
        if fitted:
            self.fit()

    def fit(self) -> None:
        """Resample what depends on the image's size, once the weights of another are loaded.

        Raises:
            ValueError: The size is no multiple of the patches.
        """
        if not hasattr(self.body, "set_input_size"):
            return
        patch = self.body.patch_embed.patch_size[0]
        if self.input_size % patch:
            raise ValueError(
                f"input size {self.input_size} is no multiple of the {patch} px patches"
            )
        self.body.set_input_size(img_size=(self.input_size, self.input_size))

    def normalised(self, image: Float[Tensor, "B 3 S S"]) -> Float[Tensor, "B 3 S S"]:
        """Images in [-1, 1] as the backbone knows them."""
        mean, std = (image.new_tensor(v)[:, None, None] for v in (self.mean, self.std))
        return ((image + 1) / 2 - mean) / std

    def blank(self) -> Float[Tensor, "1 3 S S"]:
        """An image to try it with."""
        return torch.zeros(1, 3, self.input_size, self.input_size)


class FeatureMap(Backbone):
    """The last feature map of a backbone: of a transformer, its patch tokens where they belong."""

    def __init__(self, name: str, input_size: int) -> None:
        super().__init__(name, input_size)
        _, self.channels, self.side, _ = _tried(self)

    def forward(self, image: Float[Tensor, "B 3 S S"]) -> Float[Tensor, "B C s s"]:
        """Images in [-1, 1] to features."""
        found = self.body.forward_features(self.normalised(image))
        if found.ndim == 3:
            tokens = found[:, self.body.num_prefix_tokens :]
            side = self.input_size // self.body.patch_embed.patch_size[0]
            return tokens.mT.unflatten(2, (side, side))
        channels_last = getattr(self.body, "output_fmt", "NCHW") == "NHWC"
        return found.movedim(-1, 1) if channels_last else found


class Vector(Backbone):
    """A backbone's pooled features."""

    def __init__(self, name: str, input_size: int) -> None:
        super().__init__(name, input_size)
        _, self.channels = _tried(self)

    def forward(self, image: Float[Tensor, "B 3 S S"]) -> Float[Tensor, "B C"]:
        """Images in [-1, 1] to one vector each."""
        return self.body(self.normalised(image))


@torch.no_grad()
def _tried(backbone: Backbone) -> torch.Size:
    """Shape of what it makes of one image; its statistics stay as they are."""
    shape = backbone.eval()(backbone.blank()).shape
    backbone.train()
    return shape
