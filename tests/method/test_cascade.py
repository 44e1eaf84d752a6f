import math

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from r2art.method import se3
from r2art.method.cascade import (
    Rendering,
    alignment_loss,
    area_loss,
    beyond_edge,
    box_overlap_loss,
    cascade_loss,
    corner_offset_loss,
    edge_band,
    iou,
    iou_loss,
    only_translation,
    pixel_loss,
    render,
    stage,
)
from r2art.method.kinematics import forward_kinematics
from r2art.method.shape import Prior

f64 = torch.float64
SIZE = 48
K = torch.tensor([[60.0, 0.0, 24.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], dtype=f64)
BOX_LOSSES = [iou_loss, box_overlap_loss, corner_offset_loss]

coordinate = st.floats(-100, 100)
extent = st.floats(1, 100)


@st.composite
def boxes(draw):
    x, y, w, h = draw(coordinate), draw(coordinate), draw(extent), draw(extent)
    return torch.tensor([x, y, x + w, y + h], dtype=f64)


def random_boxes(*batch: int) -> torch.Tensor:
    corner, size = 20 * torch.rand(2, *batch, 2, dtype=f64)
    return torch.cat([corner, corner + size + 5], dim=-1)


def rendering(box: torch.Tensor) -> Rendering:
    """A rendering of one part that fills, about, its box."""
    pixel = torch.arange(SIZE, dtype=f64) + 0.5
    x = torch.sigmoid(pixel - box[..., :1]) * torch.sigmoid(box[..., 2:3] - pixel)
    y = torch.sigmoid(pixel - box[..., 1:2]) * torch.sigmoid(box[..., 3:] - pixel)
    union = y[..., :, None] * x[..., None, :]
    return Rendering(box=box, union=union, parts=union[..., None, :, :])


@given(boxes(), boxes())
def test_box_losses_are_symmetric_within_their_ranges_and_least_for_equal_boxes(a, b):
    for loss, greatest in zip(BOX_LOSSES, (math.log(101), 4, 2), strict=True):
        torch.testing.assert_close(loss(a, b), loss(b, a))
        torch.testing.assert_close(loss(a, a), torch.zeros((), dtype=f64))
        assert -1e-12 <= loss(a, b) <= greatest + 1e-12


@given(boxes(), boxes(), coordinate, st.floats(0.5, 5))
def test_box_losses_do_not_see_where_or_how_large_the_picture_is(a, b, shift, scale):
    for loss in BOX_LOSSES:
        torch.testing.assert_close(loss(scale * a + shift, scale * b + shift), loss(a, b))


def test_iou_of_known_boxes():
    a, b = torch.tensor([[0.0, 0.0, 4.0, 2.0], [2.0, 0.0, 6.0, 2.0]], dtype=f64)
    assert iou(a, b).item() == pytest.approx(1 / 3)
    assert iou(a, b + 5).item() == 0


def test_disjoint_boxes_pull_each_other_though_their_iou_does_not():
    a = torch.tensor([0.0, 0.0, 4.0, 4.0], dtype=f64, requires_grad=True)
    b = torch.tensor([9.0, 11.0, 14.0, 15.0], dtype=f64)
    assert torch.autograd.grad(iou_loss(a, b), a)[0].abs().max() == 0
    for loss in (box_overlap_loss, corner_offset_loss):
        (gradient,) = torch.autograd.grad(loss(a, b), a)
        assert (gradient[:2] + gradient[2:] < 0).all()  # descending moves it right and down


@pytest.mark.parametrize("loss", BOX_LOSSES)
@pytest.mark.parametrize("offset", [3.0, 60.0], ids=["overlapping", "disjoint"])
def test_box_losses_pass_gradcheck(loss, offset):
    a = random_boxes(4).requires_grad_()
    b = (random_boxes(4) + offset).requires_grad_()
    assert torch.autograd.gradcheck(loss, (a, b))


@given(boxes(), boxes())
def test_exactly_one_stage_holds_and_the_truth_is_in_the_last(a, b):
    area = (b[2:] - b[:2]).prod() / (a[2:] - a[:2]).prod()
    first = not 0.9 <= area <= 1.1
    second = not first and bool(iou(a, b) < 0.9)
    assert stage(b, a).item() == (1 if first else 2 if second else 3)
    assert stage(a, a).item() == 3


def test_each_stage_is_reached_per_sample_and_has_its_own_loss():
    true = torch.tensor([10.0, 10.0, 30.0, 30.0], dtype=f64).expand(4, 4)
    moves = [
        [-5.0, -5.0, 5.0, 5.0],
        [8.0, 0.0, 8.0, 0.0],
        [0.3, 0.0, 0.3, 0.0],
        [90.0, 90.0, 90.0, 90.0],
    ]
    seen, wanted = rendering(true + torch.tensor(moves, dtype=f64)), rendering(true)
    loss, at = cascade_loss(seen, wanted)
    assert at.tolist() == [1, 2, 3, 2]
    area, alignment, pixels = (f(seen, wanted) for f in (area_loss, alignment_loss, pixel_loss))
    by_stage = torch.stack([area, 0.1 * area + alignment, 0.1 * area + 0.1 * alignment + pixels])
    torch.testing.assert_close(loss, by_stage[at - 1, torch.arange(4)])


def test_losses_of_a_batch_are_those_of_its_samples(batch):
    seen, wanted = random_boxes(*batch), random_boxes(*batch)
    loss, at = cascade_loss(rendering(seen), rendering(wanted))
    assert loss.shape == at.shape == batch
    alone = [
        cascade_loss(rendering(a), rendering(b))
        for a, b in zip(seen.reshape(-1, 4), wanted.reshape(-1, 4), strict=True)
    ]
    torch.testing.assert_close(loss.flatten(), torch.stack([one for one, _ in alone]))
    torch.testing.assert_close(at.flatten(), torch.stack([one for _, one in alone]))


@pytest.mark.parametrize("factor", [0.2, 0.5, 2.0, 5.0])
def test_the_area_loss_pulls_too_large_and_too_small_boxes_to_size(factor):
    true = torch.tensor([18.0, 18.0, 30.0, 30.0], dtype=f64)
    log_size = torch.tensor(math.log(factor), dtype=f64, requires_grad=True)
    loss = area_loss(rendering(24 + (true - 24) * log_size.exp()), rendering(true))
    (gradient,) = torch.autograd.grad(loss, log_size)
    assert gradient.sign() == math.copysign(1, factor - 1)
    plain = abs(math.log((12 * factor) ** 2 + 1) - math.log(145))
    assert 1 < loss.item() / plain <= math.e + 1e-12


def test_a_silhouette_that_left_the_image_weighs_most():
    """All pixels are missing, so η is e; and the gradient is still there, from the box."""
    true = torch.tensor([18.0, 18.0, 30.0, 30.0], dtype=f64)
    away = torch.tensor([500.0, 500.0, 506.0, 506.0], dtype=f64, requires_grad=True)
    loss = area_loss(rendering(away), rendering(true))
    assert loss.item() == pytest.approx(math.e * math.log(145 / 37), rel=1e-3)
    assert torch.autograd.grad(loss, away)[0].abs().min() > 0


def test_beyond_edge_counts_only_what_is_outside_of_the_truth():
    true = torch.zeros(8, 8, dtype=f64)
    true[2:6, 2:6] = 1
    part, shifted = true.clone(), true.roll(1, dims=1)
    part[2] = 0
    assert beyond_edge(part, true).item() == 0
    assert beyond_edge(shifted, true).item() == pytest.approx(4 / 16)
    assert beyond_edge(torch.ones(8, 8, dtype=f64), true * 0).item() == 5


def test_the_edge_band_lies_on_both_sides_of_the_outline(batch):
    mask = torch.zeros(*batch, 20, 20, dtype=f64)
    mask[..., 5:15, 5:15] = 1
    expected = torch.zeros(20, 20, dtype=torch.bool)
    expected[3:17, 3:17] = True
    expected[7:13, 7:13] = False
    assert (edge_band(mask) == expected).all()
    assert not edge_band(0 * mask).any()


def test_errors_beyond_the_edge_make_the_pixels_at_the_edge_weigh_more():
    true = rendering(torch.tensor([16.0, 16.0, 32.0, 32.0], dtype=f64))
    seen = true.parts.roll((1, 3), dims=(-2, -1)).requires_grad_()
    excess = beyond_edge(seen, true.parts)
    p = 1e-4 + (1 - 2e-4) * seen
    plain = -(true.parts * p.log() + (1 - true.parts) * (1 - p).log()).mean()
    loss = pixel_loss(Rendering(parts=seen, union=seen[0], box=true.box), true)
    ratio = torch.autograd.grad(loss, seen)[0] / torch.autograd.grad(plain, seen)[0]
    torch.testing.assert_close(ratio, 1 + excess * edge_band(true.parts))
    assert excess > 0.1


def test_no_silhouette_scores_better_than_the_truth():
    true = rendering(torch.tensor([16.0, 16.0, 32.0, 32.0], dtype=f64))
    best = pixel_loss(true, true)
    for _ in range(20):
        seen = (true.parts + 0.05 * torch.randn_like(true.parts)).clamp(0, 1)
        assert pixel_loss(Rendering(parts=seen, union=seen[0], box=true.box), true) > best


@pytest.mark.parametrize("loss", [area_loss, alignment_loss, pixel_loss])
def test_rendered_losses_pass_gradcheck(loss):
    box, true = random_boxes(2).requires_grad_(), rendering(random_boxes(2))
    # η and ω are constants of the gradient: freeze them by rendering them from a fixed box.
    fixed = rendering(box.detach())

    def frozen(b):
        seen = rendering(b)
        if loss is area_loss:
            seen = Rendering(parts=seen.parts, union=fixed.union, box=b)
        return loss(seen, true)

    if loss is pixel_loss:
        true = Rendering(parts=true.parts.clamp_min(1 - 1e-12), union=true.union, box=true.box)
    assert torch.autograd.gradcheck(frozen, (box,))


@pytest.fixture
def scene(chest):
    """The chest's prior, its true pose, and a function from root motions to part poses."""
    prior = Prior.from_category(chest, dtype=f64)
    axis = torch.tensor([0.8, 0.6, 0.0], dtype=f64)
    R = se3.rotation_about_axis(axis, torch.tensor(2.6, dtype=f64))
    state = torch.tensor([0.6, 0.05, 0.1], dtype=f64)

    def pose(translation: torch.Tensor, state: torch.Tensor = state) -> torch.Tensor:
        cam_T_root = se3.from_rotation_translation(R, translation)
        return cam_T_root[..., None, :, :] @ forward_kinematics(prior.kinematics, state)

    return prior, pose, torch.tensor([0.0, 0.0, 1.0], dtype=f64)


def test_the_true_pose_is_in_the_last_stage_and_still(scene):
    prior, pose, true = scene
    t = true.clone().requires_grad_()
    wanted = render(prior, pose(true), K, (SIZE, SIZE))
    loss, at = cascade_loss(render(prior, pose(t), K, (SIZE, SIZE)), wanted)
    assert at == 3
    assert torch.autograd.grad(loss, t)[0].abs().max() < 1e-2


@pytest.mark.parametrize("shift", [(0.5, 0.2, 0.6), (-0.5, -0.6, -0.2), (0.05, 0.0, 0.3)])
def test_descending_the_cascade_brings_the_object_home(scene, shift):
    """From boxes that are disjoint, through the stages in their order, to the true place."""
    prior, pose, true = scene
    wanted = render(prior, pose(true), K, (SIZE, SIZE))
    start = true + torch.tensor(shift, dtype=f64)
    offset = (start / start[2]).clone()
    offset[2] = start[2].log()
    offset.requires_grad_()
    optimizer = torch.optim.Adam([offset], lr=0.03)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, 120)
    stages = []
    for _ in range(120):
        z = offset[2].exp()
        t = torch.stack([offset[0] * z, offset[1] * z, z])
        loss, at = cascade_loss(render(prior, pose(t), K, (SIZE, SIZE)), wanted)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()
        stages.append(int(at))
    assert stages[0] < 3
    assert stages[-1] == 3
    torch.testing.assert_close(t, true, atol=0.01, rtol=0)


