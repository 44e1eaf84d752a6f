"""The small network: one shared trunk, small heads per category (Sections 4.1 and 4.2).

The trunk is any timm backbone with features at strides 4, 8, 16 and 32. A UNet-like neck brings
them together; three branches per category read its summary, decoupled as in the paper:
rotation and 2D translation, depth and size, joint states. On a whole photo the same trunk finds
the object and names its category. One dense head for all categories tells where the object is
seen, which refinement fits; while training, others tell which point of which part every place
shows.
"""

import math
from collections.abc import Sequence
from typing import Any, cast

import timm
import torch
from jaxtyping import Float
from timm.models import FeatureInfo
from torch import Tensor, nn

from r2art.core.category import Category
from r2art.method.layers import (
    FROM_THE_FRONT,
    NUM_CUES,
    Summary,
    geometric_cues,
    perceptron,
    separable,
)
from r2art.method.outputs import (
    DENSE_CHANNELS,
    NOTHING_KNOWN,
    CropOutput,
    Network,
    PoseHeads,
    RawEstimate,
    TrainingOutput,
    dense_output,
    raw_estimate,
)

STRIDES = (4, 8, 16, 32)
FIRST_LOG_DEVIATION = 2.5
"""Of places of a network that has learned nothing: 12 px."""


def make_trunk(backbone: str, options: dict[str, Any]) -> tuple[nn.Module, list[int]]:
    """A timm backbone without pre-trained weights, and its channels at strides 4, 8, 16 and 32.

    Raises:
        ValueError: It has no such features.
    """
    trunk = timm.create_model(backbone, features_only=True, out_indices=(-4, -3, -2, -1), **options)
    info = cast(FeatureInfo, trunk.feature_info)
    if info.reduction() != list(STRIDES):
        raise ValueError(
            f"the last features of {backbone} are at strides {info.reduction()}, but 4, 8, "
            "16 and 32 are needed; choose another backbone"
        )
    return trunk, info.channels()


def layers_up_to(trunk: nn.Module, stride: int) -> list[nn.Module]:
    """Layers of a trunk that its features up to a stride are made by; 0: none.

    Whatever the trunk is: they are those with parameters that these features have a gradient for.

    Raises:
        ValueError: It has no features at that stride.
    """
    if stride == 0:
        return []
    if stride == STRIDES[-1]:
        return [trunk]  # layers without parameters as well
    if stride not in STRIDES:
        raise ValueError(
            f"a trunk has features at strides {STRIDES}; none or one of them, not {stride}"
        )
    was_training = trunk.training
    maps = trunk.eval()(torch.zeros(1, 3, STRIDES[-1], STRIDES[-1]))[: STRIDES.index(stride) + 1]
    trunk.train(was_training)
    parameters = list(trunk.parameters())
    slopes = torch.autograd.grad([m.sum() for m in maps], parameters, allow_unused=True)
    made_by = {id(p) for p, slope in zip(parameters, slopes, strict=True) if slope is not None}
    return [
        m for m in trunk.modules() if any(id(p) in made_by for p in m.parameters(recurse=False))
    ]


