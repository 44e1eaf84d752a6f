"""Pictures of things whose looks can be calculated."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
import warp as wp

from r2art.core.camera import Camera
from r2art.data.rendering.render import (
    GAMMA,
    Light,
    Scene,
    diffuse_environment,
    render,
    render_labels,
    render_silhouettes,
)
from r2art.data.shape import Material, Surface

BLACK = np.zeros((8, 16, 3))
LEVEL = np.diag([1.0, -1.0, -1.0])
"""world_R_cam of a camera that looks along the environment's -z axis, upright."""
MATT = Material(color=(1.0, 1.0, 1.0), roughness=1.0)
CAMERAS = [
    Camera(90, 90, 48, 48, 96, 96),
    Camera(80, 110, 40.3, 52.7, 96, 80),
    Camera(120, 70, 61.2, 20.4, 96, 96),
]


def quad(corners, material=MATT) -> Surface:
    """A rectangle; uv (0, 0), (1, 0), (1, 1), (0, 1) at its corners."""
    corners = np.array(corners, float)
    normal = np.cross(corners[1] - corners[0], corners[3] - corners[0])
    return Surface(
        vertices=corners,
        faces=np.array([[0, 1, 2], [0, 2, 3]]),
        normals=np.tile(normal / np.linalg.norm(normal), (4, 1)),
        uv=np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]),
        material=material,
    )


def facing(x1, y1, x2, y2, z, material=MATT) -> Surface:
    """A rectangle facing the camera; its lower left corner (largest y) comes first."""
    return quad([(x1, y2, z), (x2, y2, z), (x2, y1, z), (x1, y1, z)], material)


def ball(center, radius, material=MATT) -> Surface:
    mesh = trimesh.creation.icosphere(4, radius)
    return Surface(
        vertices=mesh.vertices + center,
        faces=mesh.faces,
        normals=mesh.vertices / radius,
        uv=np.zeros((len(mesh.vertices), 2)),
        material=material,
    )


def scene(*surfaces: Surface, **changes) -> Scene:
    plain = Scene(
        surfaces=surfaces,
        labels=range(1, len(surfaces) + 1),
        lights=(),
        environment=BLACK,
        world_R_cam=LEVEL,
        show_environment=False,
    )
    return replace(plain, **changes)


