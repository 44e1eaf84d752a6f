"""Training runs. A run is a function that returns a `Recipe`; copy one to change it."""

from dataclasses import dataclass, field

from r2art.learn.objective import Weights


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """Everything that decides a run, besides its data.

    Attributes:
        backbone: Any timm name with features at strides 8, 16 and 32.
        backbone_options: Passed on to timm.
        input_size: Side (px) of crops and of the letterboxed photo.
        width: Channels of the neck.
        steps: Optimiser steps.
        crops: Crops per step, all of one category.
        photos: Whole photos per step, of all categories.
        learning_rate: At its peak, of the new layers ...
        trunk_learning_rate: ... and of the pre-trained trunk.
        warm_up: Steps of linear warm-up; the cosine decay takes the rest.
        weight_decay: Of AdamW.
        gradient_norm: Gradients are clipped to it.
        ema: Decay of the averaged weights, which are what is exported.
        cascade_from: Step at which the cascade losses join; None: never.
        cascade_pixels: Side of the silhouettes.
        seed: Of everything random.
        weights: Of the losses.
    """

    backbone: str = "mobilenetv2_100"
    backbone_options: dict[str, object] = field(default_factory=dict)
    input_size: int = 160
    width: int = 96
    steps: int = 4450
    crops: int = 32
    photos: int = 8
    learning_rate: float = 1e-3
    trunk_learning_rate: float = 5e-4
    warm_up: int = 200
    weight_decay: float = 0.02
    gradient_norm: float = 5.0
    ema: float = 0.998
    cascade_from: int | None = 1500
    cascade_pixels: int = 56
    seed: int = 0
    weights: Weights = field(default_factory=Weights)


def tiny(steps: int = 4450) -> Recipe:
    """The shipped model: MobileNetV2, a couple of hours on two CPU cores.

    ``pad_type="same"`` is what the ImageNet weights it starts from were trained with.
    """
    return Recipe(
        backbone_options={"pad_type": "same"}, steps=steps, cascade_from=min(1125, steps // 4)
    )


def further(steps: int = 5400) -> Recipe:
    """Goes on from a trained run (``--init``) at a lower rate, with the cascade from the start."""
    return Recipe(
        backbone_options={"pad_type": "same"},
        steps=steps,
        learning_rate=7e-4,
        trunk_learning_rate=3.5e-4,
        cascade_from=0,
        seed=1,
    )


def smoke(steps: int = 4) -> Recipe:
    """A few steps on small batches: shows that everything runs, learns nothing."""
    return Recipe(
        backbone_options={"pad_type": "same"},
        input_size=96,
        steps=steps,
        crops=4,
        photos=2,
        warm_up=1,
        cascade_from=1,
    )


RECIPES = {"tiny": tiny, "further": further, "smoke": smoke}
