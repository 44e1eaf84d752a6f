"""Fewer triangles, the same shape; creases stay sharp, curves smooth, pictures in place."""

import numpy as np
import pytest
import trimesh

from r2art.data.models.model import Patch
from r2art.data.models.primitives import box, cylinder, ellipsoid, patch
from r2art.data.models.simplify import LEAST, area, shares, simplified, surface
from r2art.data.shape import Material

PLAIN = Material()


def sphere(subdivisions=5):
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions)
    return patch(mesh.vertices[mesh.faces], PLAIN)


@pytest.mark.parametrize("seed", range(5))
def test_shares_keep_the_budget_and_give_none_more_than_it_has(seed):
    rng = np.random.default_rng(seed)
    counts = rng.integers(1, 20_000, size=12)
    kept = shares(rng.uniform(0, 1, 12), counts, 12_000)
    assert sum(kept) <= 12_000
    assert sum(kept) > 11_900
    assert all(k <= c for k, c in zip(kept, counts, strict=True))
    assert all(k >= min(c, LEAST) for k, c in zip(kept, counts, strict=True))


def test_what_is_few_enough_is_left_alone():
    assert shares([1.0, 2.0], [5000, 7000], 12_000) == [5000, 7000]
    cube = box(np.ones(3), PLAIN)
    assert simplified(cube, 12) is cube


def test_a_larger_patch_keeps_more():
    small, large = shares([1.0, 16.0], [50_000, 50_000], 10_000)
    assert large == pytest.approx(4 * small, rel=0.1)


def test_a_simplified_ball_is_still_a_ball():
    few = simplified(sphere(), 600)
    assert 500 < len(few.corners) <= 600
    radius = np.linalg.norm(few.corners.reshape(-1, 3), axis=1)
    np.testing.assert_allclose(radius, 1, atol=0.02)
    assert area(few) == pytest.approx(4 * np.pi, rel=0.02)
    a, b, c = np.moveaxis(few.corners, 1, 0)
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 == pytest.approx(4.19, rel=0.03)


def test_simplifying_gives_the_same_bytes_again():
    assert (
        simplified(sphere(), 300).corners.tobytes() == simplified(sphere(), 300).corners.tobytes()
    )


def test_a_picture_stays_in_place_when_its_surface_is_simplified():
    n = 60
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    points = np.stack([x, y, 0.05 * np.sin(6 * x) * np.cos(5 * y)], axis=-1).reshape(-1, 3)
    k = np.arange(n * n).reshape(n, n)
    a, b, c, d = k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]
    faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    corners = points[faces]
    look = Material(texture=np.zeros((4, 4, 3), np.uint8))
    few = simplified(Patch(corners=corners, uv=corners[..., :2], material=look), 500)
    assert 300 < len(few.corners) <= 500
    np.testing.assert_allclose(few.uv, few.corners[..., :2], atol=0.5 / n)


def test_a_box_is_sharp_and_a_ball_is_smooth():
    cube = surface(box(np.ones(3), PLAIN))
    assert cube is not None
    assert len(cube.vertices) == 24
    assert set(np.abs(cube.normals).max(axis=1)) == {1.0}
    ball = surface(sphere(3))
    assert ball is not None
    assert len(ball.vertices) == 642
    np.testing.assert_allclose(ball.normals, ball.vertices, atol=0.02)


def test_a_cylinder_is_smooth_around_and_sharp_at_its_ends():
    can = surface(cylinder(0.5, 2.0, PLAIN))
    assert can is not None
    on_cap = np.abs(can.normals[:, 2]) > 0.99
    round_about = np.abs(can.normals[:, 2]) < 0.01
    assert (on_cap | round_about).all()
    outward = can.vertices[round_about, :2] / 0.5
    np.testing.assert_allclose(can.normals[round_about, :2], outward, atol=1e-6)


def test_shading_normals_point_where_the_triangles_face():
    for shape in (box(np.ones(3), PLAIN), cylinder(0.3, 1.0, PLAIN), ellipsoid([1, 2, 3], PLAIN)):
        s = surface(shape)
        assert s is not None
        a, b, c = np.moveaxis(s.vertices[s.faces], 1, 0)
        agrees = np.einsum("fc,fkc->fk", np.cross(b - a, c - a), s.normals[s.faces])
        assert (agrees > 0).all()
        np.testing.assert_allclose(np.linalg.norm(s.normals, axis=1), 1)


def test_triangles_without_area_vanish():
    point, line = np.zeros((1, 3, 3)), np.array([[[0, 0, 0], [1, 0, 0], [2.0, 0, 0]]])
    assert surface(patch(point, PLAIN)) is None
    assert surface(patch(line, PLAIN)) is None
    kept = surface(patch(np.concatenate([box(np.ones(3), PLAIN).corners, point, line]), PLAIN))
    assert kept is not None
    assert len(kept.faces) == 12


def test_seams_of_a_picture_part_vertices_but_not_the_light():
    ball = sphere(2)
    half = ball.corners[..., :1].mean(axis=1, keepdims=True) > 0
    uv = np.broadcast_to(np.where(half, 0.5, 0.1), (len(half), 3, 2))
    s = surface(Patch(corners=ball.corners, uv=uv, material=PLAIN))
    assert s is not None
    assert len(s.vertices) > 162
    np.testing.assert_allclose(s.normals, s.vertices, atol=0.05)
