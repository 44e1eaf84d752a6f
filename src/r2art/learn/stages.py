"""Which stage of the cascade every sample was in, over a training run."""

import json
from pathlib import Path

import numpy as np
from jaxtyping import Int
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray
from torch import Tensor

from r2art.data.shards import write_atomically

LOG = "stages.jsonl"
PICTURE = "stages.png"
COLOURS = ("#d9d9d9", "#d55e00", "#f0c419", "#009e73")
"""Not met yet, stages I, II and III."""
MOST_ROWS, COLUMNS = 400, 300


class StageLog:
    """Appends one line per step to ``stages.jsonl``: which samples were met, at which stage."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._met: list[tuple[int, str, Tensor, Tensor]] = []

    def add(self, step: int, name: str, index: Int[Tensor, " B"], stage: Int[Tensor, " B"]) -> None:
        """Note the stages of the samples ``index`` of a category."""
        self._met.append((step, name, index, stage))

    def write(self) -> None:
        """Write what was noted since the last time."""
        if self._met:
            with (self._folder / LOG).open("a") as f:
                f.writelines(_line(*met) for met in self._met)
        self._met = []


def _line(step: int, name: str, index: Tensor, stage: Tensor) -> str:
    stages = "".join(map(str, stage.tolist()))
    entry = {"step": step, "category": name, "samples": index.tolist(), "stages": stages}
    return json.dumps(entry) + "\n"


def read_stages(folder: Path) -> dict[str, NDArray[np.int64]]:
    """(N, 3) step, sample and stage of everything noted, by category, in the order of steps."""
    if not (folder / LOG).exists():
        return {}
    found: dict[str, list[tuple[int, int, int]]] = {}
    for line in (folder / LOG).read_text().splitlines():
        e = json.loads(line)
        pairs = zip(e["samples"], e["stages"], strict=True)
        found.setdefault(e["category"], []).extend((e["step"], i, int(s)) for i, s in pairs)
    return {name: np.array(rows) for name, rows in sorted(found.items())}


def forget_stages_after(folder: Path, step: int) -> None:
    """Drop the lines of later steps: a resumed run writes them again."""
    if (folder / LOG).exists():
        lines = (folder / LOG).read_text().splitlines(keepends=True)
        kept = [line for line in lines if json.loads(line)["step"] <= step]
        write_atomically(folder / LOG, "".join(kept).encode())


def history(
    rows: NDArray[np.int64], samples: NDArray[np.int64], columns: int = COLUMNS
) -> NDArray[np.int64]:
    """(samples, columns) the stage each sample was last seen in, over time; 0 before the first.

    Args:
        rows: Step, sample and stage, in the order of steps.
        samples: Which ones, ascending.
        columns: Equal spans of time from the first step to the last.
    """
    first, last = rows[0, 0], rows[-1, 0]
    rows = rows[np.isin(rows[:, 1], samples)]
    column = (rows[:, 0] - first) * (columns - 1) // max(1, last - first)
    table = np.zeros((len(samples), columns), np.int64)
    for row, at, stage in zip(
        np.searchsorted(samples, rows[:, 1]), column, rows[:, 2], strict=True
    ):
        table[row, at:] = stage
    return table


def plot_stages(folder: Path) -> None:
    """Draw, per category, a line per sample in the colour of its stage, and how many are where.

    Lines are sorted by how long their samples took. Of very many samples every k-th is shown.
    """
    logged = read_stages(folder)
    if not logged:
        return
    figure = Figure(figsize=(10, 5.4 * len(logged)), layout="constrained")
    panels = figure.subplots(2 * len(logged), 1, height_ratios=[1, 3] * len(logged), squeeze=False)
    for (name, rows), (above, below) in zip(
        logged.items(), panels.reshape(-1, 2).tolist(), strict=True
    ):
        samples = np.unique(rows[:, 1])
        table = history(rows, samples[:: -(-len(samples) // MOST_ROWS)])
        table = table[np.argsort(table.sum(axis=1), kind="stable")]
        span = (int(rows[0, 0]) - 1, int(rows[-1, 0]))
        steps = np.linspace(*span, table.shape[1])
        shares = [(table == s).mean(axis=0) for s in range(4)]
        labels = ("not met yet", "stage I", "stage II", "stage III")
        above.stackplot(steps, shares, colors=COLOURS, labels=labels)
        above.set(title=f"{name}: cascade stages", xlim=span, ylim=(0, 1), ylabel="share")
        above.legend(loc="upper left", ncols=4, fontsize=7)
        colours = ListedColormap(list(COLOURS))
        extent = (*span, len(table), 0)
        below.imshow(
            table, aspect="auto", cmap=colours, vmin=0, vmax=3, extent=extent, interpolation="none"
        )
        below.set(xlabel="step", ylabel="samples")
    figure.savefig(folder / PICTURE, dpi=80)
