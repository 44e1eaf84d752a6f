"""What a model is measured on: datasets of any kind, and benchmarks made of many."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from r2art.core.errors import InputError
from r2art.data.adapters import open_source
from r2art.data.benchmark import manifest
from r2art.data.shards import Dataset
from r2art.data.source import Source


@dataclass(frozen=True)
class TestSet:
    """Labelled photos of one category, and what to call them.

    Attributes:
        name: Of the folder; short, and a good name for a file.
        source: The photos.
        about: What the dataset says of itself; JSON.
        options: Of `r2art eval`, which choose it.
    """

    __test__ = False  # pytest: this is no test

    name: str
    source: Source
    about: dict[str, Any]
    options: str


def open_testsets(
    path: Path, category: str | None = None, split: str | None = None
) -> list[TestSet]:
    """Open a dataset, or all those of a benchmark.

    Args:
        path: A folder of `r2art synth`, of `r2art benchmark make`, or of another dataset that
            `open_source` knows.
        category: Which one, where there are several; of a benchmark, only its.
        split: Which one, where a dataset has several.

    Raises:
        InputError: It is none of them, holds no such category or split, or is not complete.
    """
    if (path / manifest.NAME).exists():
        return _open_benchmark(path, category)
    source = open_source(path, category, split)
    name = path.resolve().name
    if isinstance(source, Dataset):
        return [TestSet(name, source, source.manifest, f"--data {name}")]
    shown = source.category.name
    about = {"category": shown, "source": name, "split": split or "all"}
    options = f"--data {name} --category {shown}" + (f" --split {split}" if split else "")
    return [TestSet("-".join([name, shown, *([split] if split else [])]), source, about, options)]


def _open_benchmark(path: Path, category: str | None) -> list[TestSet]:
    folders = [path / member["folder"] for member in manifest.read_manifest(path)["datasets"]]
    opened = [(folder, Dataset.open(folder)) for folder in folders]
    home = path.resolve().name
    chosen = []
    for folder, dataset in opened:
        if category in (None, dataset.category.name):
            within = folder.relative_to(path)
            options = f"--data {home}/{within.as_posix()}"
            name = "-".join(within.parts)
            chosen.append(TestSet(name, dataset, dataset.manifest, options))
    if not chosen:
        known = ", ".join(sorted({dataset.category.name for _, dataset in opened})) or "nothing"
        raise InputError(f"the benchmark {path} shows no {category or 'dataset'}; it has {known}")
    return chosen
