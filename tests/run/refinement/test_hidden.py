"""What stands before an object hides it; an estimate does not shrink away from that."""

import numpy as np
import pytest

from r2art.core.category import Category
from r2art.data.categories import make_instance, staging
from r2art.data.prior import category_prior
from r2art.run.refinement.body import body_of
from r2art.run.refinement.hidden import FAR, convex_hull, hidden, silhouette
from r2art.run.refinement.pose import pose_of, posed, rotation_of
from r2art.run.refinement.refine import refine, resolutions
from r2art.run.refinement.uncertainty import Uncertainty

SIDE = 80
K = np.array([[130.0, 0, SIDE / 2], [0, 130, SIDE / 2], [0, 0, 1]])
STATE = np.array([1.7])
OF_NETWORK = Uncertainty(rotation=0.16, place=0.02, log_depth=0.04, joint=0.14, outline=0.015)


@pytest.fixture(scope="module")
def laptop() -> Category:
    return category_prior([make_instance("laptop", s) for s in range(4)], staging("laptop"))


@pytest.fixture(scope="module")
def root() -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = rotation_of(np.array([0.5, 0.2, 0.0])) @ np.diag([1.0, -1.0, -1.0])
    pose[:3, 3] = 0.0, 0.05, 0.9
    return pose


@pytest.fixture(scope="module")
def scene(laptop, root):
    """The body, where it is, and its silhouette."""
    body = body_of(laptop)
    at = posed(body, pose_of(body, root, STATE))
    return body, at, silhouette(body, at, K, (SIDE, SIDE))


def test_the_hull_of_points_is_what_holds_them():
    rng = np.random.default_rng(0)
    square = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]
    inner = [tuple(p) for p in rng.uniform(0.5, 3.5, (30, 2))]
    assert set(convex_hull([*inner, *square, (2.0, 0.0)])) == set(square)
    assert convex_hull([(1.0, 1.0)] * 3) == [(1.0, 1.0)]
    line = convex_hull([(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)])
    assert set(line) == {(0.0, 0.0), (2.0, 2.0)}


def test_the_silhouette_is_where_the_parts_are(scene):
    body, at, shape = scene
    assert 0.05 < shape.mean() < 0.6
    for p, tips in enumerate(body.tips):
        x = at.rotation[0, p] @ tips + at.translation[0, p, :, None]
        u, v = (K @ (x / x[2]))[:2]
        inside = shape[np.clip(v, 0, SIDE - 1).astype(int), np.clip(u, 0, SIDE - 1).astype(int)]
        assert inside.mean() > 0.9


def test_behind_the_camera_there_is_none(laptop, root):
    body, behind = body_of(laptop), root.copy()
    behind[2, 3] = -0.9
    at = posed(body, pose_of(body, behind, STATE))
    assert not silhouette(body, at, K, (SIDE, SIDE)).any()
    assert not hidden(body, at, np.ones((SIDE, SIDE)), K).any()


def test_what_is_seen_whole_has_nothing_hidden(scene):
    body, at, shape = scene
    assert not hidden(body, at, shape.astype(float), K).any()
    beside = np.roll(shape, round(FAR * SIDE) - 2, axis=1)  # an estimate that is a little off
    assert not hidden(body, at, beside.astype(float), K).any()


def test_behind_a_thing_the_mask_knows_nothing(scene):
    body, at, shape = scene
    columns = np.flatnonzero(shape.any(axis=0))
    cut = columns[0] + 2 * len(columns) // 3
    seen = shape.copy()
    seen[:, cut:] = False
    found = hidden(body, at, seen.astype(float), K)
    assert not found[~shape].any()
    assert not found[:, :cut].any()
    assert found[:, cut:].sum() > 0.9 * shape[:, cut:].sum()


def test_so_it_stays_where_it_was(laptop, root, scene):
    """A right estimate is drawn away by the mask of two thirds, unless the rest is unknown."""
    body, at, shape = scene
    columns = np.flatnonzero(shape.any(axis=0))
    seen = shape.astype(float)
    seen[:, columns[0] + 2 * len(columns) // 3 :] = 0
    known = 1.0 * ~hidden(body, at, seen, K)

    def moved(known):
        found = refine(
            resolutions(laptop),
            root,
            STATE,
            seen,
            K,
            known=known,
            uncertainty=OF_NETWORK,
            starts=1,
            steps=(3, 6, 0, 2, 0),
        )
        return np.linalg.norm(found.cam_T_root[:3, 3] - root[:3, 3])

    assert moved(known) < 0.3 * moved(np.ones_like(seen))
