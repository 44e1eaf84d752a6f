"""What the errors of many images come to: areas, calibration, and how sure such figures are."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

FloatArray = NDArray[np.floating]
BoolArray = NDArray[np.bool_]

RESAMPLES = 1000
LEVEL = 0.95
AT_A_TIME = 10  # resamples, for many images make large arrays


@dataclass(frozen=True, kw_only=True)
class Interval:
    """A figure, and the ends of its bootstrap 95 % interval."""

    value: float
    low: float
    high: float


def recall_area(errors: FloatArray, tau: float) -> FloatArray:
    """What each error contributes to the area under the recall curve up to ``tau``, 0 to 1.

    Recall at t is the share of errors ≤ t, a step function. One error e contributes the time
    from e to tau. Failures are inf and give 0.
    """
    return np.clip(1 - np.asarray(errors) / tau, 0, 1)


def auc(errors: FloatArray, tau: float) -> float:
    """Area under the recall curve up to ``tau``, as a share of 1; exact, not sampled."""
    return float(recall_area(errors, tau).mean())


def auroc(score: FloatArray, positive: BoolArray) -> float:
    """Chance that a positive outscores a negative (ties count half); nan if one is missing."""
    score, positive = np.ravel(score), np.ravel(positive)
    n = np.count_nonzero(positive)
    pairs = n * (positive.size - n)
    if pairs == 0:
        return float("nan")
    return float((rankdata(score)[positive].sum() - n * (n + 1) / 2) / pairs)


def bins_of(confidence: FloatArray, bins: int) -> NDArray[np.intp]:
    """Which of so many equally wide bins of [0, 1] each confidence falls into; 1 into the last."""
    return np.minimum((np.asarray(confidence) * bins).astype(np.intp), bins - 1)


def calibration_error(confidence: FloatArray, right: BoolArray, bins: int = 10) -> float:
    """Expected calibration error: how far confidence and share of right answers lie apart.

    In each bin of confidence the difference of the two means is taken, weighted by its count
    (Naeini et al., AAAI 2015).
    """
    confidence, right = np.ravel(confidence), np.ravel(right)
    gap = np.bincount(bins_of(confidence, bins), confidence - right, minlength=bins)
    return float(np.abs(gap).sum() / confidence.size)


def bootstrap_median(
    values: FloatArray, resamples: int = RESAMPLES, level: float = LEVEL, seed: int = 0
) -> tuple[float, float]:
    """Interval that holds the median of all ``values`` with probability ``level``.

    Args:
        values: (N, ...) one row per image; whole rows are drawn again, because the parts of one
            image err together. Failures may be inf.
        resamples: How many times N rows are drawn with replacement.
        level: Of confidence.
        seed: Of the draws.
    """
    rows = values.reshape(len(values), -1)
    draws = _draws(len(rows), resamples, seed)
    blocks = np.array_split(draws, -(-resamples // AT_A_TIME))
    medians = [np.median(rows[d].reshape(len(d), -1), axis=1) for d in blocks]
    return _interval(np.concatenate(medians), level)


def bootstrap_mean(
    values: FloatArray, resamples: int = RESAMPLES, level: float = LEVEL, seed: int = 0
) -> tuple[float, float]:
    """The same of the mean of the finite values; nan where there are none."""
    rows = values.reshape(len(values), -1)
    finite = np.isfinite(rows)
    total, count = np.where(finite, rows, 0).sum(axis=1), finite.sum(axis=1)
    draws = _draws(len(rows), resamples, seed)
    counts = count[draws].sum(axis=1)
    means = total[draws].sum(axis=1)[counts > 0] / counts[counts > 0]
    return _interval(means, level)


def bootstrap(
    statistic: Callable[..., float],
    *columns: NDArray[np.generic],
    resamples: int = 300,
    level: float = LEVEL,
    seed: int = 0,
) -> tuple[float, float]:
    """The same of any statistic of (N, ...) columns, which are drawn together."""
    draws = _draws(len(columns[0]), resamples, seed)
    found = np.array([statistic(*(column[d] for column in columns)) for d in draws])
    return _interval(found[~np.isnan(found)], level)


@lru_cache(maxsize=4)
def _draws(n: int, resamples: int, seed: int) -> NDArray[np.intp]:
    """(resamples, n) row numbers; the same for every measure, so that they may be compared."""
    return np.random.default_rng(seed).integers(n, size=(resamples, n), dtype=np.intp)


def _interval(found: FloatArray, level: float) -> tuple[float, float]:
    if not found.size:
        return float("nan"), float("nan")
    low, high = np.quantile(found, [(1 - level) / 2, (1 + level) / 2], method="nearest")
    return float(low), float(high)
