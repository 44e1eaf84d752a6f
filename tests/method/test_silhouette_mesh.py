"""Exact silhouettes of meshes: those of the run tier, their gradients, and laws of areas."""

from dataclasses import replace

import numpy as np
import pytest
import roma
import torch

from r2art.core.mesh import Mesh
from r2art.method import se3
from r2art.method.kinematics import forward_kinematics
from r2art.method.shape import Deformation, Prior, deform
from r2art.method.silhouette_mesh import Triangles, mesh_silhouettes, stretched
from r2art.run.refinement.coverage import FINER, cut, layers
from r2art.run.refinement.shell import shell_of

f32, f64 = torch.float32, torch.float64
SIZE = 40
K = torch.tensor([[50.0, 0, 20], [0, 48, 19], [0, 0, 1]], dtype=f64)
CORNERS = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3, indexing="ij")).reshape(3, -1).T
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
FACES = np.array([[(a, b, c), (a, c, d)] for a, b, c, d in QUADS]).reshape(-1, 3)
DEVICES = ["cpu", pytest.param("cuda", marks=pytest.mark.skipif(
    not torch.cuda.is_available(), reason="no GPU"))]  # fmt: skip


def boxes(category):
    """The category with its parts' boxes as its mesh; a little smaller, so that none touch."""
    placed = zip(category.box_center, category.box_size, strict=True)
    vertices = np.concatenate([center + 0.95 * CORNERS * size for center, size in placed])
    parts = len(category.box_center)
    faces = np.concatenate([FACES + 8 * p for p in range(parts)])
    mesh = Mesh(vertices=vertices, faces=faces, part=np.arange(parts).repeat(8))
    return replace(category, mesh=mesh)


def scene(category, *batch: int, z: float = 0.9):
    """A category's boxes somewhere before the camera, partly out of the image."""
    category = boxes(category)
    prior = Prior.from_category(category, dtype=f64)
    R = roma.random_rotmat(batch or 1, dtype=f64).reshape(*batch, 3, 3)
    t = 0.1 * torch.randn(*batch, 3, dtype=f64) + torch.tensor([0.05, 0.0, z], dtype=f64)
    cam_T_root = se3.from_rotation_translation(R, t)
    state = 0.2 * torch.rand(*batch, len(category.joints), dtype=f64)
    mesh = Triangles.from_mesh(category.mesh, dtype=f64)
    return category, prior, mesh, cam_T_root, state


def parts_of(prior, cam_T_root, state):
    return cam_T_root[..., None, :, :] @ forward_kinematics(prior.kinematics, state)


def by_the_run_tier(category, cam_T_part, parts: list[int]) -> np.ndarray:
    """Exact coverage of the union of some parts, by NumPy."""
    shell = shell_of(category.mesh)
    R, t = cam_T_part[:, :3, :3], cam_T_part[:, :3, 3]
    _, edge, way = shell.outline(-(R.transpose(0, 2, 1) @ t[..., None])[None, ..., 0])
    keep = np.isin(shell.part[shell.edges[edge, 0]], parts)
    ends, way = shell.edges[edge[keep]], way[keep]
    part = shell.part[ends]
    x = (R[part] @ shell.vertices[ends][..., None])[..., 0] + t[part]
    uv = FINER * (x[..., :2] / x[..., 2:] * K.numpy()[[0, 1], [0, 1]] + K.numpy()[:2, 2])
    run = uv[:, 1] - uv[:, 0]
    image = np.zeros(len(ends), int)
    cells = layers(cut(uv[:, 0], run), way * run[:, 1], image, 1, SIZE * FINER)[0]
    return np.minimum(cells, 1).reshape(SIZE, FINER, SIZE, FINER).mean(axis=(1, 3))


