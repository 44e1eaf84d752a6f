"""Ways to render silhouettes of the same spheres, with their gradients, beside a floor."""

import itertools
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec

import gpu
import numpy as np
import torch
from torch import Tensor

from r2art.core.mesh import Mesh
from r2art.method import se3
from r2art.method.kinematics import KinematicModel
from r2art.method.projection import project
from r2art.method.shape import Shape
from r2art.method.silhouette import (
    KERNEL_RADIUS,
    Silhouettes,
    coverage,
    fast_silhouettes,
    patch_areas,
    plain_silhouettes,
)
from r2art.method.silhouette_mesh import Triangles, mesh_silhouettes

POINTS = 2048
SIZES = ((64, 112), (16, 224))
"""Batch and pixels."""
OURS, PLAIN = "r2art", "torch `index_add` (the definition)"
MESH = "r2art, exact coverage of 512 triangles"
"""How many pieces it cuts is known when it runs: no CUDA graph can hold that."""
FLOOR = "floor: `exp` of every pixel"
Render = Callable[[Shape, Tensor, Tensor, tuple[int, int]], Silhouettes]


def ways(batch: int, pixels: int, device: str) -> dict[str, Callable[[bool], Callable]]:
    """By name what makes a run of each way, with gradients or without."""

    def way(render: Render) -> Callable[[bool], Callable]:
        return lambda back: rendering(render, batch, pixels, device, back=back)

    matmul = way(matmul_silhouettes)
    found = {
        OURS: way(fast_silhouettes),
        PLAIN: way(plain_silhouettes),
        "torch matmul, separable kernel": matmul,
    }
    if device == "cuda":
        found["torch matmul, separable kernel, TF32"] = lambda back: gpu.tf32(matmul(back))
    if find_spec("pytorch3d"):
        found["PyTorch3D PointsRenderer"] = way(pytorch3d_silhouettes)
    found[MESH] = lambda back: mesh_rendering(batch, pixels, device, back=back)
    found[FLOOR] = lambda back: exponential(batch, pixels, device, back=back)
    return found


