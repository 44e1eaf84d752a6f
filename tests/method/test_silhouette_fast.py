"""The fast silhouettes are the plain ones: in value, in gradient, and where input is odd."""

from dataclasses import replace

import pytest
import roma
import torch
import warp as wp

from r2art.method import se3, silhouette_fast, silhouette_warp
from r2art.method.kinematics import forward_kinematics
from r2art.method.shape import Prior, Shape
from r2art.method.silhouette import (
    fast_silhouettes,
    part_silhouettes,
    plain_silhouettes,
)

f32, f64 = torch.float32, torch.float64
H, W = 40, 48
DEVICES = ["cpu", pytest.param("cuda", marks=pytest.mark.skipif(
    not torch.cuda.is_available(), reason="no GPU"))]  # fmt: skip
DIFFERENTIABLE = ("points", "normals", "areas", "pose")


def scene(chest, *batch: int, device: str = "cpu", dtype: torch.dtype = f64):
    """The chest, partly out of the image."""
    prior = Prior.from_category(chest, dtype=f64)
    R = roma.random_rotmat(batch or 1, dtype=f64).reshape(*batch, 3, 3)
    t = 0.1 * torch.randn(*batch, 3, dtype=f64) + torch.tensor([0.05, 0.0, 0.6], dtype=f64)
    state = 0.2 * torch.rand(*batch, 3, dtype=f64)
    root_T_part = forward_kinematics(prior.kinematics, state)
    cam_T_part = se3.from_rotation_translation(R, t)[..., None, :, :] @ root_T_part
    K = torch.tensor([[50.0, 0, 24], [0, 48, 19], [0, 0, 1]], dtype=f64)
    tensors = prior.points, prior.normals, prior.areas, cam_T_part, K.expand(*batch, 3, 3)
    return prior, [t.to(device, dtype) for t in tensors]


def shaped(prior: Shape, points, normals, areas) -> Shape:
    return replace(prior, points=points, normals=normals, areas=areas)


def weighted(render, prior, inputs, weights, radius) -> torch.Tensor:
    """A number that depends on every pixel of every silhouette."""
    *surface, pose, K = inputs
    seen = render(shaped(prior, *surface), pose, K, (H, W), radius)
    return (seen.parts * weights[0].to(seen.parts)).sum() + (
        seen.union * weights[1].to(seen.union)
    ).sum()


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("radius", [1.7, 2.5, 4.0, 6.3])
def test_they_are_the_plain_silhouettes(chest, batch, radius, device):
    prior, inputs = scene(chest, *batch)
    *surface, pose, K = inputs
    plain = plain_silhouettes(shaped(prior, *surface), pose, K, (H, W), radius)
    *surface, pose, K = (t.to(device, torch.float32) for t in inputs)
    fast = fast_silhouettes(shaped(prior, *surface), pose, K, (H, W), radius)
    assert plain.union.amax() > 0.9
    torch.testing.assert_close(fast.parts.cpu().to(f64), plain.parts, atol=1e-5, rtol=0)
    torch.testing.assert_close(fast.union.cpu().to(f64), plain.union, atol=1e-5, rtol=0)


