"""The small network: one shared trunk, small heads per category (Sections 4.1 and 4.2).

The trunk is any timm backbone with features at strides 4, 8, 16 and 32. A UNet-like neck brings
them together; three branches per category read its summary, decoupled as in the paper:
rotation and 2D translation, depth and size, joint states. On a whole photo the same trunk finds
the object and names its category. One dense head for all categories tells where the object is
seen, which refinement fits; while training, others tell which point of which part every place
shows.

Objects that are all the same, such as robot arms, are read by a trunk and a neck of their own,
which look for their keypoints (`r2art.method.keypoints`), and the branches read those, too.
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import timm
import torch
from jaxtyping import Float
from timm.models import FeatureInfo
from torch import Tensor, nn

from r2art.core.category import Category
from r2art.method.keypoints import FIRST_LOG_DEVIATION as FIRST_OF_KEYPOINTS
from r2art.method.keypoints import LOG_DEVIATION, Keypoints, place_of
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
    Taught,
    TrainingOutput,
    dense_output,
    raw_estimate,
)

STRIDES = (4, 8, 16, 32)
SUMMARY = 512
"""Length of the summary of a crop ..."""
KNOWN_SUMMARY = 256
"""... and of one of a known object, whose keypoints say the rest."""
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


@dataclass(frozen=True, kw_only=True)
class Reading:
    """What crops of known objects show: dense features at stride 4, and a summary."""

    fine: Float[Tensor, "B C h w"]
    summary: Float[Tensor, "B D"]


@dataclass(frozen=True, kw_only=True)
class Seen:
    """What the heads read of images: features at stride 16, and for known objects a reading."""

    p16: Float[Tensor, "B C h w"]
    known: Reading | None


class KnownObjects(nn.Module):
    """Reads crops of known objects for their keypoints."""

    def __init__(self, backbone: str, options: dict[str, Any], width: int, cells: int) -> None:
        super().__init__()
        self.trunk, channels = make_trunk(backbone, options)
        self.neck = Neck(channels, width)
        self.summary = Summary(width, cells, KNOWN_SUMMARY)
        self.decoder = Decoder(width, KNOWN_SUMMARY, decoded_channels(width))

    def forward(self, image: Float[Tensor, "B 3 S S"]) -> Reading:
        """Crops in [-1, 1] to what the heads of known objects read."""
        p4, p8, p16 = self.neck(self.trunk(image))
        summary = self.summary(p16)
        return Reading(fine=self.decoder(p4, p8, summary), summary=summary)


class CategoryHeads(nn.Module):
    """The branches of one category."""

    hidden = 256

    def __init__(
        self, category: Category, inputs: int, width: int, pose_heads: PoseHeads = "joint"
    ) -> None:
        super().__init__()
        self.num_parts = len(category.part_names)
        self.num_joints = len(category.joints)
        self.joint_centric = pose_heads == "joint"
        self.num_posed = 1 if self.joint_centric else self.num_parts
        depth_size = self.num_posed + 3 * self.num_parts + 3 * self.num_joints
        self.rot_trans = perceptron(inputs, self.hidden, FROM_THE_FRONT * self.num_posed)
        self.depth_size = perceptron(inputs, self.hidden, [0.0] * depth_size)
        if self.joint_centric:
            self.joint = perceptron(inputs, self.hidden, [0.5] * self.num_joints)
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


class KnownHeads(CategoryHeads):
    """The branches of a category of known objects, which read keypoints, too.

    Sizes are the prior's.
    """

    hidden = 384

    def __init__(self, category: Category, width: int, pose_heads: PoseHeads = "joint") -> None:
        assert category.keypoints is not None
        count = category.keypoints[..., 0].size
        super().__init__(category, KNOWN_SUMMARY + NUM_CUES + 3 * count, width, pose_heads)
        self.maps = nn.Conv2d(decoded_channels(width), count, 1)
        self.deviation = perceptron(KNOWN_SUMMARY + count, 128, [FIRST_OF_KEYPOINTS] * count)

    def located(self, reading: Reading) -> Keypoints:
        """The keypoints in crops."""
        logits = self.maps(reading.fine)
        uv, variance = place_of(logits, STRIDES[0])
        unsure = torch.cat([reading.summary, (variance + 1).log()], dim=1).detach()
        log_deviation = self.deviation(unsure).float().clamp(*LOG_DEVIATION)
        return Keypoints(logits=logits, uv=uv, log_deviation=log_deviation)

    def posed(
        self,
        summary: Float[Tensor, "B D"],
        keypoints: Keypoints,
        box: Float[Tensor, "B 4"],
        cues: Float[Tensor, "B 6"],
    ) -> RawEstimate:
        """The raw estimate, from where the keypoints lie in the box; they learn nothing by it."""
        center, extent = (box[:, :2] + box[:, 2:]) / 2, (box[:, 2:] - box[:, :2]).amax(1)
        extent = extent[:, None, None]
        places = (keypoints.uv.detach() - center[:, None]) / extent
        deviation = keypoints.log_deviation.detach() - extent[:, 0].log()
        found = torch.cat([places.flatten(1), deviation + LOG_DEVIATION[1]], dim=1)
        raw = self(torch.cat([summary.expand(found.shape[0], -1), cues, found], dim=1))
        same = torch.zeros_like(raw.log_scale)
        return replace(raw, log_scale=same, center_shift=same)


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
        taught: What learns, see `Taught`; of a trunk, what lies behind ``frozen_to``.
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
        taught: Taught = "all",
    ) -> None:
        super().__init__(categories, input_size)
        self.trunk, channels = make_trunk(backbone, backbone_options or {})
        sides = (input_size // stride for stride in STRIDES)
        self.map_shapes = [(c, side, side) for c, side in zip(channels, sides, strict=True)]
        self.neck = Neck(channels, width)
        cells = input_size // 32
        self.pose_summary = Summary(width, cells, SUMMARY)
        self.photo_summary = Summary(width, cells, 256)
        self.found_box = perceptron(256, 128, [0.0] * 4)
        self.category_logits = perceptron(256, 128, [0.0] * (len(categories) + NOTHING_KNOWN))
        self.object_logits = dense_head(width // 2, 1)
        self.decoder = Decoder(width, SUMMARY, decoded_channels(width))
        self.known = tuple(c.name for c in categories if c.keypoints is not None)
        if self.known:
            self.known_objects = KnownObjects(backbone, backbone_options or {}, width, cells)
        self.heads = nn.ModuleDict(
            {
                c.name: KnownHeads(c, width, pose_heads)
                if c.name in self.known
                else CategoryHeads(c, SUMMARY + NUM_CUES, width, pose_heads)
                for c in categories
            }
        )
        self.taught = {"all": self.names, "known": self.known, "finding": ()}[taught]
        self.frozen = layers_up_to(self.trunk, frozen_to)
        if self.known:
            self.frozen += layers_up_to(self.known_objects.trunk, frozen_to)
        if taught != "all":
            self.frozen += self._not_finding()
        for layer in self.frozen:
            layer.requires_grad_(False)

    def _not_finding(self) -> list[nn.Module]:
        """What serves no taught category alone, nor tells categories and boxes of photos.

        What those are told by keeps its statistics: photos of all categories may be rarer now.
        """
        others = (head for name, head in self.heads.items() if name not in self.taught)
        shared = [self.trunk, self.neck, self.pose_summary, self.object_logits, self.decoder]
        if self.known and not self.taught:
            shared.append(self.known_objects)
        norms = (m for m in self.photo_summary.modules() if isinstance(m, nn.BatchNorm2d))
        return [*shared, *others, *norms]

    def start_known_objects(self, learned: Collection[str] = ()) -> None:
        """Let the trunk of known objects go on from what the other has learned.

        Args:
            learned: Names of parameters that have been taken over; with that trunk's among them,
                it stays as it is.
        """
        if self.known and not any(k.startswith("known_objects.trunk.") for k in learned):
            self.known_objects.trunk.load_state_dict(self.trunk.state_dict())

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
        features = self.trunk(torch.cat([crop, photo])) if offline is None else self.maps(offline)
        p4, p8, p16 = self.neck(features)
        n, each = len(crop), len(crop) // len(names)
        logits = self.object_logits(p4)
        found_box, category_logits = self.find(Seen(p16=p16, known=None))
        readings = self._readings(names, crop, p4[:n], p8[:n], p16[:n])
        of_each = (box, K, logits[:n], category_logits[:n])
        of_crops = zip(names, *(t.split(each) for t in of_each), strict=True)
        crops: dict[str, CropOutput] = {}
        for name, box, K, mask, category in of_crops:
            told = self._told(name, readings[name], box, K) if name in readings else {}
            crops[name] = CropOutput(**told, object_logits=mask, category_logits=category)
        return TrainingOutput(
            crops=crops,
            found_box=found_box[n:],
            category_logits=category_logits[n:],
            object_logits=logits[n:],
        )

    def _readings(
        self, names: Sequence[str], crop: Tensor, p4: Tensor, p8: Tensor, p16: Tensor
    ) -> dict[str, Reading]:
        """What is read of crops by the category that they are of, of those that are taught.

        Crops of all categories that are read alike go through together.
        """
        each = len(p16) // len(names)
        found: dict[str, Reading] = {}
        for known in (False, True):
            taught = (name for name in names if name in self.taught)
            alike = [name for name in taught if (name in self.known) is known]
            if not alike:
                continue
            rows = torch.arange(len(p16), device=p16.device).split(each)
            at = torch.cat([rows[names.index(name)] for name in alike])
            if len(alike) == len(names):
                at = slice(None)  # nothing to copy
            if known:
                reading = self.known_objects(crop[at])
            else:
                summary = self.pose_summary(p16[at])
                reading = Reading(fine=self.decoder(p4[at], p8[at], summary), summary=summary)
            parts = zip(alike, reading.fine.split(each), reading.summary.split(each), strict=True)
            found |= {name: Reading(fine=fine, summary=summary) for name, fine, summary in parts}
        return found

    def _told(self, name: str, reading: Reading, box: Tensor, K: Tensor) -> dict[str, Any]:
        """What the branches of a category say of crops."""
        head = self.head(name)
        keypoints = head.located(reading) if isinstance(head, KnownHeads) else None
        return {
            "raw": self._raw(name, reading.summary, keypoints, box, K),
            "dense": dense_output(head.surface(reading.fine)),
            "keypoints": keypoints,
        }

    def features(self, image: Float[Tensor, "B 3 S S"]) -> tuple[Tensor, Seen]:
        """Image in [-1, 1] to the neck's features at stride 4, and to what the heads read."""
        p4, _, p16 = self.neck(self.trunk(image))
        known = self.known_objects(image) if self.known else None
        return p4, Seen(p16=p16, known=known)

    def object_mask(self, dense: Tensor) -> Float[Tensor, "B h w"]:
        """Stride-4 features of crops to the share of each place that shows the object."""
        return self.object_logits(dense)[:, 0].float().sigmoid()

    def estimate_raw(
        self,
        name: str,
        seen: Seen,
        box: Float[Tensor, "B 4"],
        K: Float[Tensor, "B 3 3"],
    ) -> RawEstimate:
        """What is seen in crops to the raw estimate of category ``name``."""
        if name not in self.known:
            return self._raw(name, self.pose_summary(seen.p16), None, box, K)
        assert seen.known is not None
        return self._raw(name, seen.known.summary, self.keypoints(name, seen), box, K)

    def keypoints(self, name: str, seen: Seen) -> Keypoints | None:
        """The keypoints of category ``name`` in crops; None where it has none."""
        head = self.head(name)
        if not isinstance(head, KnownHeads):
            return None
        assert seen.known is not None
        return head.located(seen.known)

    def _raw(
        self, name: str, summary: Tensor, keypoints: Keypoints | None, box: Tensor, K: Tensor
    ) -> RawEstimate:
        cues = geometric_cues(box, K, self.priors[name].frontal_area)
        head = self.head(name)
        if isinstance(head, KnownHeads):
            assert keypoints is not None
            return head.posed(summary, keypoints, box, cues)
        summary = summary.expand(cues.shape[0], -1)
        return head(torch.cat([summary, cues], dim=1))

    def head(self, name: str) -> CategoryHeads:
        """The branches of category ``name``."""
        return cast(CategoryHeads, self.heads[name])

    def summarised(self, seen: Seen) -> Tensor:
        """What is seen in whole photos as one vector each."""
        return self.photo_summary(seen.p16)
