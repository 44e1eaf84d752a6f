"""Training runs. A run is a function that returns a `Recipe`; copy one to change it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal

from r2art.core.category import Category
from r2art.learn.objective import CascadeOptions, Weights
from r2art.method.network import STRIDES, R2ArtNet
from r2art.method.outputs import Network, PoseHeads, Taught
from r2art.method.paper_network import PaperNet


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """Everything that decides a run, besides its data.

    Attributes:
        network: The small one, or the paper's.
        backbone: Any timm name. Of the small network: with features at strides 4, 8, 16 and 32; of
            the paper's: the frozen one.
        backbone_options: Passed on to timm by the small network.
        depth_backbone: Timm name of the paper's depth branch.
        joint_backbone: Timm name of the paper's joint branch.
        pretrained: Whether the paper's backbones start from timm's hub, where the job gives no
            weights; without, they start from random numbers.
        offline_features: Whether the features of a frozen backbone are computed once per photo
            and kept, which leaves no augmentation. Without, the paper's are computed anew for
            every augmented crop, and the small network's trunk is not frozen.
        frozen_to: Of the small network: the trunk's layers up to the features of this stride stay
            as they are, which saves a third of a step's time at stride 8; 0: all of it learns.
        taught: Of the small network: what of it learns.
        pose_heads: Whether joint states are regressed, or every part's pose (ablation).
        input_size: Side (px) of crops and of the letterboxed photo.
        width: Channels of the neck.
        steps: Optimiser steps.
        epochs: Passes over the crops of all data, instead of ``steps``.
        crops: Crops per step and category ...
        groups: ... of so many categories, or of all if there are fewer; and ...
        turns: How often a category has its turn with the crops, relative to others; its number of
            parts where not named.
        photos: ... whole photos per step, of all categories, of every share.
        others: Pictures per step, of every share, that show no known object.
        shares: Shares of a step's batch that each process takes.
        learning_rate: At its peak, of the new layers ...
        trunk_learning_rate: ... of the pre-trained trunk, or of what finds objects in photos where
            only that and known objects are taught ...
        dense_learning_rate: ... and of what says which point of a part every place shows.
        warm_up: Steps of linear warm-up; the cosine decay takes the rest.
        weight_decay: Of AdamW.
        gradient_norm: Gradients are clipped to it.
        ema: Decay of the averaged weights, which are what is exported.
        cascade_from: Step at which the cascade losses join; None: never.
        cascade_pixels: Side of the silhouettes.
        cascade: Which of its stages are on, and what they move.
        pictures_at: Steps after which silhouettes are drawn.
        seed: Of everything random.
        weights: Of the losses.
    """

    network: Literal["small", "paper"] = "small"
    backbone: str = "mobilenetv2_100"
    backbone_options: dict[str, object] = field(default_factory=dict)
    depth_backbone: str = "hrnet_w18_small"
    joint_backbone: str = "resnet18"
    pretrained: bool = False
    offline_features: bool = False
    frozen_to: int = 0
    taught: Taught = "all"
    pose_heads: PoseHeads = "joint"
    input_size: int = 160
    width: int = 96
    steps: int = 4450
    epochs: int | None = None
    crops: int = 32
    groups: int = 1
    turns: Mapping[str, float] = field(default_factory=dict)
    photos: int = 8
    others: int = 0
    shares: int = 1
    learning_rate: float = 1e-3
    trunk_learning_rate: float = 5e-4
    dense_learning_rate: float = 1e-3
    warm_up: int = 200
    weight_decay: float = 0.02
    gradient_norm: float = 5.0
    ema: float = 0.998
    cascade_from: int | None = 1500
    cascade_pixels: int = 56
    cascade: CascadeOptions = field(default_factory=CascadeOptions)
    pictures_at: tuple[int, ...] = ()
    seed: int = 0
    weights: Weights = field(default_factory=Weights)

    def __post_init__(self) -> None:
        if self.photos < 1 or self.others < 0:
            raise ValueError(f"1 photo or more, {self.photos}, and 0 others or more, {self.others}")
        if self.offline_features and self.others:
            raise ValueError(f"features of others cannot be kept: they vary; 0, not {self.others}")

    def make(self, categories: tuple[Category, ...]) -> Network:
        """The network of the recipe, with random weights."""
        if self.network == "paper":
            return PaperNet(
                categories,
                self.backbone,
                self.depth_backbone,
                self.joint_backbone,
                self.input_size,
                self.width,
                self.pose_heads,
            )
        options = dict(self.backbone_options)
        return R2ArtNet(
            categories,
            self.backbone,
            self.input_size,
            self.width,
            options,
            self.pose_heads,
            frozen_to=STRIDES[-1] if self.offline_features else self.frozen_to,
            taught=self.taught,
        )

    def for_photos(self, n: int, categories: int = 1, processes: int = 1) -> "Recipe":
        """With as many steps as its epochs take over ``n`` photos."""
        if self.epochs is None:
            return self
        per_step = self.crops * min(self.groups, categories) * self.shares * processes
        return replace(self, steps=max(1, -(-self.epochs * n // per_step)))


NETWORK_FIELDS = (
    "network",
    "backbone",
    "backbone_options",
    "depth_backbone",
    "joint_backbone",
    "pose_heads",
    "input_size",
    "width",
)
"""What two recipes must share so that one's checkpoint fits the other."""


