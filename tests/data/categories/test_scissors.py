"""Laws of scissors."""

import numpy as np
import pytest

from r2art.data.categories import make_instance
from r2art.data.pose import root_T_part
from r2art.data.shape import Instance
from r2art.data.staging import UPRIGHT

MAIN, OTHER = range(2)


@pytest.fixture(scope="module")
def scissors() -> list[Instance]:
    return [make_instance("scissors", seed) for seed in range(60)]


def vertices(part) -> np.ndarray:
    return np.concatenate([s.vertices for s in part])


def about_pivot(instance: Instance, share: float) -> list[np.ndarray]:
    """Vertices of both halves with the joint open by a share of its limit, from its pivot."""
    joint = instance.joints[0]
    poses = root_T_part(instance.joints, np.array([share * joint.limits[1]]))
    parts = [vertices(part) for part in instance.parts]
    moved = [v @ T[:3, :3].T + T[:3, 3] for v, T in zip(parts, poses, strict=True)]
    return [v - joint.pivot for v in moved]


def widest_gap(part, z_pivot: float) -> float:
    """Greatest distance (m) in x without material within a handle: across its loop."""
    corners = np.concatenate([s.vertices[s.faces] for s in part])
    best = 0.0
    for z in np.linspace(z_pivot + 0.02, corners[..., 2].max() - 0.002, 40):
        low, high = corners[..., 2].min(axis=1), corners[..., 2].max(axis=1)
        x = np.sort(corners[(low <= z) & (high >= z)][..., 0], axis=1)
        if len(x) == 0:
            continue
        order = np.argsort(x[:, 0])
        reach = np.maximum.accumulate(x[order, -1])
        best = max(best, float((x[order, 0][1:] - reach[:-1]).max(initial=0.0)))
    return best


def test_sizes_are_those_of_real_scissors(scissors):
    for instance in scissors:
        whole = np.concatenate(about_pivot(instance, 0.0))
        length, height = np.ptp(whole[:, 2]), np.ptp(whole[:, 1])
        assert 0.085 < length < 0.275
        assert 0.002 < height < 0.02
        assert 0.2 * length < np.ptp(whole[:, 0]) < 0.72 * length


def test_blades_point_away_from_the_user_and_handles_lie_side_by_side(scissors):
    for instance in scissors:
        main, other = about_pivot(instance, 0.0)
        for half in (main, other):
            assert half[:, 2].min() < -0.02
            assert half[:, 2].max() > 0.03
            tip = half[np.argmin(half[:, 2])]
            assert abs(tip[0]) < 0.006
        behind = 0.45 * main[:, 2].max()
        assert main[main[:, 2] > behind, 0].min() > -3e-4
        assert other[other[:, 2] > behind, 0].max() < 3e-4


def test_opening_takes_the_other_handle_to_the_left_and_its_tip_to_the_right(scissors):
    for instance in scissors:
        joint = instance.joints[0]
        assert joint.axis == (0.0, -1.0, 0.0)
        assert np.radians(45) <= joint.limits[1] <= np.radians(75)
        _, closed = about_pivot(instance, 0.0)
        _, opened = about_pivot(instance, 1.0)
        handle, tip = np.argmax(closed[:, 2]), np.argmin(closed[:, 2])
        assert opened[handle, 0] < closed[handle, 0] - 0.02
        assert opened[tip, 0] > closed[tip, 0] + 0.015


def test_blades_slide_on_each_other_without_touching(scissors):
    uppers = 0
    for instance in scissors:
        main, other = (half[half[:, 2] < -0.008] for half in about_pivot(instance, 0.0))
        places = np.unique(main[:, 2].round(9))
        places = [z for z in places if (np.abs(other[:, 2] - z) < 1e-8).any()]
        assert len(places) > 8
        sides = set()
        for z in places:
            first, second = (h[np.abs(h[:, 2] - z) < 1e-8, 1] for h in (main, other))
            assert first.min() > second.max() or second.min() > first.max()
            sides.add(bool(first.min() > second.max()))
        assert len(sides) == 1
        uppers += sides.pop()
    assert uppers < 0.3 * len(scissors)


def test_the_main_loop_is_no_smaller_and_only_equal_ones_always_lie_upright(scissors):
    equal = 0
    for instance in scissors:
        sizes = [np.ptp(v[v[:, 2] > 0.02], axis=0) for v in about_pivot(instance, 0.0)]
        assert sizes[MAIN][2] > sizes[OTHER][2] - 1e-6
        alike = np.allclose(sizes[MAIN], sizes[OTHER], atol=1e-6)
        assert alike == (instance.rests == (UPRIGHT,))
        equal += alike
    assert 0.05 < equal / len(scissors) < 0.5


def test_fingers_fit_through_both_loops(scissors):
    for instance in scissors:
        z = instance.joints[0].pivot[2]
        for part in instance.parts:
            assert 0.015 < widest_gap(part, z) < 0.04
