"""The prior of a category, of objects whose mean is known."""

import io
from dataclasses import replace

import numpy as np
import pytest

from r2art.core.category import Category
from r2art.data.categories import make_instance, staging
from r2art.data.prior import category_prior
from r2art.data.shape import Instance


def grown(instance: Instance, factor: float) -> Instance:
    parts = tuple(
        tuple(replace(s, vertices=factor * s.vertices) for s in part) for part in instance.parts
    )
    joints = tuple(
        replace(j, pivot=tuple(factor * x for x in j.pivot), limits=j.limits)
        for j in instance.joints
    )
    return replace(instance, parts=parts, joints=joints)


def test_sizes_spread_as_the_objects_do_and_survive_on_disk():
    laptop = make_instance("laptop", 0)
    factors = np.exp([-0.2, 0.0, 0.2])
    prior = category_prior([grown(laptop, f) for f in factors], staging("laptop"))
    assert prior.size_spread == pytest.approx(np.std([-0.2, 0.0, 0.2]))
    one = category_prior([laptop], staging("laptop"))
    assert prior.diagonal == pytest.approx(
        one.diagonal, rel=0.02
    )  # centres are averaged as they are
    assert one.size_spread == 0
    file = io.BytesIO()
    prior.save(file)
    file.seek(0)
    assert Category.load(file).size_spread == prior.size_spread
