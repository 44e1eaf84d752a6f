"""Section 4.3: silhouettes of a surface known by points, differentiable and without depth bias.

A point i at pixel u_i stands for a patch of surface: s_i (m²) with unit normal n_i at X_i. The
patch covers a_i = s_i fx fy |n_i · X_i| / z_i³ square pixels. Spread over a kernel of integral
1, all patches add up to L(p), the number of surface layers before a pixel: 2 inside a closed
convex part (front and back), 0 outside, and 1 on the outline, because the kernel is symmetric.

    A(p) = 1 − exp(−ln 2 · L²)

is ½ on the outline and 0.94 or more inside, so the outline is right at every distance and for
every number of points, which splats of a constant weight are not (they bias depth by percents).
Silhouettes are *amodal*: one part does not hide another.
"""

from dataclasses import dataclass
from math import ceil, log

import torch
from jaxtyping import Float, Int
from torch import Tensor

from r2art.method import se3, silhouette_fast
from r2art.method.projection import MIN_DEPTH, project
from r2art.method.shape import Shape

KERNEL_RADIUS = 2.5
"""Pixels. Reaches the next point of 2,048 over an object that fills an image of 112²."""
FAST_DEVICES = ("cpu", "cuda")
"""Where `fast_silhouettes` runs."""


@dataclass(frozen=True, kw_only=True)
class Silhouettes:
    """Coverage in [0, 1]; ½ on the outline.

    Attributes:
        parts: Of each part by itself, whatever stands before it.
        union: Of the whole object.
    """

    parts: Float[Tensor, "*B P H W"]
    union: Float[Tensor, "*B H W"]


def splat(
    uv: Float[Tensor, "*B N 2"],
    weight: Float[Tensor, "*B N"],
    radius: float,
    height: int,
    width: int,
) -> Float[Tensor, "*B {height} {width}"]:
    """Spread each weight over the pixels within ``radius`` of its point, and add up.

    The kernel is ``(15/16r)² (1−dx²/r²)² (1−dy²/r²)²`` around the point, at pixel centres: its
    integral is 1 and its slope continuous, so gradients reach both ``uv`` and ``weight``.
    """
    first = torch.floor(uv.detach() + (0.5 - radius)).long()
    tap = first[..., None, :] + torch.arange(ceil(2 * radius), device=uv.device)[:, None]
    distance = (tap + 0.5 - uv[..., None, :]) / radius
    kernel = 15 / (16 * radius) * (1 - distance.square()).clamp_min(0).square()
    value = weight[..., None, None] * kernel[..., :, None, 1] * kernel[..., None, :, 0]
    index = _padded_index(tap, height, width)
    num_images, size = uv.shape[:-2].numel(), (height + 2) * (width + 2)
    offset = torch.arange(num_images, device=uv.device).reshape(*uv.shape[:-2], 1, 1, 1) * size
    canvas = value.new_zeros(num_images * size)
    canvas = canvas.index_add(0, (offset + index).flatten(), value.flatten())
    return canvas.reshape(*uv.shape[:-2], height + 2, width + 2)[..., 1:-1, 1:-1]


def patch_areas(
    points: Float[Tensor, "*#B M 3"],
    normals: Float[Tensor, "*#B M 3"],
    areas: Float[Tensor, "*#B M"],
    K: Float[Tensor, "*#B 3 3"],
) -> Float[Tensor, "*B M"]:
    """Square pixels that each point's patch covers; 0 behind and too near to the camera.

    Args:
        points: In the camera frame (m).
        normals: Unit, in the camera frame; their sign does not matter.
        areas: Surface (m²) that each point stands for.
        K: Intrinsics.
    """
    z = points[..., 2].clamp_min(MIN_DEPTH)
    focal_area = (K[..., 0, 0] * K[..., 1, 1])[..., None]
    slant = (normals * points).sum(-1).abs() / z
    return torch.where(points[..., 2] > MIN_DEPTH, focal_area * areas * slant / z.square(), 0.0)


def coverage(layers: Float[Tensor, "*B H W"]) -> Float[Tensor, "*B H W"]:
    """From the number of surface layers before a pixel to its coverage A."""
    return -torch.expm1(-log(2) * layers.square())


def part_silhouettes(
    shape: Shape,
    cam_T_part: Float[Tensor, "*B P 4 4"],
    K: Float[Tensor, "*#B 3 3"],
    size: tuple[int, int],
    radius: float = KERNEL_RADIUS,
) -> Silhouettes:
    """Silhouettes of a shape's posed parts: by `fast_silhouettes` where it serves.

    Args:
        shape: The deformed prior, at rest.
        cam_T_part: Where its parts are.
        K: Intrinsics of the image to render (see `resize_intrinsics`).
        size: Height and width of that image.
        radius: Of the kernel (px); at least the distance between neighbouring points.
    """
    exact = cam_T_part.dtype == torch.float64 or K.requires_grad
    fast = cam_T_part.device.type in FAST_DEVICES and not exact
    return (fast_silhouettes if fast else plain_silhouettes)(shape, cam_T_part, K, size, radius)


def plain_silhouettes(
    shape: Shape,
    cam_T_part: Float[Tensor, "*B P 4 4"],
    K: Float[Tensor, "*#B 3 3"],
    size: tuple[int, int],
    radius: float = KERNEL_RADIUS,
) -> Silhouettes:
    """`part_silhouettes` by its definition, in any precision and on any device."""
    K = K[..., None, :, :]
    points = se3.transform(cam_T_part, shape.points)
    normals = shape.normals @ cam_T_part[..., :3, :3].mT
    weight = patch_areas(points, normals, shape.areas, K)
    layers = splat(project(points, K), weight, radius, *size)
    return Silhouettes(parts=coverage(layers), union=coverage(layers.sum(-3)))


def fast_silhouettes(
    shape: Shape,
    cam_T_part: Float[Tensor, "*B P 4 4"],
    K: Float[Tensor, "*#B 3 3"],
    size: tuple[int, int],
    radius: float = KERNEL_RADIUS,
) -> Silhouettes:
    """`part_silhouettes` by one pass over the points; float32, on a CPU or an NVIDIA GPU.

    Autocast changes nothing: halves are widened, and no matrix is multiplied by torch.
    """
    num_parts, num_points = shape.areas.shape[-2:]
    shapes = shape.areas.shape[:-2], cam_T_part.shape[:-3], K.shape[:-2]
    batch = (*torch.broadcast_shapes(*shapes), num_parts)
    parts, union = silhouette_fast.silhouettes(
        shape.points.float().expand(*batch, num_points, 3),
        shape.normals.float().expand(*batch, num_points, 3),
        shape.areas.float().expand(*batch, num_points),
        cam_T_part.float().expand(*batch, 4, 4),
        K.float()[..., None, :, :].expand(*batch, 3, 3),
        silhouette_fast.Target(*size, radius),
    )
    return Silhouettes(parts=parts, union=union)


def _padded_index(tap: Int[Tensor, "*B N k 2"], height: int, width: int) -> Int[Tensor, "*B N k k"]:
    """Flat index into an image with one more pixel all around, which takes what falls outside."""
    column = tap[..., 0].clamp(-1, width) + 1
    row = tap[..., 1].clamp(-1, height) + 1
    return row[..., :, None] * (width + 2) + column[..., None, :]
