"""Laws of procedural categories: every one keeps them, whatever it generates."""

import numpy as np
import pytest

from r2art.core.category import Category
from r2art.core.errors import UsageError
from r2art.data import categories
from r2art.data.categories import CATEGORIES, make_instance
from r2art.data.prior import category_prior
from r2art.data.shape import Instance, Surface

SEEDS = range(30)


@pytest.fixture(scope="module", params=CATEGORIES)
def some(request) -> list[Instance]:
    return [make_instance(request.param, seed) for seed in SEEDS]


def surfaces(instance: Instance) -> list[Surface]:
    return [s for part in instance.parts for s in part]


def vertices(part: tuple[Surface, ...] | list[Surface]) -> np.ndarray:
    return np.concatenate([s.vertices for s in part])


def looks(surface: Surface) -> tuple:
    m = surface.material
    texture = None if m.texture is None else (m.texture.shape, m.texture.tobytes())
    return m.color, m.roughness, m.metallic, m.emission, texture


def winding_normals(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    a, b, c = np.moveaxis(surface.vertices[surface.faces], 1, 0)
    normal = np.cross(b - a, c - a)
    return normal, np.linalg.norm(normal, axis=-1)


def test_the_same_seed_gives_the_same_bytes(some):
    for seed in (0, 7, 21):
        again = make_instance(some[seed].category, seed)
        assert again.joints == some[seed].joints
        for a, b in zip(surfaces(again), surfaces(some[seed]), strict=True):
            assert a.vertices.tobytes() == b.vertices.tobytes()
            assert a.uv.tobytes() == b.uv.tobytes()
            assert looks(a) == looks(b)


def test_every_seed_gives_another_object(some):
    assert len({vertices(surfaces(i)).tobytes() for i in some}) == len(some)


def test_joints_start_closed_and_their_axes_are_unit(some):
    for instance in some:
        assert len(instance.part_names) == len(instance.parts) == len(instance.joints) + 1
        for joint in instance.joints:
            assert joint.limits[0] <= 0.0 < joint.limits[1]
            assert np.linalg.norm(joint.axis) == pytest.approx(1, abs=1e-12)


def test_an_unknown_category_is_refused():
    with pytest.raises(UsageError, match="teapot"):
        make_instance("teapot", 0)


def test_the_root_box_is_centred_at_the_origin(some):
    for instance in some:
        np.testing.assert_allclose(instance.part_boxes()[0][0], 0, atol=1e-12)


def test_meshes_are_sound_and_small(some):
    for instance in some:
        assert sum(len(s.faces) for s in surfaces(instance)) < 12_000
        for s in surfaces(instance):
            assert np.isfinite(s.vertices).all()
            assert np.isfinite(s.uv).all()
            assert s.uv.shape == (len(s.vertices), 2)
            np.testing.assert_allclose(np.linalg.norm(s.normals, axis=-1), 1, atol=1e-6)
            assert s.faces.min() >= 0
            assert s.faces.max() < len(s.vertices)
            texture = s.material.texture
            assert texture is None or (texture.dtype == np.uint8 and max(texture.shape) <= 512)


def test_shading_normals_point_where_the_triangles_face(some):
    for instance in some:
        for s in surfaces(instance):
            normal, length = winding_normals(s)
            agrees = np.einsum("fc,fkc->fk", normal, s.normals[s.faces])[length > 1e-12]
            assert (agrees > -1e-12).mean() > 0.98


def test_the_prior_is_the_mean_object(some, tmp_path):
    prior = category_prior(some, categories.staging(some[0].category))
    log_sizes = np.log([i.part_boxes()[1] for i in some])
    np.testing.assert_allclose(np.log(prior.box_size), log_sizes.mean(axis=0), atol=1e-12)
    count = 2048 // len(prior.part_names)
    assert prior.points.shape == (len(prior.part_names), count, 3)
    inside = np.abs(prior.points - prior.box_center[:, None]) <= prior.box_size[:, None] / 2 + 1e-9
    assert inside.all()
    np.testing.assert_allclose(np.linalg.norm(prior.normals, axis=-1), 1, atol=1e-9)
    assert (prior.areas > 0).all()
    assert 0.2 < prior.frontal_area / prior.diagonal**2 < 1.2
    prior.save(tmp_path / "prior.npz")
    assert Category.load(tmp_path / "prior.npz").joints == prior.joints
