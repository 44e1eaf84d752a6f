"""A map's mean is where it is high, and its variance says how sure that is."""

import pytest
import torch

from r2art.method.keypoints import place_of

STRIDE = 4


def bell(u: float, v: float, width: float, height: int = 20, across: int = 24) -> torch.Tensor:
    """Logits of a normal distribution round a place (px), of a standard deviation of ``width``."""
    x = STRIDE * (torch.arange(across) + 0.5)
    y = STRIDE * (torch.arange(height) + 0.5)
    return -0.5 * ((x - u).square() + (y[:, None] - v).square())[None, None] / width**2


@pytest.mark.parametrize(("u", "v"), [(40.0, 31.0), (50.5, 44.25)])
def test_mean_and_variance_are_those_of_the_bell(u, v):
    place, variance = place_of(bell(u, v, 4.0), STRIDE)
    assert place[0, 0].tolist() == pytest.approx([u, v], abs=0.02)
    assert float(variance) == pytest.approx(2 * 16.0, rel=0.02)


def test_a_single_place_is_its_middle():
    logits = torch.zeros(1, 1, 5, 7)
    logits[0, 0, 3, 2] = 100.0
    place, variance = place_of(logits, STRIDE)
    assert place[0, 0].tolist() == [2.5 * STRIDE, 3.5 * STRIDE]
    assert float(variance) == pytest.approx(0, abs=1e-3)


def test_it_does_not_depend_on_the_level_of_the_logits():
    logits = torch.randn(2, 3, 8, 8)
    for one, other in zip(place_of(logits, STRIDE), place_of(logits + 50, STRIDE), strict=True):
        torch.testing.assert_close(one, other, rtol=1e-4, atol=1e-3)
