"""Times on a GPU: eager and as CUDA graphs, and the two ceilings of the card they ran on."""

from collections.abc import Callable, Sequence
from math import ceil
from statistics import median

import torch
from torch import Tensor

DEVICE = "cuda"
LEAST_MS = 4.0
"""Between two events there are as many runs as take this long."""
MOST_RUNS = 1000

Run = Callable[[], object]


def milliseconds(runs: Sequence[Run], rounds: int) -> float:
    """Median device time of one run; they take turns, so that no cache holds what they read."""
    for run in runs:
        run()
    once = _elapsed(runs, len(runs))
    count = min(MOST_RUNS, len(runs) * max(1, ceil(LEAST_MS / (once * len(runs)))))
    return median(_elapsed(runs, count) for _ in range(rounds))


def _elapsed(runs: Sequence[Run], count: int) -> float:
    """Milliseconds per run of ``count`` runs, by events."""
    begin, end = (torch.cuda.Event(enable_timing=True) for _ in range(2))
    torch.cuda.synchronize()
    begin.record()
    for i in range(count):
        runs[i % len(runs)]()
    end.record()
    torch.cuda.synchronize()
    return begin.elapsed_time(end) / count


def graphed(run: Run) -> Run:
    """``run`` as a CUDA graph: its kernels alone, without what the host does to launch them.

    It is run before on the stream that captures, so that nothing is compiled or loaded then. What
    ``run`` reads must stay where it is, so it is kept.
    """
    stream = torch.cuda.Stream()
    stream.wait_stream(torch.cuda.current_stream())
    with torch.cuda.stream(stream):
        for _ in range(3):
            run()
    torch.cuda.synchronize()
    graph = torch.cuda.CUDAGraph()
    with torch.cuda.graph(graph, stream=stream):
        run()
    torch.cuda.synchronize()

    def replay(_kept: Run = run) -> None:
        graph.replay()

    return replay


def ceilings(rounds: int) -> dict[str, float]:
    """What the card does at best: a copy of 1 GiB (bytes read and written), products of 8192².

    Returns:
        ``copy`` in byte/s; ``bfloat16``, ``TF32`` and ``float32`` in flop/s.
    """
    found = {"copy": _copied(rounds)}
    for name, dtype in (("bfloat16", torch.bfloat16), ("TF32", None), ("float32", torch.float32)):
        found[name] = _multiplied(dtype, rounds)
        torch.cuda.empty_cache()
    return found


def _copied(rounds: int) -> float:
    source = torch.rand(2**28, device=DEVICE)
    target = torch.empty_like(source)
    moved = 2 * source.numel() * source.element_size()
    return 1e3 * moved / milliseconds([lambda: target.copy_(source)], rounds)


def _multiplied(dtype: torch.dtype | None, rounds: int) -> float:
    """For None float32 by the tensor units."""
    size = 8192
    a, b = (torch.randn(size, size, device=DEVICE).to(dtype or torch.float32) for _ in range(2))

    def product() -> Tensor:
        return a @ b

    return 2e3 * size**3 / milliseconds([product if dtype else tf32(product)], rounds)


def tf32(run: Run) -> Run:
    """``run`` with matrix products by the tensor units, which round their operands to 10 bits."""

    def faster() -> object:
        before = torch.get_float32_matmul_precision()
        torch.set_float32_matmul_precision("high")
        try:
            return run()
        finally:
            torch.set_float32_matmul_precision(before)

    return faster


def eager_and_graph(
    make: Callable[[], Run],
    sets: int,
    rounds: int,
    failures: list[str],
    what: str,
    only: str | None = None,
) -> dict[str, float]:
    """Milliseconds of runs on ``sets`` sets of inputs, by either way that does not fail."""
    found = {}
    for way in (only,) if only else ("eager", "graph"):
        try:
            runs = [make() for _ in range(sets)]
            if way == "graph":
                runs = [graphed(run) for run in runs]
            found[way] = milliseconds(runs, rounds)
        except Exception as error:
            failures.append(f"{what}, {way}: {in_words(error)}")
        runs = []
        torch.cuda.empty_cache()
    return found


def in_words(error: Exception) -> str:
    """Its kind and the first line of what it says."""
    return f"{type(error).__name__}: {(str(error).splitlines() or [''])[0]}"


def kernels(run: Run, runs: int = 10) -> dict[str, float]:
    """Microseconds on the GPU per run in each kernel, the longest first, with how often it ran."""
    run()
    with torch.profiler.profile(activities=[torch.profiler.ProfilerActivity.CUDA]) as profile:
        for _ in range(runs):
            run()
        torch.cuda.synchronize()
    events = [e for e in profile.key_averages() if e.device_time_total > 0]
    events.sort(key=lambda e: -e.device_time_total)
    return {f"{e.count / runs:g} × {e.key[:80]}": e.device_time_total / runs for e in events}
