"""What cameras do to pictures: exposure, colour, blur, noise and JPEG."""

from math import pi

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from r2art.learn.chance import Chance


def camera_faults(image: Float[Tensor, "B 3 S S"], chance: Chance) -> Float[Tensor, "B 3 S S"]:
    """Exposure, contrast, colour cast, saturation, blur, noise and JPEG, each now and then."""
    n = len(image)
    x = (image + 1) / 2
    gamma = torch.exp(0.25 * chance.normal(n, 1, 1, 1)).clamp(0.5, 2)
    x = x.clamp(1e-4, 1).pow(gamma)
    mean = x.mean(dim=(1, 2, 3), keepdim=True)
    x = mean + (x - mean) * chance.uniform(0.6, 1.35, n, 1, 1, 1)
    x = x * (1 + 0.06 * chance.normal(n, 3, 1, 1)) + 0.06 * chance.normal(n, 1, 1, 1)
    grey = x.mean(dim=1, keepdim=True)
    saturation = chance.uniform(0.3, 1.5, n, 1, 1, 1)
    saturation = saturation * ~chance.happens(0.06, n)[:, None, None, None]
    x = grey + (x - grey) * saturation
    x = blurred(x, chance)
    amount = chance.uniform(0, 0.04, n, 1, 1, 1) * chance.happens(0.5, n)[:, None, None, None]
    x = (x + amount * chance.grain(*x.shape)).clamp(0, 1)
    compressed = recompressed(x, chance.uniform(25, 80, n))
    return torch.where(chance.happens(0.2, n)[:, None, None, None], compressed, x) * 2 - 1


def blurred(x: Tensor, chance: Chance, reach: int = 3) -> Tensor:
    """Gaussian blur of up to 1.8 px, a different one for every image; half stay sharp."""
    n = len(x)
    sigma = chance.uniform(0.3, 1.8, n, 1) * chance.happens(0.5, n, 1) + 1e-2
    at = torch.arange(-reach, reach + 1, device=x.device)
    kernel = torch.exp(-at.square() / (2 * sigma.square()))
    kernel = (kernel / kernel.sum(dim=1, keepdim=True)).repeat_interleave(3, dim=0)[:, None]
    stacked = F.pad(x, (reach, reach, reach, reach), mode="replicate").flatten(0, 1)[None]
    stacked = F.conv2d(stacked, kernel[:, :, None, :], groups=3 * n)
    stacked = F.conv2d(stacked, kernel[:, :, :, None], groups=3 * n)
    return stacked[0].unflatten(0, (n, 3))


# Of JPEG (ITU-T T.81, annex K): steps of quality 50 for brightness and for colour.
_BRIGHTNESS = (
    (16, 11, 10, 16, 24, 40, 51, 61),
    (12, 12, 14, 19, 26, 58, 60, 55),
    (14, 13, 16, 24, 40, 57, 69, 56),
    (14, 17, 22, 29, 51, 87, 80, 62),
    (18, 22, 37, 56, 68, 109, 103, 77),
    (24, 35, 55, 64, 81, 104, 113, 92),
    (49, 64, 78, 87, 103, 121, 120, 101),
    (72, 92, 95, 98, 112, 100, 103, 99),
)
_COLOUR = (
    (17, 18, 24, 47, 99, 99, 99, 99),
    (18, 21, 26, 66, 99, 99, 99, 99),
    (24, 26, 56, 99, 99, 99, 99, 99),
    (47, 66, 99, 99, 99, 99, 99, 99),
    *((99,) * 8,) * 4,
)
_TO_YCC = (
    (0.299, 0.587, 0.114),
    (-0.168736, -0.331264, 0.5),
    (0.5, -0.418688, -0.081312),
)


def recompressed(
    x: Float[Tensor, "B 3 S S"], quality: Float[Tensor, " B"]
) -> Float[Tensor, "B 3 S S"]:
    """Images in [0, 1] as JPEG of the given qualities (1 to 100) would bring them back.

    Without a codec, so that whole batches pass at once on any device: what JPEG loses is lost in
    the rounding of 8 × 8 cosine coefficients, colour at half resolution. ``S`` is a multiple of
    16.
    """
    steps = torch.where(quality < 50, 5000 / quality, 200 - 2 * quality)[:, None, None]
    to_ycc = x.new_tensor(_TO_YCC)
    y, *colour = torch.einsum("kc,bchw->kbhw", to_ycc, 255 * x)
    y = _rounded(y - 128, _steps(x.new_tensor(_BRIGHTNESS), steps)) + 128
    half = [F.avg_pool2d(c[:, None], 2)[:, 0] for c in colour]
    half = [_rounded(c, _steps(x.new_tensor(_COLOUR), steps)) for c in half]
    wide = [F.interpolate(c[:, None], scale_factor=2, mode="bilinear")[:, 0] for c in half]
    back = torch.linalg.inv(to_ycc.cpu()).to(x)
    return (torch.einsum("ck,kbhw->bchw", back, torch.stack([y, *wide])) / 255).clamp(0, 1)


def _steps(of_quality_50: Tensor, percent: Tensor) -> Float[Tensor, "B 8 8"]:
    return ((of_quality_50 * percent + 50) / 100).floor().clamp(1, 255)


def _rounded(plane: Float[Tensor, "B h w"], steps: Float[Tensor, "B 8 8"]) -> Tensor:
    """A plane whose cosine coefficients are whole multiples of the steps."""
    k = torch.arange(8, device=plane.device)
    cosines = torch.cos(pi / 8 * (k + 0.5) * k[:, None]) / 2
    cosines[0] /= 2**0.5
    blocks = plane.unflatten(2, (-1, 8)).unflatten(1, (-1, 8)).transpose(2, 3)
    steps = steps[:, None, None]
    blocks = cosines.mT @ ((cosines @ blocks @ cosines.mT / steps).round() * steps) @ cosines
    return blocks.transpose(2, 3).flatten(3, 4).flatten(1, 2)
