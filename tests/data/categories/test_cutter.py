"""Laws of cutters."""

import numpy as np
import pytest

from r2art.data.categories import make_instance
from r2art.data.shape import Instance


@pytest.fixture(scope="module")
def cutters() -> list[Instance]:
    return [make_instance("cutter", seed) for seed in range(60)]


def vertices(part) -> np.ndarray:
    return np.concatenate([s.vertices for s in part])


def steel(instance: Instance) -> np.ndarray:
    """The thin vertices of the blade part: blade and neck, without what the thumb lies on."""
    blade = vertices(instance.parts[1])
    return blade[np.abs(blade[:, 1] - middle(instance)) < 4e-4]


def middle(instance: Instance) -> float:
    """Height of the blade's plane: where its tip is."""
    blade = vertices(instance.parts[1])
    return float(blade[np.argmax(blade[:, 2]), 1])


def test_sizes_are_those_of_real_cutters(cutters):
    size = np.stack([i.part_boxes()[1][0] for i in cutters])
    assert ((size[:, 2] > 0.11) & (size[:, 2] < 0.192)).all()
    assert ((size[:, 0] > 0.011) & (size[:, 0] < 0.045)).all()
    assert ((size[:, 1] > 0.006) & (size[:, 1] < 0.03)).all()
    assert size[:, 2].std() > 0.008
    assert size[:, 0].std() > 0.004


def test_the_blade_slides_forward_out_of_the_nose(cutters):
    for instance in cutters:
        joint = instance.joints[0]
        assert joint.kind == "prismatic"
        assert joint.axis == (0.0, 0.0, 1.0)
        assert 0.02 <= joint.limits[1] <= 0.11
        handle, blade = vertices(instance.parts[0]), vertices(instance.parts[1])
        out = blade[:, 2].max() + joint.limits[1] - handle[:, 2].max()
        assert 0.7 * joint.limits[1] < out < joint.limits[1] + 0.004


def test_a_drawn_in_blade_lies_within_the_handle(cutters):
    for instance in cutters:
        handle, blade = vertices(instance.parts[0]), vertices(instance.parts[1])
        assert blade[:, 2].max() < handle[:, 2].max() + 0.002
        assert blade[:, 2].min() > handle[:, 2].min()
        flat = steel(instance)
        rear = flat[flat[:, 2] < handle[:, 2].max() - 0.012]
        assert rear[:, 0].min() > handle[:, 0].min() + 0.0005


def test_the_cutting_edge_is_on_the_left_and_the_slider_stands_out_elsewhere(cutters):
    for instance in cutters:
        handle, blade = vertices(instance.parts[0]), vertices(instance.parts[1])
        tip = blade[np.argmax(blade[:, 2])]
        assert tip[0] == pytest.approx(blade[:, 0].min(), abs=1e-4)
        on_the_back = blade[blade[:, 0] > handle[:, 0].max()]
        on_the_face = blade[blade[:, 1] > handle[:, 1].max()]
        assert len(on_the_back) or len(on_the_face)
        assert (on_the_face[:, 0] > handle[:, 0].min() + 0.003).all()


def test_nothing_of_the_handle_is_in_the_way_of_the_blade(cutters):
    for instance in cutters:
        handle, plane = vertices(instance.parts[0]), middle(instance)
        flat = steel(instance)
        left, right = flat[:, 0].min(), flat[:, 0].max()
        inside = (
            (np.abs(handle[:, 1] - plane) < 1.5e-4)
            & (handle[:, 0] > left + 1e-4)
            & (handle[:, 0] < min(right, 0.004) - 1e-4)
            & (handle[:, 2] > flat[:, 2].min())
        )
        assert not inside.any()


def test_they_differ_in_form(cutters):
    slim = [i for i in cutters if i.part_boxes()[1][0][0] < 0.02]
    short = [i for i in cutters if i.joints[0].limits[1] < 0.035]
    wheel_or_face = [
        i for i in cutters if vertices(i.parts[1])[:, 1].max() > vertices(i.parts[0])[:, 1].max()
    ]
    for some in (slim, short, wheel_or_face):
        assert 0.1 < len(some) / len(cutters) < 0.8
