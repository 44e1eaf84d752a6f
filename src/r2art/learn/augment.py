"""From stored photos to training views: windows, other backdrops, things in the way.

Views are made in batches of tensors. Randomness comes from one generator per step, so a
resumed run sees what the uninterrupted one would have seen.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import torch
from jaxtyping import Float, Int
from torch import Tensor
from torch.nn import functional as F

from r2art.data.sample import BACKDROP
from r2art.learn.chance import Chance
from r2art.learn.coordinates import shares_of
from r2art.learn.faults import camera_faults
from r2art.learn.memory import Photos, Picked, joined
from r2art.learn.relabel import poses_through
from r2art.method.shape import box_corners

MASK_STRIDE = 4
"""Pixels of a view to one place of its masks."""
CROP_MARGIN = 1.25
"""Side of the crop's window over the longer side of the box."""


@dataclass(frozen=True, kw_only=True)
class Crops:
    """B crops round objects of one category, with the labels the objective needs.

    ``index`` says which photos of the category's they are from. ``part`` are the photo's mask
    values (`r2art.data.sample.Sample.mask`), ``seen`` is the share of each place that shows the
    object, ``coordinates`` where on its part it lies (`r2art.learn.coordinates`), if that
    is known.
    """

    index: Int[Tensor, " B"]
    image: Float[Tensor, "B 3 S S"]
    part: Int[Tensor, "B s s"]
    seen: Float[Tensor, "B 1 s s"]
    coordinates: Float[Tensor, "B 3 s s"]
    K: Float[Tensor, "B 3 3"]
    box: Float[Tensor, "B 4"]
    cam_T_part: Float[Tensor, "B P 4 4"]
    joint_state: Float[Tensor, "B J"]
    box_center: Float[Tensor, "B P 3"]
    box_size: Float[Tensor, "B P 3"]


@dataclass(frozen=True, kw_only=True)
class Views:
    """N whole photos, letterboxed, with the object's box (px) in them; ``index`` as for crops.

    Of photos without an object, the box is not a number and the index -1.
    """

    index: Int[Tensor, " N"]
    image: Float[Tensor, "N 3 S S"]
    seen: Float[Tensor, "N 1 s s"]
    box: Float[Tensor, "N 4"]


def sample_window(
    image: Float[Tensor, "B C H W"],
    window: Float[Tensor, "B 4"],
    size: int,
    mode: str = "bilinear",
) -> Float[Tensor, "B C size size"]:
    """Resample the window (x1 y1 x2 y2 px, may leave the image) of each image; 0 outside."""
    height, width = image.shape[-2:]
    scale = torch.tensor([width, height], device=image.device)
    center = (window[:, :2] + window[:, 2:]) / scale - 1
    extent = (window[:, 2:] - window[:, :2]) / scale
    theta = torch.cat([torch.diag_embed(extent), center[:, :, None]], dim=2)
    grid = F.affine_grid(theta, [len(image), 1, size, size], align_corners=False)
    return F.grid_sample(image, grid, mode=mode, padding_mode="zeros", align_corners=False)


def crops(
    photos: Photos,
    index: Int[Tensor, " B"],
    size: int,
    chance: Chance,
    backdrops: Tensor | None,
    *,
    augment: bool = True,
) -> Crops:
    """Square crops of ``size`` px round the (jittered) boxes of the chosen photos."""
    return crops_of([(photos, index)], size, chance, backdrops, augment=augment)[0]


