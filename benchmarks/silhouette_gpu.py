"""Silhouettes on a GPU: their errors, and times eager and as CUDA graphs."""

import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import gpu
import torch
import warp as wp
from silhouette_ways import MESH, OURS, PLAIN, POINTS, SIZES, Render, on_device, scene, ways
from torch import Tensor

from r2art.method import silhouette_fast
from r2art.method.silhouette import fast_silhouettes, plain_silhouettes

GPU_SIZES = (*SIZES, (1024, 112))
"""Batch and pixels; the last fills a large GPU."""
THREADS = (64, 128, 256, 512, 1024, 2048)
"""Per image, to choose from."""
CACHE = 100e6
"""Bytes that no GPU's cache holds: sets of inputs and outputs take turns until they are as many."""
Keep = Callable[[dict[str, Any]], None]


def measure_gpu(
    rounds: int, keep: Keep, others: dict[str, Callable[[], Any]], *, tuned: bool
) -> dict[str, Any]:
    """All figures of a GPU.

    Args:
        rounds: Of which the median is taken.
        keep: Gets the figures there are after each stage.
        others: Further stages.
        tuned: Whether to find the best settings first.
    """
    failures: list[str] = []
    found: dict[str, Any] = {
        "device": "cuda",
        "rounds": rounds,
        "name": torch.cuda.get_device_name(),
        "versions": {"torch": torch.__version__, "Warp": wp.__version__},
        "failures": failures,
        "tables": [],
    }
    stages: dict[str, Callable[[], Any]] = {
        "differences": partial(differences, 5, gpu.DEVICE),
        "replay": replay_difference,
        "ceilings": partial(gpu.ceilings, rounds),
    }
    if tuned:
        stages["tune"] = partial(tune, rounds, failures)
        stages["differences, tuned"] = stages["differences"]
    for batch, pixels in GPU_SIZES:
        stages[f"{batch}, {pixels}²"] = partial(gpu_times, batch, pixels, rounds, failures)
    if tuned:
        stages["kernels"] = kernels
    stages |= others
    for name, stage in stages.items():
        start = time.perf_counter()
        try:
            result = stage()
        except Exception as error:
            failures.append(f"{name}: {gpu.in_words(error)}")
        else:
            if getattr(stage, "func", None) is gpu_times:
                found["tables"].append(result)
            else:
                found[name] = result
        print(f"{name}: {time.perf_counter() - start:.1f} s", file=sys.stderr, flush=True)
        keep(found)
    return found


def gpu_times(batch: int, pixels: int, rounds: int, failures: list[str]) -> dict[str, Any]:
    rows: dict[str, dict[str, float]] = {}
    for name, make in ways(batch, pixels, gpu.DEVICE).items():
        rows[name] = {}
        for column, back in (("fwd", False), ("fwd + bwd", True)):
            what = f"{name}, batch {batch}, {pixels}², {column}"
            times = gpu.eager_and_graph(
                partial(make, back), sets(batch, pixels), rounds, failures, what,
                only="eager" if name == MESH else None,
            )  # fmt: skip
            rows[name] |= {f"{column}, {way}": t for way, t in times.items()}
    return {"batch": batch, "pixels": pixels, "rows": rows}


def sets(batch: int, pixels: int) -> int:
    """How many sets of inputs take turns, so that they and their silhouettes exceed the cache."""
    return max(1, round(CACHE / least(batch, pixels, back=True)[0]))


def least(batch: int, pixels: int, *, back: bool) -> tuple[float, float]:
    """The fewest bytes and operations that any way needs, as everything is float32.

    Bytes, with every input read and every output written once per pass: the surface's 28 per
    point (place, normal, area; all images share it), 100 of a pose and a camera per image, 8 per
    pixel for its coverage by part and by union. Going back: the surface, poses and cameras again,
    4 per pixel for the gradient, 12 per point and 64 per pose for what comes out.

    Operations, per point: posing 33, projecting 6, square pixels 11; the kernel's 5 + 5 values 50
    and 5 of them weighted; 25 products that are added, 50. Going back: the first 100 again, three
    sums over the taps 130, to the camera frame 40, to the point 15 and to the pose 39. Per pixel:
    4 for each coverage, 4 for its slope.
    """
    points, images, area = batch * POINTS, batch, batch * pixels**2
    moved, done = 28 * POINTS + 100 * images + 8 * area, 155 * points + 8 * area
    if back:
        moved += 40 * POINTS + 164 * images + 4 * area
        done += 324 * points + 4 * area
    return float(moved), float(done)


