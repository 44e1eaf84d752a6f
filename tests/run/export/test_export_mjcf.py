"""MuJoCo reads from the MJCF what the prediction says."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from r2art.run.export import FORMATS


def model_of(prediction):
    return mujoco.MjModel.from_xml_string(FORMATS["mjcf"].encode(prediction).decode())


def poses(model, data, prediction):
    mujoco.mj_kinematics(model, data)
    found = np.tile(np.eye(4), (len(prediction.parts), 1, 1))
    for pose, part in zip(found, prediction.parts, strict=True):
        pose[:3, :3] = data.body(part.name).xmat.reshape(3, 3)
        pose[:3, 3] = data.body(part.name).xpos
    return found


def at_the_photo(model):
    data = mujoco.MjData(model)
    if model.nq:
        mujoco.mj_resetDataKeyframe(model, data, model.key("photo").id)
    return data


def test_the_keyframe_is_the_photo(prediction):
    model = model_of(prediction)
    data = at_the_photo(model)
    seen = [part.cam_T_part for part in prediction.parts]
    np.testing.assert_allclose(poses(model, data, prediction), seen, atol=1e-9)
    for joint in prediction.joints:
        assert data.joint(joint.name).qpos == pytest.approx(joint.state)


def test_what_the_model_says_of_a_photo_is_kept_to_a_micrometre(seen):
    model = model_of(seen)
    expected = [part.cam_T_part for part in seen.parts]
    np.testing.assert_allclose(poses(model, at_the_photo(model), seen), expected, atol=1e-6)


def test_joints_move_as_those_of_the_object(mechanism, prediction, rng):
    model = model_of(prediction)
    data = mujoco.MjData(model)
    states = mechanism.states(rng)
    for joint, state in zip(prediction.joints, states, strict=True):
        data.joint(joint.name).qpos = state
        np.testing.assert_allclose(model.joint(joint.name).range, joint.limits)
        assert model.joint(joint.name).limited
    np.testing.assert_allclose(poses(model, data, prediction), mechanism.poses(states), atol=1e-9)


def test_geoms_are_the_parts_boxes(prediction):
    model = model_of(prediction)
    data = at_the_photo(model)
    mujoco.mj_kinematics(model, data)
    for part in prediction.parts:
        geom = data.geom(part.name)
        signs = np.stack(np.meshgrid(*[[-1, 1]] * 3, indexing="ij"), axis=-1)
        corners = signs * model.geom(part.name).size @ geom.xmat.reshape(3, 3).T + geom.xpos
        np.testing.assert_allclose(corners, part.corners(), atol=1e-9)


def test_it_falls_along_its_own_down_and_not_into_itself(prediction):
    model = model_of(prediction)
    down = -prediction.parts[0].cam_T_part[:3, 1]
    np.testing.assert_allclose(model.opt.gravity, 9.81 * down, atol=1e-9)
    data = at_the_photo(model)
    mujoco.mj_step(model, data)
    assert data.ncon == 0
    assert np.isfinite(data.qpos).all()


def test_the_photos_camera_sees_the_parts_where_the_photo_does(prediction):
    """Directions of sight, for the principal point of an MJCF camera is the middle."""
    model = model_of(prediction)
    data = at_the_photo(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_camlight(model, data)
    camera = data.camera("photo_camera")
    x, y, back = camera.xmat.reshape(3, 3).T
    np.testing.assert_allclose([x, -y, -back], np.eye(3), atol=1e-9)
    half = np.tan(np.radians(model.cam("photo_camera").fovy) / 2)
    assert half == pytest.approx(prediction.camera.height / 2 / prediction.camera.fy)


def test_a_joint_without_room_still_loads(prediction):
    joints = tuple(replace(j, limits=(j.state, j.state)) for j in prediction.joints)
    assert model_of(replace(prediction, joints=joints)).njnt == len(joints)
