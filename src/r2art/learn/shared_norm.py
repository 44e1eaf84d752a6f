"""BatchNorm over the batches of all processes together, on any device.

So that several processes compute what one with the joint batch does. torch's `SyncBatchNorm`
does the same, but on GPUs only.
"""

from typing import Any

import torch
from jaxtyping import Float
from timm.layers.norm_act import BatchNormAct2d
from torch import Tensor, nn
from torch.distributed.nn.functional import all_reduce
from torch.nn import functional as F


def share_statistics(network: nn.Module) -> None:
    """Make every BatchNorm layer share its statistics; all processes must have equal batches."""
    for layer in network.modules():
        if type(layer) is BatchNormAct2d:
            layer.__class__ = SharedNormAct
        elif type(layer) is nn.BatchNorm2d:
            layer.__class__ = SharedNorm


class SharedNorm(nn.BatchNorm2d):
    """`torch.nn.BatchNorm2d` over all processes."""

    def forward(self, input: Float[Tensor, "B C H W"]) -> Float[Tensor, "B C H W"]:
        """Normalise."""
        return _normalised(self, input)


class SharedNormAct(BatchNormAct2d):
    """timm's, with its activation."""

    def forward(self, x: Float[Tensor, "B C H W"]) -> Float[Tensor, "B C H W"]:
        """Normalise and activate."""
        layer: Any = self  # timm's types are too loose
        return layer.act(layer.drop(_normalised(layer, x)))


def _normalised(layer: nn.BatchNorm2d, x: Tensor) -> Tensor:
    assert layer.running_mean is not None
    assert layer.running_var is not None
    if not layer.training:
        mean, var = layer.running_mean, layer.running_var
        return F.batch_norm(x, mean, var, layer.weight, layer.bias, False, 0.0, layer.eps)
    mean, var = _joint_statistics(x.float())
    n = torch.distributed.get_world_size() * x.numel() // x.shape[1]
    with torch.no_grad():
        momentum = layer.momentum or 0.0
        layer.running_mean.lerp_(mean, momentum)
        layer.running_var.lerp_(var * n / max(1, n - 1), momentum)
        if layer.num_batches_tracked is not None:
            layer.num_batches_tracked += 1
    scale = layer.weight * torch.rsqrt(var + layer.eps)
    shift = layer.bias - mean * scale
    return (x * scale[:, None, None] + shift[:, None, None]).to(x.dtype)


def _joint_statistics(x: Tensor) -> tuple[Tensor, Tensor]:
    """Mean and biased variance per channel over all processes.

    Each puts its own into its row of a table, and the sum of the tables holds all of them: no
    difference of large squares, as sums of squares would be.
    """
    rank, world = torch.distributed.get_rank(), torch.distributed.get_world_size()
    own = torch.stack([x.mean((0, 2, 3)), x.var((0, 2, 3), correction=0)])[None]
    empty = torch.zeros_like(own)
    table = torch.cat([own if k == rank else empty for k in range(world)])
    means, variances = all_reduce(table).unbind(1)
    mean = means.mean(0)
    return mean, (variances + (means - mean).square()).mean(0)
