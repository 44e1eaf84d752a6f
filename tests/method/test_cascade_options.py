"""The ablation's cascades: which stages are on, and whom they serve."""

import pytest
import torch

from r2art.method import se3
from r2art.method.cascade import (
    Rendering,
    alignment_loss,
    area_loss,
    cascade_loss,
    pixel_loss,
    render,
)
from r2art.method.kinematics import forward_kinematics
from r2art.method.shape import Prior

f64 = torch.float64
MOVES = {1: [-5.0, -5.0, 5.0, 5.0], 2: [8.0, 0.0, 8.0, 0.0], 3: [0.3, 0.0, 0.3, 0.0]}
"""What brings a box of 20 × 20 px into each stage."""


def rendering(box: torch.Tensor) -> Rendering:
    pixel = torch.arange(48, dtype=f64) + 0.5
    x = torch.sigmoid(pixel - box[..., :1]) * torch.sigmoid(box[..., 2:3] - pixel)
    y = torch.sigmoid(pixel - box[..., 1:2]) * torch.sigmoid(box[..., 3:] - pixel)
    union = y[..., :, None] * x[..., None, :]
    return Rendering(box=box, union=union, parts=union[..., None, :, :])


@pytest.fixture
def scene() -> tuple[Rendering, Rendering]:
    """A sample in each stage, in order, and the truth."""
    true = torch.tensor([10.0, 10.0, 30.0, 30.0], dtype=f64).expand(3, 4)
    return rendering(true + torch.tensor(list(MOVES.values()), dtype=f64)), rendering(true)


def test_a_sample_whose_stage_is_off_is_served_by_the_next_that_is_on_or_the_last(scene):
    area, align, pixel = (f(*scene) for f in (area_loss, alignment_loss, pixel_loss))
    expected = {
        (1,): [area, area, area],
        (1, 2): [area, 0.1 * area + align, 0.1 * area + align],
        (1, 2, 3): [area, 0.1 * area + align, 0.1 * area + 0.1 * align + pixel],
        (3,): [pixel, pixel, pixel],
        (1, 3): [area, 0.1 * area + pixel, 0.1 * area + pixel],
    }
    for stages, by_sample in expected.items():
        loss, stage = cascade_loss(*scene, stages=stages)
        assert stage.tolist() == [1, 2, 3]  # where a sample is does not depend on what is on
        wanted = torch.stack([term[i] for i, term in enumerate(by_sample)])
        torch.testing.assert_close(loss, wanted, msg=str(stages))


@pytest.mark.parametrize("stages", [(1,), (1, 2), (1, 2, 3), (3,)])
def test_no_cascade_moves_what_is_where_it_belongs(chest, stages):
    prior = Prior.from_category(chest, dtype=f64)
    K = torch.tensor([[60.0, 0.0, 24.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]], dtype=f64)
    R = se3.rotation_about_axis(
        torch.tensor([0.8, 0.6, 0.0], dtype=f64), torch.tensor(2.6, dtype=f64)
    )
    t = torch.tensor([0.0, 0.0, 1.0], dtype=f64, requires_grad=True)
    state = torch.tensor([0.6, 0.05, 0.1], dtype=f64)
    cam_T_part = se3.from_rotation_translation(R, t) @ forward_kinematics(prior.kinematics, state)
    seen = render(prior, cam_T_part, K, (48, 48))
    truth = render(prior, cam_T_part.detach(), K, (48, 48))
    loss, _ = cascade_loss(seen, truth, stages=stages)
    (gradient,) = torch.autograd.grad(loss, t)
    assert gradient.abs().max() < 1e-2


@pytest.mark.parametrize("at", [1, 2, 3])
def test_the_loss_of_every_stage_passes_gradcheck(at):
    true = torch.tensor([10.3, 10.1, 30.2, 30.4], dtype=f64)
    start = true + torch.tensor(MOVES[at], dtype=f64) + torch.tensor([0.013, 0.007, 0.021, 0.002])
    wanted, fixed = rendering(true), rendering(start)
    # η and ω are constants of the gradient: η is rendered from a fixed box, and a part mask of
    # nearly 1 leaves nothing outside of it for ω.
    wanted = Rendering(parts=wanted.parts.clamp_min(1 - 1e-12), union=wanted.union, box=wanted.box)

    def loss(box: torch.Tensor) -> torch.Tensor:
        seen = Rendering(parts=rendering(box).parts, union=fixed.union, box=box)
        value, stage = cascade_loss(seen, wanted)
        assert stage == at
        return value

    assert torch.autograd.gradcheck(loss, (start.requires_grad_(),))
