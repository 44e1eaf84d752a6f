"""What training minimises: base losses, the cascade after a warm-up, and auxiliary tasks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import torch
from jaxtyping import Float, Int
from torch import Tensor
from torch.nn import functional as F

from r2art.learn.augment import Crops, Views
from r2art.learn.coordinates import is_known
from r2art.learn.equivalent import better_labels
from r2art.method import cascade, losses, se3
from r2art.method.depth import translation_targets, viewing_ray
from r2art.method.estimate import Estimate, estimate
from r2art.method.keypoints import Keypoints
from r2art.method.outputs import (
    NOTHING_KNOWN,
    CropOutput,
    DenseOutput,
    NodePoses,
    RawEstimate,
    TrainingOutput,
)
from r2art.method.projection import project, resize_intrinsics
from r2art.method.rotation import egocentric_to_allocentric
from r2art.method.shape import Prior, Shape, box_corners, deform, deformation_of, thinned


@dataclass(frozen=True, kw_only=True)
class Weights:
    """How much each loss counts. The paper gives none but those inside the cascade."""

    direction: float = 1.5
    offset: float = 4.0
    depth: float = 2.0
    joint: float = 4.0
    shape: float = 2.0
    reprojection: float = 8.0
    part_mask: float = 0.5
    coordinates: float = 3.0
    correspondence: float = 0.1
    keypoint: float = 0.3
    keypoint_map: float = 0.2
    object_mask: float = 1.0
    cascade: float = 0.3
    confidence: float = 0.1
    found_box: float = 2.0
    category: float = 0.5
    photo_mask: float = 0.5


@dataclass(frozen=True, kw_only=True)
class CascadeOptions:
    """What of the cascade is on; the default is all of it.

    Attributes:
        stages: See `r2art.method.cascade.cascade_loss`.
        box_steers_all: See `r2art.method.cascade.render`.
    """

    stages: tuple[int, ...] = (1, 2, 3)
    box_steers_all: bool = False


WHOLE_CASCADE = CascadeOptions()


def true_shape(prior: Prior, crops: Crops) -> Shape:
    """The prior, deformed to the true part boxes."""
    return deform(prior, deformation_of(prior, crops.box_center, crops.box_size))


def base_losses(
    prior: Prior, output: CropOutput, found: Estimate, crops: Crops, shape: Shape
) -> dict[str, Tensor]:
    """One scalar per quantity that the network predicts for crops."""
    raw = output.raw
    assert raw is not None
    deformation = deformation_of(prior, crops.box_center, crops.box_size)
    predicted = replace(deformation, log_scale=raw.log_scale, center_shift=raw.center_shift)
    corners = corners_in_camera(found.shape, found.cam_T_part)
    true_corners = corners_in_camera(shape, crops.cam_T_part)
    terms = pose_losses(prior, raw, crops, shape)
    if raw.nodes is None:
        terms["joint"] = losses.joint_state_loss(
            found.joint_state, crops.joint_state, prior.kinematics
        ).mean()
    terms["shape"] = losses.shape_loss(predicted, deformation, prior).mean()
    terms["reprojection"] = losses.reprojection_loss(
        corners, true_corners, crops.K, crops.box
    ).mean()
    if output.dense is not None:
        terms["part_mask"] = F.cross_entropy(output.dense.part_logits, part_classes(crops))
        terms |= coordinate_losses(output.dense, crops)
    if output.keypoints is not None:
        assert prior.keypoints is not None
        terms |= keypoint_losses(prior.keypoints, output.keypoints, crops)
    if output.object_logits is not None:
        terms["object_mask"] = mask_loss(output.object_logits, crops.seen)
    terms["confidence"] = F.binary_cross_entropy_with_logits(
        raw.confidence_logit, is_right(found, crops, shape).to(raw.up)
    )
    return terms


def pose_losses(prior: Prior, raw: RawEstimate, crops: Crops, shape: Shape) -> dict[str, Tensor]:
    """Directions, offset and depth of the root; of all parts where each has a pose of its own."""
    true = crops.cam_T_part
    place = true[:, 0, :3, 3]
    errors = [_pose_errors(raw, true[:, 0, :3, :3], place, crops.box, crops.K, prior)[None]]
    if raw.nodes is not None:
        box, K = crops.box[:, None], crops.K[:, None]
        center = se3.transform(true[:, 1:], shape.box_center[:, 1:, None])[:, :, 0]
        of_nodes = _pose_errors(raw.nodes, true[:, 1:, :3, :3], center, box, K, prior)
        errors.append(of_nodes.movedim(1, 0))
    names = ("direction", "offset", "depth")
    return dict(zip(names, torch.cat(errors).mean((0, 1)), strict=True))


def _pose_errors(
    predicted: RawEstimate | NodePoses,
    R: Tensor,
    place: Tensor,
    box: Tensor,
    K: Tensor,
    prior: Prior,
) -> Float[Tensor, "*B 3"]:
    facing = egocentric_to_allocentric(R, viewing_ray(box, K))
    phi, log_lambda = translation_targets(place, box, K, prior.frontal_area)
    up = losses.direction_loss(predicted.up, facing[..., 1])
    right = losses.direction_loss(predicted.right, facing[..., 0])
    offset = losses.offset_loss(predicted.phi, phi)
    depth = losses.depth_loss(predicted.log_lambda, log_lambda)
    return torch.stack([up + right, offset, depth], dim=-1)


def mask_loss(logits: Tensor, share: Tensor) -> Tensor:
    """Cross-entropy with the share of each place that shows the object."""
    return F.binary_cross_entropy_with_logits(logits.float(), share)


def coordinate_losses(dense: DenseOutput, crops: Crops) -> dict[str, Tensor]:
    """How far off the points are that places name, and how well they know it.

    Both are means over places that show a part at a known point. ``coordinates``: pseudo-Huber of
    the distance, in diagonals of the part's box. ``correspondence``: negative logarithm of a
    bivariate Laplace density of where the point named is seen, less where the true one is.
    """
    true = crops.coordinates.movedim(1, -1)
    part = part_classes(crops) - 1
    known = (part >= 0) & is_known(true)
    part, named = part.clamp_min(0), dense.coordinates.movedim(1, -1)
    sample = torch.arange(len(part), device=part.device)[:, None, None]
    center, size = crops.box_center[sample, part], crops.box_size[sample, part]
    share = size / torch.linalg.vector_norm(size, dim=-1, keepdim=True)
    off = losses.distance_loss(named * share, true * share)
    at_rest = center[..., None, :] + torch.stack([named, true], dim=-2) * size[..., None, :]
    in_camera = se3.transform(crops.cam_T_part[sample, part], at_rest)
    uv = project(in_camera, crops.K[:, None, None])
    gap = ((uv[..., 0, :] - uv[..., 1, :]).square().sum(-1) + 1e-2).sqrt()
    density = gap * (-dense.log_deviation).exp() + 2 * dense.log_deviation
    count = known.sum().clamp_min(1)
    return {
        "coordinates": torch.where(known, off, 0.0).sum() / count,
        "correspondence": torch.where(known, density, 0.0).sum() / count,
    }


def keypoint_losses(
    keypoints: Float[Tensor, "P N 3"], found: Keypoints, crops: Crops
) -> dict[str, Tensor]:
    """How far off keypoints are, and how well the network knows it.

    ``keypoint``: negative logarithm of a bivariate Laplace density of the true place.
    ``keypoint_map``: cross-entropy of the maps with a bell of one place's width around it. Both
    are means over the points within the crop.
    """
    in_camera = se3.transform(crops.cam_T_part, keypoints.expand(len(crops.K), -1, -1, -1))
    uv = project(in_camera, crops.K[:, None]).flatten(1, 2)
    size, (height, width) = crops.image.shape[-1], found.logits.shape[2:]
    shown = ((uv > 0) & (uv < size)).all(dim=-1)
    count = shown.sum().clamp_min(1)
    gap = ((found.uv - uv).square().sum(-1) + 1e-2).sqrt()
    density = gap * (-found.log_deviation).exp() + 2 * found.log_deviation
    place = uv * uv.new_tensor([width, height]) / size - 0.5
    across = -0.5 * (torch.arange(width, device=uv.device) - place[..., :1]).square()
    down = -0.5 * (torch.arange(height, device=uv.device) - place[..., 1:]).square()
    bell = (down.softmax(-1)[..., :, None] * across.softmax(-1)[..., None, :]).flatten(2)
    surprise = -(bell * found.logits.float().flatten(2).log_softmax(-1)).sum(-1)
    return {
        "keypoint": torch.where(shown, density, 0.0).sum() / count,
        "keypoint_map": torch.where(shown, surprise, 0.0).sum() / count,
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


def cascade_term(
    found: Estimate, crops: Crops, shape: Shape, pixels: int, options: CascadeOptions
) -> tuple[Tensor, Int[Tensor, " B"]]:
    """The cascade's mean loss on silhouettes of ``pixels``², and the stage of every sample."""
    predicted, truth = renderings(found, crops, shape, pixels, options)
    loss, stage = cascade.cascade_loss(predicted, truth, stages=options.stages)
    return loss.mean(), stage