def scene(batch: int, pixels: int, parts: int = 1) -> tuple[Shape, Tensor, Tensor]:
    """Spheres that about fill the image, one per part, turned at random."""
    i = torch.arange(POINTS // parts) + 0.5
    y, turn = 1 - 2 * i * parts / POINTS, torch.pi * (1 + 5**0.5) * i
    ring = (1 - y.square()).sqrt()
    normals = torch.stack([ring * turn.cos(), y, ring * turn.sin()], dim=-1).expand(parts, -1, 3)
    area = 4 * torch.pi * 0.1**2 * parts / POINTS
    none = torch.zeros(0, 3)
    kinematics = KinematicModel(
        parent=(), prismatic=torch.zeros(0, dtype=torch.bool), axis=none, pivot=none,
        limits=torch.zeros(0, 2),
    )  # fmt: skip
    box = torch.full((parts, 3), 0.2)
    shape = Shape(
        box_center=0 * box, box_size=box, points=0.1 * normals, normals=normals,
        areas=torch.full(normals.shape[:2], area), kinematics=kinematics,
    )  # fmt: skip
    axis = torch.nn.functional.normalize(torch.randn(batch, parts, 3), dim=-1)
    R = se3.rotation_about_axis(axis, 2 * torch.pi * torch.rand(batch, parts))
    t = 0.03 * torch.randn(batch, parts, 3) + torch.tensor([0.0, 0.0, 0.6])
    K = torch.tensor([[2.4 * pixels, 0, pixels / 2], [0, 2.4 * pixels, pixels / 2], [0, 0, 1]])
    return shape, se3.from_rotation_translation(R, t), K.expand(batch, 3, 3)


def octasphere(times: int) -> Mesh:
    """A sphere of radius 0.1 by 8 · 4ᵗ triangles."""
    signs = itertools.product((1.0, -1.0), repeat=3)
    corners = np.array([np.diag(s)[:: int(np.prod(s))] for s in signs])
    for _ in range(times):
        a, b, c = corners.transpose(1, 0, 2)
        ab, bc, ca = a + b, b + c, c + a
        of_four = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        corners = np.concatenate([np.stack(x, axis=1) for x in of_four])
        corners /= np.linalg.norm(corners, axis=-1, keepdims=True)
    keys = corners.reshape(-1, 3).round(9)
    vertices, faces = np.unique(keys, axis=0, return_inverse=True)
    part = np.zeros(len(vertices), np.intp)
    return Mesh(vertices=0.1 * vertices, faces=faces.reshape(-1, 3), part=part)


def on_device(shape: Shape, device: str, dtype: torch.dtype = torch.float32) -> Shape:
    tensors = {k: v.to(device, dtype) for k, v in vars(shape).items() if isinstance(v, Tensor)}
    return replace(shape, **tensors)


def rendering(render: Render, batch: int, pixels: int, device: str, *, back: bool) -> Callable:
    """A render, and its gradient in pose and points if ``back``."""
    shape, pose, K = scene(batch, pixels)
    shape = on_device(shape, device)
    pose, K = pose.to(device).requires_grad_(back), K.to(device)
    shape.points.requires_grad_(back)
    weight = torch.rand(batch, 1, pixels, pixels, device=device)

    def run() -> None:
        seen = render(shape, pose, K, (pixels, pixels))
        if back:
            torch.autograd.grad((seen.parts,), (pose, shape.points), (weight,))

    return run


def mesh_rendering(batch: int, pixels: int, device: str, *, back: bool) -> Callable:
    """As `rendering`, of the same spheres by their triangles."""
    mesh = Triangles.from_mesh(octasphere(3), device)
    _, pose, K = scene(batch, pixels)
    pose, K = pose.to(device).requires_grad_(back), K.to(device)
    vertices = mesh.vertices.clone().requires_grad_(back)
    weight = torch.rand(batch, 1, pixels, pixels, device=device)

    def run() -> None:
        seen = mesh_silhouettes(mesh, vertices, pose, K, (pixels, pixels))
        if back:
            torch.autograd.grad((seen.parts,), (pose, vertices), (weight,))

    return run


def exponential(batch: int, pixels: int, device: str, *, back: bool) -> Callable:
    """The floor: one exponential per pixel, and its gradient."""
    image = torch.rand(batch, pixels, pixels, device=device, requires_grad=back)
    weight = torch.rand_like(image)

    def run() -> None:
        y = torch.exp(image)
        if back:
            torch.autograd.grad((y,), (image,), (weight,))

    return run


def matmul_silhouettes(
    shape: Shape, cam_T_part: Tensor, K: Tensor, size: tuple[int, int]
) -> Silhouettes:
    """The kernel is a product of one along x and one along y: a batched matrix product."""
    K = K[..., None, :, :]
    points = se3.transform(cam_T_part, shape.points)
    normals = shape.normals @ cam_T_part[..., :3, :3].mT
    weight = patch_areas(points, normals, shape.areas, K)
    uv = project(points, K)

    def along(axis: int, length: int) -> Tensor:
        pixel = torch.arange(length, device=uv.device) + 0.5
        distance = (pixel - uv[..., axis, None]) / KERNEL_RADIUS
        return 15 / (16 * KERNEL_RADIUS) * (1 - distance.square()).clamp_min(0).square()

    layers = (along(1, size[0]) * weight[..., None]).mT @ along(0, size[1])
    return Silhouettes(parts=coverage(layers), union=coverage(layers.sum(-3)))


def pytorch3d_silhouettes(
    shape: Shape, cam_T_part: Tensor, K: Tensor, size: tuple[int, int]
) -> Silhouettes:
    """Its point renderer with splats of our radius; another function of the same points."""
    from pytorch3d.renderer.points import rasterize_points
    from pytorch3d.structures import Pointclouds

    points = se3.transform(cam_T_part, shape.points).flatten(1, 2)
    uv = project(points, K)
    ndc = torch.cat([1 - 2 * uv / size[0], points[..., 2:]], dim=-1)
    radius = 2 * KERNEL_RADIUS / size[0]
    index, _, squared = rasterize_points(Pointclouds(ndc), size, radius, 10)
    alpha = torch.where(index >= 0, 1 - squared / radius**2, 0.0)
    parts = (1 - (1 - alpha).prod(dim=-1))[:, None]
    return Silhouettes(parts=parts, union=parts[:, 0])
