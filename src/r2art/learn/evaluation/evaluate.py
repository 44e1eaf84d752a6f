"""Predict every photo of a dataset and compare with its labels."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

from r2art.core.category import Category
from r2art.core.errors import InputError, UsageError
from r2art.core.prediction import Prediction
from r2art.data.sample import Sample
from r2art.data.source import Fault
from r2art.learn.evaluation.scores import Scores, score, stack
from r2art.learn.evaluation.testsets import TestSet

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
        return float(self.scores.add_aligned.mean() / self.scores.diagonal)


@dataclass(frozen=True)
class Mode:
    """Every photo predicted in one way.

    Attributes:
        scores: (N, ...) of N photos.
        predictions: N predictions, without their photos.
        messages: N reasons for a failure, empty where none.
    """

    scores: Scores
    predictions: tuple[Prediction | None, ...]
    messages: tuple[str, ...]


@dataclass(frozen=True)
class Report:
    """The outcome of an evaluation of N photos.

    Attributes:
        test: The dataset.
        indices: N indices of the photos in the dataset.
        given: With box and category given.
        found: With neither given.
        worst: The worst cases with box and category given, worst first.
        broken: What is wrong with the samples that could not be read; they are not among the N.
    """

    test: TestSet
    indices: tuple[int, ...]
    given: Mode
    found: Mode
    worst: tuple[Case, ...]
    broken: tuple[str, ...]

    @property
    def name(self) -> str:
        """Of the dataset."""
        return self.test.name

    @property
    def category(self) -> Category:
        """The dataset's category."""
        return self.test.source.category


def count(test: TestSet, limit: int | None) -> int:
    """How many photos an evaluation with this limit predicts.

    Raises:
        UsageError: Not one.
    """
    n = len(test.source) if limit is None else min(limit, len(test.source))
    if n < 1:
        raise UsageError(
            f"nothing to evaluate: {test.name} has {len(test.source)} photos, and the limit is "
            f"{limit}; at least 1 is needed"
        )
    return n


def evaluate(
    test: TestSet,
    predict: Predict,
    limit: int | None = None,
    advance: Callable[[], None] = lambda: None,
) -> Report:
    """Predict and score the first ``limit`` photos of a dataset (all by default).

    Args:
        test: The dataset.
        predict: See `Predict`.
        limit: Only so many photos.
        advance: Called after each photo.

    Raises:
        InputError: Not a single photo could be read, or predicted.
    """
    category = test.source.category
    given, found = _Tally(category, predict, True), _Tally(category, predict, False)
    indices: list[int] = []
    broken: list[str] = []
    worst: list[Case] = []
    for index in range(count(test, limit)):
        try:
            sample = test.source[index]
        except Fault as fault:
            broken.append(str(fault))
        else:
            indices.append(index)
            found.add(sample)
            worst.append(Case(index, sample, *given.add(sample)))
            worst = sorted(worst, key=lambda case: -case.badness)[:WORST]
        advance()
    if not indices:
        raise InputError(f"no photo of {test.name} can be read; the first says: {broken[0]}")
    if all(given.messages) and all(found.messages):
        raise InputError(f"no photo could be predicted; the first says: {given.messages[0]}")
    return Report(
        test=test,
        indices=tuple(indices),
        given=given.mode(),
        found=found.mode(),
        worst=tuple(worst),
        broken=tuple(broken),
    )


class _Tally:
    """Predictions of one mode, as they come."""

    def __init__(self, category: Category, predict: Predict, given_box: bool) -> None:
        self.category = category
        self.predict = predict
        self.given_box = given_box
        self.scores: list[Scores] = []
        self.predictions: list[Prediction | None] = []
        self.messages: list[str] = []

    def add(self, sample: Sample) -> tuple[Prediction | None, Scores]:
        """Predict and score one photo; those are returned."""
        begin = time.perf_counter()
        prediction, message = self._attempt(sample)
        seconds = time.perf_counter() - begin
        self.predictions.append(prediction)
        self.messages.append(message)
        self.scores.append(score(sample, self.category, prediction, seconds))
        return prediction, self.scores[-1]

    def _attempt(self, sample: Sample) -> tuple[Prediction | None, str]:
        try:
            prediction = self.predict(sample, self.given_box)
        except (InputError, UsageError) as error:
            return None, str(error)
        if prediction is None:
            return None, "no prediction"
        taken_for = prediction.category
        message = f"taken for a {taken_for}" if taken_for != self.category.name else ""
        return replace(prediction, photo=None), message

    def mode(self) -> Mode:
        """All of them."""
        return Mode(stack(self.scores), tuple(self.predictions), tuple(self.messages))