def renderings(
    found: Estimate, crops: Crops, shape: Shape, pixels: int, options: CascadeOptions
) -> tuple[cascade.Rendering, cascade.Rendering]:
    """How the estimate looks, and how it should, in images of ``pixels``².

    The prior's points suit silhouettes of 112²; smaller ones are rendered from fewer.
    """
    size = (pixels, pixels)
    K = resize_intrinsics(crops.K, pixels / crops.image.shape[-1])
    every = max(1, (112 // pixels) ** 2)
    truth = cascade.render(thinned(shape, every), crops.cam_T_part, K, size)
    predicted = cascade.render(
        thinned(found.shape, every),
        found.cam_T_part,
        K,
        size,
        box_steers_all=options.box_steers_all,
    )
    return predicted, truth


def photo_losses(
    output: TrainingOutput, views: Views, category: Tensor, names: Sequence[str]
) -> dict[str, Tensor]:
    """Finding the object in whole photos and naming its category, or that there is none.

    Crops are named as well, for a second look at a photo is one at a crop.

    Args:
        output: Of the network.
        views: The whole photos.
        category: What they show: one of ``names`` by its number, or last, none.
        names: All that the network knows.
    """
    size = views.image.shape[-1]
    known = category < output.category_logits.shape[1] - NOTHING_KNOWN
    found = output.found_box
    true = torch.where(known[:, None], views.box, found.detach())  # of nothing it is not a number
    error = F.smooth_l1_loss(found / size, true / size, beta=0.05, reduction="none").mean(dim=1)
    error = 4 * error + 0.5 * cascade.box_overlap_loss(found, true)
    terms = {
        "found_box": torch.where(known, error, 0.0).sum() / known.sum().clamp_min(1),
        "category": F.cross_entropy(*_named(output, category, names)),
    }
    if output.object_logits is not None:
        terms["photo_mask"] = mask_loss(output.object_logits, views.seen)
    return terms


def _named(
    output: TrainingOutput, category: Tensor, names: Sequence[str]
) -> tuple[Float[Tensor, "M answers"], Int[Tensor, " M"]]:
    """Logits of photos and crops, and what these show."""
    logits, true = [output.category_logits], [category]
    for name, crop in output.crops.items():
        if crop.category_logits is not None:
            logits.append(crop.category_logits)
            true.append(category.new_full((crop.category_logits.shape[0],), names.index(name)))
    return torch.cat(logits), torch.cat(true)


def crop_losses(
    prior: Prior,
    output: CropOutput,
    crops: Crops,
    cascade_pixels: int | None,
    options: CascadeOptions,
) -> tuple[dict[str, Tensor], Int[Tensor, " B"] | None]:
    """Every loss on crops of one category, and the cascade's stage of each.

    Of labels that say the same of an object that looks the same, the nearest counts.
    """
    assert output.raw is not None
    found = estimate(prior, output.raw, crops.box, crops.K)
    crops = better_labels(prior, found, crops)
    shape = true_shape(prior, crops)
    terms = base_losses(prior, output, found, crops, shape)
    if cascade_pixels is None:
        return terms, None
    terms["cascade"], stage = cascade_term(found, crops, shape, cascade_pixels, options)
    terms |= {f"stage_{s}": (stage == s).float().mean() for s in (1, 2, 3)}
    return terms, stage


def objective(
    priors: Mapping[str, Prior],
    output: TrainingOutput,
    crops: Mapping[str, Crops],
    views: Views,
    category: Tensor,
    weights: Weights,
    cascade_pixels: int | None,
    options: CascadeOptions = WHOLE_CASCADE,
) -> tuple[Tensor, dict[str, Tensor], dict[str, Int[Tensor, " B"]]]:
    """The total loss, every term of it, and the cascade's stage of every crop.

    ``cascade_pixels`` None leaves the cascade out. Losses on crops are means over the
    categories that the network estimates, however many parts these have.
    """
    found = {
        name: crop_losses(priors[name], output.crops[name], some, cascade_pixels, options)
        for name, some in crops.items()
        if output.crops[name].raw is not None
    }
    per_category = [terms for terms, _ in found.values()]
    names = list(dict.fromkeys(k for some in per_category for k in some))
    terms = {k: torch.stack([t[k] for t in per_category if k in t]).mean() for k in names}
    terms |= photo_losses(output, views, category, tuple(priors))
    weighted = {k: w * v for k, v in terms.items() if (w := getattr(weights, k, 0.0))}
    stages = {name: stage for name, (_, stage) in found.items() if stage is not None}
    return torch.stack(list(weighted.values())).sum(), terms, stages
