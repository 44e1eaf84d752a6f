"""Training on objects that look the same under another labelling of their parts.

A network that is taught one of two labels that no photo tells apart learns their mean, which is
neither. So of each sample that label counts which the estimate is nearer to.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TypeVar

import torch
from jaxtyping import Bool, Float, Int, Shaped
from torch import Tensor

from r2art.core.category import Symmetry
from r2art.learn.augment import Crops, Views
from r2art.method import losses, se3
from r2art.method.estimate import Estimate
from r2art.method.shape import Prior, box_corners

Some = TypeVar("Some", Crops, Views)

REPROJECTION = 5.0
"""Weight of the corners over that of the directions, roughly as the objective has it."""
LABELS = ("part", "coordinates", "cam_T_part", "joint_state", "box_center", "box_size")


def better_labels(prior: Prior, found: Estimate, crops: Crops) -> Crops:
    """The crops, each with that of its equivalent labels which the estimate is nearer to.

    No gradient goes through the choice. Crops of a category without a symmetry are returned as
    they are; so is a crop with an estimate that is not finite.
    """
    if prior.symmetry is None:
        return crops
    other = relabelled(crops, prior.symmetry, prior.kinematics.parent)
    turned = distance(found, other) < distance(found, crops)
    return either(turned, crops, other, LABELS)


def relabelled(crops: Crops, symmetry: Symmetry, parents: Sequence[int]) -> Crops:
    """The same crops under the other labelling, see `Symmetry`.

    Args:
        crops: Under any of the two; twice relabelled they are as they were.
        symmetry: Of their category.
        parents: The part on which each joint hangs.
    """
    swap = symmetry.swap
    pose, center = taken(crops.cam_T_part, swap), taken(crops.box_center, swap)
    origin = center[:, :1]
    R = _turned(pose[..., :3, :3], symmetry)
    t = se3.transform(pose, origin[:, None])[..., 0, :]
    return replace(
        crops,
        part=renamed(crops.part, swap),
        coordinates=_turned(crops.coordinates.movedim(1, -1), symmetry).movedim(-1, 1),
        cam_T_part=se3.from_rotation_translation(R, t),
        joint_state=taken(crops.joint_state, symmetry.joint_swap(parents)),
        box_center=_turned(center - origin, symmetry),
        box_size=taken(crops.box_size, swap),
    )


@torch.no_grad()
def distance(found: Estimate, crops: Crops) -> Float[Tensor, " B"]:
    """How far an estimate is from labels: box corners in the crop, and the parts' directions."""
    R, true_R = found.cam_T_part[..., :3, :3], crops.cam_T_part[..., :3, :3]
    direction = sum(losses.direction_loss(R[..., i], true_R[..., i]) for i in (0, 1))
    corners, true_corners = (
        se3.transform(pose, box_corners(center, size)).flatten(1, 2)
        for pose, center, size in (
            (found.cam_T_part, found.shape.box_center, found.shape.box_size),
            (crops.cam_T_part, crops.box_center, crops.box_size),
        )
    )
    reprojection = losses.reprojection_loss(corners, true_corners, crops.K, crops.box)
    return torch.as_tensor(direction).mean(-1) + REPROJECTION * reprojection


def either(which: Bool[Tensor, " B"], one: Some, other: Some, names: Iterable[str]) -> Some:
    """One, but the other in these fields of those samples that ``which`` says."""

    def chosen(name: str) -> Tensor:
        given = getattr(one, name)
        where = which.reshape(-1, *(1,) * (given.ndim - 1))
        return torch.where(where, getattr(other, name), given)

    return replace(one, **{name: chosen(name) for name in names})


def renamed(part: Int[Tensor, "B s s"], swap: Sequence[int]) -> Int[Tensor, "B s s"]:
    """Mask values after the parts have traded names."""
    result = part
    for name, old in enumerate(swap):
        result = torch.where(part == old + 1, name + 1, result)
    return result


def taken(labels: Shaped[Tensor, "B N *rest"], order: Sequence[int]) -> Tensor:
    """Labels in another order; unlike an index, no list has to reach the device for it."""
    return torch.stack([labels[:, i] for i in order], dim=1) if order else labels


def _turned(vectors: Float[Tensor, "*B 3"], symmetry: Symmetry) -> Float[Tensor, "*B 3"]:
    columns = zip(symmetry.signs, vectors.unbind(-1), strict=True)
    return torch.stack([sign * column for sign, column in columns], dim=-1)
