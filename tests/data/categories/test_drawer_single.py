"""Laws of furniture with one drawer."""

import numpy as np
import pytest
from winding import share_inside, winding_number

from r2art.data.categories import make_instance
from r2art.data.shape import Instance

CABINET, DRAWER = range(2)


@pytest.fixture(scope="module")
def cabinets() -> list[Instance]:
    return [make_instance("drawer_single", seed) for seed in range(80)]


def triangles(part) -> np.ndarray:
    return np.concatenate([s.vertices[s.faces] for s in part])


def sides(instance: Instance) -> tuple[np.ndarray, np.ndarray]:
    center, size = instance.part_boxes()
    return center - size / 2, center + size / 2


def test_sizes_go_from_a_matchbox_to_a_desk(cabinets):
    size = np.stack([i.part_boxes()[1] for i in cabinets])[:, CABINET]
    assert (size > (0.075, 0.02, 0.075)).all()
    assert (size < (1.0, 0.82, 0.6)).all()
    furniture = size[:, 1] > 0.39
    assert 0.3 < furniture.mean() < 0.75
    assert (size[furniture, 0] > 0.26).all()
    assert (size[furniture, 2] > 0.24).all()
    assert size[:, 0].std() > 0.12


def test_the_drawer_slides_towards_the_user_and_stays_in_its_opening(cabinets):
    for instance in cabinets:
        joint, (center, size) = instance.joints[0], instance.part_boxes()
        assert instance.part_names == ("cabinet", "drawer")
        assert (joint.name, joint.kind, joint.parent) == ("slide", "prismatic", 0)
        assert joint.axis == (0.0, 0.0, 1.0)
        np.testing.assert_allclose(joint.pivot, center[DRAWER], atol=1e-12)
        assert joint.limits[0] == 0.0
        assert 0.74 < joint.limits[1] / size[DRAWER, 2] < 0.96


def test_shut_the_drawer_lies_within_the_cabinet_but_for_its_front(cabinets):
    for instance in cabinets:
        low, high = sides(instance)
        assert (low[DRAWER, :2] > low[CABINET, :2] - 1e-3).all()
        assert (high[DRAWER, :2] < high[CABINET, :2] + 1e-3).all()
        assert low[DRAWER, 2] > low[CABINET, 2] + 1e-3
        assert -0.01 < high[DRAWER, 2] - high[CABINET, 2] < 0.07


@pytest.mark.parametrize("share", [0.0, 0.15, 0.5, 1.0])
def test_the_drawer_is_nowhere_within_the_cabinet(cabinets, share):
    for instance in cabinets[::4]:
        assert share_inside(instance, share * instance.joints[0].limits[1]) < 0.01


def test_the_cabinet_is_hollow_where_the_drawer_goes(cabinets):
    rng = np.random.default_rng(0)
    for instance in cabinets[::2]:
        low, high = sides(instance)
        inner = (0.1, 0.3, 0.1) + (0.8, 0.4, 0.8) * rng.random((40, 3))
        room = low[DRAWER] + inner * (high - low)[DRAWER]
        assert (winding_number(room, triangles(instance.parts[CABINET])) > 0.5).mean() < 0.06


def test_a_look_down_into_the_drawer_ends_at_its_bottom_and_some_hold_things(cabinets):
    rng, filled = np.random.default_rng(0), []
    for instance in cabinets:
        (low, high), drawer = sides(instance), triangles(instance.parts[DRAWER])
        size = (high - low)[DRAWER]
        flat = np.abs(np.ptp(drawer[..., 1], axis=1)) < 1e-9
        up = np.cross(drawer[:, 1] - drawer[:, 0], drawer[:, 2] - drawer[:, 0])[:, 1] > 1e-12
        span = np.ptp(drawer, axis=1)
        bottom = drawer[flat & up & (span[:, 0] > 0.7 * size[0]) & (span[:, 2] > 0.7 * size[2])]
        assert len(bottom) == 2
        assert bottom[..., 1].max() < low[DRAWER, 1] + 0.4 * size[1]
        inner = low[DRAWER] + (0.2, 0.3, 0.2) * size
        points = inner + rng.random((30, 3)) * size * (0.6, 0.2, 0.5)
        filled.append((winding_number(points, drawer) > 0.5).mean())
    assert np.mean(np.array(filled) < 0.05) > 0.2
    assert np.mean(np.array(filled) > 0.2) > 0.15


def test_forms_differ(cabinets):
    size = np.stack([i.part_boxes()[1] for i in cabinets])
    share = size[:, DRAWER, 1] / size[:, CABINET, 1]
    assert (share < 0.35).mean() > 0.25  # on legs, or with a shelf below
    assert (share > 0.6).mean() > 0.25  # little but the drawer
    for part in (CABINET, DRAWER):
        assert len({sum(len(s.faces) for s in i.parts[part]) for i in cabinets}) > 15
    assert len({i.parts[CABINET][0].material.color for i in cabinets}) > 30