def crops_of(
    chosen: Sequence[tuple[Photos, Int[Tensor, " B"]]],
    size: int,
    chance: Chance,
    backdrops: Tensor | None,
    *,
    augment: bool = True,
) -> list[Crops]:
    """`crops` of several categories, whose photos are of one size.

    Pictures of all are made together: a GPU waits for the number of operations, not for theirs.
    """
    picked = joined([photos.pick(index, chance.device) for photos, index in chosen])
    box = jitter(picked.box, chance) if augment else picked.box
    image, mask = pictures(picked, chance, backdrops, augment=augment)
    center, extent = (box[:, :2] + box[:, 2:]) / 2, box[:, 2:] - box[:, :2]
    half = CROP_MARGIN * extent.amax(dim=1, keepdim=True) / 2
    corner = center - half
    window = torch.cat([corner, center + half], dim=1)
    view = sample_window(image, window, size)
    stored = torch.cat([mask[:, None], picked.coordinates.float()], dim=1)
    stored = sample_window(stored, window, size // MASK_STRIDE, "nearest")
    part, coordinates = stored[:, :1], shares_of(stored[:, 1:])
    seen = shares(sample_window(shows_object(mask), window, size))
    zoom = size / (2 * half)
    of_photo = torch.cat([photos.K[index] for photos, index in chosen]).to(chance.device)
    K = of_photo.clone()
    K[:, :2, 2] -= corner
    K[:, :2] *= zoom[:, :, None]
    if augment:
        view, part, seen = occlude(view, part, seen, chance, backdrops)
        view = camera_faults(view, chance)
    pixels = {
        "image": view,
        "part": part[:, 0].long(),
        "seen": seen,
        "coordinates": coordinates,
        "K": K,
        "box": (box - corner.repeat(1, 2)) * zoom,
    }
    sizes = [len(index) for _, index in chosen]
    rows = [
        dict(zip(pixels, t, strict=True))
        for t in zip(*(v.split(sizes) for v in pixels.values()), strict=True)
    ]
    found = [
        Crops(index=index, **row, **photos.labels(index, chance.device))
        for (photos, index), row in zip(chosen, rows, strict=True)
    ]
    if not augment:
        return found
    true_focal = of_photo[:, 0, 0] / picked.image.shape[-1]
    return other_focal_length(found, true_focal, chance)


def other_focal_length(
    crops: Sequence[Crops], true_focal: Float[Tensor, " all"], chance: Chance
) -> list[Crops]:
    """Some crops as a user with a wrongly guessed camera would give them.

    The image stays; the labels become the poses that look most alike through the wrong focal
    length. So the network learns to trust the picture over the stated perspective.

    Args:
        crops: Of one or several categories, labelled for the true camera.
        true_focal: Its focal length for each of all crops, in widths of the photo.
        chance: Decides which crops, and the guess: a field of view of 45° to 75°.
    """
    n = len(true_focal)
    guess = 0.5 / torch.tan(torch.deg2rad(chance.uniform(45, 75, n)) / 2)
    factor = torch.where(chance.happens(0.35, n), guess / true_focal, 1.0)
    factors = factor.split([len(c.image) for c in crops])
    stated = [c.K.clone() for c in crops]
    for K, f in zip(stated, factors, strict=True):
        K[:, :2, :2] *= f[:, None, None]
    moved = poses_through(
        stated,
        [c.cam_T_part for c in crops],
        [box_corners(c.box_center, c.box_size) for c in crops],
        [c.box for c in crops],
        [c.K for c in crops],
    )
    return [
        replace(c, K=K, cam_T_part=poses) for c, K, poses in zip(crops, stated, moved, strict=True)
    ]


def jitter(box: Float[Tensor, "B 4"], chance: Chance) -> Float[Tensor, "B 4"]:
    """Boxes as a detector or a person would draw them: each side off by a few per cent."""
    extent = (box[:, 2:] - box[:, :2]).repeat(1, 2)
    amount = torch.where(chance.happens(0.3, len(box), 1), 0.09, 0.03)
    return box + (amount * chance.normal(len(box), 4)).clamp(-0.2, 0.2) * extent


def shows_object(mask: Float[Tensor, "B H W"]) -> Float[Tensor, "B 1 H W"]:
    """1 where a mask of a photo is of a part."""
    return ((mask > 0) & (mask != BACKDROP)).float()[:, None]


def shares(mask: Float[Tensor, "B 1 S S"]) -> Float[Tensor, "B 1 s s"]:
    """Mean of the pixels of every place."""
    return F.avg_pool2d(mask, MASK_STRIDE)


def views(
    photos: Picked,
    size: int,
    chance: Chance,
    backdrops: Tensor | None,
    *,
    augment: bool = True,
) -> Views:
    """Photos, cut to a random format and letterboxed to ``size`` px."""
    index, box = photos.index, photos.box
    image, mask = pictures(photos, chance, backdrops, augment=augment)
    height, width = image.shape[-2:]
    whole = torch.tensor([0.0, 0.0, width, height], device=chance.device).expand(len(index), 4)
    seen = format_around(box, whole, chance) if augment else whole
    extent = seen[:, 2:] - seen[:, :2]
    center, side = (seen[:, :2] + seen[:, 2:]) / 2, extent.amax(dim=1, keepdim=True)
    window = torch.cat([center - side / 2, center + side / 2], dim=1)
    view = sample_window(image, window, size)
    seen_share = shares(sample_window(shows_object(mask), window, size))
    zoom = size / side
    if augment:
        view = camera_faults(view, chance)
    bars = outside((seen - window[:, :2].repeat(1, 2)) * zoom, size)
    return Views(
        index=index,
        image=view.masked_fill(bars[:, None], 0.0),
        seen=seen_share,
        box=(box - window[:, :2].repeat(1, 2)) * zoom,
    )


def empty_views(n: int, size: int, chance: Chance, backdrops: Tensor | None) -> Views:
    """Pictures that show no object: photos, plain ones, and noise, in any format."""
    grain = F.interpolate(chance.uniform(-1, 1, n, 3, 32, 32), (size, size), mode="nearest")
    fine = (0.6 * chance.grain(n, 3, size, size)).clamp(-1, 1)
    grain = torch.where(chance.happens(0.5, n, 1, 1, 1), fine, grain)
    picture = other_backdrops(n, size, chance, backdrops)
    picture = torch.where(chance.happens(0.1, n, 1, 1, 1), grain, picture)
    half = size / 2 * torch.where(chance.happens(0.5, n, 2), chance.uniform(0.5, 1, n, 2), 1.0)
    bars = outside(torch.cat([size / 2 - half, size / 2 + half], dim=1), size)
    return Views(
        index=torch.full((n,), -1),
        image=camera_faults(picture, chance).masked_fill(bars[:, None], 0.0),
        seen=torch.zeros(n, 1, size // MASK_STRIDE, size // MASK_STRIDE, device=chance.device),
        box=torch.full((n, 4), torch.nan, device=chance.device),
    )


def format_around(box: Tensor, whole: Tensor, chance: Chance) -> Float[Tensor, "N 4"]:
    """A random part of the photo that still holds the box, as if framed differently."""
    n = len(box)
    inner = torch.cat([torch.maximum(box[:, :2], whole[:, :2]), box[:, 2:]], dim=1)
    inner[:, 2:] = torch.minimum(inner[:, 2:], whole[:, 2:])
    keep = chance.uniform(0, 1, n, 4) * chance.happens(0.5, n, 4)
    return whole + keep * 0.9 * (inner - whole)


def outside(box: Float[Tensor, "N 4"], size: int) -> Tensor:
    """(N, size, size) True at pixels whose centres lie outside of the box."""
    at = torch.arange(size, device=box.device) + 0.5
    x = (at < box[:, 0:1]) | (at > box[:, 2:3])
    y = (at < box[:, 1:2]) | (at > box[:, 3:4])
    return y[:, :, None] | x[:, None, :]


def pictures(
    photos: Picked,
    chance: Chance,
    backdrops: Tensor | None,
    *,
    augment: bool,
) -> tuple[Float[Tensor, "B 3 H W"], Float[Tensor, "B H W"]]:
    """Images in [-1, 1] and masks, some with another backdrop behind the scene."""
    image, mask = photos.image.float() / 127.5 - 1, photos.mask
    if augment:
        swap = chance.happens(0.4, len(mask))[:, None, None] & (mask == BACKDROP)
        height, width = image.shape[-2:]
        other = other_backdrops(len(mask), max(height, width), chance, backdrops)
        other = other[..., :height, :width]
        image = torch.where(swap[:, None], other, image)
    return image, mask.float()


def other_backdrops(
    n: int, size: int, chance: Chance, backdrops: Tensor | None
) -> Float[Tensor, "N 3 size size"]:
    """Windows of stored photos, or soft colour gradients where there are none."""
    grid = chance.uniform(-1, 1, n, 3, 2, 2)
    flat = chance.uniform(-1, 1, n, 3, 1, 1) + 0.2 * grid
    white = chance.happens(0.4, n)[:, None, None, None]
    flat = torch.where(white, 0.9 + 0.1 * grid, flat).clamp(-1, 1)
    plain = F.interpolate(flat, size=(size, size), mode="bilinear", align_corners=True)
    if backdrops is None:
        return plain
    chosen = backdrops[chance.choice(len(backdrops), n)].to(chance.device).float() / 127.5 - 1
    side = chosen.shape[-1] * chance.uniform(0.4, 1, n, 1)
    corner = chance.uniform(0, 1, n, 2) * (chosen.shape[-1] - side)
    cut = sample_window(chosen, torch.cat([corner, corner + side], dim=1), size)
    return torch.where(chance.happens(0.35, n)[:, None, None, None], plain, cut)


def occlude(
    image: Tensor, part: Tensor, seen: Tensor, chance: Chance, backdrops: Tensor | None
) -> tuple[Tensor, Tensor, Tensor]:
    """Cover an ellipse or a rectangle of some views, and of their masks, with something else."""
    n, size = len(image), image.shape[-1]
    hide = chance.happens(0.4, n)[:, None, None]
    center, radius = chance.uniform(0, 1, n, 2), chance.uniform(0.06, 0.33, n, 2)
    is_round = chance.happens(0.5, n)[:, None, None]

    at = (torch.arange(size, device=image.device) + 0.5) / size
    x = ((at - center[:, :1]) / radius[:, :1])[:, None, :].abs()
    y = ((at - center[:, 1:]) / radius[:, 1:])[:, :, None].abs()
    inside = torch.where(is_round, x.square() + y.square() < 1, torch.maximum(x, y) < 1)
    covered = (inside & hide)[:, None]
    image = torch.where(covered, other_backdrops(n, size, chance, backdrops), image)
    free = 1 - shares(covered.float())
    return image, part.masked_fill(free < 0.5, 0.0), seen * free
