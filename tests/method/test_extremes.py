"""Whatever a network says, and wherever the object is: numbers stay finite, gradients alive."""

import pytest
import torch

from r2art.method import cascade, losses, se3
from r2art.method.estimate import Estimate, estimate
from r2art.method.kinematics import forward_kinematics
from r2art.method.outputs import NodePoses, RawEstimate
from r2art.method.shape import Deformation, Prior, box_corners, thinned

f64 = torch.float64
INPUTS = 100_000
SIZE = (8, 8)


def extreme(*shape: int, lowest: float = -30, highest: float = 6) -> torch.Tensor:
    """Numbers of either sign of every order of magnitude from 10^-30 to 10^6, and zeros."""
    size = 10 ** (lowest + (highest - lowest) * torch.rand(shape))
    sign = torch.randint(-1, 2, shape)
    return size * sign


def extreme_raw(n: int, part_centric: bool) -> RawEstimate:
    """What a network of the two cubes might say, ready for gradients."""
    of_nodes = {"up": (n, 1, 3), "right": (n, 1, 3), "phi": (n, 1, 2), "log_lambda": (n, 1)}
    nodes = NodePoses(**{k: extreme(*shape).requires_grad_() for k, shape in of_nodes.items()})
    shapes = {"up": (n, 3), "right": (n, 3), "phi": (n, 2), "log_lambda": (n,)}
    shapes |= {"joint_share": (n, 1), "log_scale": (n, 2, 3), "center_shift": (n, 2, 3)}
    shapes |= {"confidence_logit": (n, 2)}
    said = {k: extreme(*shape).requires_grad_() for k, shape in shapes.items()}
    return RawEstimate(**said, nodes=nodes if part_centric else None)