@pytest.mark.parametrize("radius", [1.7, 2.5, 4.0, 6.3])
@pytest.mark.parametrize("width", [45, 48])
def test_groups_of_four_pixels_add_up_to_the_same(chest, radius, width):
    """The form of GPUs, by one thread."""
    _, inputs = scene(chest, 3, dtype=torch.float32)
    *surface, pose, K = inputs
    tensors = [t.expand(3, *t.shape).flatten(0, 1) for t in surface]
    tensors += [pose.flatten(0, 1), K[:, None].expand(3, 4, 3, 3).flatten(0, 1).contiguous()]
    target = silhouette_fast.Target(H, width, radius)
    found = []
    for in_fours in (False, True):
        canvas = target.canvas(12, pose)
        silhouette_fast.splat(tensors, canvas, target, in_fours=in_fours)
        found.append(target.images(canvas))
    assert found[0].amax() > 1.5
    torch.testing.assert_close(found[1], found[0], atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("radius", [2.5, 6.3])
def test_gradients_are_finite_differences_of_the_plain_silhouettes(chest, batch, radius, device):
    prior, inputs = scene(chest, *batch)
    weights = torch.randn(*batch, 4, H, W, dtype=f64), torch.randn(*batch, H, W, dtype=f64)
    given = [t.to(device, torch.float32).requires_grad_() for t in inputs[:4]]
    K = inputs[4].to(device, torch.float32)
    total = weighted(fast_silhouettes, prior, [*given, K], weights, radius)
    gradients = torch.autograd.grad(total, given)
    for i in range(4):
        direction, step = torch.randn_like(inputs[i]), 1e-6

        def at(shift: float, i: int = i, direction: torch.Tensor = direction) -> torch.Tensor:
            moved = [t + shift * direction if j == i else t for j, t in enumerate(inputs)]
            return weighted(plain_silhouettes, prior, moved, weights, radius)

        expected = (at(step) - at(-step)) / (2 * step)
        terms = gradients[i].cpu().to(f64) * direction
        error = (terms.sum() - expected).abs()
        assert error < 1e-5 * terms.abs().sum(), DIFFERENTIABLE[i]


@pytest.mark.parametrize("device", DEVICES)
def test_every_gradient_is_that_of_the_plain_silhouettes(chest, batch, device):
    prior, inputs = scene(chest, *batch)
    weights = torch.randn(*batch, 4, H, W, dtype=f64), torch.randn(*batch, H, W, dtype=f64)
    found = []
    for render, place in ((plain_silhouettes, ("cpu", f64)), (fast_silhouettes, (device, f32))):
        *given, K = (t.to(*place) for t in inputs)
        given = [t.requires_grad_() for t in given]
        found.append(torch.autograd.grad(weighted(render, prior, [*given, K], weights, 2.5), given))
    for plain, fast in zip(*found, strict=True):
        fast = fast.to("cpu", f64)
        torch.testing.assert_close(fast, plain, atol=1e-5 * plain.abs().amax(), rtol=1e-4)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU")
def test_a_cuda_graph_replays_them_with_new_inputs(chest):
    prior, (*surface, pose, K) = scene(chest, 3, device="cuda", dtype=torch.float32)
    shape = shaped(prior, *surface)
    pose.requires_grad_()

    def render() -> tuple[torch.Tensor, torch.Tensor]:
        union = fast_silhouettes(shape, pose, K, (H, W)).union
        return union, torch.autograd.grad(union.square().sum(), pose)[0]

    stream = torch.cuda.Stream()
    stream.wait_stream(torch.cuda.current_stream())
    with torch.cuda.stream(stream):
        render()
    torch.cuda.current_stream().wait_stream(stream)
    graph = torch.cuda.CUDAGraph()
    with torch.cuda.graph(graph, stream=stream):
        replayed = render()
    with torch.no_grad():
        pose += 0.02 * torch.randn_like(pose)
    graph.replay()
    for found, expected in zip(replayed, render(), strict=True):
        atol = 1e-5 * float(expected.abs().amax())
        torch.testing.assert_close(found, expected, atol=atol, rtol=1e-4)


@pytest.mark.parametrize("which", ["parts", "union"])
def test_a_loss_may_look_at_the_parts_or_the_union_alone(chest, which):
    prior, inputs = scene(chest, 2)
    found = []
    for render, dtype in ((plain_silhouettes, f64), (fast_silhouettes, torch.float32)):
        *surface, pose, K = (t.to(dtype) for t in inputs)
        pose.requires_grad_()
        seen = render(shaped(prior, *surface), pose, K, (H, W))
        found.append(torch.autograd.grad(getattr(seen, which).square().sum(), pose)[0])
    atol = 1e-5 * found[0].abs().amax()
    torch.testing.assert_close(found[1].to(f64), found[0], atol=atol, rtol=1e-4)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("render", [plain_silhouettes, fast_silhouettes])
@pytest.mark.parametrize("odd", [float("nan"), float("inf"), -float("inf")])
def test_points_that_are_not_finite_contribute_nothing(chest, render, odd, device):
    prior, inputs = scene(chest, 2)
    *surface, pose, K = (t.to(device, torch.float32) for t in inputs)
    pose.requires_grad_()
    points, normals, areas = surface
    without = areas.clone()
    without[:, ::3] = 0
    expected = render(shaped(prior, points, normals, without), pose, K, (H, W))
    broken = points.clone()
    broken[:, ::3] = odd
    seen = render(shaped(prior, broken, normals, areas), pose, K, (H, W))
    torch.testing.assert_close(seen.parts, expected.parts, atol=1e-6, rtol=0)
    if render is fast_silhouettes:
        gradients = [torch.autograd.grad(s.parts.sum(), pose)[0] for s in (seen, expected)]
        torch.testing.assert_close(*gradients)


def test_odd_normals_and_areas_contribute_nothing_either(chest):
    prior, inputs = scene(chest, 2)
    points, normals, areas, pose, K = (t.float() for t in inputs)
    normals[:, ::2], areas[:, 1::2] = float("nan"), float("nan")
    seen = fast_silhouettes(shaped(prior, points, normals, areas), pose, K, (H, W))
    assert seen.parts.abs().amax() == seen.union.abs().amax() == 0


def test_an_object_around_the_camera_is_the_plain_one_too(chest):
    """As far as single precision tells: at 1 cm a patch is a thousand times larger than at 10."""
    prior, inputs = scene(chest, 4)
    *surface, pose, K = (t.float() for t in inputs)
    pose[..., 2, 3] = 0.1
    shape = shaped(prior, *surface)
    plain = plain_silhouettes(shape, pose, K, (H, W)).parts
    torch.testing.assert_close(
        fast_silhouettes(shape, pose, K, (H, W)).parts, plain, atol=1e-3, rtol=0
    )
    assert plain.amax() > 0.9


@pytest.mark.parametrize("depth", [-1.0, 1e9, 1e30])
def test_what_is_behind_or_infinitely_far_is_not_seen_and_has_no_gradient(chest, depth):
    prior, inputs = scene(chest, 2)
    *surface, pose, K = (t.float() for t in inputs)
    pose[..., 2, 3] = depth
    pose.requires_grad_()
    seen = fast_silhouettes(shaped(prior, *surface), pose, K, (H, W))
    assert seen.union.amax() < 1e-6
    assert torch.autograd.grad(seen.parts.sum(), pose)[0].isfinite().all()


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("empty", ["samples", "points"])
def test_nothing_gives_nothing(chest, empty, device):
    prior, inputs = scene(chest, 2)
    points, normals, areas, pose, K = (t.to(device, torch.float32) for t in inputs)
    if empty == "samples":
        pose, K = pose[:0], K[:0]
    else:
        points, normals, areas = points[:, :0], normals[:, :0], areas[:, :0]
    pose.requires_grad_()
    seen = fast_silhouettes(shaped(prior, points, normals, areas), pose, K, (H, W))
    assert seen.parts.shape == (pose.shape[0], 4, H, W)
    assert seen.parts.sum() == 0
    assert torch.autograd.grad(seen.union.sum(), pose)[0].abs().sum() == 0


def test_autocast_does_not_make_them_coarse(chest):
    prior, inputs = scene(chest, 2)
    *surface, pose, K = (t.float() for t in inputs)
    expected = part_silhouettes(shaped(prior, *surface), pose, K, (H, W))
    pose.requires_grad_()
    with torch.autocast("cpu", dtype=torch.bfloat16):
        seen = part_silhouettes(shaped(prior, *surface), pose, K, (H, W))
        (gradient,) = torch.autograd.grad(seen.parts.sum(), pose)
    assert seen.parts.dtype == gradient.dtype == torch.float32
    assert torch.equal(seen.parts, expected.parts)


def test_halves_are_widened(chest):
    prior, inputs = scene(chest, 2)
    *surface, pose, K = (t.to(torch.bfloat16) for t in inputs)
    pose.requires_grad_()
    seen = part_silhouettes(shaped(prior, *surface), pose, K, (H, W))
    widened = part_silhouettes(
        shaped(prior, *(t.float() for t in surface)), pose.float(), K.float(), (H, W)
    )
    assert torch.equal(seen.parts, widened.parts)
    assert torch.autograd.grad(seen.parts.sum(), pose)[0].dtype == torch.bfloat16


def test_doubles_and_cameras_to_be_learned_take_the_plain_way(chest):
    prior, inputs = scene(chest, 2)
    *surface, pose, K = inputs
    shape = shaped(prior, *surface)
    doubles = part_silhouettes(shape, pose, K, (H, W)).parts
    assert torch.equal(doubles, plain_silhouettes(shape, pose, K, (H, W)).parts)
    *surface, pose, K = (t.float() for t in inputs)
    K.requires_grad_()
    seen = part_silhouettes(shaped(prior, *surface), pose, K, (H, W))
    assert torch.autograd.grad(seen.union.sum(), K)[0].abs().sum() > 0


@pytest.mark.slow
def test_the_kernels_compile_for_a_gpu_that_is_not_there(tmp_path):
    wp.init()
    made = wp.compile_aot_module(silhouette_warp, arch=[90], module_dir=tmp_path, use_ptx=True)
    assert ".target sm_90" in made[0].read_text(errors="ignore")
    assert "red.global.add.v4.f32" in made[0].read_text(errors="ignore")
