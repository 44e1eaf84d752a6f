"""The pixel loss in few passes over memory; its plain form costs more than the render."""

from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor
from torch.autograd.function import once_differentiable

EPSILON = 1e-4


def weighted_cross_entropy(
    predicted: Float[Tensor, "*B H W"],
    true: Float[Tensor, "*B H W"],
    weight: Float[Tensor, "*B H W"],
) -> Float[Tensor, "*B"]:
    """Mean over the pixels of ``−weight (t log p + (1 − t) log(1 − p))``.

    Here p is ``predicted``, drawn into [10⁻⁴, 1 − 10⁻⁴] by a linear map: both logarithms stay
    finite, and no gradient is cut. Gradients of first order reach ``predicted`` alone.
    """
    result = _WeightedCrossEntropy.apply(predicted, true.detach(), weight.detach())
    assert isinstance(result, Tensor)
    return result


class _WeightedCrossEntropy(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, predicted: Tensor, true: Tensor, weight: Tensor) -> Tensor:
        p = torch.add(EPSILON, predicted.detach(), alpha=1 - 2 * EPSILON)
        log_q = (1 - p).log_()
        entropy = (p.log() - log_q).mul_(true).add_(log_q).mul_(weight)
        ctx.save_for_backward(p, true, weight)
        return entropy.mean((-2, -1)).neg_()

    @staticmethod
    @once_differentiable
    def backward(  # pyright: ignore[reportIncompatibleMethodOverride]
        ctx: Any, *grads: Tensor
    ) -> tuple[Tensor | None, ...]:
        p, true, weight = ctx.saved_tensors
        share = grads[0] * ((1 - 2 * EPSILON) / (p.shape[-2] * p.shape[-1]))
        slope = (p - true).div_(p).div_(1 - p).mul_(weight).mul_(share[..., None, None])
        return slope, None, None
