"""Laws of glasses."""

import numpy as np
import pytest

from r2art.data.categories import make_instance
from r2art.data.pose import root_T_part
from r2art.data.shape import Instance

FRAME, LEFT, RIGHT = range(3)


@pytest.fixture(scope="module")
def glasses() -> list[Instance]:
    return [make_instance("eyeglasses", seed) for seed in range(60)]


def vertices(part) -> np.ndarray:
    return np.concatenate([s.vertices for s in part])


def moved(instance: Instance, share: float) -> list[np.ndarray]:
    """Vertices of every part with all joints open by a share of their limits."""
    state = share * np.array([j.limits[1] for j in instance.joints])
    poses = root_T_part(instance.joints, state)
    parts = [vertices(part) for part in instance.parts]
    return [v @ T[:3, :3].T + T[:3, 3] for v, T in zip(parts, poses, strict=True)]


def surface_points(part, count: int = 8000) -> np.ndarray:
    rng = np.random.default_rng(0)
    corners = np.concatenate([s.vertices[s.faces] for s in part])
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=-1
    )
    chosen = corners[rng.choice(len(corners), count, p=area / area.sum())]
    weights = rng.dirichlet(np.ones(3), count)
    return np.einsum("nk,nkc->nc", weights, chosen)


def depth_by_cell(points: np.ndarray, cell: float = 0.002) -> dict[tuple[int, int], tuple]:
    """Least and greatest z over each cell of the x-y plane."""
    cells: dict[tuple[int, int], list[float]] = {}
    for (i, j), z in zip(np.floor(points[:, :2] / cell).astype(int), points[:, 2], strict=True):
        cells.setdefault((int(i), int(j)), []).append(float(z))
    return {key: (min(z), max(z)) for key, z in cells.items()}


def test_sizes_are_those_of_real_glasses(glasses):
    sizes = np.stack([i.part_boxes()[1] for i in glasses])
    assert ((sizes[:, FRAME, 0] > 0.124) & (sizes[:, FRAME, 0] < 0.152)).all()
    assert ((sizes[:, FRAME, 1] > 0.027) & (sizes[:, FRAME, 1] < 0.068)).all()
    for temple in (LEFT, RIGHT):
        assert ((sizes[:, temple, 0] > 0.115) & (sizes[:, temple, 0] < 0.152)).all()


def test_axes_and_limits_are_the_conventions(glasses):
    for instance in glasses:
        left, right = instance.joints
        assert left.axis == (0.0, 1.0, 0.0)
        assert right.axis == (0.0, -1.0, 0.0)
        assert left.pivot[0] == pytest.approx(-right.pivot[0], abs=1e-3)
        assert right.pivot[0] > 0.055
        for joint in instance.joints:
            assert np.radians(85) <= joint.limits[1] <= np.radians(98)


def test_folded_temples_lie_along_the_back_of_the_front(glasses):
    for instance in glasses:
        frame, left, right = moved(instance, 0.0)
        for temple, side in ((left, -1), (right, 1)):
            size = np.ptp(temple, axis=0)
            assert size[0] > 5 * size[2]
            assert size[0] > 2 * size[1]
            hinge = instance.joints[0 if side < 0 else 1].pivot
            tip = temple[np.argmax(-side * temple[:, 0])]
            assert -side * (tip[0] - hinge[0]) > 0.12
            assert temple[:, 2].mean() < np.median(frame[:, 2])


def test_open_temples_point_back_and_drop_behind_the_ears(glasses):
    for instance in glasses:
        _, left, right = moved(instance, 1.0)
        for temple, side in ((left, -1), (right, 1)):
            hinge = instance.joints[0 if side < 0 else 1].pivot
            tip = temple[np.argmin(temple[:, 2])]
            assert hinge[2] - tip[2] > 0.12
            assert temple[:, 2].max() < hinge[2] + 0.004
            assert abs(tip[0] - hinge[0]) < 0.025
            assert tip[1] < hinge[1] - 0.004


def test_folded_temples_pass_each_other(glasses):
    """Where they cross, seen from the front, one lies behind the other."""
    for instance in glasses:
        left, right = (depth_by_cell(surface_points(instance.parts[k])) for k in (LEFT, RIGHT))
        shared = left.keys() & right.keys()
        assert shared
        depth = [min(left[c][1], right[c][1]) - max(left[c][0], right[c][0]) for c in shared]
        assert np.mean(np.array(depth) > 3e-4) < 0.05


def test_folded_temples_stay_behind_rims_and_lenses(glasses):
    for instance in glasses:
        frame = depth_by_cell(surface_points(instance.parts[FRAME]))
        for k in (LEFT, RIGHT):
            temple = depth_by_cell(surface_points(instance.parts[k]))
            inside = [c for c in frame.keys() & temple.keys() if abs(c[0]) * 0.002 < 0.055]
            cut = [temple[c][1] > frame[c][1] - 1e-3 for c in inside]
            assert np.mean(cut) < 0.04


def test_upright_they_rest_on_rims_and_tips(glasses):
    for instance in glasses:
        state = np.full(2, np.pi / 2)
        poses = root_T_part(instance.joints, state)
        R = instance.rests[0].rotation()
        low = [
            float(((vertices(p) @ T[:3, :3].T + T[:3, 3]) @ R.T)[:, 1].min())
            for p, T in zip(instance.parts, poses, strict=True)
        ]
        np.testing.assert_allclose(low, min(low), atol=2e-3)


def test_some_are_seen_through_and_some_are_dark(glasses):
    closed = 0
    for instance in glasses:
        frame = vertices(instance.parts[FRAME])
        eye = np.array([0.031, 0.0])
        closed += bool((np.linalg.norm(frame[:, :2] - eye, axis=-1) < 0.009).any())
    assert 0.2 < closed / len(glasses) < 0.7
