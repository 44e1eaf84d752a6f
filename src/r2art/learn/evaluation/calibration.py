"""What the model's confidence is worth: is it a probability, and does it warn of failures?"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.learn.evaluation import statistics
from r2art.learn.evaluation.scores import Scores
from r2art.learn.evaluation.statistics import Interval

FloatArray = NDArray[np.floating]

BINS = 10
REJECTED = 0.2


@dataclass(frozen=True, kw_only=True)
class Bin:
    """Parts whose confidence lies in one interval; the means are nan where there are none."""

    low: float
    high: float
    count: int
    confidence: float
    right: float


@dataclass(frozen=True, kw_only=True)
class Rejection:
    """What it brings to reject the photos of the lowest confidence.

    A photo is as confident as its least confident part, and right where all its parts are.

    Attributes:
        share: Of all photos that is rejected.
        right: Share of right ones among all photos.
        right_kept: The same among those kept.
        wrong_removed: Share of the wrong photos that is rejected; nan where none is wrong.
        error: Median over all photos of the aligned ADD, in units of the diagonal.
        error_kept: The same of those kept.
    """

    share: float
    right: float
    right_kept: float
    wrong_removed: float
    error: float
    error_kept: float


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """How well confidence tells right parts from wrong ones (`Scores.right`).

    Attributes:
        error: Expected calibration error over `BINS` bins.
        auroc: Chance that a right part has a higher confidence than a wrong one.
        bins: Of the reliability diagram.
        rejection: Of the `REJECTED` share of photos.
    """

    error: Interval
    auroc: Interval
    bins: tuple[Bin, ...]
    rejection: Rejection


def calibrate(scores: Scores) -> Calibration:
    """Judge the confidence in (N, ...) scores of N images; failures are wrong, at 0."""
    confidence, right = scores.confidence, scores.right
    error = statistics.bootstrap(statistics.calibration_error, confidence, right)
    auroc = statistics.bootstrap(statistics.auroc, confidence, right)
    return Calibration(
        error=Interval(
            value=statistics.calibration_error(confidence, right, BINS), low=error[0], high=error[1]
        ),
        auroc=Interval(value=statistics.auroc(confidence, right), low=auroc[0], high=auroc[1]),
        bins=reliability(confidence, right),
        rejection=reject(scores, REJECTED),
    )


def reliability(confidence: FloatArray, right: NDArray[np.bool_]) -> tuple[Bin, ...]:
    """The reliability diagram of (N, P) confidences: `BINS` bins of equal width."""
    where = statistics.bins_of(confidence, BINS)
    return tuple(
        Bin(
            low=k / BINS,
            high=(k + 1) / BINS,
            count=int((inside := where == k).sum()),
            confidence=float(confidence[inside].mean()) if inside.any() else float("nan"),
            right=float(right[inside].mean()) if inside.any() else float("nan"),
        )
        for k in range(BINS)
    )


def least_confident_first(scores: Scores) -> NDArray[np.intp]:
    """(N,) photos in the order in which they would be rejected."""
    return np.argsort(scores.confidence.min(axis=1), kind="stable")


def photo_errors(scores: Scores) -> FloatArray:
    """(N,) mean aligned ADD over the parts of each photo, in units of the diagonal."""
    return scores.add_aligned.mean(axis=1) / scores.diagonal


def reject(scores: Scores, share: float) -> Rejection:
    """Reject that share of the photos, rounded to whole ones; at least one is kept."""
    right, error = scores.all_right, photo_errors(scores)
    order = least_confident_first(scores)
    count = min(round(share * len(order)), len(order) - 1)
    kept, wrong = order[count:], np.count_nonzero(~right)
    removed = np.count_nonzero(~right[order[:count]])
    return Rejection(
        share=count / len(order),
        right=float(right.mean()),
        right_kept=float(right[kept].mean()),
        wrong_removed=removed / wrong if wrong else float("nan"),
        error=float(np.median(error)),
        error_kept=float(np.median(error[kept])),
    )
