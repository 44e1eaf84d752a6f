"""Silhouettes and the pixel loss: how long do they take, beside other ways and beside a floor?

python benchmarks/silhouette.py                              prints Markdown
python benchmarks/silhouette.py --results docs/results.md    writes the page's section

All in one run and in turns, so that a busy machine slows all of them; what counts are the ratios.
"""

import argparse
import statistics
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import roma
import torch
from torch import Tensor

from r2art.learn.recipes import tiny
from r2art.learn.results import write_section
from r2art.method import cascade, se3
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

POINTS = 2048
Render = Callable[[Shape, Tensor, Tensor, tuple[int, int]], Silhouettes]


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
    R = roma.random_rotmat(batch * parts).reshape(batch, parts, 3, 3)
    t = 0.03 * torch.randn(batch, parts, 3) + torch.tensor([0.0, 0.0, 0.6])
    K = torch.tensor([[2.4 * pixels, 0, pixels / 2], [0, 2.4 * pixels, pixels / 2], [0, 0, 1]])
    return shape, se3.from_rotation_translation(R, t), K.expand(batch, 3, 3)


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


def plain_pixel_loss(predicted: Silhouettes, true: Silhouettes) -> Tensor:
    """`cascade.pixel_loss` written down as it is defined."""
    p, target = 1e-4 + (1 - 2e-4) * predicted.parts, true.parts
    entropy = -(target * p.log() + (1 - target) * (1 - p).log())
    omega = cascade.beyond_edge(predicted.parts, target)[..., None, None]
    return ((1 + omega * cascade.edge_band(target)) * entropy).mean((-3, -2, -1))


def rendering(render: Render, batch: int, pixels: int, device: str, *, back: bool) -> Callable:
    """A render, and its gradient in pose and points if ``back``."""
    shape, pose, K = scene(batch, pixels)
    tensors = {k: v.to(device) for k, v in vars(shape).items() if isinstance(v, Tensor)}
    shape = Shape(**{**vars(shape), **tensors})
    pose, K = pose.to(device).requires_grad_(back), K.to(device)
    shape.points.requires_grad_(back)
    weight = torch.rand(batch, 1, pixels, pixels, device=device)

    def run() -> None:
        seen = render(shape, pose, K, (pixels, pixels))
        if back:
            torch.autograd.grad((seen.parts,), (pose, shape.points), (weight,))

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


def pixel_losses(loss: Callable, batch: int, pixels: int, device: str) -> Callable:
    parts = torch.rand(batch, 2, pixels, pixels, device=device, requires_grad=True)
    seen = Silhouettes(parts=parts, union=parts[:, 0])
    target = (torch.rand(batch, 2, pixels, pixels, device=device) > 0.5).float()
    true = Silhouettes(parts=target, union=target[:, 0])
    return lambda: torch.autograd.grad(loss(seen, true).sum(), parts)


def in_turns(contenders: dict[str, Callable], rounds: int, device: str) -> dict[str, float]:
    """Median milliseconds of each: CPU time of this thread, or the GPU's."""
    times: dict[str, list[float]] = {name: [] for name in contenders}
    for _ in range(rounds + 1):
        for name, run in contenders.items():
            if device == "cuda":
                torch.cuda.synchronize()
                start = time.perf_counter()
                run()
                torch.cuda.synchronize()
                times[name].append(time.perf_counter() - start)
            else:
                start = time.process_time()
                run()
                times[name].append(time.process_time() - start)
    return {name: 1e3 * statistics.median(t[1:]) for name, t in times.items()}


def table(batch: int, pixels: int, rounds: int, device: str) -> list[str]:
    ways: dict[str, Render] = {
        "r2art": fast_silhouettes,
        "torch `index_add` (the definition)": plain_silhouettes,
        "torch matmul, separable kernel": matmul_silhouettes,
    }
    if find_spec("pytorch3d"):
        ways["PyTorch3D PointsRenderer"] = pytorch3d_silhouettes
    rows = [f"| batch {batch}, {POINTS} points, {pixels}² | fwd ms | fwd + bwd ms | × floor |"]
    rows.append("| --- | ---: | ---: | ---: |")
    forward = {k: rendering(r, batch, pixels, device, back=False) for k, r in ways.items()}
    both = {k: rendering(r, batch, pixels, device, back=True) for k, r in ways.items()}
    floor = "floor: `exp` of every pixel"
    forward[floor] = exponential(batch, pixels, device, back=False)
    both[floor] = exponential(batch, pixels, device, back=True)
    f, b = in_turns(forward, rounds, device), in_turns(both, rounds, device)
    rows += [f"| {k} | {f[k]:.2f} | {b[k]:.2f} | {b[k] / b[floor]:.1f} |" for k in both]
    return [*rows, ""]


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