def test_they_are_those_of_the_run_tier(chest):
    for _ in range(5):
        category, prior, mesh, cam_T_root, state = scene(chest)
        cam_T_part = parts_of(prior, cam_T_root, state)
        seen = mesh_silhouettes(mesh, mesh.vertices, cam_T_part, K, (SIZE, SIZE), FINER)
        for part in range(4):
            expected = by_the_run_tier(category, cam_T_part.numpy(), [part])
            np.testing.assert_allclose(seen.parts[part], expected, atol=1e-9)
        expected = by_the_run_tier(category, cam_T_part.numpy(), [0, 1, 2, 3])
        np.testing.assert_allclose(seen.union, expected, atol=1e-9)
        assert expected.mean() > 0.1


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("dtype", [f32, f64])
def test_gradients_are_finite_differences(chest, batch, dtype, device):
    """Of all numbers that may move, as a share of the image's area."""
    _, prior, mesh, cam_T_root, state = scene(chest, *batch)
    inputs = [mesh.vertices, parts_of(prior, cam_T_root, state), K.expand(*batch, 3, 3)]
    weights = [torch.rand(*batch, *n, SIZE, SIZE, dtype=f64) for n in ((4,), ())]

    def total(given, on=mesh):
        seen = mesh_silhouettes(on, *given, (SIZE, SIZE))
        assert seen.parts.dtype == seen.union.dtype == given[1].dtype
        return sum((a * w.to(a)).sum() for a, w in zip(vars(seen).values(), weights, strict=True))

    moved = {k: v.to(device) for k, v in vars(mesh).items()}
    given = [t.to(device, dtype).requires_grad_() for t in inputs]
    gradients = torch.autograd.grad(total(given, Triangles(**moved)), given)
    for i, gradient in enumerate(gradients):
        direction, step = torch.randn_like(inputs[i]), 1e-6

        def at(shift: float, i: int = i, direction: torch.Tensor = direction) -> torch.Tensor:
            return total([t + shift * direction if j == i else t for j, t in enumerate(inputs)])

        expected = (at(step) - at(-step)) / (2 * step)
        found = (gradient.to("cpu", f64) * direction).sum()
        assert (found - expected).abs() < 1e-5 * SIZE**2, i


@pytest.mark.parametrize("which", ["parts", "union"])
def test_a_loss_may_look_at_the_parts_or_the_union_alone(cubes, which):
    _, prior, mesh, cam_T_root, state = scene(cubes)
    cam_T_part = parts_of(prior, cam_T_root, state)
    shift = torch.zeros(3, dtype=f64, requires_grad=True)

    def covered(t: torch.Tensor) -> torch.Tensor:
        moved = se3.from_rotation_translation(torch.eye(3, dtype=f64), t) @ cam_T_part
        seen = mesh_silhouettes(mesh, mesh.vertices, moved, K, (SIZE, SIZE))
        return getattr(seen, which).sum()

    (found,) = torch.autograd.grad(covered(shift), shift)
    steps = 1e-6 * torch.eye(3, dtype=f64)
    expected = torch.stack([(covered(d) - covered(-d)) / 2e-6 for d in steps])
    torch.testing.assert_close(found, expected, atol=1e-5 * SIZE**2, rtol=0)


def test_an_image_shows_what_the_middle_of_a_larger_one_does(chest):
    """Vertices beside, above and below the image count as they should, however far they are."""
    _, prior, mesh, cam_T_root, state = scene(chest, 3, z=0.5)
    cam_T_part = parts_of(prior, cam_T_root, state)
    small = mesh_silhouettes(mesh, mesh.vertices, cam_T_part, K, (20, 13))
    wider = K + torch.tensor([[0.0, 0, 100], [0, 0, 90], [0, 0, 0]], dtype=f64)
    large = mesh_silhouettes(mesh, mesh.vertices, cam_T_part, wider, (200, 213))
    assert 0.1 < small.union.mean() < 0.999
    for name in ("parts", "union"):
        middle = getattr(large, name)[..., 90:110, 100:113]
        torch.testing.assert_close(getattr(small, name), middle, atol=1e-9, rtol=0)


