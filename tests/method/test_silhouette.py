import math

import pytest
import roma
import torch

from r2art.method import se3
from r2art.method.cascade import pixel_loss
from r2art.method.kinematics import forward_kinematics
from r2art.method.projection import MIN_DEPTH, project
from r2art.method.shape import Prior
from r2art.method.silhouette import Silhouettes, coverage, part_silhouettes, patch_areas, splat

f64 = torch.float64
SIZE = 96
K = torch.tensor([[200.0, 0.0, 48.0], [0.0, 200.0, 48.0], [0.0, 0.0, 1.0]], dtype=f64)
SPHERE_RADIUS = 0.1
PIXELS = torch.stack(
    torch.meshgrid(*[torch.arange(SIZE, dtype=f64) + 0.5] * 2, indexing="xy"), dim=-1
)


def sphere(num: int = 2048):
    """Points, normals and areas of a sphere: a spiral, equal areas."""
    i = torch.arange(num, dtype=f64) + 0.5
    y, turn = 1 - 2 * i / num, math.pi * (1 + 5**0.5) * i
    r = (1 - y.square()).sqrt()
    normals = torch.stack([r * turn.cos(), y, r * turn.sin()], dim=-1)
    area = 4 * math.pi * SPHERE_RADIUS**2 / num
    return SPHERE_RADIUS * normals, normals, torch.full((num,), area, dtype=f64)


def sphere_layers(x: float, y: float, z: float) -> torch.Tensor:
    points, normals, areas = sphere()
    points = points + torch.tensor([x, y, z], dtype=f64)
    return splat(project(points, K), patch_areas(points, normals, areas, K), 2.5, SIZE, SIZE)


def disc_radius(z: float) -> float:
    """Pixels; of a sphere on the optical axis, whose outline is nearer than its centre."""
    return 200 * SPHERE_RADIUS / math.sqrt(z**2 - SPHERE_RADIUS**2)


def test_splats_keep_the_weight(batch):
    uv, weight = 20 + 50 * torch.rand(*batch, 400, 2, dtype=f64), torch.rand(*batch, 400, dtype=f64)
    total = splat(uv, weight, 2.5, SIZE, SIZE).sum((-2, -1))
    torch.testing.assert_close(total, weight.sum(-1), rtol=2e-3, atol=0)


def test_splats_add_up_and_move_with_their_points(batch):
    uv, weight = 20 + 50 * torch.rand(*batch, 30, 2, dtype=f64), torch.rand(*batch, 30, dtype=f64)
    whole = splat(uv, weight, 2.5, SIZE, SIZE)
    halves = [
        splat(uv[..., i, :], weight[..., i], 2.5, SIZE, SIZE) for i in (slice(9), slice(9, 30))
    ]
    torch.testing.assert_close(halves[0] + halves[1], whole)
    moved = splat(uv + torch.tensor([4.0, -3.0], dtype=f64), weight, 2.5, SIZE, SIZE)
    torch.testing.assert_close(moved, whole.roll((-3, 4), dims=(-2, -1)))


def test_a_splat_is_its_kernel_at_the_pixel_centres():
    uv, r = torch.tensor([[40.3, 30.8]], dtype=f64), 2.7
    d = (PIXELS - uv) / r
    kernel = (15 / (16 * r)) ** 2 * (1 - d.square()).clamp_min(0).square().prod(-1)
    torch.testing.assert_close(splat(uv, torch.ones(1, dtype=f64), r, SIZE, SIZE), kernel)


def test_what_is_outside_of_the_image_contributes_nothing():
    uv = torch.tensor([[-3.0, 40.0], [40.0, 1e9], [99.0, -1e6], [SIZE + 2.6, 50.0]], dtype=f64)
    assert splat(uv, torch.ones(4, dtype=f64), 2.5, SIZE, SIZE).abs().max() == 0


@pytest.mark.parametrize("z", [0.6, 0.8, 1.0, 1.5, 2.0])
def test_a_spheres_silhouette_has_the_right_area_at_every_depth(z):
    covered = (coverage(sphere_layers(0.0, 0.0, z)) > 0.5).sum()
    assert covered.item() == pytest.approx(math.pi * disc_radius(z) ** 2, rel=0.02)


def test_coverage_is_half_on_the_outline_and_full_inside():
    distance = (PIXELS - 48).norm(dim=-1) - disc_radius(0.8)
    A = coverage(sphere_layers(0.0, 0.0, 0.8))
    assert A[distance.abs() < 0.35].mean().item() == pytest.approx(0.5, abs=0.05)
    assert A[distance < -3].mean() > 0.92
    assert A[distance > 2.6 * math.sqrt(2)].max() == 0


