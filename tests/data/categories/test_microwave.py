"""Laws of microwave ovens."""

import numpy as np
import pytest
from winding import share_inside

from r2art.data.categories import make_instance
from r2art.data.pose import root_T_part
from r2art.data.shape import Instance

BODY, DOOR = range(2)


@pytest.fixture(scope="module")
def ovens() -> list[Instance]:
    return [make_instance("microwave", seed) for seed in range(60)]


def vertices(part) -> np.ndarray:
    return np.concatenate([s.vertices for s in part])


def opened(instance: Instance, angle: float) -> np.ndarray:
    """The door's vertices at an angle (rad)."""
    T = root_T_part(instance.joints, np.array([angle]))[DOOR]
    return vertices(instance.parts[DOOR]) @ T[:3, :3].T + T[:3, 3]


def test_sizes_are_those_of_the_market(ovens):
    size = np.stack([i.part_boxes()[1] for i in ovens])[:, BODY]
    assert (size > (0.43, 0.245, 0.32)).all()
    assert (size < (0.56, 0.345, 0.49)).all()
    assert (size.std(axis=0) > 0.012).all()


def test_the_hinge_is_upright_at_the_left_front_edge(ovens):
    for instance in ovens:
        joint, (center, size) = instance.joints[0], instance.part_boxes()
        assert instance.part_names == ("body", "door")
        assert (joint.kind, joint.parent, joint.axis) == ("revolute", 0, (0.0, -1.0, 0.0))
        low, high = center - size / 2, center + size / 2
        assert joint.pivot[0] == pytest.approx(low[DOOR, 0], abs=0.003)
        assert joint.pivot[0] == pytest.approx(low[BODY, 0], abs=0.02)
        assert low[DOOR, 2] < joint.pivot[2] < high[DOOR, 2]
        assert joint.limits[0] == 0.0
        assert np.radians(88) <= joint.limits[1] <= np.radians(135)


def test_the_free_end_swings_to_the_front_and_then_to_the_left(ovens):
    for instance in ovens:
        joint, door = instance.joints[0], vertices(instance.parts[DOOR])
        end = np.argmax(door[:, 0])
        wide = door[end, 0] - joint.pivot[0]
        quarter, full = opened(instance, np.pi / 2), opened(instance, joint.limits[1])
        assert quarter[end, 2] > joint.pivot[2] + 0.9 * wide
        assert abs(quarter[end, 0] - joint.pivot[0]) < 0.1
        reach = wide * np.cos(joint.limits[1])
        assert full[end, 0] - joint.pivot[0] == pytest.approx(reach, abs=0.1)


def test_the_controls_stand_at_the_right_of_the_door_and_belong_to_the_body(ovens):
    for instance in ovens:
        body, door = vertices(instance.parts[BODY]), vertices(instance.parts[DOOR])
        right = body[body[:, 0] > door[:, 0].max()]
        assert 0.15 < np.ptp(right[:, 0]) / np.ptp(body[:, 0]) < 0.32
        front = np.median(door[door[:, 2] > 0][:, 2])
        assert right[:, 2].max() > front - 0.005
        behind_door = body[body[:, 0] < door[:, 0].max()]
        assert behind_door[:, 2].max() < instance.joints[0].pivot[2] + 1e-9


@pytest.mark.parametrize("share", [0.0, 0.15, 0.5, 1.0])
def test_only_the_latches_reach_into_the_body_and_only_when_shut(ovens, share):
    for instance in ovens[::12]:
        within = share_inside(instance, share * instance.joints[0].limits[1])
        assert within < (0.015 if share == 0.0 else 0.005)


def test_the_cooking_space_is_hollow_and_reaches_deep(ovens):
    """From the middle of the door one looks at the rear wall, most of the body's depth away."""
    for instance in ovens:
        center, size = instance.part_boxes()
        triangles = np.concatenate([s.vertices[s.faces] for s in instance.parts[BODY]])
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        eye = center[DOOR, :2] + (0, 0.2 * size[DOOR, 1])
        edges = np.roll(triangles, -1, axis=1)[..., :2] - triangles[..., :2]
        to_eye = eye - triangles[..., :2]
        side = edges[..., 0] * to_eye[..., 1] - edges[..., 1] * to_eye[..., 0]
        hit = (side > 0).all(axis=1) & (normal[:, 2] > 1e-12)
        assert hit.any()
        depth = center[DOOR, 2] - triangles[hit, :, 2].max()
        assert depth > 0.6 * size[BODY, 2]
