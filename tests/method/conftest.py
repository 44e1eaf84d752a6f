"""Objects to test on."""

import numpy as np
import pytest
import torch

from r2art.core.category import Category, Joint
from r2art.method.kinematics import KinematicModel

torch.set_num_threads(1)


@pytest.fixture(autouse=True)
def _seed():
    torch.manual_seed(0)


@pytest.fixture(params=[(), (2,), (3, 1, 2)], ids=str)
def batch(request) -> tuple[int, ...]:
    return request.param


def _box_surface(center, size, per_face: int):
    """A lattice on each face of a box; each point's share of its face is the same."""
    side = round(per_face**0.5)
    ticks = (np.arange(side) + 0.5) / side - 0.5
    a, b = (g.ravel() for g in np.meshgrid(ticks, ticks))
    points, normals = [], []
    for axis in range(3):
        for sign in (-0.5, 0.5):
            face = np.insert(np.stack([a, b], axis=1), axis, sign, axis=1)
            points.append(center + face * size)
            normals.append(np.sign(sign) * np.eye(3)[[axis]].repeat(len(a), axis=0))
    return np.concatenate(points), np.concatenate(normals)


def _boxes(name: str, joints: tuple[Joint, ...], center, size, per_face: int = 64) -> Category:
    center, size = np.array(center, dtype=float), np.array(size, dtype=float)
    points, normals = zip(
        *[_box_surface(c, s, per_face) for c, s in zip(center, size, strict=True)], strict=True
    )
    x, y, z = size.T
    return Category(
        name=name,
        part_names=tuple(f"part{k}" for k in range(len(center))),
        joints=joints,
        box_center=center,
        box_size=size,
        points=np.stack(points),
        normals=np.stack(normals),
        areas=2 * (x * y + y * z + z * x),
        frontal_area=0.05,
    )


@pytest.fixture
def cubes() -> Category:
    """Two cubes on a hinge: the points of a cube share its surface equally."""
    hinge = Joint(
        name="hinge",
        kind="revolute",
        parent=0,
        axis=(-1.0, 0.0, 0.0),
        pivot=(0.0, 0.1, -0.1),
        limits=(0.0, 2.0),
    )
    return _boxes("cubes", (hinge,), [(0, 0, 0), (0.05, 0.2, 0)], [(0.2,) * 3, (0.2,) * 3])


@pytest.fixture
def chest() -> Category:
    """A body with a lid (hinge) that carries a slide, and a slide of its own: a tree."""
    kinds = [("revolute", 0, (-1.0, 0.0, 0.0)), ("prismatic", 1, (0.0, 0.6, 0.8))]
    kinds += [("prismatic", 0, (0.0, 0.0, 1.0))]
    center = [(0, 0, 0), (0, 0.12, 0), (0, 0.16, 0.02), (0, 0, 0.05)]
    size = [(0.4, 0.2, 0.3), (0.4, 0.04, 0.3), (0.1, 0.05, 0.1), (0.3, 0.15, 0.2)]
    joints = tuple(
        Joint(
            name=f"joint{j}",
            kind=kind,
            parent=parent,
            axis=axis,
            pivot=(0.0, 0.1, -0.15),
            limits=(0.0, 1.5) if kind == "revolute" else (0.0, 0.2),
        )
        for j, (kind, parent, axis) in enumerate(kinds)
    )
    return _boxes("chest", joints, center, size)


@pytest.fixture
def arm() -> KinematicModel:
    """Six random joints on a random tree, the limits of no matter."""
    axis = torch.randn(6, 3, dtype=torch.float64)
    return KinematicModel(
        parent=(0, 1, 1, 0, 4, 3),
        prismatic=torch.tensor([False, True, False, False, True, False]),
        axis=axis / axis.norm(dim=-1, keepdim=True),
        pivot=torch.randn(6, 3, dtype=torch.float64),
        limits=torch.tensor([[-3.0, 3.0]], dtype=torch.float64).expand(6, 2),
    )
