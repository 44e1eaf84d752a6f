import math

import pytest
import torch

from r2art.method.shape import Deformation, Prior, box_corners, deform, deformation_of, thinned

f64 = torch.float64


@pytest.fixture
def prior(chest) -> Prior:
    return Prior.from_category(chest, dtype=f64)


def random_deformation(prior: Prior, *batch: int) -> Deformation:
    log_scale, shift = 0.3 * torch.randn(2, *batch, *prior.box_size.shape, dtype=f64)
    shift[..., 0, :] = 0
    return Deformation(log_scale=log_scale, center_shift=0.1 * shift)


def test_zero_coefficients_give_the_prior(prior, batch):
    zero = torch.zeros(*batch, *prior.box_size.shape, dtype=f64)
    shape = deform(prior, Deformation(log_scale=zero, center_shift=zero))
    for name in ("box_center", "box_size", "points", "normals", "areas"):
        expected = getattr(prior, name)
        torch.testing.assert_close(getattr(shape, name), expected.expand(*batch, *expected.shape))
    pivot = prior.kinematics.pivot
    torch.testing.assert_close(shape.kinematics.pivot, pivot.expand(*batch, *pivot.shape))


def test_the_deformation_of_an_instances_boxes_gives_them_back(prior, batch):
    deformation = random_deformation(prior, *batch)
    shape = deform(prior, deformation)
    found = deformation_of(prior, shape.box_center, shape.box_size)
    torch.testing.assert_close(found.log_scale, deformation.log_scale)
    torch.testing.assert_close(found.center_shift, deformation.center_shift)


@pytest.mark.parametrize("every", [1, 3, 4])
def test_a_thinned_shape_keeps_every_parts_area(prior, every):
    shape = thinned(prior, every)
    torch.testing.assert_close(shape.areas.sum(-1), prior.areas.sum(-1))
    torch.testing.assert_close(shape.points, prior.points[:, ::every])


def test_points_and_pivots_keep_their_place_in_their_parts_box(prior, batch):
    shape = deform(prior, random_deformation(prior, *batch))

    def place(s, x):
        return (x - s.box_center[..., None, :]) / s.box_size[..., None, :]

    expected = place(prior, prior.points)
    torch.testing.assert_close(place(shape, shape.points), expected.expand(*batch, -1, -1, -1))

    def pivot_place(s):
        return (s.kinematics.pivot - s.box_center[..., 1:, :]) / s.box_size[..., 1:, :]

    torch.testing.assert_close(pivot_place(shape), pivot_place(prior).expand(*batch, -1, -1))


def test_only_the_roots_scale_moves_the_other_parts(prior):
    """A cabinet twice as wide has its drawers twice as far apart, however big they are."""
    log_scale = torch.zeros(4, 3, dtype=f64)
    log_scale[0] = math.log(2)
    shift = torch.zeros(4, 3, dtype=f64)
    shape = deform(prior, Deformation(log_scale=log_scale, center_shift=shift))
    torch.testing.assert_close(shape.box_center, 2 * prior.box_center)
    torch.testing.assert_close(shape.box_size[1:], prior.box_size[1:])


def test_the_surface_of_a_scaled_cube_is_that_of_the_cuboid(cubes, batch):
    prior = Prior.from_category(cubes, dtype=f64)
    shape = deform(prior, random_deformation(prior, *batch))
    x, y, z = shape.box_size.unbind(-1)
    torch.testing.assert_close(shape.areas.sum(-1), 2 * (x * y + y * z + z * x))


def test_normals_stay_unit_and_at_right_angles_to_the_surface(prior, batch):
    normal = torch.randn(prior.normals.shape, dtype=f64)
    normal = normal / normal.norm(dim=-1, keepdim=True)
    tangent = torch.linalg.cross(normal, torch.randn_like(normal))
    deformation = random_deformation(prior, *batch)
    fields = {**vars(prior), "normals": normal}
    shape = deform(Prior(**fields), deformation)
    stretched = deformation.log_scale.exp()[..., None, :] * tangent
    one = torch.ones(shape.normals.shape[:-1], dtype=f64)
    torch.testing.assert_close(shape.normals.norm(dim=-1), one)
    torch.testing.assert_close((shape.normals * stretched).sum(-1), 0 * one)


def test_box_corners_span_the_box(prior, batch):
    center, size = torch.randn(2, *batch, 4, 3, dtype=f64)
    corners = box_corners(center, size.abs())
    torch.testing.assert_close(corners.mean(-2), center)
    torch.testing.assert_close(corners.amax(-2) - corners.amin(-2), size.abs())
    assert len(torch.unique(corners.reshape(-1, 8, 3)[0], dim=0)) == 8


def test_a_priors_points_share_the_parts_areas(chest, prior):
    torch.testing.assert_close(prior.areas.sum(-1), torch.as_tensor(chest.areas))
    assert prior.frontal_area == chest.frontal_area
