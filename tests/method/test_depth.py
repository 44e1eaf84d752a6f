import torch
from hypothesis import given
from hypothesis import strategies as st

from r2art.core.camera import Camera
from r2art.method.depth import projection_depth, root_translation, translation_targets, viewing_ray
from r2art.method.projection import project, resize_intrinsics

f64 = torch.float64
AREA = 0.06


def random_view(*batch: int) -> tuple[torch.Tensor, torch.Tensor]:
    camera = Camera(310, 290, 150, 120, 320, 240)
    corner, size = torch.rand(2, *batch, 2, dtype=f64)
    box = torch.cat([100 * corner, 100 * corner + 20 + 90 * size], dim=-1)
    return box, torch.as_tensor(camera.K, dtype=f64).expand(*batch, 3, 3)


@given(st.floats(0.1, 10), st.floats(0.05, 3), st.floats(0.05, 3))
def test_a_frontal_rectangle_is_at_its_projection_depth(depth, width, height):
    _, K = random_view()
    corners = torch.tensor([[0.1, -0.2, depth], [0.1 + width, height - 0.2, depth]], dtype=f64)
    box = project(corners, K).flatten()
    torch.testing.assert_close(
        projection_depth(box, K, width * height), torch.tensor(depth, dtype=f64)
    )


def test_scaling_image_and_intrinsics_together_leaves_the_translation(batch):
    box, K = random_view(*batch)
    phi, log_lambda = torch.randn(*batch, 2, dtype=f64), torch.randn(batch, dtype=f64)
    translation = root_translation(phi, log_lambda, box, K, AREA)
    resized = root_translation(phi, log_lambda, 0.35 * box, resize_intrinsics(K, 0.35), AREA)
    torch.testing.assert_close(resized, translation)


def test_cropping_leaves_the_translation(batch):
    box, K = random_view(*batch)
    phi, log_lambda = torch.randn(*batch, 2, dtype=f64), torch.randn(batch, dtype=f64)
    cropped = K - torch.tensor([[0.0, 0.0, 40.0], [0.0, 0.0, 25.0], [0.0, 0.0, 0.0]], dtype=f64)
    moved = box - torch.tensor([40.0, 25.0, 40.0, 25.0], dtype=f64)
    torch.testing.assert_close(
        root_translation(phi, log_lambda, moved, cropped, AREA),
        root_translation(phi, log_lambda, box, K, AREA),
    )


def test_targets_of_a_translation_give_it_back(batch):
    box, K = random_view(*batch)
    translation = torch.randn(*batch, 3, dtype=f64) + torch.tensor([0.0, 0.0, 6.0], dtype=f64)
    area = torch.rand(batch, dtype=f64) + 0.01
    phi, log_lambda = translation_targets(translation, box, K, area)
    torch.testing.assert_close(root_translation(phi, log_lambda, box, K, area), translation)


def test_without_offset_and_correction_the_root_is_on_the_ray_at_projection_depth(batch):
    box, K = random_view(*batch)
    zero = torch.zeros(batch, dtype=f64)
    translation = root_translation(torch.zeros(*batch, 2, dtype=f64), zero, box, K, AREA)
    torch.testing.assert_close(translation[..., 2], projection_depth(box, K, AREA))
    ray = viewing_ray(box, K)
    torch.testing.assert_close(ray.norm(dim=-1), torch.ones(batch, dtype=f64))
    torch.testing.assert_close(ray / ray[..., 2:], translation / translation[..., 2:])


def test_twice_the_correction_is_twice_the_distance(batch):
    box, K = random_view(*batch)
    phi, log_lambda = torch.randn(*batch, 2, dtype=f64), torch.randn(batch, dtype=f64)
    near = root_translation(phi, log_lambda, box, K, AREA)
    far = root_translation(phi, log_lambda + torch.tensor(2.0).log(), box, K, AREA)
    torch.testing.assert_close(far, 2 * near)
