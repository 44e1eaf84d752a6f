"""The prior of a category, of objects whose mean is known."""

import io
from dataclasses import replace

import numpy as np
import pytest

from r2art.core.category import Category
from r2art.data.categories import make_instance, staging
from r2art.data.prior import category_prior, shape_basis
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


def test_the_shape_basis_is_made_of_the_ways_in_which_objects_differ():
    """Boxes that vary in two ways alone give back these two, as large as they vary."""
    rng = np.random.default_rng(0)
    center, size = np.array([[0, 0, 0], [0, 0.1, 0]]), np.array([[0.4, 0.2, 0.3], [0.4, 0.02, 0.3]])
    wider, higher = rng.normal(0, 0.2, 4000), rng.normal(0, 0.05, 4000)
    scale = np.ones((4000, 2, 3))
    scale[:, :, 0] = np.exp(wider)[:, None]  # both parts grow wider together
    centers = center + np.zeros_like(scale)
    centers[:, 1, 1] += higher  # and the second one lies higher or lower
    basis = shape_basis(centers, scale * size, center, size)
    assert basis.shape == (2, 2, 6)
    expected = np.zeros((2, 2, 6))
    expected[0, :, 0] = 0.2
    expected[1, 1, 4] = 0.05
    signs = np.sign((basis * expected).sum(axis=(1, 2), keepdims=True))
    np.testing.assert_allclose(signs * basis, expected, atol=0.01)


def test_the_shape_basis_explains_real_objects_and_survives_on_disk():
    objects = [make_instance("laptop", seed) for seed in range(40)]
    prior = category_prior(objects, staging("laptop"))
    assert prior.shape_basis is not None
    size = np.stack([o.part_boxes()[1] for o in objects])
    log_scale = np.log(size / prior.box_size)
    explained = (prior.shape_basis[..., :3] ** 2).sum()
    assert 0.9 < explained / (log_scale**2).sum(axis=(1, 2)).mean() <= 1.001
    strength = np.linalg.norm(prior.shape_basis[..., :3], axis=(1, 2))
    assert strength[0] == strength.max()
    file = io.BytesIO()
    prior.save(file)
    file.seek(0)
    np.testing.assert_array_equal(Category.load(file).shape_basis, prior.shape_basis)
