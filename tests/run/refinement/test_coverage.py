"""Exact silhouettes of meshes: beside drawn ones, and by the laws of areas."""

import numpy as np
import pytest

from r2art.core.mesh import Mesh
from r2art.run.refinement.coverage import cut, layers
from r2art.run.refinement.shell import shell_of

CUBE = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3, indexing="ij")).reshape(3, -1).T
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
FACES = np.array([[(a, b, c), (a, c, d)] for a, b, c, d in QUADS]).reshape(-1, 3)


def covered(corners: np.ndarray, size: int) -> np.ndarray:
    """Layers of one polygon, counter-clockwise as seen."""
    run = np.roll(corners, -1, axis=0) - corners
    image = np.zeros(len(corners), int)
    return layers(cut(corners, run), run[:, 1], image, 1, size)[0]


def sampled(corners: np.ndarray, size: int, fine: int = 64) -> np.ndarray:
    """The same by testing fine × fine points of every pixel."""
    at = (np.arange(size * fine) + 0.5) / fine
    x, y = np.meshgrid(at, at)
    inside = np.ones(x.shape, bool)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        inside &= (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) < 0
    return inside.reshape(size, fine, size, fine).mean(axis=(1, 3))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("reach", [1.0, 3.0])
def test_the_share_of_every_pixel_is_exact(seed, reach):
    """Also where the polygon leaves the image on any side."""
    rng = np.random.default_rng(seed)
    angle = -np.sort(rng.uniform(0, 2 * np.pi, 7))
    corners = 6 + reach * 4.5 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    corners += rng.uniform(-2, 2, 2)
    expected = sampled(corners, 12)
    assert expected.max() > 0.9
    np.testing.assert_allclose(covered(corners, 12), expected, atol=0.02)


def test_areas_add_up():
    corners = np.array([[2.3, 1.7], [3.1, 9.2], [8.9, 5.5]])
    area = abs(np.linalg.det(corners[1:] - corners[0])) / 2
    np.testing.assert_allclose(covered(corners, 10).sum(), area)
    np.testing.assert_allclose(covered(corners[::-1], 10).sum(), -area)


def test_straight_edges_on_pixel_borders_are_exact():
    square = np.array([[2.0, 2], [2, 5], [5, 5], [5, 2]])
    expected = np.zeros((7, 7))
    expected[2:5, 2:5] = 1
    np.testing.assert_allclose(covered(square, 7), expected, atol=1e-12)


def test_the_outline_of_a_cube_is_the_edges_between_what_is_seen_and_what_is_not():
    shell = shell_of(Mesh(vertices=CUBE, faces=FACES, part=np.zeros(8, int)))
    assert len(shell.edges) == 18
    assert (shell.beside < 12).all()
    _, edge, way = shell.outline(np.array([[[0.0, 0, -3]]]))  # before the face z = −0.5
    ends = shell.vertices[shell.edges[edge]]
    np.testing.assert_allclose(ends[..., 2], -0.5)
    assert len(edge) == 4
    _, edge, way = shell.outline(np.array([[[2.0, 3, -3]]]))
    assert len(edge) == 6  # three faces are seen
    ends = np.where(way[:, None] > 0, shell.edges[edge], shell.edges[edge][:, ::-1])
    assert sorted(ends[:, 0]) == sorted(ends[:, 1])  # they make a loop


def test_a_stretched_shell_has_the_planes_of_its_vertices():
    mesh = Mesh(vertices=CUBE, faces=FACES, part=np.zeros(8, int))
    old, new, scale = np.zeros((1, 3)), np.array([[0.1, 0.2, 0.3]]), np.array([[2.0, 1.0, 0.5]])
    shell = shell_of(mesh).stretched(old, new, scale)
    for corner in FACES.T:
        along = (shell.normals[:-1] * shell.vertices[corner]).sum(axis=-1)
        np.testing.assert_allclose(along, shell.offsets[:-1])
