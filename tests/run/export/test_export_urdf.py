"""yourdfpy and MuJoCo, which did not write it, read from the URDF what the prediction says."""

import io
from dataclasses import replace
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
import yourdfpy

from r2art.run.export import FORMATS
from r2art.run.export.solids import CAMERA, DENSITY


def urdf(prediction):
    return FORMATS["urdf"].encode(prediction)


def by_yourdfpy(text, names, states):
    """(P, 4, 4) poses of links in the camera's frame, with joints set by name."""
    robot = yourdfpy.URDF.load(io.BytesIO(text))
    assert robot.validate(), robot.errors
    robot.update_cfg(states)
    return np.stack([robot.get_transform(name, CAMERA) for name in names])


def by_mujoco(text, names, states):
    model = mujoco.MjModel.from_xml_string(text.decode())
    data = mujoco.MjData(model)
    for name, state in states.items():
        data.joint(name).qpos = state
    mujoco.mj_kinematics(model, data)
    poses = np.tile(np.eye(4), (len(names), 1, 1))
    for pose, name in zip(poses, names, strict=True):
        pose[:3, :3] = data.body(name).xmat.reshape(3, 3)
        pose[:3, 3] = data.body(name).xpos
    return poses


def names_states_poses(prediction):
    names = [part.name for part in prediction.parts]
    states = {joint.name: joint.state for joint in prediction.joints}
    return names, states, [part.cam_T_part for part in prediction.parts]


@pytest.mark.parametrize("read", [by_yourdfpy, by_mujoco])
def test_at_the_predicted_states_every_part_is_where_it_was_seen(prediction, read):
    names, states, poses = names_states_poses(prediction)
    np.testing.assert_allclose(read(urdf(prediction), names, states), poses, atol=1e-9)


@pytest.mark.parametrize("read", [by_yourdfpy, by_mujoco])
def test_at_other_states_every_part_is_where_the_object_would_have_it(
    mechanism, prediction, rng, read
):
    names, states, _ = names_states_poses(prediction)
    other = mechanism.states(rng)
    states = dict(zip(states, other.tolist(), strict=True))
    found = read(urdf(prediction), names, states)
    np.testing.assert_allclose(found, mechanism.poses(other), atol=1e-9)


@pytest.mark.parametrize("read", [by_yourdfpy, by_mujoco])
def test_what_the_model_says_of_a_photo_is_kept_to_a_micrometre(seen, read):
    names, states, poses = names_states_poses(seen)
    np.testing.assert_allclose(read(urdf(seen), names, states), poses, atol=1e-6)


@pytest.mark.parametrize("read", [by_yourdfpy, by_mujoco])
def test_a_prediction_at_odds_with_itself_keeps_its_poses(prediction, rng, read):
    """A model may give poses, axes and states that do not quite fit one another."""
    joints = tuple(
        replace(j, state=j.state + rng.normal(), pivot=j.pivot + rng.normal(size=3))
        for j in prediction.joints
    )
    names, states, poses = names_states_poses(replace(prediction, joints=joints))
    found = read(urdf(replace(prediction, joints=joints)), names, states)
    np.testing.assert_allclose(found, poses, atol=1e-9)


def test_straight_up_is_no_special_case(prediction):
    """Roll and yaw are one where the pitch is 90°."""
    for sign in (-1, 1):
        for roll in (0.0, 0.7):
            c, s = np.cos(roll), np.sin(roll)
            pose = np.eye(4)
            pitched = np.array([[0, 0, sign], [0, 1, 0], [-sign, 0, 0]])
            pose[:3, :3] = pitched @ [[1, 0, 0], [0, c, -s], [0, s, c]]
            root = replace(prediction.parts[0], cam_T_part=pose)
            only = replace(prediction, parts=(root,), joints=())
            np.testing.assert_allclose(by_yourdfpy(urdf(only), ["part 0"], {})[0], pose, atol=1e-9)


def test_joints_keep_kind_limits_and_state(prediction):
    robot = ElementTree.fromstring(urdf(prediction))
    found = {j.get("name"): j for j in robot.findall("joint")}
    initial = {
        j.get("name"): float(j.findtext("state_interface/param"))
        for j in robot.iterfind("ros2_control/joint")
    }
    assert initial == pytest.approx({j.name: j.state for j in prediction.joints})
    for joint in prediction.joints:
        element = found[joint.name]
        assert element.get("type") == joint.kind
        limit = element.find("limit").attrib
        assert (float(limit["lower"]), float(limit["upper"])) == pytest.approx(joint.limits)


def test_boxes_are_the_parts_boxes_to_see_and_to_touch(prediction):
    _, states, _ = names_states_poses(prediction)
    text = urdf(prediction)
    robot = yourdfpy.URDF.load(io.BytesIO(text), build_collision_scene_graph=True)
    robot.update_cfg(states)
    scene = robot.scene
    corners = np.concatenate([p.corners().reshape(-1, 3) for p in prediction.parts])
    np.testing.assert_allclose(scene.bounds, [corners.min(axis=0), corners.max(axis=0)], atol=1e-7)
    for part in prediction.parts:
        link = next(
            robot.link_map[n] for n in (part.name, f"{part.name}_body") if robot.link_map[n].visuals
        )
        for shape in (*link.visuals, *link.collisions):
            np.testing.assert_allclose(shape.geometry.box.size, part.box_size)


def test_physics_runs_with_the_masses_of_the_boxes(prediction):
    model = mujoco.MjModel.from_xml_string(urdf(prediction).decode())
    boxes = [DENSITY * np.prod(p.box_size) for p in prediction.parts]
    assert model.body_mass.sum() == pytest.approx(sum(boxes), abs=1e-5)
    for link in ElementTree.fromstring(urdf(prediction)).iter("link"):
        assert link.get("name") == CAMERA or link.find("inertial") is not None
    data = mujoco.MjData(model)
    for joint in prediction.joints:
        data.joint(joint.name).qpos = joint.state
    mujoco.mj_step(model, data)
    assert np.isfinite(data.qpos).all()
    assert not any(data.warning[i].number for i in range(len(data.warning)))


def test_parts_called_like_the_frames_in_between_are_told_apart(prediction):
    """Imported objects name their parts as they like."""
    names = [CAMERA, "part 2", f"{CAMERA}_to_part", "part 2_body", "part 3_body", '<&">', "é"]
    new = {p.name: name for p, name in zip(prediction.parts, names, strict=False)}
    parts = tuple(replace(p, name=new.get(p.name, p.name)) for p in prediction.parts)
    joints = tuple(
        replace(j, parent=new.get(j.parent, j.parent), child=new.get(j.child, j.child))
        for j in prediction.joints
    )
    odd = replace(prediction, parts=parts, joints=joints)
    names, states, poses = names_states_poses(odd)
    text = urdf(odd)
    links = [link.get("name") for link in ElementTree.fromstring(text).iter("link")]
    assert len(set(links)) == len(links)
    np.testing.assert_allclose(by_mujoco(text, names, states), poses, atol=1e-9)
