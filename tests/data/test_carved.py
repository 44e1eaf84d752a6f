"""Boxes with a cavity."""

import numpy as np
import pytest

from r2art.data.procedural.carved import carved
from r2art.data.shape import Material

PLAIN, INSIDE, FLOOR = Material(), Material(), Material()
BOX = ((0.0, 0.0, 0.0), (4.0, 5.0, 6.0))


def volume(solid) -> float:
    corners = np.concatenate([s.vertices[s.faces] for s in solid])
    return float(np.einsum("fc,fc->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)


@pytest.mark.parametrize("axis", range(3))
def test_the_cavity_is_taken_out_of_the_box(axis):
    lower, upper = np.array([0.5, 2.0, 1.0]), np.array([3.0, 4.0, 4.5])
    upper[axis] = BOX[1][axis]
    solid = carved(BOX, (lower, upper), axis, PLAIN)
    assert volume(solid) == pytest.approx(120 - np.prod(upper - lower), rel=1e-6)
    vertices = np.concatenate([s.vertices for s in solid])
    np.testing.assert_allclose([vertices.min(axis=0), vertices.max(axis=0)], BOX, atol=1e-12)


def test_a_round_cavity_takes_less_away_and_a_round_box_holds_less():
    cavity = ((1, 1, 1), (3, 4, 6))
    sharp = volume(carved(BOX, cavity, 2, PLAIN))
    assert volume(carved(BOX, cavity, 2, PLAIN, inner_radius=0.5)) > sharp
    assert volume(carved(BOX, cavity, 2, PLAIN, radius=0.5)) < sharp


@pytest.mark.parametrize("axis", range(3))
def test_the_floor_faces_the_opening_and_shows_its_picture_once(axis):
    cavity = (np.full(3, 1.0), np.where(np.arange(3) == axis, BOX[1], 3.0))
    solid = carved(BOX, cavity, axis, PLAIN, inside=INSIDE, floor=FLOOR)
    floor = next(s for s in solid if s.material is FLOOR)
    np.testing.assert_allclose(floor.normals[:, axis], 1)
    np.testing.assert_allclose(floor.vertices[:, axis], 1.0)
    np.testing.assert_allclose([floor.uv.min(axis=0), floor.uv.max(axis=0)], [[0, 0], [1, 1]])
