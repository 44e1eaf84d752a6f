"""Points of a known object, each looked for in the crop by a map of its own.

Objects that are all the same, as robot arms are, have points that can be told apart. A map per
point says where in the crop it is, hidden or not; its mean is the place (an integral regression,
Sun et al., 2018), and how far off that may be is estimated beside.
"""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

FIRST_LOG_DEVIATION = 2.0
"""Of keypoints of a network that has learned nothing: 7 px."""
LOG_DEVIATION = (-2.0, 4.0)
"""Least and greatest logarithm of a deviation: 0.14 to 55 px."""


@dataclass(frozen=True, kw_only=True)
class Keypoints:
    """What a crop says of the N keypoints of a known object.

    Attributes:
        logits: Where each is: of every place.
        uv: The places (px of the crop).
        log_deviation: Logarithm of how far off (px) they may be.
    """

    logits: Float[Tensor, "B N h w"]
    uv: Float[Tensor, "B N 2"]
    log_deviation: Float[Tensor, "B N"]


def place_of(logits: Float[Tensor, "B N h w"], stride: int) -> tuple[Tensor, Tensor]:
    """The mean (B, N, 2) of maps over places ``stride`` px apart, and its variance (B, N), in px.

    Pixels count from the crop's corner, so the middle of the first place is at half a stride.
    """
    height, width = logits.shape[2:]
    share = logits.float().flatten(2).softmax(dim=-1).unflatten(2, (height, width))
    u = stride * (torch.arange(width, device=logits.device) + 0.5)
    v = stride * (torch.arange(height, device=logits.device) + 0.5)
    across, down = share.sum(dim=2), share.sum(dim=3)
    mean = torch.stack([(across * u).sum(-1), (down * v).sum(-1)], dim=-1)
    square = (across * u.square()).sum(-1) + (down * v.square()).sum(-1)
    variance = square - mean.square().sum(-1)
    return mean, variance.clamp_min(0)
