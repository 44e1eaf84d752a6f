"""Predict every photo of a dataset and compare with its labels."""

import itertools
from dataclasses import dataclass
from typing import Any, Protocol

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from r2art.core.category import Category
from r2art.core.errors import InputError, UsageError
from r2art.core.prediction import Prediction
from r2art.data.sample import Sample
from r2art.data.shards import Dataset, from_row
from r2art.learn.scores import Scores, score, stack

WORST = 20


class Predict(Protocol):
    """How the evaluation asks for a prediction.

    With ``given_box`` the 2D box and the category are told, otherwise the model has to find
    them; the camera is always told. `InputError`, `UsageError` and None count as failures.
    """

    def __call__(self, sample: Sample, given_box: bool) -> Prediction | None:
        """Predict one photo."""
        ...


@dataclass(frozen=True)
class Case:
    """One photo, what was predicted with box and category given, and how wrong that is."""

    index: int
    sample: Sample
    prediction: Prediction | None
    scores: Scores

    @property
    def badness(self) -> float:
        """Mean ADD over the parts, aligned, in units of the diagonal; inf for failures."""
        return float(self.scores.aligned.mean() / self.scores.diagonal)


@dataclass(frozen=True)
class Report:
    """The outcome of an evaluation of N photos.

    Attributes:
        category: The dataset's category.
        manifest: What the dataset says of itself.
        indices: N indices of the photos in the dataset.
        given: (N, ...) scores with box and category given.
        found: (N, ...) scores with neither given.
        messages: N reasons for a failure with box and category given, empty where none.
        worst: The worst cases, worst first.
    """

    category: Category
    manifest: dict[str, Any]
    indices: tuple[int, ...]
    given: Scores
    found: Scores
    messages: tuple[str, ...]
    worst: tuple[Case, ...]


def evaluate(dataset: Dataset, predict: Predict, limit: int | None = None) -> Report:
    """Predict and score the first ``limit`` photos of a dataset (all by default).

    Raises:
        InputError: Not a single photo could be predicted.
    """
    n = len(dataset) if limit is None else min(limit, len(dataset))
    if n < 1:
        raise UsageError(f"nothing to evaluate with a limit of {limit}; give at least 1")
    given, found, indices, messages = [], [], [], []
    worst: list[Case] = []
    with _progress() as progress:
        task = progress.add_task(f"{dataset.category.name} eval", total=n)
        for row in itertools.islice(dataset.rows(), n):
            sample = from_row(row)
            prediction, message = _attempt(predict, sample, given_box=True)
            by_itself, _ = _attempt(predict, sample, given_box=False)
            given.append(score(sample, dataset.category, prediction))
            found.append(score(sample, dataset.category, by_itself))
            indices.append(row["index"])
            messages.append(message)
            case = Case(row["index"], sample, prediction, given[-1])
            worst = sorted([*worst, case], key=lambda c: -c.badness)[:WORST]
            progress.advance(task)
    if all(messages):
        raise InputError(f"no photo could be predicted; the first says: {messages[0]}")
    return Report(
        category=dataset.category,
        manifest=dataset.manifest,
        indices=tuple(indices),
        given=stack(given),
        found=stack(found),
        messages=tuple(messages),
        worst=tuple(worst),
    )


def _attempt(predict: Predict, sample: Sample, given_box: bool) -> tuple[Prediction | None, str]:
    try:
        prediction = predict(sample, given_box)
    except (InputError, UsageError) as error:
        return None, str(error)
    return prediction, "" if prediction else "no prediction"


def _progress() -> Progress:
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    return Progress(*columns, TimeRemainingColumn(), console=Console(stderr=True))