def losses_table(rounds: int, device: str) -> list[str]:
    rows = ["| pixel loss and gradient, 2 parts | plain ms | r2art ms | × faster |"]
    rows.append("| --- | ---: | ---: | ---: |")
    for batch, pixels in ((32, 56), (64, 112)):
        t = in_turns(
            {
                "plain": pixel_losses(plain_pixel_loss, batch, pixels, device),
                "ours": pixel_losses(cascade.pixel_loss, batch, pixels, device),
            },
            rounds,
            device,
        )
        ratio = t["plain"] / t["ours"]
        rows.append(
            f"| batch {batch}, {pixels}² | {t['plain']:.1f} | {t['ours']:.1f} | {ratio:.1f} |"
        )
    return [*rows, ""]


def share_of_step(rounds: int, device: str) -> str:
    """The cascade's two renderings, losses and gradients beside the trunk's."""
    import timm

    recipe = tiny()
    pixels, batch = recipe.cascade_pixels, recipe.crops
    every = (112 // pixels) ** 2
    shape, pose, K = scene(batch, pixels, parts=2)
    thin = {k: getattr(shape, k)[:, ::every].to(device) for k in ("points", "normals", "areas")}
    thin["areas"] = thin["areas"] * every
    shape = Shape(**{**vars(shape), **thin})
    pose, K = pose.to(device).requires_grad_(), K.to(device)
    true = pose.detach().roll(1, dims=0)
    trunk = timm.create_model(recipe.backbone, features_only=True, **recipe.backbone_options)
    trunk = trunk.to(device).to(memory_format=torch.channels_last).train()
    image = torch.rand(batch + recipe.photos, 3, recipe.input_size, recipe.input_size)
    image = image.to(device).contiguous(memory_format=torch.channels_last)

    def cascade_part() -> None:
        with torch.no_grad():
            truth = cascade.render(shape, true, K, (pixels, pixels))
        loss, _ = cascade.cascade_loss(cascade.render(shape, pose, K, (pixels, pixels)), truth)
        torch.autograd.grad(loss.sum(), pose)

    def trunk_part() -> None:
        trunk.zero_grad()
        sum(level.mean() for level in trunk(image)).backward()

    t = in_turns({"cascade": cascade_part, "trunk": trunk_part}, max(3, rounds // 4), device)
    share = t["cascade"] / (t["cascade"] + t["trunk"])
    return (
        f"In a step of the recipe `tiny` the cascade (two renderings, all losses, gradients) takes "
        f"{t['cascade']:.1f} ms and the trunk {t['trunk']:.0f} ms: {100 * share:.1f} %."
    )


def report(rounds: int, device: str, flags: str) -> str:
    """The section of docs/results.md."""
    where = torch.cuda.get_device_name() if device == "cuda" else "one CPU thread, CPU time"
    absent = "" if find_spec("pytorch3d") else " PyTorch3D cannot be imported here (no wheel)."
    timed = "" if device == "cuda" else " Not timed on a GPU."
    facts = (
        f"Medians of {rounds} rounds in turns ({where}).{absent}{timed} Gradients are those in "
        f"pose and points. Written by `python benchmarks/silhouette.py{flags}`."
    )
    lines = ["## Silhouettes", "", facts, ""]
    for batch, pixels in ((64, 112), (16, 224)):
        lines += table(batch, pixels, rounds, device)
    return "\n".join([*lines, *losses_table(rounds, device), share_of_step(rounds, device)])


def main() -> None:
    parser = argparse.ArgumentParser(description="Benchmark silhouettes and their losses.")
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--device", default="cpu", choices=["cpu", "cuda"])
    parser.add_argument("--results", type=Path, help="write the section on silhouettes")
    args = parser.parse_args()
    torch.set_num_threads(1)
    torch.manual_seed(0)
    flags = f" --rounds {args.rounds}" + (" --results docs/results.md" if args.results else "")
    section = report(args.rounds, args.device, flags)
    print(section)
    if args.results:
        write_section(args.results, "silhouette", section)


if __name__ == "__main__":
    main()
