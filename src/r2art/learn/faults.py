"""What cameras do to pictures: exposure, colour, blur, noise and JPEG."""

import io

import numpy as np
import torch
from jaxtyping import Float
from PIL import Image
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
    x = (x + amount * chance.normal(*x.shape)).clamp(0, 1)
    return recompressed(x, chance.happens(0.2, n), chance) * 2 - 1


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


def recompressed(x: Tensor, which: Tensor, chance: Chance) -> Tensor:
    """JPEG artefacts of quality 25 to 80 on the chosen images."""
    x = x.clone()
    for i in which.nonzero()[:, 0].tolist():
        picture = (x[i].permute(1, 2, 0).cpu().numpy() * 255).astype(np.uint8)
        buffer = io.BytesIO()
        quality = int(chance.uniform(25, 80, 1))
        Image.fromarray(picture).save(buffer, "JPEG", quality=quality)
        decoded = np.asarray(Image.open(buffer))
        x[i] = torch.from_numpy(decoded.copy()).permute(2, 0, 1).to(x) / 255
    return x
