"""What training minimises: base losses, the cascade after a warm-up, and auxiliary tasks."""

from dataclasses import dataclass, replace

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from r2art.learn.augment import Crops, Views
from r2art.method import cascade, losses, se3
from r2art.method.depth import translation_targets, viewing_ray
from r2art.method.estimate import Estimate, estimate
from r2art.method.network import TrainingOutput
from r2art.method.projection import resize_intrinsics
from r2art.method.rotation import egocentric_to_allocentric
from r2art.method.shape import Prior, Shape, box_corners, deform, deformation_of, thinned


@dataclass(frozen=True, kw_only=True)
class Weights:
    """How much each loss counts. The paper gives none but those inside the cascade."""

    direction: float = 4.0
    offset: float = 4.0
    depth: float = 2.0
    joint: float = 4.0
    shape: float = 2.0
    reprojection: float = 8.0
    part_mask: float = 0.5
    cascade: float = 0.3
    confidence: float = 0.1
    found_box: float = 2.0
    category: float = 0.5
    photo_mask: float = 0.5


def true_shape(prior: Prior, crops: Crops) -> Shape:
    """The prior, deformed to the true part boxes."""
    return deform(prior, deformation_of(prior, crops.box_center, crops.box_size))


def base_losses(
    prior: Prior, output: TrainingOutput, found: Estimate, crops: Crops, shape: Shape
) -> dict[str, Tensor]:
    """One scalar per quantity that the network predicts for crops."""
    raw = output.raw
    R = crops.cam_T_part[:, 0, :3, :3]
    facing = egocentric_to_allocentric(R, viewing_ray(crops.box, crops.K))
    t = crops.cam_T_part[:, 0, :3, 3]
    phi, log_lambda = translation_targets(t, crops.box, crops.K, prior.frontal_area)
    deformation = deformation_of(prior, crops.box_center, crops.box_size)
    predicted = replace(deformation, log_scale=raw.log_scale, center_shift=raw.center_shift)
    corners = corners_in_camera(found.shape, found.cam_T_part)
    true_corners = corners_in_camera(shape, crops.cam_T_part)
    directions = losses.direction_loss(raw.up, facing[..., 1]) + losses.direction_loss(
        raw.right, facing[..., 0]
    )
    return {
        "direction": directions.mean(),
        "offset": losses.offset_loss(raw.phi, phi).mean(),
        "depth": losses.depth_loss(raw.log_lambda, log_lambda).mean(),
        "joint": losses.joint_state_loss(
            found.joint_state, crops.joint_state, prior.kinematics
        ).mean(),
        "shape": losses.shape_loss(predicted, deformation, prior).mean(),
        "reprojection": losses.reprojection_loss(corners, true_corners, crops.K, crops.box).mean(),
        "part_mask": F.cross_entropy(output.mask_logits, part_classes(crops)),
        "confidence": F.binary_cross_entropy_with_logits(
            raw.confidence_logit, is_right(found, crops, shape).to(raw.up)
        ),
    }


def part_classes(crops: Crops) -> Tensor:
    """Mask classes: 0 for all that is no part."""
    is_part = crops.part <= crops.box_size.shape[1]
    return torch.where(is_part, crops.part, 0)


def corners_in_camera(shape: Shape, cam_T_part: Tensor) -> Float[Tensor, "B PN 3"]:
    """All corners of all part boxes, in the camera frame (m)."""
    corners = box_corners(shape.box_center, shape.box_size)
    return se3.transform(cam_T_part, corners).flatten(1, 2)


@torch.no_grad()
def is_right(found: Estimate, crops: Crops, shape: Shape, share: float = 0.1) -> Tensor:
    """(B, P) whether a part's ADD, scale-aligned, is below ``share`` of its diameter.

    The scale is aligned because one photo cannot tell it: the confidence is about what the
    photo shows.
    """
    points = shape.points[:, :, ::16]
    true = se3.transform(crops.cam_T_part, points)
    turned = (points[..., None, :] * found.cam_T_part[:, :, None, :3, :3]).sum(-1)
    t = found.cam_T_part[:, :, None, :3, 3]
    scale = (t * (true - turned)).sum((1, 2, 3)) / t.expand_as(true).square().sum((1, 2, 3))
    error = torch.linalg.vector_norm(turned + scale[:, None, None, None] * t - true, dim=-1)
    diameter = torch.linalg.vector_norm(shape.box_size, dim=-1)
    return error.mean(-1) < share * diameter


def cascade_term(found: Estimate, crops: Crops, shape: Shape, pixels: int) -> tuple[Tensor, Tensor]:
    """The cascade's mean loss on silhouettes of ``pixels``², and the stage of every sample.

    The prior's points suit silhouettes of 112²; smaller ones are rendered from fewer.
    """
    size = crops.image.shape[-1]
    K = resize_intrinsics(crops.K, pixels / size)
    every = max(1, (112 // pixels) ** 2)
    truth = cascade.render(thinned(shape, every), crops.cam_T_part, K, (pixels, pixels))
    predicted = cascade.render(thinned(found.shape, every), found.cam_T_part, K, (pixels, pixels))
    loss, stage = cascade.cascade_loss(predicted, truth)
    return loss.mean(), stage


def photo_losses(output: TrainingOutput, views: Views, category: Tensor) -> dict[str, Tensor]:
    """Finding the object in whole photos and naming its category."""
    size = views.image.shape[-1]
    error = F.smooth_l1_loss(output.found_box / size, views.box / size, beta=0.05)
    overlap = cascade.box_overlap_loss(output.found_box, views.box).mean()
    return {
        "found_box": 4 * error + 0.5 * overlap,
        "category": F.cross_entropy(output.category_logits, category),
        "photo_mask": F.binary_cross_entropy_with_logits(output.photo_mask_logits, views.seen),
    }


def objective(
    prior: Prior,
    output: TrainingOutput,
    crops: Crops,
    views: Views,
    category: Tensor,
    weights: Weights,
    cascade_pixels: int | None,
) -> tuple[Tensor, dict[str, Tensor]]:
    """The total loss and every term of it; ``cascade_pixels`` None leaves the cascade out."""
    found = estimate(prior, output.raw, crops.box, crops.K)
    shape = true_shape(prior, crops)
    terms = base_losses(prior, output, found, crops, shape)
    terms |= photo_losses(output, views, category)
    total = sum((getattr(weights, k) * v for k, v in terms.items()), start=torch.zeros(()))
    if cascade_pixels is not None:
        loss, stage = cascade_term(found, crops, shape, cascade_pixels)
        total = total + weights.cascade * loss
        terms["cascade"] = loss
        terms |= {f"stage_{s}": (stage == s).float().mean() for s in (1, 2, 3)}
    return total, terms
