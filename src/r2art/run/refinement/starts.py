"""Where to look: poses around an estimate, and other joint states where one does not fit."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from r2art.run.refinement.body import Body
from r2art.run.refinement.pose import Pose, rotation_of
from r2art.run.refinement.uncertainty import Uncertainty

FloatArray = NDArray[np.floating]


def spread(body: Body, estimate: Pose, uncertainty: Uncertainty, count: int) -> Pose:
    """The estimate and ``count`` − 1 poses around it, turned about axes all around, joints moved.

    Turns are 0.8 and 1.6 standard deviations by turns, joints up to 2.
    """
    i = np.arange(count)
    height = 1 - 2 * (i - 0.5) / max(1, count - 1)
    ring = np.sqrt(np.clip(1 - height**2, 0, 1))
    turn = i * np.pi * (1 + 5**0.5)
    axis = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=-1)
    angle = uncertainty.rotation * np.where(i % 2, 1.6, 0.8) * (i > 0)
    joint = np.arange(1, len(body.parent) + 1)
    golden = np.mod(i[:, None] / (1 + _plastic(len(joint))) ** joint, 1) * 2 - 1
    span = body.limits[:, 1] - body.limits[:, 0]
    shift = golden * (i > 0)[:, None] * 2 * uncertainty.joint * span
    state = np.clip(estimate.joint_state + shift, body.limits[:, 0], body.limits[:, 1])
    return Pose(
        rotation=rotation_of(axis * angle[:, None]) @ estimate.rotation,
        anchor=np.repeat(estimate.anchor, count, axis=0),
        joint_state=state,
        log_scale=np.repeat(estimate.log_scale, count, axis=0),
        border=np.repeat(estimate.border, count),
    )


def _plastic(dimensions: int) -> float:
    """φ − 1, where φ^(d+1) = φ + 1: multiples of 1/φ, 1/φ², ... fill a cube evenly."""
    root = 1.5
    for _ in range(30):
        root = (1 + root) ** (1 / (dimensions + 1))
    return root - 1


def other_states(body: Body, pose: Pose, each: int) -> Pose:
    """One start's pose, and that with every joint by itself at ``each`` other states, evenly over
    its range.
    """
    joints = len(body.parent)
    states = np.repeat(pose.joint_state, 1 + each * joints, axis=0)
    for j, (low, high) in enumerate(body.limits):
        rows = slice(1 + each * j, 1 + each * (j + 1))
        states[rows, j] = low + (high - low) * (np.arange(each) + 0.5) / each
    return replace(pose.pick(np.zeros(len(states), np.intp)), joint_state=states)
