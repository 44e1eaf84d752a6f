"""Where the keypoints of a known object are seen, it comes to lie, even if some of them err."""

import numpy as np
import pytest

from r2art.core.camera import Camera
from r2art.data.prior import keypoints_of
from r2art.run.refinement.body import Body
from r2art.run.refinement.keypoint_fit import fitted_to_keypoints
from r2art.run.refinement.mask_fit import with_pose
from r2art.run.refinement.pose import moved, pose_of
from r2art.run.refinement.refine import resolutions

CAMERA = Camera(300, 300, 160, 120, 320, 240)
BOX = (60, 40, 240, 210)


@pytest.fixture(scope="module", params=["drawer", "eyeglasses"])
def truth(request, predictor, pixels):
    """Some object that the model believes to see, taken for the truth and for a known one."""
    found = predictor.predict(pixels, CAMERA, request.param, BOX, refine=0)
    middle = [sum(joint.limits) / 2 for joint in found.joints]
    center, size = (
        np.array([getattr(p, k) for p in found.parts]) for k in ("box_center", "box_size")
    )
    body = resolutions(predictor.category(request.param).prior())[0].stretched(center, size)
    pose = pose_of(body, found.parts[0].cam_T_part, np.array(middle))
    prior = predictor.category(request.param).prior()
    share = (keypoints_of(prior.points, prior.box_center) - prior.box_center[:, None]) / (
        prior.box_size[:, None]
    )
    keypoints = center[:, None] + share * size[:, None]
    return with_pose(found, body, pose, found.refinement), body, keypoints


def seen(prediction, keypoints) -> dict[str, np.ndarray]:
    """What a network without error would say of them."""
    pairs = zip(prediction.parts, keypoints, strict=True)
    in_camera = [x @ p.cam_T_part[:3, :3].T + p.cam_T_part[:3, 3] for p, x in pairs]
    uv = CAMERA.project(np.concatenate(in_camera))
    return {"keypoint": uv, "keypoint_deviation": np.full(len(uv), 1.0)}


def off_course(prediction, body: Body, seed: int):
    """Turned by 25 degrees, displaced, joints moved by a fifth of their range."""
    rng = np.random.default_rng(seed)
    state = np.array([joint.state for joint in prediction.joints])
    step = np.zeros((1, body.freedom))
    turn = rng.normal(size=3)
    step[0, :3] = np.radians(25) * turn / np.linalg.norm(turn)
    step[0, 3:6] = 0.02, -0.01, 0.05
    sense = rng.choice([-1, 1], len(state))
    step[0, 6 : body.border] = 0.2 * sense * (body.limits[:, 1] - body.limits[:, 0])
    start = moved(body, pose_of(body, prediction.parts[0].cam_T_part, state), step)
    return with_pose(prediction, body, start, prediction.refinement)


def apart(prediction, truth) -> float:
    """Greatest displacement of a box corner, as a share of the object's distance."""
    pairs = zip(prediction.parts, truth.parts, strict=True)
    gap = max(np.linalg.norm(a.corners() - b.corners(), axis=-1).max() for a, b in pairs)
    return float(gap / truth.parts[0].cam_T_part[2, 3])


@pytest.mark.parametrize("seed", range(3))
def test_it_comes_home(truth, seed):
    true, body, keypoints = truth
    start = off_course(true, body, seed)
    found = fitted_to_keypoints(start, body, keypoints, seen(true, keypoints), CAMERA.K, 6)
    assert apart(start, true) > 0.05
    assert apart(found, true) < 0.01
    assert found.refinement is not None
    assert found.refinement.residual < 0.01 < found.refinement.start_residual
    for joint, other in zip(found.joints, true.joints, strict=True):
        low, high = joint.limits
        assert abs(joint.state - other.state) < 0.02 * (high - low)


def test_keypoints_that_err_far_do_not_count_for_much(truth):
    true, body, keypoints = truth
    start = off_course(true, body, 0)
    outputs = seen(true, keypoints)
    wrong = np.arange(len(outputs["keypoint"])) % 7 == 3
    outputs["keypoint"] = outputs["keypoint"] + 40.0 * wrong[:, None]
    found = fitted_to_keypoints(start, body, keypoints, outputs, CAMERA.K, 6)
    assert apart(found, true) < 0.03


def test_sizes_and_names_stay(truth):
    true, body, keypoints = truth
    start = off_course(true, body, 1)
    found = fitted_to_keypoints(start, body, keypoints, seen(true, keypoints), CAMERA.K, 6)
    for part, other in zip(found.parts, start.parts, strict=True):
        assert part.name == other.name
        np.testing.assert_allclose(part.box_size, other.box_size)
    assert (found.category, found.box, found.camera) == (start.category, start.box, start.camera)
