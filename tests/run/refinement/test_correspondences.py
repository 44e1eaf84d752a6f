"""Places that say which point they show: their errors, and how these move with the object."""

from dataclasses import replace

import numpy as np
import pytest

from r2art.run.refinement.body import Body
from r2art.run.refinement.correspondences import Correspondences, correspondence_errors
from r2art.run.refinement.pose import Pose, moved, pose_of, posed, rotation_of
from r2art.run.refinement.refine import resolutions

K = np.array([[220.0, 0, 80], [0, 210, 78], [0, 0, 1]])


@pytest.fixture(scope="module", params=["drawer", "eyeglasses"])
def bodies(request, predictor) -> tuple[Body, ...]:
    return resolutions(predictor.category(request.param).prior())


def some_pose(body: Body) -> Pose:
    cam_T_root = np.eye(4)
    cam_T_root[:3, :3] = rotation_of(np.array([2.9, 0.3, -0.2]))
    cam_T_root[:3, 3] = np.array([0.1, 0.05, 4.0]) * np.linalg.norm(body.size[0])
    return pose_of(body, cam_T_root, body.limits.mean(axis=1))


def places_of(body: Body, pose: Pose, each: int = 25, deviation: float = 1.0) -> Correspondences:
    """What a network without error would say of some points of all parts."""
    rng = np.random.default_rng(0)
    part = np.repeat(np.arange(len(body.center)), each)
    coordinates = rng.uniform(-0.5, 0.5, (len(part), 3))
    at = posed(body.hollow(), pose)
    at_rest = body.center[part] + coordinates * body.size[part]
    x = np.einsum("nij,nj->ni", at.rotation[0, part], at_rest) + at.translation[0, part]
    uv = (x @ K.T)[:, :2] / x[:, 2:]
    return Correspondences(
        part=part, coordinates=coordinates, uv=uv, deviation=np.full(len(part), deviation)
    )


@pytest.mark.parametrize("scale", [False, True])
def test_errors_move_as_their_derivatives_say(bodies, scale):
    body = bodies[0]
    rng = np.random.default_rng(1)
    home = some_pose(body)
    freedom = body.freedom + (body.center.size if scale else 0)
    both = home.beside(moved(body, home, 0.05 * rng.normal(size=(1, freedom))))
    places = places_of(body, home)
    places = replace(
        places,
        uv=places.uv + rng.normal(size=places.uv.shape),
        deviation=rng.uniform(0.3, 9.0, len(places.part)),
    )

    def cost(pose: Pose) -> np.ndarray:
        return (correspondence_errors(body, pose, places, K, scale=scale).error ** 2).sum(axis=-1)

    errors = correspondence_errors(body, both, places, K, scale=scale)
    half_gradient = (errors.slopes @ errors.error[..., None])[..., 0]
    for d in range(freedom):
        step = np.zeros((2, freedom))
        step[:, d] = 1e-5
        slope = (cost(moved(body, both, step)) - cost(moved(body, both, -step))) / 4e-5
        np.testing.assert_allclose(half_gradient[:, d], slope, rtol=2e-3, atol=2e-3)


def test_far_places_count_as_their_distance_does(bodies):
    """The loss of a place d deviations off is 2 (√(1 + d²) − 1)."""
    body = bodies[0]
    home = some_pose(body)
    places = places_of(body, home, each=1, deviation=2.0)
    for off in (0.1, 3.0, 400.0):
        wrong = replace(places, uv=places.uv + np.array([0.6, 0.8]) * 2.0 * off)
        error = correspondence_errors(body, home, wrong, K, scale=False).error
        loss = (error**2).sum() / len(places.part)
        assert loss == pytest.approx(2 * (np.sqrt(1 + off**2) - 1), rel=1e-6)