def differences(rounds: int, device: str) -> dict[str, dict[str, float]]:
    """Greatest differences of both forms in float32 to `plain_silhouettes` in double precision.

    Fresh inputs in every round. Coverage: absolute; gradients: of the greatest one there.
    """
    found: dict[str, dict[str, float]] = {OURS: {}, PLAIN: {}}
    size = (112, 96)
    for _ in range(rounds):
        given = scene(8, 112, parts=2)
        weights = torch.randn(8, 2, *size, device=device), torch.randn(8, *size, device=device)
        true = graded(plain_silhouettes, given, weights, size, device, torch.float64)
        for way, render in ((OURS, fast_silhouettes), (PLAIN, plain_silhouettes)):
            seen = graded(render, given, weights, size, device, torch.float32)
            for name, expected in true.items():
                scale = expected.abs().amax() if name.startswith("gradient") else 1.0
                by = ((seen[name].double() - expected).abs().amax() / scale).item()
                found[way][name] = worse(by, found[way].get(name, 0.0))
    return found


def worse(a: float, b: float) -> float:
    """The greater of two errors; not a number is the worst."""
    return a if a != a or a > b else b


def graded(
    render: Render, given: Any, weights: Any, size: tuple[int, int], device: str, dtype: torch.dtype
) -> dict[str, Tensor]:
    """Silhouettes, and the gradients of their weighted sum in all that has any."""
    shape, pose, K = given
    shape, pose = on_device(shape, device, dtype), pose.to(device, dtype, copy=True)
    inputs = {"pose": pose, **{k: getattr(shape, k) for k in ("points", "normals", "areas")}}
    for tensor in inputs.values():
        tensor.requires_grad_()
    seen = render(shape, pose, K.to(device, dtype), size)
    total = (seen.parts * weights[0].to(dtype)).sum() + (seen.union * weights[1].to(dtype)).sum()
    gradients = torch.autograd.grad(total, list(inputs.values()))
    named = {f"gradient in {k}": g for k, g in zip(inputs, gradients, strict=True)}
    return {"parts": seen.parts.detach(), "union": seen.union.detach(), **named}


def replay_difference() -> float:
    """Greatest difference of a replayed graph, its inputs new, to the same without a graph.

    Of coverage, and of the pose's gradient as a share of the greatest one there.
    """
    shape, pose, K = scene(8, 112)
    shape, pose, K = on_device(shape, gpu.DEVICE), pose.to(gpu.DEVICE), K.to(gpu.DEVICE)
    pose.requires_grad_()
    weight = torch.rand(8, 1, 112, 112, device=gpu.DEVICE)
    seen, gradient = torch.empty_like(weight), torch.empty_like(pose)

    def run() -> None:
        parts = fast_silhouettes(shape, pose, K, (112, 112)).parts
        seen.copy_(parts.detach())
        gradient.copy_(torch.autograd.grad((parts,), (pose,), (weight,))[0])

    replay = gpu.graphed(run)
    with torch.no_grad():
        pose.copy_(scene(8, 112)[1])
        weight.copy_(torch.rand_like(weight))
        for written in (seen, gradient):
            written.fill_(float("nan"))
    replay()
    found = seen.clone(), gradient.clone()
    run()
    scales = 1.0, gradient.abs().amax()
    both = zip(found, (seen, gradient), scales, strict=True)
    return worse(*(((a - b).abs().amax() / scale).item() for a, b, scale in both))


def tune(rounds: int, failures: list[str]) -> dict[str, Any]:
    """Milliseconds as graphs for each setting of `silhouette_fast`; the best one stays set.

    One setting after the other, by the mean over all sizes of the time beside the best one's.
    """
    found: dict[str, Any] = {}
    for setting, back, values in (
        ("IN_FOURS", False, (True, False)),
        ("SPLAT_THREADS", False, THREADS),
        ("ADJOINT_THREADS", True, THREADS),
    ):
        by_value: dict[Any, list[float]] = {}
        for value in values:
            setattr(silhouette_fast, setting, value)
            by_value[value] = [
                gpu.eager_and_graph(
                    partial(ways(batch, pixels, gpu.DEVICE)[OURS], back),
                    sets(batch, pixels),
                    rounds,
                    failures,
                    f"{setting} {value}, batch {batch}, {pixels}²",
                    only="graph",
                ).get("graph", float("inf"))
                for batch, pixels in GPU_SIZES
            ]
        least = [min(times) for times in zip(*by_value.values(), strict=True)]

        def excess(value: Any, by_value: Any = by_value, least: Any = least) -> float:
            return sum(t / best for t, best in zip(by_value[value], least, strict=True))

        best = min(by_value, key=excess)
        setattr(silhouette_fast, setting, best)
        found[setting] = {"ms": {str(k): v for k, v in by_value.items()}, "best": best}
    return found


def kernels() -> dict[str, dict[str, float]]:
    """Microseconds of every kernel of a render and its gradient, by the profiler."""
    found = {}
    for batch, pixels in GPU_SIZES:
        run = ways(batch, pixels, gpu.DEVICE)[OURS](True)
        found[f"batch {batch}, {pixels}²"] = gpu.kernels(run)
    return found
