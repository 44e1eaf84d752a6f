"""Solids around curves, plates with holes, and the outlines that they are made from."""

import numpy as np
import pytest

from r2art.data.procedural.bands import band
from r2art.data.procedural.outlines import evenly, grown, outward, oval, polygon
from r2art.data.procedural.solids import FRAMES
from r2art.data.procedural.swept import mirrored, swept
from r2art.data.shape import Material, Surface

PLAIN = Material()
ROUND = (2.0, 2.0, 2.0, 2.0)


def volume(solid: Surface) -> float:
    a, b, c = np.moveaxis(solid.vertices[solid.faces], 1, 0)
    return float(np.einsum("fc,fc->", a, np.cross(b, c)) / 6)


def area(outline: np.ndarray) -> float:
    x, y = outline.T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)


def circle(radius: float, count: int = 200) -> np.ndarray:
    angle = np.arange(count) * 2 * np.pi / count
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize(("radius", "section"), [(None, np.pi / 4), (0.02, 1.0), (1e-3, 1.0)])
def test_a_bar_encloses_its_volume_outward(radius, section, turn):
    path = np.linspace((0, 0, 0), (0, 0.5, 2 * turn), 9)
    bar = swept(path, (1, 0, 0), 0.3, 0.2, PLAIN, radius=radius, segments=12)
    expected = section * 0.3 * 0.2 * np.linalg.norm(path[-1])
    assert volume(bar) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("turn", [1, -1])
def test_a_ring_encloses_what_pappus_says(turn):
    path = np.insert(circle(1.0)[::turn], 1, 0.0, axis=-1)
    ring = swept(path, path, 0.3, 0.2, PLAIN, segments=12, closed=True)
    assert volume(ring) == pytest.approx(2 * np.pi * np.pi / 4 * 0.3 * 0.2, rel=0.01)
    assert np.abs(ring.vertices[:, 1]).max() == pytest.approx(0.1)
    away = np.linalg.norm(ring.vertices[:, [0, 2]], axis=-1)
    assert (away.min(), away.max()) == pytest.approx((0.85, 1.15), abs=1e-3)


def test_width_and_height_may_vary_along_a_bar():
    path = np.linspace((0, 0, 0), (0, 0, 1), 30)
    width = np.linspace(0.1, 0.3, 30)
    bar = swept(path, (1, 0, 0), width, 0.05, PLAIN, radius=1e-4)
    assert volume(bar) == pytest.approx(0.2 * 0.05, rel=0.01)
    at_end = bar.vertices[bar.vertices[:, 2] > 0.999]
    assert np.ptp(at_end, axis=0)[:2] == pytest.approx((0.3, 0.05))


@pytest.mark.parametrize("axis", range(3))
def test_a_band_encloses_its_volume_outward(axis):
    plate = band(circle(0.5), circle(1.0), axis, 0.2, PLAIN, radius=1e-3)
    assert volume(plate) == pytest.approx(np.pi * 0.75 * 0.2, rel=0.01)
    assert np.ptp(plate.vertices @ FRAMES[axis][2]) == pytest.approx(0.2)


def test_rounding_a_band_only_takes_away():
    sharp = band(circle(0.5), circle(1.0), 1, 0.2, PLAIN, radius=1e-4)
    soft = band(circle(0.5), circle(1.0), 1, 0.2, PLAIN, radius=0.08)
    assert 0.9 * volume(sharp) < volume(soft) < volume(sharp)
    away = np.linalg.norm(soft.vertices[:, [0, 2]], axis=-1)
    assert (away.min(), away.max()) == pytest.approx((0.5, 1.0))


def test_a_mirrored_solid_stays_right_side_out():
    bar = swept(np.linspace((1, 0, 0), (1, 0, 1), 5), (1, 0, 0), 0.1, 0.1, PLAIN)
    other = mirrored(bar)
    assert volume(other) == pytest.approx(volume(bar))
    assert other.vertices[:, 0].max() < -0.9


def test_a_round_oval_is_a_circle_and_a_high_power_fills_its_box():
    radius = np.linalg.norm(oval((2, 2, 2, 2), ROUND, count=60), axis=-1)
    np.testing.assert_allclose(radius, 2, rtol=1e-3)
    assert area(oval((1, 1, 1, 1), (30.0,) * 4, count=400)) == pytest.approx(4, rel=0.02)
    uneven = oval((3, 2, 1, 0.5), ROUND, count=200)
    np.testing.assert_allclose(uneven.max(axis=0), (3, 2), rtol=1e-3)
    np.testing.assert_allclose(uneven.min(axis=0), (-1, -0.5), rtol=2e-3)


def test_a_sharp_polygon_has_its_area():
    assert area(polygon(6, 1.0, sharpness=200.0, count=600)) == pytest.approx(
        6 * np.tan(np.pi / 6), rel=0.01
    )


def test_outlines_run_counter_clockwise_and_grow_by_what_is_asked():
    for outline in (oval((1, 1, 1, 1), ROUND), polygon(5, 1.0), evenly(circle(1.0), 40)):
        assert area(outline) > 0
        assert (np.einsum("nc,nc->n", outward(outline), outline) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(grown(circle(1.0), 0.25), axis=-1), 1.25, rtol=1e-3)
    steps = np.linalg.norm(np.diff(evenly([(0, 0), (3, 0), (3, 1), (0, 1)], 16), axis=0), axis=-1)
    np.testing.assert_allclose(steps, 0.5)
