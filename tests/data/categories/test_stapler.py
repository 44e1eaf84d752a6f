"""Laws of staplers."""

import numpy as np
import pytest

from r2art.data.categories import make_instance
from r2art.data.pose import root_T_part
from r2art.data.shape import Instance


@pytest.fixture(scope="module")
def staplers() -> list[Instance]:
    return [make_instance("stapler", seed) for seed in range(60)]


def vertices(part) -> np.ndarray:
    return np.concatenate([s.vertices for s in part])


def opened(instance: Instance, share: float) -> np.ndarray:
    """The arm's vertices, opened by a share of its range."""
    T = root_T_part(instance.joints, share * np.array([j.limits[1] for j in instance.joints]))[1]
    return vertices(instance.parts[1]) @ T[:3, :3].T + T[:3, 3]


def test_sizes_are_those_of_real_staplers(staplers):
    size = np.stack([i.part_boxes()[1] for i in staplers])
    length = size[:, 0, 2]
    assert ((length > 0.05) & (length < 0.301)).all()
    assert 0.11 < np.median(length) < 0.165
    assert length.std() > 0.025
    assert ((size[:, 0, 0] > 0.018) & (size[:, 0, 0] < 0.1)).all()
    assert (size[:, :, 0] < 0.75 * size[:, :, 2]).all()


def test_the_hinge_is_at_the_rear_and_lifts_the_mouth(staplers):
    for instance in staplers:
        joint = instance.joints[0]
        assert joint.kind == "revolute"
        assert joint.axis == (-1.0, 0.0, 0.0)
        assert np.radians(25) <= joint.limits[1] <= np.radians(170)
        assert joint.pivot[2] < -0.3 * instance.part_boxes()[1][0, 2]
        arm, lifted = vertices(instance.parts[1]), opened(instance, 0.2)
        mouth = np.argmax(arm[:, 2])
        reach = arm[mouth, 2] - joint.pivot[2]
        assert lifted[mouth, 1] > arm[mouth, 1] + 0.8 * reach * np.sin(0.2 * joint.limits[1])


def test_at_rest_the_mouth_gapes_a_little_over_the_anvil(staplers):
    for instance in staplers:
        base, arm = vertices(instance.parts[0]), vertices(instance.parts[1])
        front = arm[:, 2].max() - 0.012
        middle = 0.006
        anvil = base[(base[:, 2] > front) & (np.abs(base[:, 0]) < middle), 1].max()
        mouth = arm[(arm[:, 2] > front) & (np.abs(arm[:, 0]) < middle + 0.002), 1].min()
        assert 0.0015 < mouth - anvil < 0.03


def test_the_arm_neither_sinks_into_the_base_nor_below_the_desk(staplers):
    for instance in staplers:
        base, joint = vertices(instance.parts[0]), instance.joints[0]
        desk, floor = base[:, 1].min(), base[np.abs(base[:, 0]) < 0.004]
        rear = floor[floor[:, 2] < joint.pivot[2] - 0.004, 1].max()
        for share in (0.0, 0.5, 1.0):
            arm = opened(instance, share)
            assert arm[:, 1].min() > desk + 0.001
            behind = arm[(arm[:, 2] < joint.pivot[2]) & (arm[:, 2] > base[:, 2].min())]
            assert behind[:, 1].min(initial=1.0) > rear - 0.003


def test_they_differ_in_form(staplers):
    length = np.array([i.part_boxes()[1][0, 2] for i in staplers])
    arm_wide = np.array([i.part_boxes()[1][1, 0] for i in staplers])
    opening = np.array([i.joints[0].limits[1] for i in staplers])
    for some in (length < 0.09, length > 0.19, arm_wide > 0.026, arm_wide < 0.02):
        assert 0.03 < some.mean() < 0.6
    assert (opening > np.radians(140)).any()
    assert (opening < np.radians(50)).any()