def rays(camera: Camera) -> np.ndarray:
    """(H, W, 3) directions of depth 1 through the pixels' centres."""
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    x, y = (u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy
    return np.stack([x, y, np.ones_like(x)], axis=-1)


@pytest.mark.parametrize("camera", CAMERAS, ids=["plain", "wide pixels", "off centre"])
def test_a_ball_looks_as_calculated(camera):
    center, radius = np.array([0.02, -0.05, 1.1]), 0.3
    frame = render(scene(ball(center, radius)), camera)
    ray = rays(camera)
    a, b, c = (ray**2).sum(-1), ray @ center, center @ center - radius**2
    hit = b**2 >= a * c
    depth = (b - np.sqrt(np.maximum(b**2 - a * c, 0))) / a
    inside = hit & (frame.label == 1)
    assert np.count_nonzero(hit) > 500
    assert np.count_nonzero(hit != (frame.label == 1)) <= 0.02 * np.count_nonzero(hit)
    assert np.abs(frame.depth - depth)[inside].mean() < 0.003 * radius
    np.testing.assert_array_equal(frame.depth[frame.label == 0], 0)


def test_a_balls_silhouette_is_the_analytic_disk():
    camera, z, radius = CAMERAS[0], 1.1, 0.3
    frame = render(scene(ball((0, 0, z), radius)), camera)
    area = np.pi * camera.fx**2 * radius**2 / (z**2 - radius**2)
    assert frame.coverage.sum() == pytest.approx(area, rel=0.015)
    assert np.count_nonzero(frame.label) == pytest.approx(area, rel=0.015)
    assert frame.depth.max() < np.sqrt(z**2 - radius**2) + 0.01
    assert frame.depth[frame.depth > 0].min() == pytest.approx(z - radius, abs=0.002)


@pytest.mark.parametrize(("edge", "label"), [(10.4, 2), (10.6, 1)])
def test_the_ray_through_a_pixels_centre_decides_its_label(edge, label):
    camera = CAMERAS[0]
    x = (edge - camera.cx) / camera.fx
    two = scene(facing(-1, -1, x, 1, 1), facing(x, -1, 1, 1, 1))
    for refine_rays in (0, 4):
        frame = render(two, camera, refine_rays=refine_rays)
        assert np.unique(frame.label[:, 10]).tolist() == [label]
        np.testing.assert_allclose(frame.depth, 1, atol=1e-5)


def shaded() -> Scene:
    """Something with soft shadows, a half-hidden ball and a patterned floor."""
    tiles = np.random.default_rng(0).integers(0, 255, (8, 8, 3), np.uint8)
    floor = quad(
        [(-1, 0.3, 0.6), (1, 0.3, 0.6), (1, 0.3, 2), (-1, 0.3, 2)], Material(texture=tiles)
    )
    return scene(
        ball((0, 0.1, 1.2), 0.2, Material(color=(0.8, 0.2, 0.1), roughness=0.3)),
        facing(0.05, -0.2, 0.3, 0.2, 0.9),
        floor,
        lights=[Light(direction=(-0.5, -0.7, -0.5), color=(2, 2, 2), radius=0.1)],
        environment=np.full((8, 16, 3), 0.5),
    )


def test_the_same_seed_gives_the_same_bytes():
    first, again, other = (render(shaded(), CAMERAS[0], seed=s) for s in (3, 3, 4))
    for name in ("rgb", "coverage", "label", "depth"):
        assert getattr(first, name).tobytes() == getattr(again, name).tobytes()
    assert first.rgb.tobytes() != other.rgb.tobytes()
    assert first.label.tobytes() == other.label.tobytes()
    assert first.depth.tobytes() == other.depth.tobytes()


def test_coverage_is_a_share_and_nothing_shines_where_it_is_zero():
    frame = render(shaded(), CAMERAS[0], refine_rays=3)
    assert 0 <= frame.coverage.min() < frame.coverage.max() <= 1
    assert np.any((frame.coverage > 0) & (frame.coverage < 1))
    assert np.all(frame.coverage[frame.label > 0] > 0)
    assert np.any(frame.coverage == 0)
    np.testing.assert_array_equal(frame.rgb[frame.coverage == 0], 0)
    assert np.isfinite(frame.rgb).all()
    assert frame.rgb.min() >= 0


def test_a_picture_without_edges_needs_no_finer_rays():
    flat = scene(facing(-2, -2, 2, 2, 1, replace(MATT, emission=1.0)))
    np.testing.assert_allclose(render(flat, CAMERAS[0]).rgb, 1, atol=1e-5)


def test_whole_silhouettes_hold_the_visible_ones():
    frame, surfaces = render(shaded(), CAMERAS[0]), shaded().surfaces
    for label, surface in enumerate(surfaces, start=1):
        whole = render_labels([surface], [label], CAMERAS[0])
        seen = frame.label == label
        assert np.all(whole[seen] == label)
        hidden = np.count_nonzero(whole) - np.count_nonzero(seen)
        assert (hidden == 0) == (label == 2)  # only the one in front shows all of itself


@pytest.mark.parametrize("camera", CAMERAS, ids=["plain", "wide pixels", "off centre"])
def test_silhouettes_are_what_each_group_shows_alone(camera):
    surfaces = shaded().surfaces
    bits = render_silhouettes([[s] for s in surfaces], camera)
    for k, surface in enumerate(surfaces):
        alone = render_labels([surface], [1], camera) == 1
        assert alone.any()
        np.testing.assert_array_equal((bits >> k & 1).astype(bool), alone)
    together = render_silhouettes([surfaces], camera)
    np.testing.assert_array_equal(together > 0, bits > 0)


def test_a_floor_that_reaches_behind_the_camera_ends_at_the_horizon():
    camera, y = CAMERAS[0], 0.3
    floor = quad([(-50, y, -50), (50, y, -50), (50, y, 50), (-50, y, 50)])
    frame = render(scene(floor), camera)
    down = rays(camera)[..., 1]
    below = down > y / 45
    assert np.all(frame.label[below] == 1)
    assert np.all(frame.label[down <= 0] == 0)
    np.testing.assert_allclose(frame.depth[below], y / down[below], rtol=1e-4)
    np.testing.assert_array_equal(render_labels([floor], [1], camera), frame.label)


def test_faces_beside_and_behind_the_camera_are_not_seen():
    behind = [facing(-1, -1, 1, 1, -1), facing(3, -1, 4, 1, 1)]
    assert not render_silhouettes([behind], CAMERAS[0]).any()
    assert not render(scene(*behind), CAMERAS[0]).label.any()


@pytest.mark.skipif(not wp.is_cuda_available(), reason="Warp finds no CUDA device")
def test_cpu_and_cuda_see_the_same():
    cpu, cuda = (render(shaded(), CAMERAS[0], device=d) for d in ("cpu", "cuda"))
    assert np.mean(cpu.label != cuda.label) < 1e-3
    same = cpu.label == cuda.label
    np.testing.assert_allclose(cpu.depth[same], cuda.depth[same], rtol=1e-3)
    assert np.abs(cpu.rgb - cuda.rgb)[same].mean() < 0.02
    groups = [[s] for s in shaded().surfaces]
    masks = [render_silhouettes(groups, CAMERAS[0], device=d) for d in ("cpu", "cuda")]
    assert np.mean(masks[0] != masks[1]) < 1e-3


def test_a_surface_turned_away_from_the_only_light_is_black():
    camera, plate = CAMERAS[0], facing(-1, -1, 1, 1, 1)
    for direction, is_lit in [((0, 0, 1), False), ((0, 0, -1), True)]:
        light = Light(direction=direction, color=(1, 1, 1), radius=0)
        rgb = render(scene(plate, lights=[light]), camera).rgb
        assert (rgb.max() > 0) == is_lit
    np.testing.assert_array_equal(render(scene(plate), camera).rgb, 0)


@pytest.mark.parametrize("angle", [0.0, 0.5, 1.0])
def test_a_matt_surface_follows_lamberts_law(angle):
    camera, strength, grey = CAMERAS[0], 2.0, 0.6
    direction = (np.sin(angle), 0, -np.cos(angle))
    light = Light(direction=direction, color=(strength,) * 3, radius=0)
    plate = facing(-1, -1, 1, 1, 1, Material(color=(grey,) * 3, roughness=1.0))
    rgb = render(scene(plate, lights=[light]), camera).rgb[48, 48]
    lambert = grey**GAMMA / np.pi * np.cos(angle) * strength
    gloss = 0.04 / np.pi / 4 * strength  # of a dielectric at its roughest, at most
    assert np.all(rgb >= lambert * (1 - 1e-4))
    assert np.all(rgb <= lambert + 2 * gloss)


def test_shadows_fall_where_geometry_says():
    camera = CAMERAS[0]
    y, lower, upper = 0.3, np.array([-0.15, 0.1, 1.0]), np.array([0.1, 0.1, 1.3])
    floor = quad([(-2, y, 0.4), (2, y, 0.4), (2, y, 4), (-2, y, 4)])
    roof = quad(
        [
            (lower[0], 0.1, lower[2]),
            (upper[0], 0.1, lower[2]),
            (upper[0], 0.1, upper[2]),
            (lower[0], 0.1, upper[2]),
        ]
    )
    to_light = np.array([0.4, -0.8, -0.3])
    to_light /= np.linalg.norm(to_light)
    light = Light(direction=tuple(to_light), color=(3, 3, 3), radius=0)
    frame = render(scene(floor, roof, lights=[light]), camera, refine_rays=0)
    point = rays(camera) * frame.depth[..., None]
    at_roof = point + (0.1 - y) / to_light[1] * to_light
    margin = np.minimum(at_roof - lower, upper - at_roof)[..., [0, 2]].min(axis=-1)
    on_floor = (frame.label == 1) & (np.abs(margin) > 1e-3)
    is_dark = frame.rgb.max(axis=-1) == 0
    assert np.count_nonzero(on_floor & (margin > 0)) > 50
    np.testing.assert_array_equal(is_dark[on_floor], (margin > 0)[on_floor])


def test_uv_zero_is_the_lower_left_corner_of_a_texture_and_it_repeats():
    colors = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]], np.uint8)
    texture = colors.repeat(32, axis=0).repeat(32, axis=1)
    look = Material(color=(1.0, 1.0, 1.0), texture=texture, emission=1.0)
    camera = Camera(100, 100, 50, 50, 100, 100)
    plate = facing(-0.5, -0.5, 0.5, 0.5, 1, look)
    rgb = render(scene(plate), camera, refine_rays=0).rgb
    for row, v in enumerate((25, 75)):
        for column, u in enumerate((25, 75)):
            np.testing.assert_allclose(rgb[v, u], colors[row, column] / 255, atol=1e-5)
    twice = render(scene(replace(plate, uv=2 * plate.uv)), camera, refine_rays=0).rgb
    for v in (12, 62):
        for u in (12, 62):
            np.testing.assert_allclose(twice[v, u], [1, 0, 0], atol=1e-5)


