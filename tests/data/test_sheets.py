"""Sheets, lofts and prints made of grids of points, and their creased normals."""

import numpy as np
import pytest

from r2art.data.procedural.creases import creased
from r2art.data.procedural.profiles import arch, curve, rounded, stations
from r2art.data.procedural.sheets import draped, loft, sampled, sheet
from r2art.data.shape import Material, Surface

PLAIN = Material()


def volume(solid: tuple[Surface, ...]) -> float:
    corners = np.concatenate([s.vertices[s.faces] for s in solid])
    return float(np.einsum("fc,fc->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)


def ring(half: float, count: int = 4) -> np.ndarray:
    angle = (np.arange(count) + 0.5) * 2 * np.pi / count
    return half / np.cos(np.pi / count) * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def tower(half: float, heights: np.ndarray) -> np.ndarray:
    flat = np.broadcast_to(ring(half), (len(heights), 4, 2))
    deep = np.broadcast_to(heights[:, None, None], (len(heights), 4, 1))
    return np.concatenate([flat, deep], axis=-1)


def test_a_loft_encloses_its_volume_outward():
    assert volume((loft(tower(1.0, np.array([1.0, 2.0, 4.0])), PLAIN),)) == pytest.approx(12)


def test_a_tube_encloses_the_volume_of_its_wall_and_a_hole_takes_its_share():
    heights = np.linspace(0, 3, 4)
    outer, inner = tower(1.0, heights), tower(0.5, heights)
    assert volume(sheet(outer, inner, PLAIN, wrap=True)) == pytest.approx(12 - 3)
    holes = np.zeros((3, 4), bool)
    holes[1, 2] = True
    assert volume(sheet(outer, inner, PLAIN, wrap=True, holes=holes)) == pytest.approx(9 - 3 / 4)


def test_an_open_sheet_is_closed_around_its_rim():
    z = np.linspace(0, 1, 5)
    outer, inner = arch(z, 0.5, 0.0, 1.0, 0.2), arch(z, 0.4, 0.0, 0.9, 0.1)
    shell = np.concatenate([s.vertices[s.faces] for s in sheet(outer, inner, PLAIN)])
    area = np.cross(shell[:, 1] - shell[:, 0], shell[:, 2] - shell[:, 0]) / 2
    np.testing.assert_allclose(area.sum(axis=0), 0, atol=1e-12)  # as of every closed surface
    assert volume(sheet(outer, inner, PLAIN)) > 0


def test_creases_split_edges_sharper_than_their_angle_only():
    cube = creased(*_cube(), PLAIN)
    assert np.isclose(np.abs(cube.normals).max(axis=-1), 1).all()
    smooth = creased(*_cube(), PLAIN, angle=2.0)
    assert np.abs(smooth.normals).max() < 0.95
    assert (np.einsum("vd,vd->v", smooth.normals, smooth.vertices) > 0).all()


def _cube() -> tuple[np.ndarray, np.ndarray]:
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = np.array(
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    )
    return corners, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def test_a_print_lies_above_its_face_and_reads_from_outside():
    rows = arch(np.linspace(0, 1, 5), 0.5, 0.0, 1.0, 0.3)
    mark = draped(
        sampled(rows, np.linspace(1, 3, 4)[:, None], np.linspace(6, 7, 5)), PLAIN, lift=0.01
    )
    assert (mark.vertices[:, 1] > 1.0).all()
    a, b, c = np.moveaxis(mark.vertices[mark.faces], 1, 0)
    (ua, ub, uc) = np.moveaxis(mark.uv[mark.faces], 1, 0)
    turn = np.cross(b - a, c - a)
    flat = (ub - ua)[:, 0] * (uc - ua)[:, 1] - (ub - ua)[:, 1] * (uc - ua)[:, 0]
    assert (flat * turn[:, 1] > 0).all()  # the image is not mirrored


def test_a_grid_is_sampled_at_its_points_and_between():
    grid = np.random.default_rng(0).random((4, 3, 3))
    rows, columns = np.arange(4)[:, None], np.arange(3)
    np.testing.assert_allclose(sampled(grid, rows, columns), grid)
    np.testing.assert_allclose(sampled(grid, rows[::-1], columns), grid[::-1])
    between = sampled(grid, 1.25, 0.5)
    ahead = 0.75 * grid[1] + 0.25 * grid[2]
    np.testing.assert_allclose(between, (ahead[0] + ahead[1]) / 2)


def test_a_curve_meets_its_knots_and_never_overshoots():
    knots = [(0.0, 1.0), (1.0, 3.0), (2.0, 3.0), (4.0, 0.0)]
    at = np.linspace(-1, 5, 200)
    np.testing.assert_allclose(curve([0, 1, 2, 4], knots), [1, 3, 3, 0])
    assert curve(at, knots).max() <= 3 + 1e-12
    assert curve(at, knots).min() >= -1e-12
    assert (np.diff(curve(np.linspace(0, 1, 50), knots)) > 0).all()


def test_stations_rise_and_rounded_ends_are_quarter_circles():
    at = stations(0.0, 1.0, 0.1, (0.2, 0.1))
    assert at[0] == 0
    assert at[-1] == pytest.approx(1)
    assert (np.diff(at) > 0).all()
    retreat = rounded(at, 0.0, 1.0, (0.2, 0.0))
    rear = at < 0.2
    np.testing.assert_allclose((0.2 - at[rear]) ** 2 + (0.2 - retreat[rear]) ** 2, 0.04)
    assert (retreat[~rear] == 0).all()
