"""Slabs, bent sheets among them, are closed solids with outward normals."""

import numpy as np
import pytest

from r2art.data.procedural.slabs import arc, bent, notched, slab
from r2art.data.shape import Material, Surface

PLAIN = Material()
SPAN = (1.0, 3.0)


def volume(solid: tuple[Surface, ...]) -> float:
    corners = np.concatenate([s.vertices[s.faces] for s in solid])
    return float(np.einsum("fc,fc->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)


def area(outline: np.ndarray) -> float:
    x, y = outline.T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("span", [SPAN, SPAN[::-1]])
def test_a_slab_encloses_its_outline_times_its_length(axis, span):
    first, other = notched((0, 0), (2, 1), 0.5, 0.25)
    outline = np.concatenate([first, other[::-1]])
    solid = slab(first, other, axis, span, PLAIN)
    assert volume(solid) == pytest.approx(2 * area(outline))
    assert area(outline) == pytest.approx(2 - np.pi * 0.25**2 / 2, rel=0.01)


@pytest.mark.parametrize("axis", range(3))
def test_a_bent_sheet_keeps_its_thickness(axis):
    corner = [(2.0, 0.0), (2.0, 1.0), (0.0, 1.0)]  # counter-clockwise: the inside is on the left
    assert volume(bent(corner, 0.1, axis, SPAN, PLAIN)) == pytest.approx(2 * (3 * 0.1 - 0.1**2))


def test_an_arc_passes_its_ends_and_its_crown_and_bends_smoothly():
    points = arc((1.0, 0.0), (-1.0, 0.0), 0.6, 16)
    np.testing.assert_allclose(points[[0, 8, 16]], [(1, 0), (0, 0.6), (-1, 0)], atol=1e-12)
    vault = bent(points, 0.05, 0, SPAN, PLAIN)
    outside = vault[0]
    center_y = 0.6 - (1 + 0.6**2) / (2 * 0.6)
    radial = outside.vertices[:, 1:] @ [[0, 1], [-1, 0]] - (0, center_y)
    radial /= np.linalg.norm(radial, axis=-1, keepdims=True)
    turned = outside.normals[:, 1:] @ [[0, 1], [-1, 0]]
    assert (turned * radial).sum(axis=-1).min() > 0.99
