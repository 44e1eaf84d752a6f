"""What every network of this package says, and how it is asked.

A network sees crops round objects and whole photos. Of a crop it gives the `RawEstimate` that
`r2art.method.estimate` turns into poses; in a photo it finds the object and names its category.
"""

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, Literal

import torch
from jaxtyping import Float
from torch import Tensor, nn

from r2art.core.category import Category
from r2art.method.keypoints import Keypoints
from r2art.method.shape import Prior

PoseHeads = Literal["joint", "part"]
"""Joint-centric: the root's pose and joint states. Part-centric: a pose for every part."""

Taught = Literal["all", "known", "finding"]
"""What of a network learns: all of it; what serves known objects alone, and what finds objects in
whole photos and names their category; or only the latter."""


@dataclass(frozen=True, kw_only=True)
class NodePoses:
    """Poses of the parts behind the root, one by one: the part-centric ablation.

    The fields mean what those of `RawEstimate` mean for the root, with the centre of the part's
    box in place of the root's origin.
    """

    up: Float[Tensor, "*B J 3"]
    right: Float[Tensor, "*B J 3"]
    phi: Float[Tensor, "*B J 2"]
    log_lambda: Float[Tensor, "*B J"]


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
        nodes: Poses of the other parts; then the joint states are read off the poses, and
            ``joint_share`` means nothing.
    """

    up: Float[Tensor, "*B 3"]
    right: Float[Tensor, "*B 3"]
    phi: Float[Tensor, "*B 2"]
    log_lambda: Float[Tensor, "*B"]
    joint_share: Float[Tensor, "*B J"]
    log_scale: Float[Tensor, "*B P 3"]
    center_shift: Float[Tensor, "*B P 3"]
    confidence_logit: Float[Tensor, "*B P"]
    nodes: NodePoses | None = None


def raw_estimate(
    rot_trans: Float[Tensor, "B posed 8"],
    log_lambda: Float[Tensor, "B posed"],
    joint_share: Float[Tensor, "B J"],
    size: Float[Tensor, "B D"],
    confidence_logit: Float[Tensor, "B P"],
) -> RawEstimate:
    """Numbers by their names.

    Args:
        rot_trans: Up, right and φ of the root, and of the other parts where they are regressed.
        log_lambda: Likewise.
        joint_share: Of the joints.
        size: 3 P log-scales, then 3 J shifts of centres.
        confidence_logit: Of the parts.
    """
    batch, num_parts = confidence_logit.shape
    log_scale, shift = size.split([3 * num_parts, size.shape[1] - 3 * num_parts], dim=1)
    shift = shift.reshape(batch, num_parts - 1, 3)
    up, right, phi = rot_trans.split([3, 3, 2], dim=2)
    nodes = NodePoses(
        up=up[:, 1:], right=right[:, 1:], phi=phi[:, 1:], log_lambda=log_lambda[:, 1:]
    )
    return RawEstimate(
        up=up[:, 0],
        right=right[:, 0],
        phi=phi[:, 0],
        log_lambda=log_lambda[:, 0],
        joint_share=joint_share,
        log_scale=log_scale.reshape(batch, num_parts, 3),
        center_shift=torch.cat([torch.zeros_like(shift[:, :1]), shift], dim=1),
        confidence_logit=confidence_logit,
        nodes=nodes if rot_trans.shape[1] > 1 else None,
    )


@dataclass(frozen=True, kw_only=True)
class DenseOutput:
    """What every place of a crop, at stride 4, says of the surface that is seen there.

    Attributes:
        part_logits: Which part it is; class 0 is none, k + 1 part k.
        coordinates: Where on that part, in its box: from -0.5 to 0.5 along each axis.
        log_deviation: Logarithm of how far (px of the crop) that may be seen from the place's
            middle if the pose is right.
    """

    part_logits: Float[Tensor, "B classes h w"]
    coordinates: Float[Tensor, "B 3 h w"]
    log_deviation: Float[Tensor, "B h w"]


LOG_DEVIATION = (-1.0, 4.0)
"""Least and greatest of a `DenseOutput`: 0.4 to 55 px."""
DENSE_CHANNELS = 5
"""Of the maps of a `DenseOutput`, besides one for every part: none, coordinates, deviation."""


def dense_output(maps: Float[Tensor, "B D h w"]) -> DenseOutput:
    """Maps by their names, in float32 but for the parts."""
    parts = maps.shape[1] - DENSE_CHANNELS
    logits, coordinates, log_deviation = maps.split([parts + 1, 3, 1], dim=1)
    return DenseOutput(
        part_logits=logits,
        coordinates=coordinates.float(),
        log_deviation=log_deviation[:, 0].float().clamp(*LOG_DEVIATION),
    )


NOTHING_KNOWN = 1
"""Answers to what a photo shows that are no category: one, the last."""


@dataclass(frozen=True, kw_only=True)
class CropOutput:
    """What a training pass yields of crops of one category; what it has no head for is None.

    Attributes:
        raw: The raw estimate of every crop.
        keypoints: Of known objects.
        dense: What every place says of the parts.
        object_logits: Where the object is seen, at stride 4.
        category_logits: What the crops show, taken for whole photos, which they are at a second
            look.
    """

    raw: RawEstimate | None = None
    keypoints: Keypoints | None = None
    dense: DenseOutput | None = None
    object_logits: Float[Tensor, "B 1 h w"] | None = None
    category_logits: Float[Tensor, "B answers"] | None = None


@dataclass(frozen=True, kw_only=True)
class TrainingOutput:
    """What one training pass yields.

    Attributes:
        crops: Of the crops, by category.
        found_box: The object's box (px) in every whole photo.
        category_logits: What the photos show: one of the C categories, or last, none of them.
        object_logits: Where in the photos the object is seen, at stride 4; None without a head.
    """

    crops: dict[str, CropOutput]
    found_box: Float[Tensor, "N 4"]
    category_logits: Float[Tensor, "N answers"]
    object_logits: Float[Tensor, "N 1 h w"] | None


FINDING = ("photo_summary.", "found_box.", "category_logits.")
"""What finds objects in whole photos and names their category, of a `Network`."""


class Network(nn.Module):
    """A network for several categories, whatever it is made of.

    Args:
        categories: What it can estimate.
        input_size: Side (px) of the square input; a multiple of 32.

    Attributes:
        names: Of the categories.
        priors: By name.
        photo_summary: What `find` reads, to one vector.
        found_box: From it the box, as centre and log-size.
        category_logits: From it the category, or that it is none of them.
    """

    photo_summary: nn.Module
    found_box: nn.Module
    category_logits: nn.Module

    def __init__(self, categories: tuple[Category, ...], input_size: int) -> None:
        super().__init__()
        if input_size % 32:
            raise ValueError(f"input size must be a multiple of 32, got {input_size}")
        self.input_size = input_size
        self.names = tuple(c.name for c in categories)
        self.priors = {c.name: Prior.from_category(c) for c in categories}

    @abstractmethod
    def offline(self, image: Float[Tensor, "B 3 S S"]) -> Float[Tensor, "B ..."]:
        """What frozen layers say of images in [-1, 1]: always the same, so it can be kept.

        The training pass takes it as ``offline``, of crops and then of photos.
        """

    @abstractmethod
    def features(self, image: Float[Tensor, "B 3 S S"]) -> tuple[Tensor, Any]:
        """Images in [-1, 1] to dense features, and to what `find` and `estimate_raw` read."""

    @abstractmethod
    def estimate_raw(
        self, name: str, seen: Any, box: Float[Tensor, "B 4"], K: Float[Tensor, "B 3 3"]
    ) -> RawEstimate:
        """What is seen in crops, with box and intrinsics, to the numbers of category ``name``.

        One crop may be seen through several cameras: then there are several boxes and K.
        """

    def keypoints(self, name: str, seen: Any) -> Keypoints | None:
        """What is seen in crops to the keypoints of category ``name``, or nothing."""
        del name, seen
        return None

    @property
    def finds_keypoints(self) -> bool:
        """Whether it looks for keypoints of known objects."""
        return type(self).keypoints is not Network.keypoints

    def object_mask(self, dense: Tensor) -> Float[Tensor, "B h w"] | None:
        """Dense features of crops to the share of each place that shows the object, or nothing."""
        del dense
        return None

    @abstractmethod
    def summarised(self, seen: Any) -> Float[Tensor, "B D"]:
        """What is seen in whole photos as one vector each."""

    def find(self, seen: Any) -> tuple[Float[Tensor, "B 4"], Float[Tensor, "B answers"]]:
        """What is seen in whole photos to the object's box (px) and category logits, in float32."""
        summary = self.summarised(seen)
        center, log_size = self.found_box(summary).float().split(2, dim=1)
        half = (log_size - 0.5).exp() / 2
        box = torch.cat([0.5 + center - half, 0.5 + center + half], dim=1)
        return box * self.input_size, self.category_logits(summary).float()
