"""Straight wires."""

import numpy as np
import pytest

from r2art.data.procedural.wires import wires
from r2art.data.shape import Material


def test_wires_are_closed_prisms_between_their_ends():
    rng = np.random.default_rng(0)
    ends = rng.random((7, 2, 3))
    wire = wires(ends, 0.01, Material(), sides=5)
    a, b, c = np.moveaxis(wire.vertices[wire.faces], 1, 0)
    volume = np.einsum("fc,fc->", a, np.cross(b, c)) / 6
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1).sum()
    area = 5 / 2 * np.sin(2 * np.pi / 5) * 0.01**2
    assert volume == pytest.approx(length * area, rel=1e-9)


def test_every_vertex_lies_on_its_wire_s_surface_and_its_normal_points_away():
    ends = np.array([[[0, 0, 0], [0, 0, 1]], [[1, 0, 0], [1, 2, 0]]], dtype=float)
    wire = wires(ends, 0.1, Material())
    own = np.repeat(ends, 8, axis=0)
    along = own[:, 1] - own[:, 0]
    offset = wire.vertices - own[:, 0]
    offset -= along * np.sum(offset * along, -1, keepdims=True) / np.sum(along**2, -1)[:, None]
    np.testing.assert_allclose(offset, 0.1 * wire.normals, atol=1e-12)