def test_the_best_depth_of_a_sphere_before_its_exact_mask_is_the_true_one():
    true = ((PIXELS - 48).norm(dim=-1) < disc_radius(0.8)).to(f64)[None]
    depths = torch.linspace(0.75, 0.85, 41)
    A = coverage(torch.stack([sphere_layers(0.0, 0.0, z) for z in depths.tolist()]))[:, None]
    loss = pixel_loss(
        Silhouettes(parts=A, union=A[:, 0]),
        Silhouettes(parts=true.expand_as(A), union=true.expand_as(A[:, 0])),
    )
    assert depths[loss.argmin()].item() == pytest.approx(0.8, rel=0.01)


def test_patches_of_a_surface_cover_its_projection_twice(cubes):
    prior = Prior.from_category(cubes, dtype=f64)
    R = roma.random_rotmat(1, dtype=f64)[0]
    cam_T_root = se3.from_rotation_translation(R, torch.tensor([0.1, 0.0, 30.0], dtype=f64))
    points = se3.transform(cam_T_root, prior.points[0])
    areas = patch_areas(points, prior.normals[0] @ R.mT, prior.areas[0], K)
    shadow = 0.2**2 * R[2].abs().sum()  # of a cube, seen from afar
    torch.testing.assert_close(areas.sum(), 2 * shadow * (200 / 30) ** 2, rtol=0.02, atol=0)


def posed(chest, *batch: int):
    prior = Prior.from_category(chest, dtype=f64)
    R = roma.random_rotmat(batch or 1, dtype=f64).reshape(*batch, 3, 3)
    t = torch.tensor([0.0, 0.0, 1.5], dtype=f64) + 0.1 * torch.randn(*batch, 3, dtype=f64)
    cam_T_root = se3.from_rotation_translation(R, t)
    state = 0.2 * torch.rand(*batch, 3, dtype=f64)
    return prior, cam_T_root[..., None, :, :] @ forward_kinematics(prior.kinematics, state)


def test_the_union_covers_every_part_and_nothing_else(chest, batch):
    prior, cam_T_part = posed(chest, *batch)
    seen = part_silhouettes(prior, cam_T_part, K, (SIZE, SIZE), radius=4.0)
    assert seen.parts.shape == (*batch, 4, SIZE, SIZE)
    assert (seen.union[..., None, :, :] >= seen.parts - 1e-12).all()
    assert ((seen.union > 0) == (seen.parts > 0).any(-3)).all()


def test_a_batch_is_rendered_as_its_samples_are(chest):
    prior, cam_T_part = posed(chest, 3)
    together = part_silhouettes(prior, cam_T_part, K.expand(3, 3, 3), (SIZE, 60)).parts
    alone = [part_silhouettes(prior, T, K, (SIZE, 60)).parts for T in cam_T_part]
    torch.testing.assert_close(together, torch.stack(alone))


@pytest.mark.parametrize("z", [-2.0, 0.0, MIN_DEPTH, 0.2, 1e6])
def test_no_place_of_the_object_is_too_bad_to_render(chest, z):
    prior, cam_T_part = posed(chest)
    t = torch.tensor([0.3, 0.0, z], dtype=f64, requires_grad=True)
    moved = se3.from_rotation_translation(torch.eye(3, dtype=f64), t) @ cam_T_part
    seen = part_silhouettes(prior, moved, K, (SIZE, SIZE)).union
    assert seen.isfinite().all()
    assert torch.autograd.grad(seen.sum(), t)[0].isfinite().all()


def test_points_behind_the_camera_contribute_nothing(chest):
    prior, cam_T_part = posed(chest)
    behind = cam_T_part - torch.eye(4, dtype=f64)[:, 2:3] @ torch.tensor(
        [[0, 0, 0, 4.0]], dtype=f64
    )
    assert part_silhouettes(prior, behind, K, (SIZE, SIZE)).parts.abs().max() == 0


def test_splats_pass_gradcheck():
    uv = (2 + 5 * torch.rand(2, 5, 2, dtype=f64)).requires_grad_()
    weight = torch.rand(2, 5, dtype=f64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda u, w: coverage(splat(u, w, 2.3, 9, 8)), (uv, weight))


def test_silhouettes_pass_gradcheck_in_the_pose(chest):
    prior, cam_T_part = posed(chest)
    cam_T_part.requires_grad_()

    def few_pixels(T):
        return part_silhouettes(prior, T, K, (SIZE, SIZE)).union[40:60:4, 40:60:4]

    assert torch.autograd.gradcheck(few_pixels, (cam_T_part,), atol=1e-4, rtol=1e-3, fast_mode=True)
