"""A picture of a step: crops with their true and their estimated silhouette."""

import io

import numpy as np
import torch
from jaxtyping import Float
from PIL import Image, ImageDraw, ImageFont
from torch import Tensor
from torch.nn import functional as F

from r2art.learn.augment import Crops
from r2art.learn.objective import CascadeOptions, renderings, true_shape
from r2art.method.cascade import stage
from r2art.method.estimate import estimate
from r2art.method.outputs import RawEstimate
from r2art.method.shape import Prior

TILE, COLUMNS, CAPTION = 224, 4, 22
TRUE, ESTIMATED = (0, 200, 90), (255, 0, 160)


@torch.no_grad()
def silhouette_sheet(
    prior: Prior, raw: RawEstimate, crops: Crops, most: int = 8, pixels: int = 112
) -> bytes:
    """PNG of the first crops: the true outline green, the estimated one pink, and the stage.

    Silhouettes are of all of the prior's points, whatever the loss makes do with.
    """
    found = estimate(prior, raw, crops.box, crops.K)
    shape = true_shape(prior, crops)
    predicted, truth = renderings(found, crops, shape, pixels, CascadeOptions())
    stages = stage(predicted.box, truth.box)
    n = min(most, len(stages))
    sheet = Image.new("RGB", (COLUMNS * TILE, -(-n // COLUMNS) * (TILE + CAPTION)), "white")
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(14)
    for i in range(n):
        x, y = i % COLUMNS * TILE, i // COLUMNS * (TILE + CAPTION)
        picture = _enlarged(crops.image[i])
        rgb = ((picture.clamp(-1, 1) + 1) * 127.5).byte().permute(1, 2, 0).cpu().numpy().copy()
        for silhouette, colour in ((truth.union[i], TRUE), (predicted.union[i], ESTIMATED)):
            rgb[_outline(silhouette)] = colour
        sheet.paste(Image.fromarray(rgb), (x, y + CAPTION))
        roman = ("I", "II", "III")[int(stages[i]) - 1]
        pen.text((x + 4, y + 2), f"#{int(crops.index[i])}: stage {roman}", "black", font)
    out = io.BytesIO()
    sheet.save(out, "PNG")
    return out.getvalue()


def _enlarged(image: Float[Tensor, "C H W"]) -> Float[Tensor, "C TILE TILE"]:
    return F.interpolate(image[None], (TILE, TILE), mode="bilinear", align_corners=False)[0]


def _outline(silhouette: Float[Tensor, "h w"]) -> np.ndarray:
    """(TILE, TILE) True on the line where the coverage passes ½, 2 px wide."""
    inside = (_enlarged(silhouette[None]) > 0.5).float()[None]
    eroded = -F.max_pool2d(-inside, 5, stride=1, padding=2)
    return (inside > eroded)[0, 0].cpu().numpy()
