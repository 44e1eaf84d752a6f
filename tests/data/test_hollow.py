"""Tubs and collars enclose the volume of their walls, outward, whichever side is open."""

import numpy as np
import pytest

from r2art.data.procedural.hollow import collar, tub
from r2art.data.procedural.solids import FACE_FRAMES, FACE_NAMES
from r2art.data.shape import Material, Surface

PLAIN = Material()


def volume(solid: tuple[Surface, ...]) -> float:
    corners = np.concatenate([s.vertices[s.faces] for s in solid])
    return float(np.einsum("fc,fc->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)


@pytest.mark.parametrize("opens", FACE_NAMES)
def test_a_tub_is_a_box_less_its_inside(opens):
    size = np.array([1.0, 2.0, 3.0])
    hollow = size - 0.2 + 0.1 * np.abs(FACE_FRAMES[FACE_NAMES.index(opens), 2])
    solid = tub((0, 0, 0), size, 0.1, PLAIN, opens=opens)
    assert volume(solid) == pytest.approx(size.prod() - hollow.prod(), rel=1e-3)


@pytest.mark.parametrize("opens", FACE_NAMES)
def test_one_sees_into_it_only_through_the_opening(opens):
    outward = FACE_FRAMES[FACE_NAMES.index(opens), 2]
    solid = tub((-1, -1, -1), (1, 1, 1), 0.1, PLAIN, opens=opens, radius=0.2, edge=0.15)
    vertices = np.concatenate([s.vertices for s in solid])
    np.testing.assert_allclose(np.abs(vertices).max(axis=0), 1, atol=1e-12)
    floor = solid[-1]
    np.testing.assert_allclose(floor.vertices @ outward, -0.9, atol=1e-12)
    np.testing.assert_allclose(floor.normals, np.tile(outward, (len(floor.normals), 1)))


def test_a_draft_narrows_the_floor_and_keeps_the_opening():
    solid = tub((-1, -1, -1), (1, 1, 1), 0.1, PLAIN, draft=0.2)
    vertices = np.concatenate([s.vertices for s in solid])
    at = {y: vertices[np.isclose(vertices[:, 1], y)] for y in (-1, 1)}
    assert np.abs(at[-1][:, 0]).max() == pytest.approx(0.8)
    assert np.abs(at[1][:, 0]).max() == pytest.approx(1.0)
    assert volume(solid) > 0


@pytest.mark.parametrize("axis", range(3))
def test_a_collar_is_a_box_less_its_hole(axis):
    size = np.array([1.0, 2.0, 3.0])
    hole = size - 0.4 + 0.4 * np.eye(3)[axis]
    solid = collar((0, 0, 0), size, 0.2, axis, PLAIN)
    assert volume(solid) == pytest.approx(size.prod() - hole.prod(), rel=1e-3)
    vertices = np.concatenate([s.vertices for s in solid])
    np.testing.assert_allclose([vertices.min(axis=0), vertices.max(axis=0)], [(0, 0, 0), size])
