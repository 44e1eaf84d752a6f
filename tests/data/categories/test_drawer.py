"""Laws of cabinets with drawers."""

import numpy as np
import pytest

from r2art.data.categories import make_instance
from r2art.data.shape import Instance


@pytest.fixture(scope="module")
def cabinets() -> list[Instance]:
    return [make_instance("drawer", seed) for seed in range(50)]


def test_sizes_are_those_of_real_cabinets(cabinets):
    sizes = np.stack([i.part_boxes()[1] for i in cabinets])[:, 0]
    assert (sizes > (0.29, 0.44, 0.33)).all()
    assert (sizes < (0.86, 0.81, 0.66)).all()


def test_drawers_slide_to_the_front_and_stay_within_the_cabinet(cabinets):
    for instance in cabinets:
        center, size = instance.part_boxes()
        assert instance.part_names == ("cabinet", "drawer_top", "drawer_middle", "drawer_bottom")
        assert (np.diff(center[1:, 1]) < 0).all()
        for k, joint in enumerate(instance.joints):
            assert joint.axis == (0.0, 0.0, 1.0)
            np.testing.assert_allclose(joint.pivot, center[k + 1], atol=1e-12)
            assert joint.limits[0] == 0.0
            assert 0.74 < joint.limits[1] / size[k + 1, 2] < 0.96


def test_closed_drawers_do_not_overlap_each_other_or_leave_the_cabinet(cabinets):
    for instance in cabinets:
        center, size = instance.part_boxes()
        low, high = center - size / 2, center + size / 2
        assert (low[1:3, 1] > high[2:4, 1] - 0.012).all()
        assert (low[1:, :2] > low[0, :2] - 1e-3).all()
        assert (high[1:, :2] < high[0, :2] + 1e-3).all()
        assert (low[1:, 2] > low[0, 2]).all()
