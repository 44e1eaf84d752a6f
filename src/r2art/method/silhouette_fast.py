"""`silhouette.part_silhouettes` in float32 on CPU and CUDA, with a hand-written adjoint."""

from functools import cache
from math import log
from typing import Any, NamedTuple

import torch
import warp as wp
from jaxtyping import Float
from torch import Tensor
from torch.autograd.function import once_differentiable

from r2art.method import silhouette_warp as kernels
from r2art.method.projection import MIN_DEPTH
from r2art.method.silhouette_warp import TAPS

SPLAT_THREADS = 2048
"""Threads per image on a GPU that splat its points."""
ADJOINT_THREADS = 1024
"""Threads per image on a GPU for the adjoint; each adds its share of the pose's gradient."""

IN_FOURS = True
"""Whether GPUs add to four pixels at once."""


class Target(NamedTuple):
    """Height, width and kernel radius (px) of the images."""

    height: int
    width: int
    radius: float

    @property
    def margin(self) -> int:
        """Unused pixels before each row: as many as a row of a splat is wide, in whole vectors."""
        return TAPS * -(-int(2 * self.radius + 0.999) // TAPS)

    def canvas(self, images: int, like: Tensor) -> Tensor:
        """An empty canvas, with room for the last row's splats."""
        pixels = images * self.height * (self.width + self.margin) + self.margin + TAPS
        return like.new_zeros(pixels)

    def images(self, canvas: Tensor) -> Tensor:
        """The (N, H, W) images of a canvas, a view."""
        stride = self.width + self.margin
        rows = canvas[: canvas.shape[0] - self.margin - TAPS]
        return rows.reshape(-1, self.height, stride)[..., self.margin :]


def silhouettes(
    points: Float[Tensor, "*B P M 3"],
    normals: Float[Tensor, "*B P M 3"],
    areas: Float[Tensor, "*B P M"],
    cam_T_part: Float[Tensor, "*B P 4 4"],
    K: Float[Tensor, "*B P 3 3"],
    target: Target,
) -> tuple[Float[Tensor, "*B P H W"], Float[Tensor, "*B H W"]]:
    """Coverage of every part and of their union, see `silhouette.part_silhouettes`.

    Gradients of first order reach points, normals, areas and poses; not ``K``.
    """
    parts, union = _Silhouettes.apply(points, normals, areas, cam_T_part, K, target)  # pyright: ignore[reportGeneralTypeIssues]
    return parts, union


class _Silhouettes(torch.autograd.Function):
    """Layers L by the kernels; ``A = 1 − 2^(−L²)`` and ``dA/dL = 2 ln 2 L (1 − A)`` in place."""

    @staticmethod
    def forward(ctx: Any, *args: Any) -> tuple[Tensor, Tensor]:
        *tensors, target = args
        batch = tensors[0].shape[:-2]
        tensors = [t.detach().flatten(0, len(batch) - 1).contiguous() for t in tensors]
        canvas = target.canvas(batch.numel(), tensors[0])
        splat(tensors, canvas, target, in_fours=IN_FOURS and canvas.is_cuda)
        layers = target.images(canvas).unflatten(0, batch)
        total = layers.sum(-3)
        parts, union = _coverage(layers), _coverage(total)
        ctx.save_for_backward(*tensors, layers, total, parts, union)
        ctx.target, ctx.batch = target, batch
        ctx.set_materialize_grads(False)
        return parts, union

    @staticmethod
    @once_differentiable
    def backward(  # pyright: ignore[reportIncompatibleMethodOverride]
        ctx: Any, *grads: Tensor | None
    ) -> tuple[Tensor | None, ...]:
        *tensors, layers, total, parts, union = ctx.saved_tensors
        target = ctx.target
        canvas = target.canvas(ctx.batch.numel(), tensors[0])
        by_layers = target.images(canvas).unflatten(0, ctx.batch)
        by_part, by_union = grads
        if by_part is not None:
            by_layers.copy_(_slope(layers, parts).mul_(by_part))
        if by_union is not None:
            by_layers.add_(_slope(total, union).mul_(by_union).unsqueeze(-3))
        gradients = [torch.zeros_like(t) for t in tensors[:4]]
        *surface, pose = gradients
        outputs = [wp.from_torch(pose, dtype=wp.mat44), _surface(surface)]
        _launch(kernels.splat_adjoint, ADJOINT_THREADS, tensors, canvas, target, outputs)
        return (*(g.unflatten(0, ctx.batch) for g in gradients), None, None)


def _coverage(layers: Tensor) -> Tensor:
    return 1 - layers.square().mul_(-log(2)).exp_()


def _slope(layers: Tensor, coverage: Tensor) -> Tensor:
    return (1 - coverage).mul_(layers).mul_(2 * log(2))


def splat(tensors: list[Tensor], canvas: Tensor, target: Target, *, in_fours: bool) -> None:
    """Add the layers of (N, M) points, normals, areas, N poses and cameras to a canvas.

    Args:
        tensors: These five.
        canvas: See `Target.canvas`.
        target: What it shows.
        in_fours: By groups of four pixels, as suits GPUs, and not by vectors as suits CPUs.
    """
    if in_fours:
        wp.init()
        pixels = [wp.from_torch(canvas)]
        _launch(kernels.splat_in_fours, SPLAT_THREADS, tensors, canvas, target, pixels)
    else:
        _launch(kernels.splat, SPLAT_THREADS, tensors, canvas, target)


def _launch(
    kernel: Any,
    gpu_threads: int,
    tensors: Any,
    canvas: Tensor,
    target: Target,
    outputs: list[Any] | None = None,
) -> None:
    """Nothing is allocated or waited for here, so a CUDA graph can capture it."""
    wp.init()
    *surface, pose, K = tensors
    threads = min(gpu_threads, max(1, surface[0].shape[1])) if canvas.is_cuda else 1
    wp.launch(
        kernel,
        dim=(pose.shape[0], threads),
        inputs=[
            wp.from_torch(pose, dtype=wp.mat44),
            wp.from_torch(K, dtype=wp.mat33),
            _surface(surface),
            _canvas(canvas, target),
            threads,
            *(outputs or []),
        ],
        device=wp.device_from_torch(canvas.device),
        stream=_current_stream(canvas.device) if canvas.is_cuda else None,
    )


def _current_stream(device: torch.device) -> Any:
    """Torch's stream, for Warp to launch on: during a capture the one that is captured."""
    return _stream(torch.cuda.current_stream(device).cuda_stream, device)


@cache
def _stream(handle: int, device: torch.device) -> Any:
    return wp.Stream(wp.device_from_torch(device), cuda_stream=handle)


def _surface(tensors: Any) -> Any:
    surface = kernels.Surface()
    points, normals, areas = tensors
    surface.points = wp.from_torch(points, dtype=wp.vec3)
    surface.normals = wp.from_torch(normals, dtype=wp.vec3)
    surface.areas = wp.from_torch(areas)
    return surface


def _canvas(canvas: Tensor, target: Target) -> Any:
    """The canvas as overlapping vectors: one starts at every pixel."""
    result = kernels.Canvas()
    result.rows = wp.array(
        ptr=canvas.data_ptr(),
        dtype=kernels.taps,
        shape=(canvas.shape[0] - TAPS + 1,),
        strides=(canvas.element_size(),),
        device=wp.device_from_torch(canvas.device),
    )
    result.height, result.width, result.margin = target.height, target.width, target.margin
    result.radius, result.near = target.radius, MIN_DEPTH
    return result