def test_a_batch_is_rendered_as_its_samples_are(chest):
    _, prior, mesh, cam_T_root, state = scene(chest, 3)
    cam_T_part = parts_of(prior, cam_T_root, state)
    vertices = mesh.vertices + 0.01 * torch.randn(3, *mesh.vertices.shape, dtype=f64)
    together = mesh_silhouettes(mesh, vertices, cam_T_part, K, (SIZE, 30))
    for i in range(3):
        alone = mesh_silhouettes(mesh, vertices[i], cam_T_part[i], K, (SIZE, 30))
        torch.testing.assert_close(together.parts[i], alone.parts)
        torch.testing.assert_close(together.union[i], alone.union)


@pytest.mark.parametrize("odd", ["nan", "inf", "behind", "at the camera"])
def test_what_cannot_be_drawn_is_left_out_and_has_no_gradient(chest, odd):
    _, prior, mesh, cam_T_root, state = scene(chest, 2)
    cam_T_part = parts_of(prior, cam_T_root, state)
    vertices = mesh.vertices.clone()
    if odd in ("nan", "inf"):
        vertices[9] = float(odd)  # of part 1
    else:
        cam_T_part[:, 1, 2, 3] = -2.0 if odd == "behind" else 0.0
    cam_T_part.requires_grad_()
    seen = mesh_silhouettes(mesh, vertices, cam_T_part, K, (SIZE, SIZE))
    (gradient,) = torch.autograd.grad(seen.union.sum() + seen.parts.sum(), cam_T_part)
    assert seen.parts[:, 1].abs().amax() == 0
    assert seen.parts[:, 0].amax() == 1
    assert gradient.isfinite().all()
    assert gradient[:, 1].abs().amax() == 0 < gradient[:, 0].abs().amax()


def test_no_samples_give_no_images(chest):
    _, prior, mesh, cam_T_root, state = scene(chest, 2)
    cam_T_part = parts_of(prior, cam_T_root, state)[:0].requires_grad_()
    seen = mesh_silhouettes(mesh, mesh.vertices, cam_T_part, K, (SIZE, SIZE))
    assert seen.parts.shape == (0, 4, SIZE, SIZE)
    assert torch.autograd.grad(seen.union.sum(), cam_T_part)[0].shape == (0, 4, 4, 4)


def test_halves_are_widened_and_autocast_changes_nothing(chest):
    _, prior, mesh, cam_T_root, state = scene(chest, 2)
    cam_T_part = parts_of(prior, cam_T_root, state).to(torch.bfloat16).requires_grad_()
    expected = mesh_silhouettes(mesh, mesh.vertices, cam_T_part.to(f32), K, (SIZE, SIZE))
    with torch.autocast("cpu", dtype=torch.bfloat16):
        seen = mesh_silhouettes(mesh, mesh.vertices, cam_T_part, K, (SIZE, SIZE))
        (gradient,) = torch.autograd.grad(seen.parts.sum(), cam_T_part)
    assert seen.parts.dtype == f32
    assert gradient.dtype == torch.bfloat16
    assert torch.equal(seen.parts, expected.parts)


def test_vertices_are_deformed_as_points_are(chest, batch):
    category = boxes(chest)
    points = category.mesh.vertices.reshape(4, 8, 3)
    normals = np.ones_like(points) / 3**0.5
    prior = Prior.from_category(replace(category, points=points, normals=normals), dtype=f64)
    deformation = Deformation(
        log_scale=0.2 * torch.randn(*batch, 4, 3, dtype=f64),
        center_shift=0.1 * torch.randn(*batch, 4, 3, dtype=f64),
    )
    shape = deform(prior, deformation)
    mesh = Triangles.from_mesh(category.mesh, dtype=f64)
    torch.testing.assert_close(stretched(mesh, prior, shape), shape.points.flatten(-3, -2))
