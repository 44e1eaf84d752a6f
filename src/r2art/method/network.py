"""The network: one shared trunk, small heads per category (Sections 4.1 and 4.2).

The trunk is any timm backbone with features at strides 8, 16 and 32. A UNet-like neck brings
them together; three branches per category read its summary, decoupled as in the paper:
rotation and 2D translation, depth and size, joint states. A dense head segments the parts
while training. On a whole photo the same trunk finds the object and names its category.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import timm
import torch
from jaxtyping import Float
from timm.models import FeatureInfo
from torch import Tensor, nn

from r2art.core.category import Category
from r2art.method.depth import projection_depth, viewing_ray
from r2art.method.shape import Prior

BACKGROUND = 1  # mask classes that are no part
NUM_CUES = 6


@dataclass(frozen=True, kw_only=True)
class RawEstimate:
    """What a category's branches say, before any geometry.

    Attributes:
        up: Direction α of the root's y axis, relative to the viewing ray; any length.
        right: Direction β of its x axis.
        phi: Offset of the projected root origin from the box centre, in box sizes.
        log_lambda: Logarithm of the depth correction λ.
        joint_share: Joint states as share of their range, 0 closed, 1 at the upper limit.
        log_scale: Deformation of the prior, see `r2art.method.shape.Deformation`.
        center_shift: Likewise (m); zero for the root.
        confidence_logit: Of the event that a part's ADD stays below 10 % of its diameter.
    """

    up: Float[Tensor, "*B 3"]
    right: Float[Tensor, "*B 3"]
    phi: Float[Tensor, "*B 2"]
    log_lambda: Float[Tensor, "*B"]
    joint_share: Float[Tensor, "*B J"]
    log_scale: Float[Tensor, "*B P 3"]
    center_shift: Float[Tensor, "*B P 3"]
    confidence_logit: Float[Tensor, "*B P"]


@dataclass(frozen=True, kw_only=True)
class TrainingOutput:
    """What one training pass yields.

    Attributes:
        raw: The raw estimate of every crop.
        mask_logits: Part segmentation of the crops at stride 8; class 0 is no part, k + 1 part k.
        found_box: The object's box (px) in every whole photo.
        category_logits: What the photos show.
        photo_mask_logits: Where in the photos the object is seen, at stride 8.
    """

    raw: RawEstimate
    mask_logits: Float[Tensor, "B classes h w"]
    found_box: Float[Tensor, "N 4"]
    category_logits: Float[Tensor, "N C"]
    photo_mask_logits: Float[Tensor, "N 1 h w"]


def separable(channels_in: int, channels_out: int, stride: int = 1) -> nn.Sequential:
    """Depthwise 3×3 and pointwise convolution, each normalised."""
    return nn.Sequential(
        nn.Conv2d(channels_in, channels_in, 3, stride, 1, groups=channels_in, bias=False),
        nn.BatchNorm2d(channels_in),
        nn.Conv2d(channels_in, channels_out, 1, bias=False),
        nn.BatchNorm2d(channels_out),
        nn.ReLU(inplace=True),
    )


def perceptron(inputs: int, hidden: int, first_answer: Sequence[float]) -> nn.Sequential:
    """Two-layer MLP; its last layer starts near zero, so that it gives ``first_answer``."""
    last = nn.Linear(hidden, len(first_answer))
    nn.init.normal_(last.weight, std=0.01)
    with torch.no_grad():
        last.bias.copy_(torch.tensor(first_answer))
    return nn.Sequential(nn.Linear(inputs, hidden), nn.ReLU(inplace=True), last)


def make_trunk(backbone: str, options: dict[str, Any]) -> tuple[nn.Module, list[int]]:
    """A timm backbone without pre-trained weights, and its channels at strides 8, 16 and 32.

    Raises:
        ValueError: It has no such features.
    """
    trunk = timm.create_model(backbone, features_only=True, out_indices=(-3, -2, -1), **options)
    info = cast(FeatureInfo, trunk.feature_info)
    if info.reduction() != [8, 16, 32]:
        raise ValueError(
            f"the last features of {backbone} are at strides {info.reduction()}, but 8, 16 and "
            "32 are needed; choose another backbone"
        )
    return trunk, info.channels()


class Neck(nn.Module):
    """Three feature maps to one at stride 16 (for the summary) and one at stride 8 (dense)."""

    def __init__(self, channels: Sequence[int], width: int) -> None:
        super().__init__()
        self.lateral = nn.ModuleList(nn.Conv2d(c, width, 1) for c in channels)
        self.at_16 = separable(width, width)
        self.at_8 = separable(width, width)
        self.up = nn.Upsample(scale_factor=2, mode="nearest")

    def forward(self, features: list[Tensor]) -> tuple[Tensor, Tensor]:
        """Features at strides 8, 16, 32 to (stride 8, stride 16)."""
        s8, s16, s32 = (f(x) for f, x in zip(self.lateral, features, strict=True))
        p16 = self.at_16(s16 + self.up(s32))
        return self.at_8(s8 + self.up(p16)), p16


class Summary(nn.Module):
    """A stride-16 map to one vector that still knows where things are."""

    def __init__(self, width: int, cells: int, outputs: int) -> None:
        super().__init__()
        squeezed = width * 3 // 4
        self.layers = nn.Sequential(
            separable(width, squeezed, stride=2),
            nn.Flatten(),
            nn.Linear(squeezed * cells * cells, outputs),
            nn.LayerNorm(outputs),
            nn.ReLU(inplace=True),
        )

    def forward(self, p16: Tensor) -> Tensor:
        """(B, width, H, W) to (B, outputs)."""
        return self.layers(p16)


FROM_THE_FRONT = [*(0.0, -0.9, -0.4), *(1.0, 0.0, 0.0), *(0.0, 0.0)]
"""Up, right and φ of an object seen from a little above."""


class CategoryHeads(nn.Module):
    """The branches of one category."""

    def __init__(self, category: Category, inputs: int, width: int) -> None:
        super().__init__()
        self.num_parts = len(category.part_names)
        self.num_joints = len(category.joints)
        depth_size = 1 + 3 * self.num_parts + 3 * self.num_joints
        self.rot_trans = perceptron(inputs, 256, FROM_THE_FRONT)
        self.depth_size = perceptron(inputs, 256, [0.0] * depth_size)
        self.joint = perceptron(inputs, 256, [0.5] * self.num_joints)
        self.confidence = perceptron(inputs, 64, [0.0] * self.num_parts)
        self.mask = nn.Sequential(
            separable(width, 64), nn.Conv2d(64, self.num_parts + BACKGROUND, 1)
        )

    def forward(self, summary: Float[Tensor, "B D"]) -> RawEstimate:
        """Summary of a crop to the category's raw estimate, in float32 even under autocast."""
        rt, ds = self.rot_trans(summary).float(), self.depth_size(summary).float()
        batch, P = summary.shape[0], self.num_parts
        shift = ds[:, 1 + 3 * P :].reshape(batch, self.num_joints, 3)
        return RawEstimate(
            up=rt[:, 0:3],
            right=rt[:, 3:6],
            phi=rt[:, 6:8],
            log_lambda=ds[:, 0],
            joint_share=self.joint(summary).float(),
            log_scale=ds[:, 1 : 1 + 3 * P].reshape(batch, P, 3),
            center_shift=torch.cat([torch.zeros_like(shift[:, :1]), shift], dim=1),
            confidence_logit=self.confidence(summary.detach()).float(),
        )