def test_the_middle_of_the_environment_lies_ahead_and_its_top_above():
    environment = np.zeros((32, 64, 3))
    environment[:16, :, 0], environment[:, 32:, 1] = 1, 1  # red: upper half; green: right half
    behind_us = facing(-1, -1, 1, 1, -1)
    lookout = scene(behind_us, environment=environment, show_environment=True)
    frame = render(lookout, Camera(50, 50, 48, 48, 96, 96))
    for v, is_up in ((10, True), (86, False)):
        for u, is_right in ((10, False), (86, True)):
            np.testing.assert_allclose(frame.rgb[v, u], [is_up, is_right, 0], atol=1e-5)
    np.testing.assert_array_equal(frame.coverage, 0)


def mean_radiance(coefficients: np.ndarray, direction: np.ndarray) -> np.ndarray:
    x, y, z = direction
    basis = [1, y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y]
    return np.array(basis) @ coefficients


def test_a_constant_environment_is_that_constant_in_every_direction():
    constant = np.array([0.3, 0.7, 1.1])
    coefficients = diffuse_environment(np.tile(constant, (32, 64, 1)))
    for direction in np.random.default_rng(0).normal(size=(20, 3)):
        direction /= np.linalg.norm(direction)
        np.testing.assert_allclose(mean_radiance(coefficients, direction), constant, rtol=2e-3)


def test_light_from_above_dims_by_two_thirds_of_the_cosine():
    """The cosine-weighted mean of 1 + l·y about n is 1 + 2/3 n·y."""
    height = np.cos((np.arange(64) + 0.5) / 64 * np.pi)
    environment = np.broadcast_to(1 + height[:, None, None], (64, 128, 3))
    coefficients = diffuse_environment(environment)
    for direction in np.random.default_rng(0).normal(size=(20, 3)):
        direction /= np.linalg.norm(direction)
        expected = 1 + 2 / 3 * direction[1]
        np.testing.assert_allclose(mean_radiance(coefficients, direction), expected, atol=5e-3)


def test_a_matt_wall_under_a_constant_sky_shines_as_bright_as_the_sky():
    sky = np.full((32, 64, 3), 0.5)
    wall = facing(-2, -2, 2, 2, 1)
    rgb = render(scene(wall, environment=sky), CAMERAS[0]).rgb
    np.testing.assert_allclose(rgb, 0.5, rtol=0.06)  # and a little gloss
