"""A model's confidence made a probability, of its parts and its joints' states.

`r2art.core.confidence` says what is weighed. The weights of a category are those of least
cross-entropy, pulled towards the identity, so that a few photos, or photos of which all parts are
right, or none, still give weights that can be meant.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import onnx
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import expit

from r2art.core.confidence import Calibration, Weights, log_misfit, log_odds
from r2art.core.errors import InputError, UsageError
from r2art.core.prediction import Prediction
from r2art.data.sample import Sample
from r2art.data.source import Fault
from r2art.learn.evaluation import statistics
from r2art.learn.evaluation.evaluate import count
from r2art.learn.evaluation.scores import score
from r2art.learn.evaluation.testsets import TestSet
from r2art.learn.exported import metadata, with_metadata

FloatArray = NDArray[np.floating]

PULL = 1.0
"""Strength of the pull: a weight that is 1 away from the identity costs half a nat, as much as
0.7 parts of which nothing is known."""
FOLDS = 5
DIGITS = 6
"""Of the weights, behind the point."""


class Predict(Protocol):
    """How photos are predicted: box, category and camera told, confidence the network's own."""

    def __call__(self, sample: Sample, category: str, refined: bool) -> Prediction:
        """Predict one photo, with the usual refinement or with none."""
        ...


@dataclass(frozen=True, kw_only=True)
class Parts:
    """M predicted parts, those of one photo together; or joints, by the parts that they move.

    Attributes:
        photo: (M,) number of the photo.
        confidence: (M,) what the network says.
        right: (M,) which are right, see `r2art.learn.evaluation.scores.Scores`.
        residual: (M,) of the photo's refinement; None: they were not refined.
    """

    photo: NDArray[np.intp]
    confidence: FloatArray
    right: NDArray[np.bool_]
    residual: FloatArray | None

    def chosen(self, which: NDArray[np.bool_]) -> "Parts":
        """Some of them."""
        residual = None if self.residual is None else self.residual[which]
        return Parts(
            photo=self.photo[which],
            confidence=self.confidence[which],
            right=self.right[which],
            residual=residual,
        )


@dataclass(frozen=True, kw_only=True)
class Worth:
    """What confidences are worth.

    Attributes:
        error: Expected calibration error; nan where there are none.
        auroc: Chance that a right part has a higher confidence than a wrong one; nan where all
            are right, or none.
    """

    error: float
    auroc: float

    @classmethod
    def of(cls, confidence: FloatArray, right: NDArray[np.bool_]) -> "Worth":
        """Judge the confidences of some parts as `r2art eval` does."""
        if not right.size or not np.all(np.isfinite(confidence)):
            return cls(error=np.nan, auroc=np.nan)
        return cls(
            error=statistics.calibration_error(confidence, right),
            auroc=statistics.auroc(confidence, right),
        )


@dataclass(frozen=True, kw_only=True)
class Judged:
    """One way to predict, before and after calibration.

    Attributes:
        photos: How many were predicted.
        right: Share of right parts.
        before: Of what the network says.
        after: Of probabilities whose weights were fitted without the photo they speak of.
    """

    photos: int
    right: float
    before: Worth
    after: Worth


@dataclass(frozen=True, kw_only=True)
class Found:
    """The weights for parts or joints, and what they bring.

    Attributes:
        calibration: The weights.
        refined: Of estimates refined as `r2art predict` does; None where none could be.
        plain: Of estimates that are the network's alone.
    """

    calibration: Calibration
    refined: Judged | None
    plain: Judged

    @classmethod
    def of(cls, refined: Parts, plain: Parts) -> "Found":
        """Fit and judge."""
        return cls(
            calibration=Calibration(refined=fit(refined), plain=fit(plain)),
            refined=judge(refined) if refined.photo.size else None,
            plain=judge(plain),
        )


@dataclass(frozen=True, kw_only=True)
class Calibrated:
    """The outcome for one category.

    Attributes:
        category: Its name.
        parts: What was found of its parts ...
        joints: ... and of its joints' states; None where it has no joints.
    """

    category: str
    parts: Found
    joints: Found | None


def calibrate(
    tests: Sequence[TestSet], predict: Predict, advance: Callable[[], None] = lambda: None
) -> tuple[list[Calibrated], list[str]]:
    """Find the weights of every category that the datasets show.

    Args:
        tests: The datasets; several of one category are taken together.
        predict: See `Predict`. `InputError` and `UsageError` leave a photo out.
        advance: Called after each photo.

    Returns:
        A result per category, in the order of the datasets; and what is wrong with the samples
        that could not be read.

    Raises:
        InputError: Of a category no photo could be read, or predicted.
    """
    results, broken = [], []
    for name in dict.fromkeys(test.source.category.name for test in tests):
        of_this = [test for test in tests if test.source.category.name == name]
        refined, plain, faults = _predicted(of_this, predict, advance)
        broken += faults
        parts, joints = (
            [_together(kind, refined=how) for kind, how in ((a, True), (b, False))]
            for a, b in zip(zip(*refined, strict=True), zip(*plain, strict=True), strict=True)
        )
        has_joints = joints[1].photo.size > 0
        results.append(
            Calibrated(
                category=name,
                parts=Found.of(*parts),
                joints=Found.of(*joints) if has_joints else None,
            )
        )
    return results, broken


