"""Laws of procedural objects: where parts are, how joints open them, how large they are."""

import numpy as np
import pytest

from r2art.core.category import Category
from r2art.core.errors import UsageError
from r2art.data.pose import root_T_part, transformed
from r2art.data.procedural import GENERATORS, make_instance
from r2art.data.procedural.curved import ellipsoid, prism
from r2art.data.procedural.prior import category_prior
from r2art.data.procedural.solids import FACE_NAMES, box, cylinder, decal, plate
from r2art.data.shape import Instance, Material, Surface

SEEDS = range(50)
PLAIN = Material()


@pytest.fixture(scope="module")
def instances() -> dict[str, list[Instance]]:
    return {name: [make_instance(name, seed) for seed in SEEDS] for name in GENERATORS}


@pytest.fixture(params=sorted(GENERATORS))
def some(request, instances) -> list[Instance]:
    return instances[request.param]


def surfaces(instance: Instance) -> list[Surface]:
    return [s for part in instance.parts for s in part]


def vertices(part: tuple[Surface, ...] | list[Surface]) -> np.ndarray:
    return np.concatenate([s.vertices for s in part])


def looks(surface: Surface) -> tuple:
    m = surface.material
    texture = None if m.texture is None else (m.texture.shape, m.texture.tobytes())
    return m.color, m.roughness, m.metallic, m.emission, texture


def volume(solid: tuple[Surface, ...]) -> float:
    corners = np.concatenate([s.vertices[s.faces] for s in solid])
    return float(np.einsum("fc,fc->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)


def winding_normals(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    a, b, c = np.moveaxis(surface.vertices[surface.faces], 1, 0)
    normal = np.cross(b - a, c - a)
    return normal, np.linalg.norm(normal, axis=-1)


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


def test_the_same_seed_gives_the_same_bytes(some):
    for seed in (0, 7, 31):
        again = make_instance(some[seed].category, seed)
        assert again.joints == some[seed].joints
        for a, b in zip(surfaces(again), surfaces(some[seed]), strict=True):
            assert a.vertices.tobytes() == b.vertices.tobytes()
            assert a.uv.tobytes() == b.uv.tobytes()
            assert looks(a) == looks(b)


def test_every_seed_gives_another_object(some):
    assert len({vertices(surfaces(i)).tobytes() for i in some}) == len(some)


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


def test_sizes_are_those_of_real_things(instances):
    laptops = np.stack([i.part_boxes()[1] for i in instances["laptop"]])
    assert ((laptops[:, 0, 0] > 0.25) & (laptops[:, 0, 0] < 0.42)).all()
    assert ((laptops[:, 0, 2] > 0.17) & (laptops[:, 0, 2] < 0.34)).all()
    assert ((laptops[:, 0, 1] > 0.007) & (laptops[:, 0, 1] < 0.065)).all()
    cabinets = np.stack([i.part_boxes()[1] for i in instances["drawer"]])[:, 0]
    assert (cabinets > (0.29, 0.44, 0.33)).all()
    assert (cabinets < (0.86, 0.81, 0.66)).all()


def test_a_closed_laptop_is_flat_and_its_lid_rises_at_the_front(instances):
    for instance in instances["laptop"]:
        center, size = instance.part_boxes()
        low, high = center - size / 2, center + size / 2
        assert high[:, 1].max() - low[:, 1].min() < 0.075
        assert low[1, 1] > center[0, 1]
        lid = vertices(instance.parts[1])
        front = lid[np.argmax(lid[:, 2])]
        T = root_T_part(instance.joints, np.array([np.pi / 2]))[1]
        raised = T[:3, :3] @ front + T[:3, 3]
        assert raised[1] > front[1] + 0.8 * size[1, 2]
        assert instance.joints[0].pivot[2] < -0.35 * size[0, 2]


def test_the_screen_faces_the_user_once_open(instances):
    for instance in instances["laptop"]:
        glowing = [s for s in instance.parts[1] if s.material.emission > 0]
        T = root_T_part(instance.joints, np.array([np.pi / 2]))[1]
        for s in glowing:
            opened = transformed(s, T)
            np.testing.assert_allclose(opened.normals[:, 2], 1, atol=1e-9)
            upper = opened.uv[:, 1] > 0.5
            assert opened.vertices[upper, 1].min() > opened.vertices[~upper, 1].max()
            right = opened.uv[:, 0] > 0.5
            assert opened.vertices[right, 0].min() > opened.vertices[~right, 0].max()


def test_drawers_slide_to_the_front_and_stay_within_the_cabinet(instances):
    for instance in instances["drawer"]:
        center, size = instance.part_boxes()
        assert instance.part_names == ("cabinet", "drawer_top", "drawer_middle", "drawer_bottom")
        assert (np.diff(center[1:, 1]) < 0).all()
        for k, joint in enumerate(instance.joints):
            assert joint.axis == (0.0, 0.0, 1.0)
            np.testing.assert_allclose(joint.pivot, center[k + 1], atol=1e-12)
            assert joint.limits[0] == 0.0
            assert 0.74 < joint.limits[1] / size[k + 1, 2] < 0.96


def test_closed_drawers_do_not_overlap_each_other_or_leave_the_cabinet(instances):
    for instance in instances["drawer"]:
        center, size = instance.part_boxes()
        low, high = center - size / 2, center + size / 2
        assert (low[1:3, 1] > high[2:4, 1] - 0.012).all()
        assert (low[1:, :2] > low[0, :2] - 1e-3).all()
        assert (high[1:, :2] < high[0, :2] + 1e-3).all()
        assert (low[1:, 2] > low[0, 2]).all()


@pytest.mark.parametrize("name", sorted(GENERATORS))
def test_the_prior_is_the_mean_object(name, instances, tmp_path):
    prior = category_prior(name, SEEDS)
    log_sizes = np.log([i.part_boxes()[1] for i in instances[name]])
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
