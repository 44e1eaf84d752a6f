"""Laws of areas, calibration and bootstrap intervals."""

import numpy as np
import pytest

from r2art.learn.evaluation import statistics


@pytest.fixture
def rng():
    return np.random.default_rng(7)


@pytest.mark.parametrize("tau", [0.02, 0.1])
def test_auc_agrees_with_integrating_the_recall_curve(rng, tau):
    errors = np.concatenate([rng.exponential(0.05, 97), [np.inf, np.inf, 0]])
    t = (np.arange(200_000) + 0.5) / 200_000 * tau
    recall = np.searchsorted(np.sort(errors), t, side="right") / errors.size
    assert statistics.auc(errors, tau) == pytest.approx(recall.mean(), abs=1e-5)


def test_auc_is_one_for_no_error_and_zero_for_failures():
    assert statistics.auc(np.zeros(4), 0.1) == 1
    assert statistics.auc(np.full(4, np.inf), 0.1) == 0
    assert statistics.auc(np.array([0.0, np.inf]), 0.1) == 0.5


def test_auroc_counts_pairs_in_order(rng):
    score, positive = rng.integers(0, 8, 60) / 8, rng.random(60) < 0.4
    first, second = score[positive][:, None], score[~positive]
    expected = ((first > second) + 0.5 * (first == second)).mean()
    assert statistics.auroc(score, positive) == pytest.approx(expected)
    assert np.isnan(statistics.auroc(score, np.ones(60, bool)))


def test_the_bootstrap_interval_holds_the_true_median_as_often_as_it_says():
    rng = np.random.default_rng(0)
    trials = 120
    held = 0
    for k in range(trials):
        low, high = statistics.bootstrap_median(rng.exponential(size=(80, 1)), 200, seed=k)
        held += low <= np.log(2) <= high
    assert 0.88 <= held / trials <= 0.995


def test_failures_may_reach_the_interval_but_make_no_nan():
    low, high = statistics.bootstrap_median(np.array([1, 2, np.inf, np.inf])[:, None])
    assert 1 <= low <= high == np.inf


@pytest.mark.parametrize("statistic", ["mean", "own"])
def test_the_bootstrap_interval_of_a_mean_holds_the_true_one_as_often_as_it_says(statistic):
    rng = np.random.default_rng(1)
    trials, held = 120, 0
    for k in range(trials):
        values = rng.exponential(size=(80, 2))
        if statistic == "mean":
            low, high = statistics.bootstrap_mean(values, 200, seed=k)
        else:
            low, high = statistics.bootstrap(np.mean, values, resamples=200, seed=k)
        held += low <= 1 <= high
    assert 0.86 <= held / trials <= 0.995


def test_a_mean_leaves_failures_out_and_is_unknown_without_any_success():
    values = np.array([[1.0, np.inf], [3.0, 3.0], [np.inf, np.inf]])
    low, high = statistics.bootstrap_mean(values)
    assert 1 <= low < high == 3
    assert np.isnan(statistics.bootstrap_mean(np.full((4, 1), np.inf))).all()


def test_a_whole_photo_is_drawn_again_not_its_parts():
    """Copies of a column tell nothing new, so the interval must not shrink."""
    column = np.random.default_rng(3).normal(size=(50, 1))
    many = np.repeat(column, 16, axis=1)
    for interval in (statistics.bootstrap_median, statistics.bootstrap_mean):
        np.testing.assert_allclose(interval(many), interval(column), rtol=1e-12)


def test_a_confidence_that_is_a_probability_is_calibrated_and_an_overconfident_one_is_not():
    rng = np.random.default_rng(2)
    p = rng.uniform(size=40_000)
    right = rng.uniform(size=p.size) < p
    assert statistics.calibration_error(p, right) < 0.015
    assert statistics.calibration_error(np.ones(100), np.arange(100) < 70) == pytest.approx(0.3)
    assert statistics.calibration_error(np.ones(5), np.ones(5, bool)) == 0
    assert statistics.calibration_error(np.zeros(5), np.ones(5, bool)) == 1
