"""Silhouettes and the pixel loss: how long do they take, beside other ways and beside a floor?

python benchmarks/silhouette.py                              prints Markdown
python benchmarks/silhouette.py --results docs/results.md    writes the page's section
python benchmarks/silhouette.py --device cuda --json FILE    on a GPU; keeps the figures ...
python benchmarks/silhouette.py --from-json FILE --results docs/results.md     ... for the page

On a CPU all in one run and in turns, so that a busy machine slows all of them; what counts are the
ratios. On a GPU eager and as CUDA graphs, beside a large copy and large matrix products in the same
run; what fails there is named and stops nothing.
"""

import argparse
import json
import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from silhouette_gpu import measure_gpu
from silhouette_report import section
from silhouette_ways import SIZES, on_device, scene, ways
from torch import Tensor

from r2art.learn.results import write_section
from r2art.method import cascade
from r2art.method.silhouette import Silhouettes


def plain_pixel_loss(predicted: Silhouettes, true: Silhouettes) -> Tensor:
    """`cascade.pixel_loss` written down as it is defined."""
    p, target = 1e-4 + (1 - 2e-4) * predicted.parts, true.parts
    entropy = -(target * p.log() + (1 - target) * (1 - p).log())
    omega = cascade.beyond_edge(predicted.parts, target)[..., None, None]
    return ((1 + omega * cascade.edge_band(target)) * entropy).mean((-3, -2, -1))


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


def cpu_times(batch: int, pixels: int, rounds: int) -> dict[str, Any]:
    made = ways(batch, pixels, "cpu")
    f, b = (
        in_turns({name: make(back) for name, make in made.items()}, rounds, "cpu")
        for back in (False, True)
    )
    rows = {name: {"fwd": f[name], "fwd + bwd": b[name]} for name in made}
    return {"batch": batch, "pixels": pixels, "rows": rows}


def loss_times(rounds: int, device: str) -> list[dict[str, Any]]:
    found = []
    for batch, pixels in ((32, 56), (64, 112)):
        losses = {"plain": plain_pixel_loss, "ours": cascade.pixel_loss}
        contenders = {k: pixel_losses(f, batch, pixels, device) for k, f in losses.items()}
        found.append({"batch": batch, "pixels": pixels, **in_turns(contenders, rounds, device)})
    return found


def step_times(rounds: int, device: str) -> dict[str, float]:
    """The cascade's two renderings, losses and gradients beside the trunk's."""
    import timm

    from r2art.learn.recipes import tiny

    recipe = tiny()
    pixels, batch = recipe.cascade_pixels, recipe.crops
    every = (112 // pixels) ** 2
    shape, pose, K = scene(batch, pixels, parts=2)
    thin = {k: getattr(shape, k)[:, ::every] for k in ("points", "normals", "areas")}
    thin["areas"] = thin["areas"] * every
    shape = on_device(replace(shape, **thin), device)
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

    parts = {"cascade": cascade_part, "trunk": trunk_part}
    return in_turns(parts, max(3, rounds // 4), device)


def measure_cpu(rounds: int) -> dict[str, Any]:
    return {
        "device": "cpu",
        "rounds": rounds,
        "tables": [cpu_times(batch, pixels, rounds) for batch, pixels in SIZES],
        "losses": loss_times(rounds, "cpu"),
        "step": step_times(rounds, "cpu"),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description="Benchmark silhouettes and their losses.")
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--device", default="cpu", choices=["cpu", "cuda"])
    parser.add_argument("--tune", action="store_true", help="on a GPU: the best settings first")
    parser.add_argument("--json", type=Path, help="write the figures")
    parser.add_argument("--from-json", type=Path, help="read the figures, measure nothing")
    parser.add_argument("--results", type=Path, help="write the section on silhouettes")
    args = parser.parse_args()
    torch.set_num_threads(1)
    torch.manual_seed(0)

    def keep(found: dict[str, Any]) -> None:
        if args.json:
            args.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")

    if args.from_json:
        found = json.loads(args.from_json.read_text(encoding="utf-8"))
    elif args.device == "cuda":
        others = {
            "losses": lambda: loss_times(args.rounds, "cuda"),
            "step": lambda: step_times(args.rounds, "cuda"),
        }
        found = measure_gpu(args.rounds, keep, others, tuned=args.tune)
    else:
        found = measure_cpu(args.rounds)
    keep(found)
    flags = " --device cuda" if found["device"] == "cuda" else ""
    flags += " --tune" if "tune" in found else ""
    text = section(found, f"python benchmarks/silhouette.py --rounds {found['rounds']}{flags}")
    print(text)
    if args.results:
        name = "silhouette-gpu" if found["device"] == "cuda" else "silhouette"
        write_section(args.results, name, text)
    for name in ("tune", "kernels"):
        for what, times in found.get(name, {}).items():
            print(what, json.dumps(times, indent=1))


if __name__ == "__main__":
    main()
