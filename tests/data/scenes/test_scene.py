"""Labelled photos: pose, box, mask and depth must all tell of the same object."""

from dataclasses import fields, replace

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from r2art.data.categories import CATEGORIES, make_instance, staging
from r2art.data.pose import posed_vertices, root_T_part, transformed
from r2art.data.rendering.render import render_labels
from r2art.data.sample import BACKDROP, Sample
from r2art.data.scenes.scene import LEAST_SEEN, make_sample
from r2art.data.scenes.surroundings import Surroundings
from r2art.data.shape import Instance
from r2art.data.staging import Staging, View, facing_rotation, place_object

SIZE = 128
FRONTAL = View(azimuth=0, elevation=0, roll=0, fov=0.8, fill=0.7, place=(0.5, 0.5))
NO_FILES = Surroundings()


def photograph(category: str, seed: int) -> tuple[Instance, Sample]:
    instance = make_instance(category, seed)
    rng = np.random.default_rng(seed)
    return instance, make_sample(rng, instance, staging(category), NO_FILES, SIZE)


@pytest.fixture(scope="module")
def photos() -> list[tuple[Instance, Sample]]:
    return [photograph(category, seed) for category in CATEGORIES for seed in range(5)]


def some_object(seed: int) -> tuple[np.random.Generator, np.ndarray]:
    rng = np.random.default_rng(seed)
    instance = make_instance(("laptop", "drawer")[seed % 2], seed)
    state = Staging().sample_joint_state(rng, instance.joints)
    return rng, posed_vertices(instance, root_T_part(instance.joints, state))


@pytest.mark.parametrize("seed", range(12))
def test_the_box_is_that_of_the_projected_object_which_is_all_in_front(seed):
    rng, vertices = some_object(seed)
    for _ in range(5):
        camera, cam_T_root, box = place_object(Staging().sample_view(rng), vertices, SIZE)
        in_camera = vertices @ cam_T_root[:3, :3].T + cam_T_root[:3, 3]
        assert in_camera[:, 2].min() > 0
        uv = camera.project(in_camera)
        np.testing.assert_allclose(box, [*uv.min(axis=0), *uv.max(axis=0)], atol=1e-9)


@pytest.mark.parametrize("seed", range(12))
def test_the_object_fills_the_image_as_asked_and_stands_where_asked(seed):
    rng, vertices = some_object(seed)
    view = View(
        azimuth=rng.uniform(-1, 1),
        elevation=rng.uniform(0, 0.8),
        roll=rng.uniform(-0.2, 0.2),
        fov=rng.uniform(0.4, 0.8),
        fill=rng.uniform(0.4, 0.8),
        place=(rng.random(), rng.random()),
    )
    camera, _, box = place_object(view, vertices, SIZE)
    extent = box[2:] - box[:2]
    assert extent.max() == pytest.approx(view.fill * SIZE, rel=0.01)
    np.testing.assert_allclose(box[:2] / (SIZE - extent), view.place, atol=0.01)
    longest = 2 * np.arctan(SIZE / 2 / camera.fx)
    assert longest == pytest.approx(view.fov)


def seen_from(view: View) -> dict[str, np.ndarray]:
    """The root's axes as directions in the camera frame."""
    return dict(zip("xyz", facing_rotation(view).T, strict=True))


def test_from_straight_ahead_one_faces_the_front():
    axes = seen_from(FRONTAL)
    np.testing.assert_allclose(axes["x"], [1, 0, 0], atol=1e-12)  # right is right
    np.testing.assert_allclose(axes["y"], [0, -1, 0], atol=1e-12)  # up is up
    np.testing.assert_allclose(axes["z"], [0, 0, -1], atol=1e-12)  # the front comes nearer


def test_from_its_right_the_right_side_is_nearer_and_from_above_the_top():
    right = seen_from(replace(FRONTAL, azimuth=0.5))
    assert right["x"][2] == pytest.approx(-np.sin(0.5))
    assert right["z"][0] < 0  # and the front points to the image's left
    above = seen_from(replace(FRONTAL, elevation=0.5))
    assert above["y"][2] == pytest.approx(-np.sin(0.5))
    assert above["y"][1] < 0  # up still points up
    rolled = seen_from(replace(FRONTAL, azimuth=0.5, elevation=0.5, roll=0.3))
    level = seen_from(replace(FRONTAL, azimuth=0.5, elevation=0.5))
    for axis in "xyz":
        assert rolled[axis][2] == pytest.approx(level[axis][2])  # roll keeps all depths
        x, y = level[axis][:2]
        turned = [np.cos(0.3) * x - np.sin(0.3) * y, np.sin(0.3) * x + np.cos(0.3) * y]
        np.testing.assert_allclose(rolled[axis][:2], turned)


def test_views_turn_without_mirroring():
    rng = np.random.default_rng(0)
    for _ in range(20):
        R = facing_rotation(Staging().sample_view(rng))
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(R) > 0


def on_part(sample: Sample, part: int) -> np.ndarray:
    """(n, 3) what the pixels of a part see, carried to its frame by depth, camera and pose."""
    v, u = np.nonzero(sample.mask == part + 1)
    z, camera = sample.depth[v, u], sample.camera
    x, y = (u + 0.5 - camera.cx) / camera.fx, (v + 0.5 - camera.cy) / camera.fy
    points = np.stack([x * z, y * z, z, np.ones_like(z)], axis=-1)
    return (points @ np.linalg.inv(sample.cam_T_part[part]).T)[:, :3]