def extreme_view(n: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Boxes from a thousandth of a pixel to ten thousand, anywhere, and cameras to match."""
    corner = extreme(n, 2, lowest=-3, highest=4)
    box = torch.cat([corner, corner + 10 ** (-3 + 7 * torch.rand(n, 2))], dim=1)
    focal = 10 ** (5 * torch.rand(n, 2))
    K = torch.diag_embed(torch.cat([focal, torch.ones(n, 1)], dim=1))
    K[:, :2, 2] = extreme(n, 2, lowest=-3, highest=4)
    return box, K


def tensors(*things) -> list[torch.Tensor]:
    found: list[torch.Tensor] = []
    for thing in things:
        if isinstance(thing, torch.Tensor):
            found.append(thing)
        elif hasattr(thing, "__dataclass_fields__"):
            found += tensors(*vars(thing).values())
    return found


def base_terms(prior: Prior, found: Estimate, raw: RawEstimate, box, K) -> list[torch.Tensor]:
    ones = torch.ones_like(raw.up)
    deformation = Deformation(log_scale=raw.log_scale, center_shift=raw.center_shift)
    none = Deformation(log_scale=0 * raw.log_scale, center_shift=0 * raw.center_shift)
    corners = box_corners(found.shape.box_center, found.shape.box_size)
    corners = se3.transform(found.cam_T_part, corners).flatten(1, 2)
    truth = torch.randn_like(corners) + torch.tensor([0.0, 0.0, 3.0])
    return [
        losses.direction_loss(raw.up, ones),
        losses.direction_loss(raw.right, ones),
        losses.offset_loss(raw.phi, 0 * raw.phi),
        losses.depth_loss(raw.log_lambda, 0 * raw.log_lambda),
        losses.joint_state_loss(found.joint_state, 0 * found.joint_state, prior.kinematics),
        losses.shape_loss(deformation, none, prior),
        losses.reprojection_loss(corners, truth, K, box),
    ]


@pytest.mark.parametrize("part_centric", [False, True], ids=["joint-centric", "part-centric"])
def test_estimates_and_base_losses_are_finite_for_any_numbers(cubes, part_centric):
    prior = thinned(Prior.from_category(cubes), 64)
    raw = extreme_raw(INPUTS, part_centric)
    box, K = extreme_view(INPUTS)
    found = estimate(prior, raw, box, K)
    terms = base_terms(prior, found, raw, box, K)
    for value in tensors(found, *terms):
        if value.is_floating_point():
            assert value.isfinite().all()
    total = sum(term.sum() for term in terms)
    leaves = [t for t in tensors(raw) if t is not raw.confidence_logit]
    for gradient in torch.autograd.grad(total, leaves, allow_unused=True):
        assert gradient is None or gradient.isfinite().all()


def test_the_cascade_is_finite_for_any_numbers(cubes):
    prior = thinned(Prior.from_category(cubes), 64)
    n = INPUTS // 10
    wanted = estimate(prior, likely_raw(n), *likely_view(n))
    K = likely_view(n)[1]
    truth = cascade.render(wanted.shape, wanted.cam_T_part, K, SIZE)
    for _ in range(10):
        raw = extreme_raw(n, part_centric=False)
        found = estimate(prior, raw, *extreme_view(n))
        seen = cascade.render(found.shape, found.cam_T_part, K, SIZE, box_steers_all=True)
        loss, stage = cascade.cascade_loss(seen, truth)
        assert loss.isfinite().all()
        assert ((stage >= 1) & (stage <= 3)).all()
        leaves = [t for t in tensors(raw) if t is not raw.confidence_logit]
        for gradient in torch.autograd.grad(loss.sum(), leaves):
            assert gradient.isfinite().all()


def likely_view(n: int) -> tuple[torch.Tensor, torch.Tensor]:
    K = torch.tensor([[10.0, 0, 4], [0, 10, 4], [0, 0, 1]]).expand(n, 3, 3)
    return torch.tensor([1.0, 1.0, 7.0, 7.0]).expand(n, 4), K


def likely_raw(n: int) -> RawEstimate:
    return RawEstimate(
        up=torch.randn(n, 3),
        right=torch.randn(n, 3),
        phi=torch.zeros(n, 2),
        log_lambda=torch.zeros(n),
        joint_share=torch.rand(n, 1),
        log_scale=torch.zeros(n, 2, 3),
        center_shift=torch.zeros(n, 2, 3),
        confidence_logit=torch.zeros(n, 2),
    )


def test_gradients_are_alive_for_random_poses(chest):
    """At each of 500 places, most of them outside of the image, the cascade pulls the root."""
    prior = thinned(Prior.from_category(chest, dtype=f64), 4)
    n, size = 500, (24, 24)
    K = torch.tensor([[30.0, 0, 12], [0, 30, 12], [0, 0, 1]], dtype=f64)
    R, state = (
        random_rotations(2, n),
        torch.rand(2, n, 3, dtype=f64) * prior.kinematics.limits[:, 1],
    )
    z = 0.3 + 5 * torch.rand(n, dtype=f64)
    ray = 0.7 * torch.randn(n, 2, dtype=f64)
    t = torch.stack([ray[:, 0] * z, ray[:, 1] * z, z], dim=1).requires_grad_()
    true_t = torch.tensor([0.0, 0.0, 1.0], dtype=f64).expand(n, 3)

    def look(R, t, state):
        cam_T_root = se3.from_rotation_translation(R, t)
        poses = cam_T_root[:, None] @ forward_kinematics(prior.kinematics, state)
        return cascade.render(prior, poses, K, size)

    seen, truth = look(R[0], t, state[0]), look(R[1], true_t, state[1])
    disjoint = cascade.iou(seen.box, truth.box) == 0
    assert 0.3 < disjoint.double().mean() < 0.95
    loss, stage = cascade.cascade_loss(seen, truth)
    assert set(stage.tolist()) >= {1, 2}
    (gradient,) = torch.autograd.grad(loss.sum(), t)
    assert gradient.isfinite().all()
    alive = gradient.norm(dim=1) > 1e-6
    assert alive.double().mean() >= 0.99


def random_rotations(*batch: int) -> torch.Tensor:
    q, _ = torch.linalg.qr(torch.randn(*batch, 3, 3, dtype=f64))
    return q * torch.linalg.det(q)[..., None, None]
