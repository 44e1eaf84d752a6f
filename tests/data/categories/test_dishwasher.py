"""Laws of dishwashers."""

import numpy as np
import pytest
from winding import share_inside

from r2art.data.categories import make_instance
from r2art.data.pose import root_T_part
from r2art.data.shape import Instance

BODY, DOOR = range(2)


@pytest.fixture(scope="module")
def dishwashers() -> list[Instance]:
    return [make_instance("dishwasher", seed) for seed in range(60)]


def vertices(part) -> np.ndarray:
    return np.concatenate([s.vertices for s in part])


def opened(instance: Instance, angle: float) -> np.ndarray:
    """The door's vertices at an angle (rad)."""
    T = root_T_part(instance.joints, np.array([angle]))[DOOR]
    return vertices(instance.parts[DOOR]) @ T[:3, :3].T + T[:3, 3]


def test_sizes_are_those_of_the_market(dishwashers):
    size = np.stack([i.part_boxes()[1] for i in dishwashers])[:, BODY]
    standard = np.array([0.448, 0.55, 0.6])
    nearest = np.abs(size[:, :1] - standard)
    assert (nearest.min(axis=1) < 0.012).all()
    assert set(nearest.argmin(axis=1)) == {0, 1, 2}
    tabletop = size[:, 1] < 0.5
    assert (size[tabletop, 1] > 0.43).all()
    assert ((size[~tabletop, 1] > 0.81) & (size[~tabletop, 1] < 0.93)).all()
    assert 0.05 < tabletop.mean() < 0.25
    assert ((size[:, 2] > 0.42) & (size[:, 2] < 0.68)).all()


def test_the_hinge_runs_along_the_lower_front_edge(dishwashers):
    for instance in dishwashers:
        joint, (center, size) = instance.joints[0], instance.part_boxes()
        assert instance.part_names == ("body", "door")
        assert (joint.kind, joint.parent, joint.axis) == ("revolute", 0, (1.0, 0.0, 0.0))
        low, high = center - size / 2, center + size / 2
        assert joint.pivot[1] == pytest.approx(low[DOOR, 1], abs=0.01)
        assert low[DOOR, 2] < joint.pivot[2] < high[DOOR, 2]
        assert joint.limits[0] == 0.0
        assert np.radians(80) <= joint.limits[1] <= np.radians(95)


def test_the_door_falls_open_towards_the_user_and_not_through_the_floor(dishwashers):
    for instance in dishwashers:
        joint, door = instance.joints[0], vertices(instance.parts[DOOR])
        top = np.argmax(door[:, 1])
        tall = door[top, 1] - joint.pivot[1]
        half, full = opened(instance, np.pi / 4), opened(instance, joint.limits[1])
        assert half[top, 2] > door[top, 2] + 0.5 * tall
        assert full[top, 2] > joint.pivot[2] + 0.9 * tall
        assert full[:, 1].min() > vertices(instance.parts[BODY])[:, 1].min()


def test_shut_the_door_covers_the_front_and_stays_within_the_body_s_sides(dishwashers):
    for instance in dishwashers:
        center, size = instance.part_boxes()
        low, high = center - size / 2, center + size / 2
        assert low[DOOR, 0] > low[BODY, 0] - 1e-9
        assert high[DOOR, 0] < high[BODY, 0] + 1e-9
        assert size[DOOR, 0] * size[DOOR, 1] > 0.75 * size[BODY, 0] * size[BODY, 1]
        assert high[DOOR, 2] > vertices(instance.parts[BODY])[:, 2].min() + 0.9 * size[BODY, 2]


@pytest.mark.parametrize("share", [0.0, 0.15, 0.5, 1.0])
def test_the_door_is_nowhere_within_the_body_or_its_racks(dishwashers, share):
    for instance in dishwashers[::20]:
        assert share_inside(instance, share * instance.joints[0].limits[1]) < 0.01


def test_racks_can_be_seen_through_the_open_front(dishwashers):
    """Rays from the front meet wires and dishes before the rear wall of the tub."""
    for instance in dishwashers:
        body, (center, size) = vertices(instance.parts[BODY]), instance.part_boxes()
        middle = np.abs(body - center[DOOR])[:, :2] < 0.35 * size[DOOR, :2]
        seen = body[middle.all(axis=1)]
        front, back = center[DOOR, 2], body[:, 2].min()
        between = (seen[:, 2] < front - 0.08) & (seen[:, 2] > back + 0.1)
        assert between.sum() > 300


def test_front_and_controls_vary(dishwashers):
    """Handles, pockets, strips and furniture fronts give the doors many outlines."""
    depth = np.array([i.part_boxes()[1][DOOR, 2] for i in dishwashers])
    pieces = {len(i.parts[DOOR]) for i in dishwashers}
    assert depth.std() > 0.01
    assert len(pieces) > 6
