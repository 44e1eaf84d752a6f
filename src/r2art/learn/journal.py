"""A run's diary: mean losses as lines of JSON, and a picture of their curves."""

import json
import time
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl

from r2art.data.shards import write_atomically

LOG = "log.jsonl"
CURVES = "losses.png"


class Journal:
    """Averages every loss between two lines of the log of the run in ``folder``."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._begin()

    def _begin(self) -> None:
        self._seen: dict[str, list[float]] = defaultdict(list)
        self._since = time.perf_counter()

    def add(self, terms: Mapping[str, float]) -> None:
        """Note the losses of one step."""
        for name, value in terms.items():
            self._seen[name].append(value)

    def means(self) -> dict[str, float]:
        """Means over the steps since the last line that had the loss at all."""
        return {name: sum(values) / len(values) for name, values in self._seen.items()}

    def write(self, step: int) -> None:
        """Append the means as a line, and begin anew."""
        entry = {"step": step, "seconds": time.perf_counter() - self._since, **self.means()}
        with (self._folder / LOG).open("a") as f:
            f.write(_line(entry))
        self._begin()


def _line(entry: dict[str, Any]) -> str:
    rounded = {k: round(v, 5) if isinstance(v, float) else v for k, v in entry.items()}
    return json.dumps(rounded) + "\n"


def read_log(folder: Path) -> list[dict[str, Any]]:
    """The lines of a run's log, oldest first; none where there is no log."""
    if not (folder / LOG).exists():
        return []
    return [json.loads(line) for line in (folder / LOG).read_text().splitlines()]


def forget_after(folder: Path, step: int) -> None:
    """Drop the lines a killed run has written after its last checkpoint: they will come again."""
    kept = [entry for entry in read_log(folder) if entry["step"] <= step]
    if (folder / LOG).exists():
        write_atomically(folder / LOG, "".join(map(_line, kept)).encode())


def plot_losses(folder: Path) -> None:
    """Draw every logged loss over the steps."""
    entries = read_log(folder)
    names = sorted({k for e in entries for k in e} - {"step", "seconds"})
    if not names:
        return
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    columns = 4
    rows = -(-len(names) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(4 * columns, 2.6 * rows), squeeze=False)
    figure.subplots_adjust(0.05, 0.05, 0.98, 0.95, wspace=0.3, hspace=0.4)
    for axis, name in zip(axes.flat, names, strict=False):
        steps, values = zip(*[(e["step"], e[name]) for e in entries if name in e], strict=True)
        axis.plot(steps, values, linewidth=1)
        axis.set_title(name, fontsize=9)
        if min(values) > 0 and not name.startswith("stage"):
            axis.set_yscale("log")
    for axis in axes.flat[len(names) :]:
        axis.axis("off")
    figure.savefig(folder / CURVES, dpi=80)
    plt.close(figure)