@pytest.mark.parametrize(
    "translation", [(0, 0, -1), (0, 0, 0), (0, 0, 0.02), (1e5, -1e5, 1), (0, 0, 1e6), (3, 0, 0.1)]
)
@pytest.mark.parametrize("dtype", [torch.float32, f64])
def test_losses_and_gradients_are_finite_wherever_the_object_is(chest, scene, translation, dtype):
    prior = Prior.from_category(chest, dtype=dtype)
    _, pose, true = scene
    wanted = render(prior, pose(true).to(dtype), K.to(dtype), (SIZE, SIZE))
    t = torch.tensor(translation, dtype=f64, requires_grad=True)
    seen = render(prior, pose(t).to(dtype), K.to(dtype), (SIZE, SIZE), box_steers_all=True)
    for loss in (
        cascade_loss(seen, wanted)[0],
        area_loss(seen, wanted),
        alignment_loss(seen, wanted),
    ):
        assert loss.isfinite()
        assert torch.autograd.grad(loss, t, retain_graph=True)[0].isfinite().all()
    assert pixel_loss(seen, wanted).isfinite()


def test_by_default_the_box_moves_nothing_but_the_roots_translation(scene):
    prior, pose, true = scene
    t = (true + 0.3).requires_grad_()
    state = torch.tensor([0.6, 0.05, 0.1], dtype=f64, requires_grad=True)

    def gradients(box_steers_all: bool):
        seen = render(prior, pose(t, state), K, (SIZE, SIZE), box_steers_all=box_steers_all)
        return torch.autograd.grad(seen.box.sum(), (t, state), allow_unused=True)

    all_t, all_state = gradients(True)
    only_t, only_state = gradients(False)
    torch.testing.assert_close(only_t, all_t)
    assert all_state.abs().max() > 0
    assert only_state.abs().max() == 0


def test_only_translation_changes_no_pose(scene):
    _, pose, true = scene
    cam_T_part = pose(true.expand(2, 3))
    torch.testing.assert_close(only_translation(cam_T_part), cam_T_part)