Both = tuple[Parts, Parts]
"""The parts and the joints of one photo."""


def _predicted(
    tests: Sequence[TestSet], predict: Predict, advance: Callable[[], None]
) -> tuple[list[Both], list[Both], list[str]]:
    """Every photo refined, where it could be, and plain; and the faults of samples."""
    refined, plain = [], []
    broken: list[str] = []
    for test in tests:
        for index in range(count(test, None)):
            try:
                sample = test.source[index]
                with_it = _both(test, sample, predict, refined=True, photo=len(plain))
                without = _both(test, sample, predict, refined=False, photo=len(plain))
            except Fault as fault:
                broken.append(str(fault))
            except (InputError, UsageError) as error:
                broken.append(f"{test.name}, photo {index}: {error}")
            else:
                refined.append(with_it)
                plain.append(without)
            advance()
    if not plain:
        raise InputError(f"no photo of {tests[0].name} can be used; the first says: {broken[0]}")
    return refined, plain, broken


def _both(test: TestSet, sample: Sample, predict: Predict, *, refined: bool, photo: int) -> Both:
    category = test.source.category
    prediction = predict(sample, category.name, refined)
    scores = score(sample, category, prediction)
    fit = prediction.refinement

    def judged(confidence: FloatArray, right: NDArray[np.bool_]) -> Parts:
        return Parts(
            photo=np.full(confidence.shape, photo),
            confidence=confidence,
            right=right,
            residual=None if fit is None else np.full(confidence.shape, fit.residual),
        )

    moved = scores.confidence[1:]  # joint j moves part j + 1
    return judged(scores.confidence, scores.right), judged(moved, scores.state_right)


def _together(parts: Sequence[Parts], *, refined: bool) -> Parts:
    """The parts of several photos as one, if refined, of those that were; there may be none."""
    parts = [p for p in parts if not refined or p.residual is not None]
    none = np.zeros(0)
    residuals = [p.residual for p in parts if p.residual is not None]
    return Parts(
        photo=np.concatenate([none.astype(np.intp), *(p.photo for p in parts)]),
        confidence=np.concatenate([none, *(p.confidence for p in parts)]),
        right=np.concatenate([none.astype(bool), *(p.right for p in parts)]),
        residual=np.concatenate([none, *residuals]) if refined else None,
    )


def fit(parts: Parts) -> Weights:
    """The weights of least cross-entropy, pulled towards the identity (see `PULL`).

    The loss, Σ −log p(right) + ½ `PULL` ‖w − w₀‖², is strictly convex, so there is one minimum.
    """
    columns = [np.ones_like(parts.confidence), log_odds(parts.confidence)]
    if parts.residual is not None:
        columns.append(log_misfit(parts.residual))
    X, y = np.stack(columns, axis=1), parts.right.astype(float)
    identity = np.array([0.0, 1.0, 0.0])[: X.shape[1]]

    def loss(w: FloatArray) -> tuple[float, FloatArray]:
        odds, off = X @ w, w - identity
        value = (np.logaddexp(0, odds) - y * odds).sum() + PULL / 2 * (off**2).sum()
        return float(value), X.T @ (expit(odds) - y) + PULL * off

    found = minimize(loss, identity, jac=True, method="BFGS").x
    bias, slope, misfit = [round(float(w), DIGITS) for w in (*found, 0.0)][:3]
    return Weights(bias=bias, slope=slope, misfit=misfit)


def judge(parts: Parts) -> Judged:
    """What the confidences of at least one part are worth, before and after calibration."""
    return Judged(
        photos=len(np.unique(parts.photo)),
        right=float(parts.right.mean()),
        before=Worth.of(parts.confidence, parts.right),
        after=Worth.of(cross_validated(parts), parts.right),
    )


def cross_validated(parts: Parts) -> FloatArray:
    """(M,) probabilities, each by weights fitted without its photo; nan of a single photo.

    Photos go to the `FOLDS` folds in turn; fewer photos make fewer folds.
    """
    _, photo = np.unique(parts.photo, return_inverse=True)
    folds = min(FOLDS, int(photo.max()) + 1)
    result = np.full(parts.confidence.shape, np.nan)
    if folds < 2:
        return result
    for k in range(folds):
        held_out = photo % folds == k
        weights, asked = fit(parts.chosen(~held_out)), parts.chosen(held_out)
        result[held_out] = weights.probability(asked.confidence, asked.residual)
    return result


def with_calibration(model: onnx.ModelProto, found: Sequence[Calibrated]) -> onnx.ModelProto:
    """The same model with these calibrations, and no others, in its metadata."""
    about = metadata(model)
    by_name = {result.category: result for result in found}
    for described in about["categories"]:
        described.pop("calibration", None)
        described.pop("joint_calibration", None)
        if (result := by_name.get(described["name"])) is not None:
            described["calibration"] = result.parts.calibration.to_dict()
            if result.joints is not None:
                described["joint_calibration"] = result.joints.calibration.to_dict()
    return with_metadata(model, about)
