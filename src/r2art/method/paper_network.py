"""The network of the paper: frozen DINOv2 features and three branches of their own.

- Rotation and 2D translation (Section 4.1): a three-layer UNet-like network re-modulates the
  frozen features; MLPs read α, β and φ off it.
- Depth: HRNet's view of the image, the re-modulated features, and d_p with the box, embedded,
  are concatenated; MLPs read λ and the shape's deformation off them.
- Joint states (Section 4.2): ResNet's view of the image and an MLP.

The paper gives these names and no more; docs/paper.md lists what was chosen. Every backbone is a
timm name. The frozen features of an image never change, so they can be computed once per sample.
"""

from dataclasses import dataclass
from typing import cast

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

from r2art.core.category import Category
from r2art.method.backbones import FeatureMap, Vector
from r2art.method.layers import FROM_THE_FRONT, NUM_CUES, Summary, geometric_cues, perceptron
from r2art.method.outputs import (
    NOTHING_KNOWN,
    CropOutput,
    Network,
    PoseHeads,
    RawEstimate,
    TrainingOutput,
    raw_estimate,
)

CUE_EMBEDDING = 64


@dataclass(frozen=True)
class Seen:
    """What the branches read of B images: the images themselves, and re-modulated features."""

    image: Float[Tensor, "B 3 S S"]
    modulated: Float[Tensor, "B C s s"]


def convolution(channels_in: int, channels_out: int, stride: int = 1) -> nn.Sequential:
    """A normalised 3×3 convolution."""
    return nn.Sequential(
        nn.Conv2d(channels_in, channels_out, 3, stride, 1, bias=False),
        nn.BatchNorm2d(channels_out),
        nn.ReLU(inplace=True),
    )


class UNet(nn.Module):
    """Three layers, each of half the resolution of the one before, and the way back up."""

    def __init__(self, channels: int, width: int) -> None:
        super().__init__()
        self.enter = convolution(channels, width)
        self.down = nn.ModuleList(convolution(width, width, stride=2) for _ in range(2))
        self.up = nn.ModuleList(convolution(2 * width, width) for _ in range(2))

    def forward(self, features: Float[Tensor, "B C s s"]) -> Float[Tensor, "B width s s"]:
        """Frozen features to re-modulated ones of the same resolution."""
        levels = [self.enter(features)]
        for layer in self.down:
            levels.append(layer(levels[-1]))
        x = levels.pop()
        for layer in self.up:
            skip = levels.pop()
            wide = F.interpolate(x, size=skip.shape[-2:], mode="nearest")
            x = layer(torch.cat([skip, wide], dim=1))
        return x


class PaperHeads(nn.Module):
    """The MLPs of one category.

    Args:
        category: What they estimate.
        inputs: Lengths of the vectors that the three branches give.
        pose_heads: Whether joint states or the parts' poses are regressed.
    """

    def __init__(
        self, category: Category, inputs: tuple[int, int, int], pose_heads: PoseHeads
    ) -> None:
        super().__init__()
        self.num_parts, self.num_joints = len(category.part_names), len(category.joints)
        self.joint_centric = pose_heads == "joint"
        self.num_posed = 1 if self.joint_centric else self.num_parts
        rot_trans, depth, joint = inputs
        up, right, phi = FROM_THE_FRONT[:3], FROM_THE_FRONT[3:6], FROM_THE_FRONT[6:]
        self.alpha = perceptron(rot_trans, 256, up * self.num_posed)
        self.beta = perceptron(rot_trans, 256, right * self.num_posed)
        self.phi = perceptron(rot_trans, 256, phi * self.num_posed)
        self.log_lambda = perceptron(depth, 256, [0.0] * self.num_posed)
        self.deformation = perceptron(depth, 256, [0.0] * 3 * (self.num_parts + self.num_joints))
        if self.joint_centric:
            self.joint = perceptron(joint, 256, [0.5] * self.num_joints)
        self.confidence = perceptron(sum(inputs), 64, [0.0] * self.num_parts)

    def forward(self, rot_trans: Tensor, depth: Tensor, joint: Tensor) -> RawEstimate:
        """The branches' vectors to the raw estimate, in float32 even under autocast."""
        directions = (m(rot_trans).float() for m in (self.alpha, self.beta, self.phi))
        columns = [v.unflatten(1, (self.num_posed, -1)) for v in directions]
        if self.joint_centric:
            joint_share = self.joint(joint).float()
        else:
            joint_share = columns[0].new_zeros(len(joint), self.num_joints)
        everything = torch.cat([rot_trans, depth, joint], dim=1).detach()
        return raw_estimate(
            torch.cat(columns, dim=2),
            self.log_lambda(depth).float(),
            joint_share,
            self.deformation(depth).float(),
            self.confidence(everything).float(),
        )


