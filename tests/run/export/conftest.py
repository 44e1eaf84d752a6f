"""Objects with random trees of joints, and where their parts are by another mathematics."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from r2art.core.camera import Camera
from r2art.core.prediction import JointEstimate, PartEstimate, Prediction

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


@dataclass
class Mechanism:
    """An object that is known exactly; axes and pivots in the root frame at rest, one per joint."""

    cam_T_root: np.ndarray
    kinds: list[str]
    parents: list[int]
    axes: np.ndarray
    pivots: np.ndarray
    limits: np.ndarray

    def poses(self, states):
        """(P, 4, 4) ``cam_T_part``, as a product of matrix exponentials."""
        poses = [self.cam_T_root]
        for parent, *joint, state in zip(
            self.parents, self.kinds, self.axes, self.pivots, states, strict=True
        ):
            poses.append(poses[parent] @ expm(state * twist(*joint)))
        return np.stack(poses)

    def states(self, rng):
        return rng.uniform(*self.limits.T)

    def prediction(self, rng, states):
        """What a perfect model would say of it, with boxes of any shape."""
        poses = self.poses(states)
        parts = tuple(
            PartEstimate(
                name=f"part {p}",
                cam_T_part=pose,
                box_center=0.2 * rng.normal(size=3),
                box_size=rng.uniform(0.001, 0.5, 3),
                confidence=float(rng.uniform()),
            )
            for p, pose in enumerate(poses)
        )
        joints = tuple(
            JointEstimate(
                name=f"joint {j}",
                kind=self.kinds[j],
                parent=f"part {parent}",
                child=f"part {j + 1}",
                state=float(states[j]),
                limits=tuple(self.limits[j].tolist()),
                axis=poses[parent][:3, :3] @ self.axes[j],
                pivot=poses[parent][:3, :3] @ self.pivots[j] + poses[parent][:3, 3],
            )
            for j, parent in enumerate(self.parents)
        )
        return Prediction(
            image_path="a photo.jpg",
            category="thing",
            category_score=0.5,
            box=(10.0, 20.0, 300.0, 200.0),
            camera=Camera(300, 310, 170, 115, 320, 240),
            camera_source="given",
            parts=parts,
            joints=joints,
        )


def twist(kind, axis, pivot):
    """(4, 4) generator of a joint's motion."""
    generator = np.zeros((4, 4))
    if kind == "prismatic":
        generator[:3, 3] = axis
    else:
        generator[:3, :3] = np.cross(np.eye(3), axis)
        generator[:3, 3] = -np.cross(axis, pivot)
    return generator


def random_mechanism(seed):
    """Up to seven joints of both kinds, in chains and branches, at any place."""
    rng = np.random.default_rng(seed)
    J = seed % 8
    kinds = rng.choice(["revolute", "prismatic"], J).tolist()
    axes = rng.normal(size=(J, 3))
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    pose[:3, 3] = rng.normal((0, 0, 3))
    low = rng.uniform(-2, 0, J)
    return Mechanism(
        cam_T_root=pose,
        kinds=kinds,
        parents=[int(rng.integers(max(0, j - 1), j + 1)) for j in range(J)],
        axes=axes / np.linalg.norm(axes, axis=1, keepdims=True),
        pivots=0.5 * rng.normal(size=(J, 3)),
        limits=np.stack([low, low + rng.uniform(0.1, 4, J)], axis=1),
    )


@pytest.fixture(params=range(8))
def seed(request):
    return request.param


@pytest.fixture
def rng(seed):
    return np.random.default_rng(1000 + seed)


@pytest.fixture
def mechanism(seed):
    return random_mechanism(seed)


@pytest.fixture
def prediction(mechanism, rng):
    return mechanism.prediction(rng, mechanism.states(rng))


@pytest.fixture(scope="session", params=["laptop", "drawer"])
def seen(request, predictor):
    """What the shipped model says of an example photo."""
    return predictor.predict(EXAMPLES / f"{request.param}.png")