class Neck(nn.Module):
    """Four feature maps to those at stride 16 (for the summary), 8 and 4 (dense)."""

    def __init__(self, channels: Sequence[int], width: int) -> None:
        super().__init__()
        finest, *coarser = channels
        self.lateral = nn.ModuleList(nn.Conv2d(c, width, 1) for c in coarser)
        self.at_16 = separable(width, width)
        self.at_8 = separable(width, width)
        self.fine_lateral = nn.Conv2d(finest, width // 2, 1)
        self.narrow = nn.Conv2d(width, width // 2, 1)
        self.at_4 = separable(width // 2, width // 2)
        self.up = nn.Upsample(scale_factor=2, mode="nearest")

    def forward(self, features: list[Tensor]) -> tuple[Tensor, Tensor, Tensor]:
        """Features at strides 4, 8, 16, 32 to those at 4, of half the width, at 8 and at 16."""
        finest, *coarser = features
        s8, s16, s32 = (f(x) for f, x in zip(self.lateral, coarser, strict=True))
        p16 = self.at_16(s16 + self.up(s32))
        p8 = self.at_8(s8 + self.up(p16))
        return self.at_4(self.fine_lateral(finest) + self.up(self.narrow(p8))), p8, p16


def decoded_channels(width: int) -> int:
    """Of what the dense heads of the categories read."""
    return width * 2 // 3


class Decoder(nn.Module):
    """What places show, from what is seen there, where they are, and what the whole crop shows.

    It serves training alone, beside the heads of the categories that read it.

    Args:
        width: Channels of the neck.
        summary: Length of the summary of the crop.
        outputs: Channels at stride 4.
    """

    def __init__(self, width: int, summary: int, outputs: int) -> None:
        super().__init__()
        self.context = nn.Linear(summary, width)
        self.at_8 = nn.Sequential(
            separable(2 * width + 2, width), separable(width, width), separable(width, width)
        )
        self.up = nn.Upsample(scale_factor=2, mode="nearest")
        self.at_4 = nn.Sequential(
            separable(width + width // 2, outputs), separable(outputs, outputs)
        )

    def forward(self, p4: Tensor, p8: Tensor, summary: Tensor) -> Tensor:
        """The neck's features at strides 4 and 8, and the summary, to features at stride 4."""
        height, width = p8.shape[2:]
        whole = self.context(summary)[:, :, None, None].expand(-1, -1, height, width)
        along = torch.linspace(-1, 1, width, device=p8.device, dtype=p8.dtype)
        down = torch.linspace(-1, 1, height, device=p8.device, dtype=p8.dtype)
        x = along.expand(len(p8), 1, height, width)
        y = down[:, None].expand(len(p8), 1, height, width)
        coarse = self.at_8(torch.cat([p8, whole, x, y], dim=1))
        return self.at_4(torch.cat([p4, self.up(coarse)], dim=1))


def dense_head(channels: int, classes: int) -> nn.Sequential:
    """Logits for every place."""
    return nn.Sequential(separable(channels, channels), nn.Conv2d(channels, classes, 1))


class CategoryHeads(nn.Module):
    """The branches of one category."""

    def __init__(
        self, category: Category, inputs: int, width: int, pose_heads: PoseHeads = "joint"
    ) -> None:
        super().__init__()
        self.num_parts = len(category.part_names)
        self.num_joints = len(category.joints)
        self.joint_centric = pose_heads == "joint"
        self.num_posed = 1 if self.joint_centric else self.num_parts
        depth_size = self.num_posed + 3 * self.num_parts + 3 * self.num_joints
        self.rot_trans = perceptron(inputs, 256, FROM_THE_FRONT * self.num_posed)
        self.depth_size = perceptron(inputs, 256, [0.0] * depth_size)
        if self.joint_centric:
            self.joint = perceptron(inputs, 256, [0.5] * self.num_joints)
        self.confidence = perceptron(inputs, 64, [0.0] * self.num_parts)
        self.surface = nn.Conv2d(decoded_channels(width), self.num_parts + DENSE_CHANNELS, 1)
        with torch.no_grad():
            self.surface.bias[-1] = FIRST_LOG_DEVIATION  # pyright: ignore[reportOptionalSubscript]

    def forward(self, summary: Float[Tensor, "B D"]) -> RawEstimate:
        """Summary of a crop to the category's raw estimate, in float32 even under autocast."""
        rt, ds = self.rot_trans(summary).float(), self.depth_size(summary).float()
        log_lambda, size = ds.split([self.num_posed, ds.shape[1] - self.num_posed], dim=1)
        if self.joint_centric:
            joint_share = self.joint(summary).float()
        else:
            joint_share = ds.new_zeros(len(ds), self.num_joints)
        return raw_estimate(
            rt.unflatten(1, (self.num_posed, 8)),
            log_lambda,
            joint_share,
            size,
            self.confidence(summary.detach()).float(),
        )


class R2ArtNet(Network):
    """Trunk, neck and heads of several categories.

    Args:
        categories: What it can estimate.
        backbone: Any timm name with features at strides 4, 8, 16 and 32.
        input_size: Side (px) of the square input; a multiple of 32.
        width: Channels of the neck.
        backbone_options: Passed on to timm.
        pose_heads: Whether joint states or the parts' poses are regressed.
        frozen_to: The trunk's layers up to the features of this stride stay as they are, in
            evaluation mode and without gradient; 32: all of it; 0: none.
    """

    def __init__(
        self,
        categories: tuple[Category, ...],
        backbone: str = "mobilenetv2_100",
        input_size: int = 192,
        width: int = 96,
        backbone_options: dict[str, Any] | None = None,
        pose_heads: PoseHeads = "joint",
        frozen_to: int = 0,
    ) -> None:
        super().__init__(categories, input_size)
        self.trunk, channels = make_trunk(backbone, backbone_options or {})
        self.frozen = layers_up_to(self.trunk, frozen_to)
        for layer in self.frozen:
            layer.requires_grad_(False)
        sides = (input_size // stride for stride in STRIDES)
        self.map_shapes = [(c, side, side) for c, side in zip(channels, sides, strict=True)]
        self.neck = Neck(channels, width)
        cells = input_size // 32
        self.pose_summary = Summary(width, cells, 512)
        self.photo_summary = Summary(width, cells, 256)
        self.found_box = perceptron(256, 128, [0.0] * 4)
        self.category_logits = perceptron(256, 128, [0.0] * (len(categories) + NOTHING_KNOWN))
        self.object_logits = dense_head(width // 2, 1)
        self.decoder = Decoder(width, 512, decoded_channels(width))
        inputs = 512 + NUM_CUES
        self.heads = nn.ModuleDict(
            {c.name: CategoryHeads(c, inputs, width, pose_heads) for c in categories}
        )

    def train(self, mode: bool = True) -> "R2ArtNet":
        """Training mode, except for frozen layers."""
        super().train(mode)
        for layer in self.frozen:
            layer.eval()
        return self

    @torch.no_grad()
    def offline(self, image: Float[Tensor, "B 3 S S"]) -> Float[Tensor, "B D"]:
        """What a frozen trunk says of images in [-1, 1], its four maps in one row each."""
        return torch.cat([m.flatten(1) for m in self.trunk(image)], dim=1)

    def maps(self, offline: Float[Tensor, "B D"]) -> list[Tensor]:
        """The rows of `offline` as the maps they are of, at strides 4, 8, 16 and 32."""
        rows = offline.split([math.prod(shape) for shape in self.map_shapes], dim=1)
        return [row.unflatten(1, shape) for row, shape in zip(rows, self.map_shapes, strict=True)]

    def forward(
        self,
        names: tuple[str, ...],
        crop: Float[Tensor, "B 3 S S"],
        box: Float[Tensor, "B 4"],
        K: Float[Tensor, "B 3 3"],
        photo: Float[Tensor, "N 3 S S"],
        offline: Float[Tensor, "BN D"] | None = None,
    ) -> TrainingOutput:
        """One training pass: equally many crops of each category, and whole photos of any.

        All go through the trunk together, so that its batch statistics fit all; where all of it
        is frozen, ``offline`` is what it says of crops and photos, if that is known.
        """
        if offline is None:
            p4, p8, p16 = self.neck(self.trunk(torch.cat([crop, photo])))
        else:
            p4, p8, p16 = self.neck(self.maps(offline))
        n, each = len(crop), len(crop) // len(names)
        logits = self.object_logits(p4)
        found_box, category_logits = self.find(p16)
        summary = self.pose_summary(p16[:n])
        fine = self.decoder(p4[:n], p8[:n], summary)
        of_each = (fine, summary, box, K, logits[:n], category_logits[:n])
        of_crops = zip(names, *(t.split(each) for t in of_each), strict=True)
        return TrainingOutput(
            crops={
                name: CropOutput(
                    raw=self._raw(name, summary, box, K),
                    dense=dense_output(self.head(name).surface(fine)),
                    object_logits=mask,
                    category_logits=category,
                )
                for name, fine, summary, box, K, mask, category in of_crops
            },
            found_box=found_box[n:],
            category_logits=category_logits[n:],
            object_logits=logits[n:],
        )

    def features(self, image: Float[Tensor, "B 3 S S"]) -> tuple[Tensor, Tensor]:
        """Image in [-1, 1] to neck features at strides 4 and 16."""
        p4, _, p16 = self.neck(self.trunk(image))
        return p4, p16

    def object_mask(self, dense: Tensor) -> Float[Tensor, "B h w"]:
        """Stride-4 features of crops to the share of each place that shows the object."""
        return self.object_logits(dense)[:, 0].float().sigmoid()

    def estimate_raw(
        self,
        name: str,
        seen: Tensor,
        box: Float[Tensor, "B 4"],
        K: Float[Tensor, "B 3 3"],
    ) -> RawEstimate:
        """Stride-16 features of crops to the raw estimate of category ``name``."""
        return self._raw(name, self.pose_summary(seen), box, K)

    def _raw(self, name: str, summary: Tensor, box: Tensor, K: Tensor) -> RawEstimate:
        cues = geometric_cues(box, K, self.priors[name].frontal_area)
        summary = summary.expand(cues.shape[0], -1)
        return self.head(name)(torch.cat([summary, cues], dim=1))

    def head(self, name: str) -> CategoryHeads:
        """The branches of category ``name``."""
        return cast(CategoryHeads, self.heads[name])

    def summarised(self, seen: Tensor) -> Tensor:
        """Stride-16 features of whole photos as one vector each."""
        return self.photo_summary(seen)
