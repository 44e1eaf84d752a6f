"""Moving joints by hand gives the poses the object would have."""

import numpy as np

from r2art.run.export.mechanism import inverse, part_poses, rigid


def test_parts_follow_the_states_that_are_given(mechanism, prediction, rng):
    states = mechanism.states(rng)
    named = {joint.name: state for joint, state in zip(prediction.joints, states, strict=True)}
    np.testing.assert_allclose(part_poses(prediction, named), mechanism.poses(states), atol=1e-9)


def test_joints_left_out_stay(mechanism, prediction, rng):
    present = np.array([joint.state for joint in prediction.joints])
    np.testing.assert_allclose(part_poses(prediction, {}), mechanism.poses(present), atol=1e-9)
    for j, joint in enumerate(prediction.joints):
        states = present.copy()
        states[j] = mechanism.states(rng)[j]
        found = part_poses(prediction, {joint.name: states[j]})
        np.testing.assert_allclose(found, mechanism.poses(states), atol=1e-9)


def test_of_a_nearly_rigid_pose_the_nearest_rigid_one_is_taken(prediction, rng):
    for part in prediction.parts:
        rough = part.cam_T_part + 1e-6 * np.pad(rng.normal(size=(3, 3)), ((0, 1), (0, 1)))
        pose = rigid(rough)
        np.testing.assert_allclose(pose @ inverse(pose), np.eye(4), atol=1e-12)
        np.testing.assert_allclose(pose, part.cam_T_part, atol=1e-5)
