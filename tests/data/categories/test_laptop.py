"""Laws of laptops."""

import numpy as np
import pytest

from r2art.data.categories import make_instance
from r2art.data.pose import root_T_part, transformed
from r2art.data.shape import Instance


@pytest.fixture(scope="module")
def laptops() -> list[Instance]:
    return [make_instance("laptop", seed) for seed in range(50)]


def vertices(part) -> np.ndarray:
    return np.concatenate([s.vertices for s in part])


def test_sizes_are_those_of_real_laptops(laptops):
    sizes = np.stack([i.part_boxes()[1] for i in laptops])
    assert ((sizes[:, 0, 0] > 0.25) & (sizes[:, 0, 0] < 0.42)).all()
    assert ((sizes[:, 0, 2] > 0.17) & (sizes[:, 0, 2] < 0.34)).all()
    assert ((sizes[:, 0, 1] > 0.007) & (sizes[:, 0, 1] < 0.065)).all()


def test_a_closed_laptop_is_flat_and_its_lid_rises_at_the_front(laptops):
    for instance in laptops:
        center, size = instance.part_boxes()
        low, high = center - size / 2, center + size / 2
        assert high[:, 1].max() - low[:, 1].min() < 0.075
        assert low[1, 1] > center[0, 1]
        lid = vertices(instance.parts[1])
        front = lid[np.argmax(lid[:, 2])]
        T = root_T_part(instance.joints, np.array([np.pi / 2]))[1]
        raised = T[:3, :3] @ front + T[:3, 3]
        assert raised[1] > front[1] + 0.8 * size[1, 2]
        assert instance.joints[0].pivot[2] < -0.35 * size[0, 2]


def test_the_screen_faces_the_user_once_open(laptops):
    for instance in laptops:
        glowing = [s for s in instance.parts[1] if s.material.emission > 0]
        T = root_T_part(instance.joints, np.array([np.pi / 2]))[1]
        for s in glowing:
            opened = transformed(s, T)
            np.testing.assert_allclose(opened.normals[:, 2], 1, atol=1e-9)
            upper = opened.uv[:, 1] > 0.5
            assert opened.vertices[upper, 1].min() > opened.vertices[~upper, 1].max()
            right = opened.uv[:, 0] > 0.5
            assert opened.vertices[right, 0].min() > opened.vertices[~right, 0].max()