def recipe_of(stored: Mapping[str, Any]) -> Recipe:
    """A recipe as a run's ``run.json`` has it; what an older one does not know has its default."""
    known = {f.name: stored[f.name] for f in fields(Recipe) if f.name in stored}
    known["weights"] = Weights(**stored.get("weights", {}))
    cascade = dict(stored.get("cascade", {}))
    if "stages" in cascade:
        cascade["stages"] = tuple(cascade["stages"])
    known["cascade"] = CascadeOptions(**cascade)
    known["pictures_at"] = tuple(stored.get("pictures_at", ()))
    return Recipe(**known)


def tiny(steps: int = 4450) -> Recipe:
    """The shipped model: MobileNetV2, a couple of hours on two CPU cores.

    ``pad_type="same"`` is what the ImageNet weights it starts from were trained with.
    """
    return Recipe(
        backbone_options={"pad_type": "same"},
        steps=steps,
        others=2,
        cascade_from=min(1125, steps // 4),
    )


def further(steps: int = 5400) -> Recipe:
    """Goes on from a trained run (``--init``) at a lower rate, with the cascade from the start.

    The trunk's first layers, which take most of the time, stay as they are.
    """
    return Recipe(
        backbone_options={"pad_type": "same"},
        frozen_to=8,
        steps=steps,
        crops=9,
        groups=3,
        photos=6,
        others=2,
        learning_rate=4e-4,
        trunk_learning_rate=2e-4,
        cascade_from=0,
        seed=1,
    )


def known(steps: int = 8000) -> Recipe:
    """Known objects, such as robot arms, beside what a trained run or model (``--init``) knows.

    That keeps all it has learned of other categories; photos of these are needed nonetheless, to
    be told apart from. Give known objects their turns: ``--turns panda=99 iiwa7=99``.
    """
    return Recipe(
        backbone_options={"pad_type": "same"},
        frozen_to=8,
        taught="known",
        steps=steps,
        crops=12,
        groups=3,
        photos=8,
        others=2,
        trunk_learning_rate=4e-4,
        cascade_from=None,
        seed=1,
    )


def finding(steps: int = 4000) -> Recipe:
    """Only what finds objects in whole photos and names their category, of a trained model.

    All that it says of poses stays as it is (``--init``). On a CPU a step of 70 pictures is as fast
    as one of 35 otherwise.
    """
    return Recipe(
        backbone_options={"pad_type": "same"},
        taught="finding",
        steps=steps,
        crops=4,
        groups=100,
        photos=32,
        others=8,
        trunk_learning_rate=5e-4,
        cascade_from=None,
        seed=1,
    )


def many(steps: int = 9000) -> Recipe:
    """All categories in one network, on a GPU: all of them in every step; the shipped model.

    From a trained run or model (``--init``), whose trunk knows what such objects look like.
    """
    return Recipe(
        backbone_options={"pad_type": "same"},
        steps=steps,
        crops=32,
        groups=100,
        photos=64,
        others=12,
        warm_up=300,
        ema=0.999,
        cascade_from=None,
        seed=2,
    )


def smoke(steps: int = 4) -> Recipe:
    """A few steps on small batches: shows that everything runs, learns nothing."""
    return Recipe(
        backbone_options={"pad_type": "same"},
        input_size=96,
        steps=steps,
        crops=4,
        photos=2,
        others=1,
        warm_up=1,
        cascade_from=1,
    )


def paper(steps: int | None = None) -> Recipe:
    """The network and the training that the paper describes: 224², 2,048 points, 200 epochs.

    One category is meant, but more will do. Batch size, rates and loss weights are not given.
    """
    return Recipe(
        network="paper",
        backbone="vit_small_patch14_dinov2",
        pretrained=True,
        offline_features=True,
        input_size=224,
        width=128,
        steps=1 if steps is None else steps,
        epochs=200 if steps is None else None,
        learning_rate=3e-4,
        trunk_learning_rate=3e-4,
        cascade_from=1000 if steps is None else min(1000, steps // 4),
        cascade_pixels=112,
        weights=Weights(part_mask=0.0, object_mask=0.0),
    )


def ablation_I(steps: int = 4450) -> Recipe:
    """Table 2, row I: no cascade."""
    return replace(tiny(steps), cascade_from=None)


def ablation_II(steps: int = 4450) -> Recipe:
    """Table 2, row II: stage I alone, the area."""
    return replace(tiny(steps), cascade=CascadeOptions(stages=(1,)))


def ablation_III(steps: int = 4450) -> Recipe:
    """Table 2, row III: stages I and II, area and alignment."""
    return replace(tiny(steps), cascade=CascadeOptions(stages=(1, 2)))


def ablation_IV(steps: int = 4450) -> Recipe:
    """Table 2, row IV: the whole cascade; what `tiny` does."""
    return replace(tiny(steps), cascade=CascadeOptions(stages=(1, 2, 3)))


def pixel_only(steps: int = 4450) -> Recipe:
    """Beside Table 2: the pixels alone, at every stage."""
    return replace(tiny(steps), cascade=CascadeOptions(stages=(3,)))


def box_steers_all(steps: int = 4450) -> Recipe:
    """Beside Table 2: the whole cascade, its boxes moving every degree of freedom, as printed."""
    return replace(tiny(steps), cascade=CascadeOptions(box_steers_all=True))


def part_centric(steps: int = 4450) -> Recipe:
    """What the paper argues against: every part's pose regressed by itself, no joints."""
    return replace(tiny(steps), pose_heads="part")


RECIPES = {
    f.__name__: f
    for f in (
        tiny,
        further,
        known,
        finding,
        many,
        smoke,
        paper,
        ablation_I,
        ablation_II,
        ablation_III,
        ablation_IV,
        pixel_only,
        box_steers_all,
        part_centric,
    )
}
