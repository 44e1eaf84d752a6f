import torch
from hypothesis import given
from hypothesis import strategies as st

from r2art.core.camera import Camera
from r2art.method.projection import (
    box_center,
    box_of_points,
    box_size,
    project,
    resize_intrinsics,
)

f64 = torch.float64
CAMERA = Camera(310, 290, 150, 120, 320, 240)
K = torch.as_tensor(CAMERA.K, dtype=f64)


def points_in_front(*batch: int) -> torch.Tensor:
    return torch.randn(*batch, 7, 3, dtype=f64) + torch.tensor([0.0, 0.0, 9.0], dtype=f64)


def test_projection_agrees_with_the_camera_of_core(batch):
    points = points_in_front(*batch)
    torch.testing.assert_close(project(points, K), torch.as_tensor(CAMERA.project(points.numpy())))


def test_resized_intrinsics_are_those_of_the_resized_camera():
    torch.testing.assert_close(
        resize_intrinsics(K, 0.5), torch.as_tensor(CAMERA.resize(160, 120).K)
    )


@given(st.lists(st.floats(-1e6, 1e6, width=32), min_size=3, max_size=3))
def test_every_point_has_a_finite_pixel_and_gradient(point):
    point = torch.tensor([point], requires_grad=True)
    uv = project(point, K.float())
    (gradient,) = torch.autograd.grad(uv.sum(), point)
    assert uv.isfinite().all()
    assert gradient.isfinite().all()


def test_the_box_holds_every_point_and_touches_one_on_each_side(batch):
    uv = torch.randn(*batch, 9, 2, dtype=f64)
    box = box_of_points(uv)
    low, high = uv - box[..., None, :2], box[..., None, 2:] - uv
    assert (low >= 0).all()
    assert (high >= 0).all()
    assert (low.amin(-2) == 0).all()
    assert (high.amin(-2) == 0).all()


def test_a_soft_box_is_inside_the_hard_one_and_tends_to_it(batch):
    uv = 20 * torch.randn(*batch, 30, 2, dtype=f64)
    hard, soft = box_of_points(uv), box_of_points(uv, softness=2.0)
    assert (soft[..., :2] >= hard[..., :2]).all()
    assert (soft[..., 2:] <= hard[..., 2:]).all()
    torch.testing.assert_close(box_of_points(uv, softness=1e-3), hard)


def test_center_and_size_of_a_box():
    box = torch.tensor([1.0, 2.0, 5.0, 10.0])
    torch.testing.assert_close(box_center(box), torch.tensor([3.0, 6.0]))
    torch.testing.assert_close(box_size(box), torch.tensor([4.0, 8.0]))


def test_projection_and_boxes_pass_gradcheck():
    points = points_in_front(2).requires_grad_()
    assert torch.autograd.gradcheck(lambda p: box_of_points(project(p, K)), (points,))
    assert torch.autograd.gradcheck(lambda p: box_of_points(project(p, K), 3.0), (points,))
