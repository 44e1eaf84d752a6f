"""The weights that make a confidence a probability."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from r2art.core.confidence import EDGE, Calibration, Weights

WEIGHT = st.floats(-1e6, 1e6)
SHARE = st.floats(0, 1)


@given(SHARE)
def test_weights_of_nothing_change_nothing(confidence):
    expected = min(max(confidence, EDGE), 1 - EDGE)
    assert Weights().probability(confidence) == pytest.approx(expected, abs=1e-12)
    assert Weights().probability(confidence, 0.5) == pytest.approx(expected, abs=1e-12)


@given(WEIGHT, WEIGHT, WEIGHT, SHARE, st.floats(0, 1e300) | st.none())
def test_whatever_the_input_the_answer_is_a_probability(bias, slope, misfit, confidence, residual):
    said = Weights(bias=bias, slope=slope, misfit=misfit).probability(confidence, residual)
    assert 0 <= said <= 1


def test_it_is_the_logistic_function_of_the_weighted_sum():
    weights = Weights(bias=-0.5, slope=0.6, misfit=-0.8)
    odds = -0.5 + 0.6 * math.log(0.9 / 0.1) - 0.8 * math.log((0.05 + 0.001) / (0.03 + 0.001))
    assert weights.probability(0.9, 0.05) == pytest.approx(1 / (1 + math.exp(-odds)), abs=1e-12)
    many = weights.probability([0.9, 0.2], [0.05, 0.01])
    np.testing.assert_array_equal(
        many, [weights.probability(0.9, 0.05), weights.probability(0.2, 0.01)]
    )


@given(WEIGHT, WEIGHT, WEIGHT)
def test_what_a_file_holds_is_what_was_put_there(bias, slope, misfit):
    refined = Weights(bias=bias, slope=slope, misfit=misfit)
    calibration = Calibration(refined=refined, plain=Weights(bias=slope, slope=bias))
    assert Calibration.from_dict(calibration.to_dict()) == calibration


@pytest.mark.parametrize("weight", [math.nan, math.inf, -math.inf, 1e7])
def test_a_weight_that_cannot_be_meant_is_refused(weight):
    for name in ("bias", "slope", "misfit"):
        with pytest.raises(ValueError, match="a weight of the calibration"):
            Weights(**{name: weight})
