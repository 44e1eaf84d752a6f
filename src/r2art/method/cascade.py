"""Section 4.3: the cascade of losses on how the object looks, coarse to fine -- Algorithm 1.

Stage I asks for a box of the right area, II for the right box, III for the right silhouette.
Truth is rendered from the true pose and shape with the same function as the prediction, so
both are amodal and equally soft. Letters: B batch, P parts, H × W pixels. Boxes are
``x1 y1 x2 y2`` (px). Every loss is one number per sample, finite for finite input.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor
from torch.nn import functional as F

from r2art.method import se3
from r2art.method.projection import box_of_points, box_size, project
from r2art.method.shape import Shape
from r2art.method.silhouette import KERNEL_RADIUS, Silhouettes, part_silhouettes
from r2art.method.silhouette_loss import weighted_cross_entropy

EPSILON = 1e-4
IOU_EPSILON = 1e-2
"""Caps Eq. 5 at 4.6, and its gradient: 1/IoU would be thousands where boxes begin to touch."""


@dataclass(frozen=True, kw_only=True)
class Rendering(Silhouettes):
    """How an object looks: its silhouettes and the box around its projected points.

    Attributes:
        box: Not cut to the image, so it tells where an object went that left it.
    """

    box: Float[Tensor, "*B 4"]


def render(
    shape: Shape,
    cam_T_part: Float[Tensor, "*B P 4 4"],
    K: Float[Tensor, "*#B 3 3"],
    size: tuple[int, int],
    *,
    box_steers_all: bool = False,
    softness: float = 0.0,
    radius: float = KERNEL_RADIUS,
) -> Rendering:
    """Render an object for `cascade_loss`.

    Args:
        shape: The deformed prior, at rest.
        cam_T_part: Where its parts are.
        K: Intrinsics of the image to render.
        size: Its height and width.
        box_steers_all: Whether gradients of the box reach every degree of freedom, as in the
            paper. By default they only move the root's translation: four numbers cannot tell
            rotation, joints and shape, and corrupt them.
        softness: Of the box's sides (px), see `box_of_points`.
        radius: Of the splats (px).
    """
    seen = part_silhouettes(shape, cam_T_part, K, size, radius)
    points = shape.points
    if not box_steers_all:
        cam_T_part, points = only_translation(cam_T_part), points.detach()
    if softness > 0:
        points = se3.transform(cam_T_part, points).flatten(-3, -2)
        return Rendering(**vars(seen), box=box_of_points(project(points, K), softness))
    return Rendering(**vars(seen), box=tight_box(points, cam_T_part, K))


def tight_box(
    points: Float[Tensor, "*#B P M 3"],
    cam_T_part: Float[Tensor, "*B P 4 4"],
    K: Float[Tensor, "*#B 3 3"],
) -> Float[Tensor, "*B 4"]:
    """`box_of_points` of all parts' points, of which only the four that touch it are tracked."""
    with torch.no_grad():
        uv = project(se3.transform(cam_T_part, points), K[..., None, :, :]).flatten(-3, -2)
        touching = torch.cat([uv.argmin(-2), uv.argmax(-2)], dim=-1)
    num_points = points.shape[-2]
    points = points.flatten(-3, -2).expand(*touching.shape[:-1], -1, 3)
    points = points.gather(-2, touching[..., None].expand(*touching.shape, 3))
    part = (touching // num_points)[..., None, None].expand(*touching.shape, 4, 4)
    pose = cam_T_part.gather(-3, part)
    uv = project(se3.transform(pose, points[..., None, :])[..., 0, :], K)
    return torch.stack([uv[..., i, i % 2] for i in range(4)], dim=-1)


def only_translation(cam_T_part: Float[Tensor, "*B P 4 4"]) -> Float[Tensor, "*B P 4 4"]:
    """The same poses, through which gradients reach nothing but the root's translation."""
    root = cam_T_part[..., :1, :3, 3:]
    return cam_T_part.detach() + F.pad(root - root.detach(), (3, 0, 0, 1))


def area_loss(predicted: Rendering, true: Rendering) -> Float[Tensor, "*B"]:
    """Log-ratio of the box areas -- Eq. 4, weighted by η from 1 to e.

    η grows with the share of silhouette pixels missing or in excess; it carries no gradient.

    Deviation: η as printed is unsigned in the prose, signed in the formula, and overflows.
    """
    pixels, true_pixels = predicted.union.detach().sum((-2, -1)), true.union.sum((-2, -1))
    error = (true_pixels - pixels).abs() / true_pixels.clamp_min(1)
    eta = error.clamp_max(1).exp().detach()
    return eta * (_log_area(true.box) - _log_area(predicted.box)).abs()


def iou(a: Float[Tensor, "*B 4"], b: Float[Tensor, "*B 4"]) -> Float[Tensor, "*B"]:
    """Intersection over union of boxes; 0 where they are disjoint."""
    intersection = _overlap(a, b).clamp_min(0).prod(-1)
    union = box_size(a).prod(-1) + box_size(b).prod(-1) - intersection
    return intersection / union.clamp_min(EPSILON)


def iou_loss(a: Float[Tensor, "*B 4"], b: Float[Tensor, "*B 4"]) -> Float[Tensor, "*B"]:
    """Negative logarithm of the IoU -- Eq. 5. 0 for equal boxes, at most 4.6.

    Without gradient where the boxes are disjoint; Eqs. 6 and 7 pull there.
    """
    return -((iou(a, b) + IOU_EPSILON) / (1 + IOU_EPSILON)).log()


def box_overlap_loss(a: Float[Tensor, "*B 4"], b: Float[Tensor, "*B 4"]) -> Float[Tensor, "*B"]:
    """Bounding box overlap (BBO) -- Eq. 6, in [0, 4).

    Overlap over hull, side by side; the overlap of disjoint boxes is their distance, negative.
    """
    return 2 - (_overlap(a, b) / _hull(a, b).clamp_min(EPSILON)).sum(-1)


def corner_offset_loss(a: Float[Tensor, "*B 4"], b: Float[Tensor, "*B 4"]) -> Float[Tensor, "*B"]:
    """Distances of both corners (CO) -- Eq. 7, in diagonals of the hull; in [0, 2]."""
    corners = torch.linalg.vector_norm((a - b).unflatten(-1, (2, 2)), dim=-1)
    return corners.sum(-1) / torch.linalg.vector_norm(_hull(a, b), dim=-1).clamp_min(EPSILON)


def alignment_loss(predicted: Rendering, true: Rendering) -> Float[Tensor, "*B"]:
    """The box losses together -- Eq. 8."""
    boxes = predicted.box, true.box
    return (
        0.4 * iou_loss(*boxes) + 0.3 * box_overlap_loss(*boxes) + 0.3 * corner_offset_loss(*boxes)
    )


def beyond_edge(
    predicted: Float[Tensor, "*B H W"], true: Float[Tensor, "*B H W"]
) -> Float[Tensor, "*B"]:
    """ω: predicted pixels outside of the true mask, over the true ones -- Eq. 9, at most 5.

    Deviation: a ratio and not a count, which would be thousands; without gradient.
    """
    predicted, true = predicted.detach(), true.detach()
    excess = (predicted * (1 - true)).sum((-2, -1)) / true.sum((-2, -1)).clamp_min(1)
    return excess.clamp_max(5)


def edge_band(mask: Float[Tensor, "*B H W"], pixels: int = 2) -> Bool[Tensor, "*B H W"]:
    """The pixels within ``pixels`` (in x and y) of the mask's outline, on both of its sides."""
    inside = mask > 0.5
    return _dilated(inside, pixels) & _dilated(~inside, pixels)


def pixel_loss(predicted: Silhouettes, true: Silhouettes) -> Float[Tensor, "*B"]:
    """Edge-aware cross-entropy of the parts' silhouettes -- Eq. 10; mean over pixels and parts.

    Weighted by 1 + ω within 2 px of the true outline. It is least, but not 0, at the truth,
    whose soft edges have an entropy of their own.
    """
    omega = beyond_edge(predicted.parts, true.parts)[..., None, None]
    weight = 1 + omega * edge_band(true.parts)
    return weighted_cross_entropy(predicted.parts, true.parts, weight).mean(-1)


def stage(
    predicted: Float[Tensor, "*B 4"], true: Float[Tensor, "*B 4"], delta: float = 0.1
) -> Int[Tensor, "*B"]:
    """Which stage of Algorithm 1 a predicted box is in: 1, 2 or 3, per sample.

    I while its area is not within ``delta`` of the true one; else II while the IoU is below
    1 − delta; else III.

    Deviation: as printed, II asks for I, and II and III are never reached; docs/paper.md.
    """
    area, true_area = box_size(predicted).prod(-1), box_size(true).prod(-1)
    wrong_area = (area - true_area).abs() > delta * true_area
    misplaced = iou(predicted, true) < 1 - delta
    return torch.where(wrong_area, 1, torch.where(misplaced, 2, 3))


def cascade_loss(
    predicted: Rendering, true: Rendering, delta: float = 0.1, stages: Sequence[int] = (1, 2, 3)
) -> tuple[Float[Tensor, "*B"], Int[Tensor, "*B"]]:
    """Algorithm 1: each sample's loss by the stage it is in, and that stage (1, 2, 3).

    Args:
        predicted: How the estimate looks.
        true: How it should.
        delta: See `stage`.
        stages: Those that are on, in order; fewer in the ablation. Samples of a stage that is
            off are served by the next one that is on, or by the last.
    """
    losses = {1: area_loss, 2: alignment_loss, 3: pixel_loss}
    at = stage(predicted.box, true.box, delta)
    before, served = torch.zeros_like(predicted.box[..., 0]), []
    for s in stages:
        term = losses[s](predicted, true)
        served.append((s, before + term))
        before = before + 0.1 * term
    loss = served[-1][1]
    for s, staged in reversed(served[:-1]):
        loss = torch.where(at <= s, staged, loss)
    return loss, at


def _dilated(mask: Bool[Tensor, "*B H W"], pixels: int) -> Bool[Tensor, "*B H W"]:
    """The pixels with a True one within ``pixels`` in x and y: first along, then across."""
    for axis in (-1, -2):
        size, near = mask.shape[axis], mask.clone()
        for step in range(1, min(pixels, size - 1) + 1):
            near.narrow(axis, step, size - step).logical_or_(mask.narrow(axis, 0, size - step))
            near.narrow(axis, 0, size - step).logical_or_(mask.narrow(axis, step, size - step))
        mask = near
    return mask


def _log_area(box: Float[Tensor, "*B 4"]) -> Float[Tensor, "*B"]:
    return (box_size(box).prod(-1) + 1).log()


def _overlap(a: Float[Tensor, "*B 4"], b: Float[Tensor, "*B 4"]) -> Float[Tensor, "*B 2"]:
    return torch.minimum(a[..., 2:], b[..., 2:]) - torch.maximum(a[..., :2], b[..., :2])


def _hull(a: Float[Tensor, "*B 4"], b: Float[Tensor, "*B 4"]) -> Float[Tensor, "*B 2"]:
    return torch.maximum(a[..., 2:], b[..., 2:]) - torch.minimum(a[..., :2], b[..., :2])
