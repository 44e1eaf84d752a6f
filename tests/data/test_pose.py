"""The labels' kinematics, held to the method's (written apart) and to an exponential map."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from r2art.core.category import Joint
from r2art.data.categories import make_instance
from r2art.data.pose import joint_matrix, posed_vertices, root_T_part, transformed
from r2art.method.kinematics import KinematicModel, forward_kinematics


def random_tree(seed: int, num_joints: int) -> tuple[tuple[Joint, ...], np.ndarray]:
    """Joints on random parents, and a state for each."""
    rng = np.random.default_rng(seed)
    axes = rng.normal(size=(num_joints, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    joints = tuple(
        Joint(
            name=f"joint{j}",
            kind="prismatic" if rng.random() < 0.5 else "revolute",
            parent=int(rng.integers(j + 1)),
            axis=tuple(axes[j].tolist()),
            pivot=tuple(rng.normal(size=3).tolist()),
            limits=(-3.0, 3.0),
        )
        for j in range(num_joints)
    )
    return joints, rng.uniform(-3, 3, num_joints)


def exponential(joint: Joint, state: float) -> np.ndarray:
    twist = np.zeros((4, 4))
    if joint.kind == "prismatic":
        twist[:3, 3] = joint.axis
    else:
        twist[:3, :3] = np.cross(np.eye(3), joint.axis)
        twist[:3, 3] = np.cross(joint.pivot, joint.axis)
    return expm(state * twist)


@given(seed=st.integers(0, 2**32 - 1), num_joints=st.integers(0, 7))
@settings(max_examples=40, deadline=None)
def test_labels_and_method_agree_on_every_tree(seed, num_joints):
    joints, state = random_tree(seed, num_joints)
    rows = [(j.axis, j.pivot, j.limits) for j in joints]
    axis, pivot, limits = (
        torch.tensor([row[i] for row in rows], dtype=torch.float64).reshape(num_joints, width)
        for i, width in enumerate((3, 3, 2))
    )
    kinematics = KinematicModel(
        parent=tuple(j.parent for j in joints),
        prismatic=torch.tensor([j.kind == "prismatic" for j in joints], dtype=torch.bool),
        axis=axis,
        pivot=pivot,
        limits=limits,
    )
    expected = forward_kinematics(kinematics, torch.as_tensor(state)).numpy()
    np.testing.assert_allclose(root_T_part(joints, state), expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("seed", range(5))
def test_poses_are_products_of_exponentials(seed):
    joints, state = random_tree(seed, 6)
    poses = root_T_part(joints, state)
    np.testing.assert_array_equal(poses[0], np.eye(4))
    for j, joint in enumerate(joints):
        motion = exponential(joint, state[j])
        np.testing.assert_allclose(joint_matrix(joint, state[j]), motion, atol=1e-10)
        np.testing.assert_allclose(poses[j + 1], poses[joint.parent] @ motion, atol=1e-10)


def test_a_moved_surface_keeps_its_shape_and_its_normals_turn_along():
    surface = make_instance("laptop", 1).parts[1][0]
    motion = joint_matrix(random_tree(0, 1)[0][0], 0.7)
    motion = motion @ exponential(random_tree(3, 4)[0][3], 1.3)
    moved = transformed(surface, motion)
    homogeneous = np.c_[surface.vertices, np.ones(len(surface.vertices))] @ motion.T
    np.testing.assert_allclose(moved.vertices, homogeneous[:, :3], atol=1e-12)
    ahead = np.c_[surface.vertices + surface.normals, np.ones(len(surface.vertices))] @ motion.T
    np.testing.assert_allclose(moved.vertices + moved.normals, ahead[:, :3], atol=1e-12)


def test_posed_vertices_are_those_of_all_surfaces_each_under_its_parts_pose():
    instance = make_instance("drawer", 2)
    poses = root_T_part(instance.joints, np.array([0.1, 0.0, 0.2]))
    expected = [
        transformed(s, T).vertices
        for part, T in zip(instance.parts, poses, strict=True)
        for s in part
    ]
    np.testing.assert_allclose(posed_vertices(instance, poses), np.concatenate(expected))
    opened = (
        posed_vertices(instance, poses)[:, 2].max()
        - posed_vertices(instance, root_T_part(instance.joints, np.zeros(3)))[:, 2].max()
    )
    assert opened == pytest.approx(0.2)
