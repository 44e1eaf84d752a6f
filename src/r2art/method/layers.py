"""What the networks are made of: small layers, and cues that pixels do not hold."""

from collections.abc import Sequence

import torch
from jaxtyping import Float
from torch import Tensor, nn

from r2art.method.depth import projection_depth, viewing_ray

NUM_CUES = 6
FROM_THE_FRONT = [*(0.0, -0.9, -0.4), *(1.0, 0.0, 0.0), *(0.0, 0.0)]
"""Up, right and φ of an object seen from a little above."""


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


class Summary(nn.Module):
    """A feature map to one vector that still knows where things are.

    Args:
        width: Channels of the map.
        cells: Half of its side, rounded up.
        outputs: Length of the vector.
    """

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

    def forward(self, features: Tensor) -> Tensor:
        """(B, width, H, W) to (B, outputs)."""
        return self.layers(features)


def geometric_cues(
    box: Float[Tensor, "*B 4"], K: Float[Tensor, "*B 3 3"], frontal_area: float
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
