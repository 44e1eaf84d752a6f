"""Section 4.1: the root's translation from a box, two offsets and one depth correction.

Boxes are ``x1 y1 x2 y2`` in pixels, ``K`` the intrinsics of the *same* (cropped, resized)
image. Lengths are metres.
"""

import torch
from jaxtyping import Float
from torch import Tensor

from r2art.method.projection import box_center, box_size


def projection_depth(
    box: Float[Tensor, "*#B 4"],
    K: Float[Tensor, "*#B 3 3"],
    frontal_area: float | Float[Tensor, "*#B"],
) -> Float[Tensor, "*B"]:
    """Depth (m) at which a patch of ``frontal_area`` (m²) would fill the box -- Eq. 1.

    The camera and the object's usual size are in this number, so the network only corrects it
    and need learn neither. From one photo metric depth is a prior, not a measurement: the
    frontal area is a constant of the category, unless the user knows the object.
    """
    area = box_size(box).prod(-1)
    return (K[..., 0, 0] * K[..., 1, 1] * frontal_area / area).sqrt()


def viewing_ray(box: Float[Tensor, "*#B 4"], K: Float[Tensor, "*#B 3 3"]) -> Float[Tensor, "*B 3"]:
    """Unit vector from the camera through the box's centre."""
    x, y = _normalized_image(box_center(box), K)
    ray = torch.stack([x, y, torch.ones_like(x)], dim=-1)
    return ray / torch.linalg.vector_norm(ray, dim=-1, keepdim=True)


def root_translation(
    phi: Float[Tensor, "*#B 2"],
    log_lambda: Float[Tensor, "*#B"],
    box: Float[Tensor, "*#B 4"],
    K: Float[Tensor, "*#B 3 3"],
    frontal_area: float | Float[Tensor, "*#B"],
) -> Float[Tensor, "*B 3"]:
    """Camera-to-root translation (m) from the network's three numbers.

    Args:
        phi: Where the root's origin projects to: offset from the box centre, in box sizes.
        log_lambda: Logarithm of the correction λ, so that ``z = λ · d_p`` stays positive.
        box: ``x1 y1 x2 y2`` (px).
        K: Intrinsics of the image the box was measured in.
        frontal_area: ``S_wld`` of Eq. 1 (m²).

    Deviation: the paper predicts metric x and y, which are coupled to z; docs/paper.md#phi.
    """
    z = log_lambda.exp() * projection_depth(box, K, frontal_area)
    x, y = _normalized_image(box_center(box) + phi * box_size(box), K)
    return torch.stack([x * z, y * z, z], dim=-1)


def translation_targets(
    translation: Float[Tensor, "*#B 3"],
    box: Float[Tensor, "*#B 4"],
    K: Float[Tensor, "*#B 3 3"],
    frontal_area: float | Float[Tensor, "*#B"],
) -> tuple[Float[Tensor, "*B 2"], Float[Tensor, "*B"]]:
    """The ``phi`` and ``log_lambda`` from which `root_translation` gives ``translation``."""
    x, y, z = translation.unbind(-1)
    u = K[..., 0, 0] * x / z + K[..., 0, 2]
    v = K[..., 1, 1] * y / z + K[..., 1, 2]
    phi = (torch.stack([u, v], dim=-1) - box_center(box)) / box_size(box)
    return phi, (z / projection_depth(box, K, frontal_area)).log()


def _normalized_image(
    uv: Float[Tensor, "*#B 2"], K: Float[Tensor, "*#B 3 3"]
) -> tuple[Float[Tensor, "*B"], Float[Tensor, "*B"]]:
    x = (uv[..., 0] - K[..., 0, 2]) / K[..., 0, 0]
    y = (uv[..., 1] - K[..., 1, 2]) / K[..., 1, 1]
    return x, y
