"""Photos in a mirror: twice as many views, of objects that are alike on both sides."""

from dataclasses import fields, replace

import torch
from jaxtyping import Float
from torch import Tensor

from r2art.core.category import Category, Mirror
from r2art.learn.augment import Crops, Views
from r2art.learn.chance import Chance
from r2art.learn.equivalent import Some, either, renamed, taken


def some_mirrored(crops: Crops, category: Category, chance: Chance) -> Crops:
    """Every other crop in a mirror, by chance; none of a category without one."""
    if category.mirror is None:
        return crops
    other = mirrored(crops, category.mirror, [joint.parent for joint in category.joints])
    return _by_chance(crops, other, chance)


def some_views_mirrored(views: Views, chance: Chance) -> Views:
    """Every other photo in a mirror, by chance: what it shows keeps its name, whatever it is."""
    size = views.image.shape[-1]
    other = replace(
        views,
        image=views.image.flip(-1),
        seen=views.seen.flip(-1),
        box=_box_mirrored(views.box, size),
    )
    return _by_chance(views, other, chance)


def mirrored(crops: Crops, mirror: Mirror, parents: list[int]) -> Crops:
    """All crops in a mirror, see `Mirror`; twice mirrored they are as they were.

    Args:
        crops: Of one category.
        mirror: Of that category.
        parents: The part on which each joint hangs.
    """
    size, swap = crops.image.shape[-1], mirror.swap
    M = torch.diag(crops.K.new_tensor([-1.0, 1.0, 1.0, 1.0]))
    K = crops.K.clone()
    K[:, 0, 2] = size - K[:, 0, 2]
    return replace(
        crops,
        image=crops.image.flip(-1),
        part=renamed(crops.part, swap).flip(-1),
        seen=crops.seen.flip(-1),
        coordinates=crops.coordinates.flip(-1) * M.diagonal()[:3, None, None],
        K=K,
        box=_box_mirrored(crops.box, size),
        cam_T_part=M @ taken(crops.cam_T_part, swap) @ M,
        joint_state=taken(crops.joint_state, mirror.joint_swap(parents)),
        box_center=taken(crops.box_center, swap) * M.diagonal()[:3],
        box_size=taken(crops.box_size, swap),
    )


def _box_mirrored(box: Float[Tensor, "N 4"], size: int) -> Float[Tensor, "N 4"]:
    x1, y1, x2, y2 = box.unbind(1)
    return torch.stack([size - x2, y1, size - x1, y2], dim=1)


def _by_chance(one: Some, other: Some, chance: Chance) -> Some:
    which = chance.happens(0.5, len(one.image))
    return either(which, one, other, [f.name for f in fields(one)])
