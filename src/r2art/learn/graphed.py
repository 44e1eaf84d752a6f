"""Steps as CUDA graphs: thousands of small operations that the CPU no longer launches one by one.

A graph repeats the same operations on the same memory. So every step must be made alike: crops of
all categories, none of whose features are kept, and without the cascade, whose capture fails for a
reason not yet found.
"""

import math
from collections.abc import Iterator
from dataclasses import fields

import torch
from torch import Tensor
from torch.optim import Optimizer

from r2art.learn.batches import Ahead, Batch
from r2art.learn.step import Done, Passed, Steps, done

EAGER = 3
"""Steps before a graph is made: what is loaded and chosen at first use must be there."""


def is_alike(steps: Steps) -> bool:
    """Whether all steps of a run on one GPU are made of the same operations."""
    return (
        steps.accelerator.device.type == "cuda"
        and steps.accelerator.num_processes == 1
        and steps.offline is None
        and steps.batches.recipe.groups >= len(steps.batches.photos)
        and steps.batches.recipe.cascade_from is None
    )


class GraphedSteps:
    """`Steps` that are replayed.

    Args:
        steps: What to graph, see `is_alike`; its optimiser must be capturable.
    """

    def __init__(self, steps: Steps) -> None:
        self._steps = steps
        self._optimizer: Optimizer = getattr(steps.optimizer, "optimizer", steps.optimizer)
        self._stream = torch.cuda.Stream()
        self._taken = 0
        self._graph: torch.cuda.CUDAGraph | None = None
        self._batch: Batch | None = None
        self._passed: Passed | None = None
        broken = torch.zeros((), device=steps.accelerator.device)
        self._optimizer.found_inf = broken  # pyright: ignore[reportAttributeAccessIssue]

    def __call__(self, step: int, time_share: float = 0.0) -> Done | None:
        """Take one step, as `Steps` does."""
        steps = self._steps
        steps.set_rates(step, time_share)
        batch = steps.batches(step)
        if self._taken < EAGER:
            self._taken += 1
            passed = self._aside(batch)
        else:
            passed = self._replayed(batch)
        norm, *means = steps.read(passed.numbers)
        if not math.isfinite(norm):
            return None
        return done(batch, passed, means)

    def _aside(self, batch: Batch) -> Passed:
        """A step as it is, on the stream that will capture."""
        self._stream.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(self._stream):
            passed = self._step(batch)
        torch.cuda.current_stream().wait_stream(self._stream)
        return passed

    def _replayed(self, batch: Batch) -> Passed:
        if self._graph is None:
            self._capture(batch)
        assert self._graph is not None
        assert self._batch is not None
        assert self._passed is not None
        for kept, new in zip(_tensors(self._batch), _tensors(batch), strict=True):
            kept.copy_(new)
        self._graph.replay()
        return self._passed

    def _capture(self, batch: Batch) -> None:
        if isinstance(self._steps.batches, Ahead):
            self._steps.batches.rest()
        torch.cuda.synchronize()
        self._batch, graph = batch, torch.cuda.CUDAGraph()
        with torch.cuda.graph(graph, stream=self._stream):
            self._passed = self._step(batch)
        self._graph = graph

    def _step(self, batch: Batch) -> Passed:
        """All of a step; what was not finite changes nothing."""
        model = self._steps.model
        model.train()
        buffers = [(b, b.clone()) for b in model.buffers()]
        passed = self._steps.passed(batch, None)
        broken = ~torch.isfinite(passed.numbers[0])
        self._optimizer.found_inf.copy_(broken)  # pyright: ignore[reportAttributeAccessIssue]
        self._optimizer.step()
        for buffer, old in buffers:
            buffer.copy_(torch.where(broken, old, buffer))
        return passed


def _tensors(batch: Batch) -> Iterator[Tensor]:
    """What a step reads of a batch; not the photos' numbers, which stay on the CPU."""
    for part in (*batch.crops.values(), batch.views):
        for f in fields(part):
            if f.name != "index":
                yield getattr(part, f.name)
    yield batch.category