class PaperNet(Network):
    """The three branches on frozen features, and heads for several categories.

    Args:
        categories: What it can estimate; one, in the paper.
        features: Timm name of the frozen backbone.
        depth: Timm name of the depth branch's.
        joint: Timm name of the joint branch's.
        input_size: Side (px) of the square input; a multiple of 32 and of the patches.
        width: Channels of the UNet.
        pose_heads: Whether joint states or the parts' poses are regressed.
    """

    def __init__(
        self,
        categories: tuple[Category, ...],
        features: str = "vit_small_patch14_dinov2",
        depth: str = "hrnet_w18_small",
        joint: str = "resnet18",
        input_size: int = 224,
        width: int = 128,
        pose_heads: PoseHeads = "joint",
    ) -> None:
        super().__init__(categories, input_size)
        self.frozen = FeatureMap(features, input_size).requires_grad_(False).eval()
        self.depth = Vector(depth, input_size)
        self.joint = Vector(joint, input_size)
        self.unet = UNet(self.frozen.channels, width)
        cells = -(-self.frozen.side // 2)
        self.pose_summary = Summary(width, cells, 512)
        self.embed_cues = nn.Sequential(nn.Linear(NUM_CUES, CUE_EMBEDDING), nn.ReLU(inplace=True))
        self.photo_summary = Summary(width, cells, 256)
        self.found_box = perceptron(256, 128, [0.0] * 4)
        self.category_logits = perceptron(256, 128, [0.0] * (len(categories) + NOTHING_KNOWN))
        inputs = (512, self.depth.channels + width + CUE_EMBEDDING, self.joint.channels)
        self.heads = nn.ModuleDict({c.name: PaperHeads(c, inputs, pose_heads) for c in categories})

    def train(self, mode: bool = True) -> "PaperNet":
        """Training mode, except for what is frozen."""
        super().train(mode)
        self.frozen.eval()
        return self

    @torch.no_grad()
    def offline(self, image: Float[Tensor, "B 3 S S"]) -> Float[Tensor, "B C s s"]:
        """The frozen features of images in [-1, 1]."""
        return self.frozen(image)

    def forward(
        self,
        names: tuple[str, ...],
        crop: Float[Tensor, "B 3 S S"],
        box: Float[Tensor, "B 4"],
        K: Float[Tensor, "B 3 3"],
        photo: Float[Tensor, "N 3 S S"],
        offline: Float[Tensor, "BN C s s"] | None = None,
    ) -> TrainingOutput:
        """One training pass: equally many crops of each category, and whole photos of any.

        Args:
            names: The crops' categories.
            crop: In [-1, 1].
            box: Round the objects in the crops.
            K: Intrinsics of the crops.
            photo: In [-1, 1].
            offline: Frozen features of crops and photos, if they are known.
        """
        if offline is None:
            offline = self.offline(torch.cat([crop, photo]))
        modulated = self.unet(offline)
        n, each = len(crop), len(crop) // len(names)
        found_box, category_logits = self.find(Seen(photo, modulated[n:]))
        of_crops = zip(names, *(t.split(each) for t in (crop, modulated[:n], box, K)), strict=True)
        return TrainingOutput(
            crops={
                name: CropOutput(
                    raw=self.estimate_raw(name, Seen(crop, seen), box, K),
                    dense=None,
                    object_logits=None,
                )
                for name, crop, seen, box, K in of_crops
            },
            found_box=found_box,
            category_logits=category_logits,
            object_logits=None,
        )

    def features(self, image: Float[Tensor, "B 3 S S"]) -> tuple[Tensor, Seen]:
        """Image in [-1, 1] to re-modulated features, alone and with the image."""
        modulated = self.unet(self.offline(image))
        return modulated, Seen(image, modulated)

    def estimate_raw(
        self, name: str, seen: Seen, box: Float[Tensor, "B 4"], K: Float[Tensor, "B 3 3"]
    ) -> RawEstimate:
        """What is seen in crops to the raw estimate of category ``name``."""
        cues = self.embed_cues(geometric_cues(box, K, self.priors[name].frontal_area))
        pooled = seen.modulated.mean((2, 3))
        of_images = self.pose_summary(seen.modulated), self.depth(seen.image), pooled
        rotation, depth, pooled, joint = (
            t.expand(cues.shape[0], -1) for t in (*of_images, self.joint(seen.image))
        )
        heads = cast(PaperHeads, self.heads[name])
        return heads(rotation, torch.cat([depth, pooled, cues], dim=1), joint)

    def summarised(self, seen: Seen) -> Tensor:
        """Whole photos as one vector each."""
        return self.photo_summary(seen.modulated)
