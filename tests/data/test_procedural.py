"""Solids that procedural objects are built from."""

import numpy as np
import pytest

from r2art.data.procedural.curved import ellipsoid, prism
from r2art.data.procedural.solids import FACE_NAMES, box, cylinder, decal, plate
from r2art.data.shape import Material, Surface

PLAIN = Material()


def vertices(part: tuple[Surface, ...] | list[Surface]) -> np.ndarray:
    return np.concatenate([s.vertices for s in part])


def volume(solid: tuple[Surface, ...]) -> float:
    corners = np.concatenate([s.vertices[s.faces] for s in solid])
    return float(np.einsum("fc,fc->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)


@pytest.mark.parametrize(
    ("solid", "expected"),
    [
        ((box((0, 0, 0), (1, 2, 3), PLAIN),), 6.0),
        *((plate((0, 0, 0), (1, 2, 3), axis, PLAIN), 6.0) for axis in range(3)),
        *((cylinder((1, 2, 3), k, 0.5, 2.0, PLAIN, segments=64), np.pi / 2) for k in range(3)),
        *((prism([(0, 0), (1, 0), (0, 1)], k, (1, 3), PLAIN), 1.0) for k in range(3)),
        ((ellipsoid((1, 1, 1), (1, 2, 3), PLAIN, rings=60, segments=61),), 8 * np.pi),
    ],
)
def test_closed_solids_enclose_their_volume_outward(solid, expected):
    assert volume(solid) == pytest.approx(expected, rel=0.01)


def test_rounding_only_takes_away_and_keeps_the_box():
    solid = plate((0, 0, 0), (1, 0.2, 2), 1, PLAIN, radius=0.1, bevel=(0.02, 0.05))
    corners = vertices(solid)
    np.testing.assert_allclose(corners.min(axis=0), (0, 0, 0), atol=1e-12)
    np.testing.assert_allclose(corners.max(axis=0), (1, 0.2, 2), atol=1e-12)
    assert 0.9 * 0.4 < volume(solid) < 0.4


@pytest.mark.parametrize("side", FACE_NAMES)
def test_a_decal_lies_just_outside_its_side(side):
    mark = decal((0, 0, 0), (1, 2, 3), side, PLAIN, lift=1e-3)
    inner = np.clip(mark.vertices, 0, (1, 2, 3))
    np.testing.assert_allclose(mark.vertices - inner, 1e-3 * mark.normals, atol=1e-12)
