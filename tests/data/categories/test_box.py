"""Laws of boxes with a hinged lid."""

import numpy as np
import pytest
from winding import share_inside, winding_number

from r2art.data.categories import make_instance
from r2art.data.pose import root_T_part
from r2art.data.shape import Instance

BOX, LID = range(2)


@pytest.fixture(scope="module")
def boxes() -> list[Instance]:
    return [make_instance("box", seed) for seed in range(80)]


def vertices(part) -> np.ndarray:
    return np.concatenate([s.vertices for s in part])


def triangles(part) -> np.ndarray:
    return np.concatenate([s.vertices[s.faces] for s in part])


def opened(instance: Instance, angle: float) -> np.ndarray:
    """The lid's vertices at an angle (rad)."""
    T = root_T_part(instance.joints, np.array([angle]))[LID]
    return vertices(instance.parts[LID]) @ T[:3, :3].T + T[:3, 3]


def sides(instance: Instance) -> tuple[np.ndarray, np.ndarray]:
    center, size = instance.part_boxes()
    return center - size / 2, center + size / 2


def test_sizes_go_from_a_pocket_tin_to_a_trunk(boxes):
    size = np.stack([i.part_boxes()[1] for i in boxes])[:, BOX]
    assert (size > (0.07, 0.01, 0.045)).all()
    assert (size < (0.67, 0.42, 0.5)).all()
    width = size[:, 0]
    assert (width < 0.2).mean() > 0.1
    assert (width > 0.45).mean() > 0.1
    assert 0.2 < np.median(width) < 0.42


def test_the_hinge_runs_along_the_upper_rear_edge_and_lifts_the_front(boxes):
    for instance in boxes:
        joint, (low, high) = instance.joints[0], sides(instance)
        assert instance.part_names == ("box", "lid")
        assert (joint.kind, joint.parent, joint.axis) == ("revolute", 0, (-1.0, 0.0, 0.0))
        assert joint.limits[0] == 0.0
        assert np.radians(85) <= joint.limits[1] <= np.radians(185)
        assert joint.pivot[2] == pytest.approx(low[LID, 2], abs=0.01)
        assert high[BOX, 1] - 0.02 < joint.pivot[1] < high[BOX, 1] + 0.001
        lid = vertices(instance.parts[LID])
        front = np.argmax(lid[:, 2])
        reach = lid[front, 2] - joint.pivot[2]
        lifted = opened(instance, 0.3)[front, 1] - lid[front, 1]
        assert lifted > 0.6 * reach * np.sin(0.3)


def test_open_as_far_as_it_goes_the_lid_clears_the_opening_and_the_ground(boxes):
    for instance in boxes:
        joint, (low, _) = instance.joints[0], sides(instance)
        full = opened(instance, joint.limits[1])
        depth = instance.part_boxes()[1][BOX, 2]
        assert np.median(full[:, 2]) < joint.pivot[2] + 0.15 * depth
        assert full[:, 1].min() > low[BOX, 1]


def test_shut_the_lid_covers_the_box(boxes):
    for instance in boxes:
        low, high = sides(instance)
        size = high - low
        assert high[LID, 1] > high[BOX, 1]
        assert (size[LID, [0, 2]] > 0.8 * size[BOX, [0, 2]]).all()
        assert (np.abs((low + high)[LID] / 2)[[0, 2]] < 0.08 * size[BOX, [0, 2]] + 0.01).all()


@pytest.mark.parametrize("share", [0.0, 0.15, 0.5, 1.0])
def test_the_lid_is_nowhere_within_the_box_but_at_its_hinges(boxes, share):
    for instance in boxes[::5]:
        assert share_inside(instance, share * instance.joints[0].limits[1]) < 0.03


def test_a_look_down_into_the_open_box_ends_at_its_floor(boxes):
    """The lowest triangle of the box that faces up lies at most a wall above its underside."""
    for instance in boxes:
        (low, high), box = sides(instance), triangles(instance.parts[BOX])
        normal = np.cross(box[:, 1] - box[:, 0], box[:, 2] - box[:, 0])
        eye = (low + high)[LID, ::2] / 2 + (0.0013, 0.0017)
        edges = np.roll(box, -1, axis=1)[..., ::2] - box[..., ::2]
        to_eye = eye - box[..., ::2]
        side = edges[..., 0] * to_eye[..., 1] - edges[..., 1] * to_eye[..., 0]
        hit = (side < 0).all(axis=1) & (normal[:, 1] > 1e-12)
        assert hit.any()
        assert box[hit, :, 1].mean(axis=1).min() < low[BOX, 1] + 0.03


def test_boxes_are_hollow_and_some_hold_things(boxes):
    """How much of the room below the lid is solid: little on the whole, nothing in many."""
    rng = np.random.default_rng(0)
    filled = []
    for instance in boxes[::2]:
        low, high = sides(instance)
        size = high[BOX] - low[BOX]
        points = low[BOX] + size * (0.2, 0.25, 0.25)
        points = points + rng.random((40, 3)) * size * (0.6, 0.35, 0.5)
        within = winding_number(points, triangles(instance.parts[BOX])) > 0.5
        filled.append(within.mean())
    assert 0.05 < np.mean(filled) < 0.45
    assert np.mean(np.array(filled) < 0.05) > 0.15
    assert np.mean(np.array(filled) > 0.3) > 0.15


def test_boxes_differ_in_form_and_look(boxes):
    size = np.stack([i.part_boxes()[1] for i in boxes])
    flatness = np.log(size[:, BOX, 1] / size[:, BOX, 0])
    lid = np.log(size[:, LID, 1] / size[:, BOX, 1])
    assert flatness.std() > 0.3
    assert lid.std() > 0.3
    assert len({i.parts[BOX][0].material.color for i in boxes}) > 30
    assert len({round(float(np.degrees(i.joints[0].limits[1]))) for i in boxes}) > 25
