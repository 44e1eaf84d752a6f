"""Handles, controls, prints and dishes: each keeps the measures it is given."""

import numpy as np
import pytest

from r2art.data.procedural.assembly import bounds
from r2art.data.procedural.controls import button, knob
from r2art.data.procedural.curved import revolved
from r2art.data.procedural.dishes import dish
from r2art.data.procedural.grips import grip
from r2art.data.procedural.prints import Print
from r2art.data.shape import Material

PLAIN = Material()
AT = np.array([0.1, 0.2, 0.3])


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("kind", ["bar", "rod", "bow"])
def test_a_grip_stands_before_its_front_in_the_length_and_reach_it_is_given(kind, axis):
    pieces = grip(np.random.default_rng(0), AT, axis, 0.3, 0.04, PLAIN, kind)
    lower, upper = bounds(pieces)
    size = upper - lower
    np.testing.assert_allclose((lower + upper)[:2] / 2, AT[:2], atol=1e-9)
    assert size[axis] == pytest.approx(0.3, abs=0.02)
    assert size[1 - axis] < 0.03
    assert upper[2] == pytest.approx(AT[2] + 0.04, abs=0.002)
    assert lower[2] > AT[2] - 0.01


def test_knobs_and_buttons_stand_on_their_point():
    for pieces in (
        knob(np.random.default_rng(0), AT, 0.02, 0.015, PLAIN),
        button(AT, (0.04, 0.04), 0.015, PLAIN),
    ):
        lower, upper = bounds(pieces)
        np.testing.assert_allclose((lower + upper)[:2] / 2, AT[:2], atol=1e-3)
        np.testing.assert_allclose((upper - lower)[:2], 0.04, atol=1e-3)
        assert (lower[2], upper[2]) == pytest.approx((0.3, 0.315), abs=1e-3)


def test_a_print_is_drawn_in_metres_from_its_lower_left_corner():
    sheet = Print(0.2, 0.1, (1.0, 1.0, 1.0), px=200)
    sheet.box((0.15, 0.08), (0.04, 0.02), filled=True)
    image = sheet.texture()
    assert image.shape == (100, 200, 3)
    y, x = np.nonzero(image[..., 0] < 255)
    assert (x.min(), x.max()) == pytest.approx((130, 170), abs=1)
    assert (y.min(), y.max()) == pytest.approx((10, 30), abs=1)


@pytest.mark.parametrize("upturned", [False, True])
@pytest.mark.parametrize("kind", ["plate", "bowl", "cup", "glass", "pot"])
def test_dishes_are_closed_hollow_and_as_large_as_asked(kind, upturned):
    profile = dish(kind, 0.1, 0.05, upturned=upturned)
    solid = revolved(profile, (0, 0, 0), 1, PLAIN, segments=48)
    a, b, c = np.moveaxis(solid.vertices[solid.faces], 1, 0)
    volume = np.einsum("fc,fc->", a, np.cross(b, c)) / 6
    assert 0.02 < volume / (np.pi * 0.1**2 * 0.05) < 0.5
    np.testing.assert_allclose(
        [solid.vertices[:, 1].min(), np.ptp(solid.vertices[:, 1])], [0, 0.05]
    )
    assert np.abs(solid.vertices[:, 0]).max() == pytest.approx(0.1)
    opening = np.isclose(solid.vertices[:, 1], 0.0 if upturned else 0.05)
    assert np.linalg.norm(solid.vertices[opening], axis=-1).min() > 0.08