def test_every_pixel_of_a_part_lies_in_its_box_at_rest(photos):
    """Mask, depth, camera, pose, joint state and box close."""
    pixels = 0
    for _, sample in photos:
        for part, (center, size) in enumerate(zip(sample.box_center, sample.box_size, strict=True)):
            points = on_part(sample, part)
            pixels += len(points)
            assert np.all(np.abs(points - center) <= size / 2 + 1e-3)
    assert pixels > 10_000


def test_every_pixel_of_a_part_lies_on_its_surface(photos):
    for instance, sample in photos:
        for part, surfaces in enumerate(instance.parts):
            points = on_part(sample, part)
            if len(points) < 20:
                continue
            mesh = trimesh.util.concatenate(
                [trimesh.Trimesh(s.vertices, s.faces, process=False) for s in surfaces]
            )
            cloud, _ = trimesh.sample.sample_surface(mesh, 20_000, seed=0)
            distance, _ = cKDTree(cloud).query(points)
            spacing = np.sqrt(mesh.area / len(cloud))
            assert np.quantile(distance, 0.95) < 2 * spacing
            assert distance.max() < 6 * spacing


def test_points_of_a_part_project_into_its_silhouette(photos):
    for instance, sample in photos:
        for part, surfaces in enumerate(instance.parts):
            moved = [transformed(s, sample.cam_T_part[part]) for s in surfaces]
            whole = render_labels(moved, [1] * len(moved), sample.camera) > 0
            assert np.all(whole[sample.mask == part + 1])
            faces = np.concatenate([s.vertices[s.faces] for s in moved])
            pixel = np.floor(sample.camera.project(faces.mean(axis=1))).astype(int)
            inside = np.all((pixel >= 1) & (pixel < SIZE - 1), axis=1)
            u, v = pixel[inside].T
            near = np.max([whole[v + a, u + b] for a in (-1, 0, 1) for b in (-1, 0, 1)], axis=0)
            area = np.linalg.norm(
                np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]), axis=1
            )[inside]  # what is thinner than a pixel may slip between rays, but it is small
            assert near @ area >= 0.98 * area.sum()


def test_the_visible_share_is_that_of_the_whole_silhouette(photos):
    shares = []
    for instance, sample in photos:
        assert np.all((sample.visible >= 0) & (sample.visible <= 1))
        for part, surfaces in enumerate(instance.parts):
            moved = [transformed(s, sample.cam_T_part[part]) for s in surfaces]
            whole = np.count_nonzero(render_labels(moved, [1] * len(moved), sample.camera))
            if whole > 400:
                share = np.count_nonzero(sample.mask == part + 1) / whole
                shares.append(share)
                assert sample.visible[part] == pytest.approx(share, abs=0.01)
    assert min(shares) < 0.5
    assert max(shares) > 0.95


def test_whole_silhouettes_are_those_of_the_parts_alone(photos):
    for instance, sample in photos:
        assert sample.amodal.dtype == np.uint16
        assert sample.amodal.max() < 1 << len(instance.parts)
        for part, surfaces in enumerate(instance.parts):
            moved = [transformed(s, sample.cam_T_part[part]) for s in surfaces]
            alone = render_labels(moved, [1] * len(moved), sample.camera) == 1
            whole = (sample.amodal >> part & 1).astype(bool)
            assert np.all(whole[sample.mask == part + 1])
            assert np.count_nonzero(whole != alone) <= 2 + 0.002 * np.count_nonzero(alone)


def test_a_good_part_of_every_object_is_seen(photos):
    shares = []
    for _, sample in photos:
        seen = np.count_nonzero((sample.mask > 0) & (sample.mask != BACKDROP))
        shares.append(seen / np.count_nonzero(sample.amodal))
    assert min(shares) >= LEAST_SEEN
    assert np.mean(np.array(shares) < 0.95) > 0.05  # and some are partly hidden


def test_labels_keep_their_promises(photos):
    for instance, sample in photos:
        v, u = np.nonzero((sample.mask > 0) & (sample.mask != BACKDROP))
        x1, y1, x2, y2 = sample.box
        assert x1 - 1 <= u.min() + 0.5
        assert u.max() + 0.5 <= x2 + 1
        assert y1 - 1 <= v.min() + 0.5
        assert v.max() + 0.5 <= y2 + 1
        assert set(np.unique(sample.mask)) <= {*range(len(instance.parts) + 1), BACKDROP}
        assert np.all(sample.depth[sample.mask == BACKDROP] == 0)
        limits = np.array([j.limits for j in instance.joints])
        assert np.all((sample.joint_state >= limits[:, 0]) & (sample.joint_state <= limits[:, 1]))
        relative = np.linalg.inv(sample.cam_T_part[0]) @ sample.cam_T_part
        expected = root_T_part(instance.joints, sample.joint_state)
        np.testing.assert_allclose(relative, expected, atol=1e-9)
        assert sample.image.shape == (SIZE, SIZE, 3)
        assert sample.image.std() > 3


def test_a_photo_can_be_made_again_to_the_byte(photos):
    _, sample = photos[0]
    _, again = photograph(CATEGORIES[0], 0)
    for field in fields(Sample):
        first, second = getattr(sample, field.name), getattr(again, field.name)
        if field.name == "camera":
            assert first == second
        else:
            assert first.tobytes() == second.tobytes()