class R2ArtNet(nn.Module):
    """Trunk, neck and heads of several categories.

    Args:
        categories: What it can estimate.
        backbone: Any timm name with features at strides 8, 16 and 32.
        input_size: Side (px) of the square input; a multiple of 32.
        width: Channels of the neck.
        backbone_options: Passed on to timm.
    """

    def __init__(
        self,
        categories: tuple[Category, ...],
        backbone: str = "mobilenetv2_100",
        input_size: int = 192,
        width: int = 96,
        backbone_options: dict[str, Any] | None = None,
    ) -> None:
        super().__init__()
        if input_size % 32:
            raise ValueError(f"input size must be a multiple of 32, got {input_size}")
        self.input_size = input_size
        self.names = tuple(c.name for c in categories)
        self.priors = {c.name: Prior.from_category(c) for c in categories}
        self.trunk, channels = make_trunk(backbone, backbone_options or {})
        self.neck = Neck(channels, width)
        cells = input_size // 32
        self.pose_summary = Summary(width, cells, 512)
        self.photo_summary = Summary(width, cells, 256)
        self.found_box = perceptron(256, 128, [0.0] * 4)
        self.category_logits = perceptron(256, 128, [0.0] * len(categories))
        self.photo_mask = nn.Conv2d(width, 1, 1)
        self.heads = nn.ModuleDict(
            {c.name: CategoryHeads(c, 512 + NUM_CUES, width) for c in categories}
        )

    def forward(
        self,
        name: str,
        crop: Float[Tensor, "B 3 S S"],
        box: Float[Tensor, "B 4"],
        K: Float[Tensor, "B 3 3"],
        photo: Float[Tensor, "N 3 S S"],
    ) -> TrainingOutput:
        """One training pass: crops of category ``name`` and whole photos of any category.

        Both go through the trunk together, so that its batch statistics fit both.
        """
        p8, p16 = self.features(torch.cat([crop, photo]))
        n = len(crop)
        found_box, category_logits = self.find(p16[n:])
        return TrainingOutput(
            raw=self.estimate_raw(name, p16[:n], box, K),
            mask_logits=self.head(name).mask(p8[:n]),
            found_box=found_box,
            category_logits=category_logits,
            photo_mask_logits=self.photo_mask(p8[n:]),
        )

    def features(self, image: Float[Tensor, "B 3 S S"]) -> tuple[Tensor, Tensor]:
        """Image in [-1, 1] to neck features at strides 8 and 16."""
        return self.neck(self.trunk(image))

    def estimate_raw(
        self,
        name: str,
        p16: Tensor,
        box: Float[Tensor, "B 4"],
        K: Float[Tensor, "B 3 3"],
    ) -> RawEstimate:
        """Crop features to the raw estimate of category ``name``."""
        cues = geometric_cues(box, K, self.priors[name].frontal_area, self.input_size)
        return self.head(name)(torch.cat([self.pose_summary(p16), cues], dim=1))

    def head(self, name: str) -> CategoryHeads:
        """The branches of category ``name``."""
        return cast(CategoryHeads, self.heads[name])

    def find(self, p16: Tensor) -> tuple[Float[Tensor, "B 4"], Float[Tensor, "B C"]]:
        """Whole-photo features to the object's box (px) and category logits, in float32."""
        summary = self.photo_summary(p16)
        center, log_size = self.found_box(summary).float().split(2, dim=1)
        half = (log_size - 0.5).exp() / 2
        box = torch.cat([0.5 + center - half, 0.5 + center + half], dim=1)
        return box * self.input_size, self.category_logits(summary).float()


def geometric_cues(
    box: Float[Tensor, "*B 4"], K: Float[Tensor, "*B 3 3"], frontal_area: float, size: int
) -> Float[Tensor, "*B 6"]:
    """What the pixels cannot say: projection depth, apparent size and viewing direction.

    The paper concatenates "depth information" to the image features; with RGB alone this is
    ``d_p`` and the box (readings of Sec. 4.1).
    """
    width, height = box[..., 2] - box[..., 0], box[..., 3] - box[..., 1]
    ray = viewing_ray(box, K)
    return torch.stack(
        [
            projection_depth(box, K, frontal_area).log(),
            (width / K[..., 0, 0]).log(),
            (height / K[..., 1, 1]).log(),
            (width / height).log(),
            2 * ray[..., 0],
            2 * ray[..., 1],
        ],
        dim=-1,
    )
