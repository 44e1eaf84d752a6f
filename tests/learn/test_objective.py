"""At the truth there is nothing to minimise; elsewhere there is, and a way down."""

from dataclasses import fields, replace

import numpy as np
import pytest
import torch

from r2art.learn.augment import MASK_STRIDE, Crops, Views, crops
from r2art.learn.chance import Chance
from r2art.learn.coordinates import is_known
from r2art.learn.memory import Photos
from r2art.learn.objective import (
    CascadeOptions,
    Weights,
    cascade_term,
    coordinate_losses,
    corners_in_camera,
    is_right,
    mask_loss,
    objective,
    part_classes,
    pose_losses,
    true_shape,
)
from r2art.method import se3
from r2art.method.depth import translation_targets, viewing_ray
from r2art.method.estimate import estimate, share_from_state
from r2art.method.kinematics import forward_kinematics
from r2art.method.outputs import (
    LOG_DEVIATION,
    CropOutput,
    DenseOutput,
    NodePoses,
    RawEstimate,
    TrainingOutput,
)
from r2art.method.projection import box_of_points, project
from r2art.method.rotation import egocentric_to_allocentric
from r2art.method.shape import Prior, Shape, deformation_of

SURE = 30.0
PIXELS = 56
SIDE = 64 // MASK_STRIDE
NAME = "some"
OF_KNOWN = {"keypoint", "keypoint_map"}
"""Terms of known objects alone: see `test_known`."""
WEIGHED = [f.name for f in fields(Weights) if f.name not in OF_KNOWN]


@pytest.fixture(params=["laptop", "drawer"])
def truth(request, photos) -> tuple[Prior, Crops]:
    """Crops of objects that are the deformed prior exactly (a real hinge's place varies a bit)."""
    return exactly(photos[request.param])


def exactly(some: Photos) -> tuple[Prior, Crops]:
    prior = Prior.from_category(some.category)
    made = crops(some, torch.arange(8), 64, Chance(0, torch.device("cpu")), None, augment=False)
    state = made.joint_state.minimum(prior.kinematics.limits[:, 1])
    shape = true_shape(prior, made)
    poses = made.cam_T_part[:, :1] @ forward_kinematics(shape.kinematics, state)
    box = box_of_points(project(corners_in_camera(shape, poses), made.K))
    seen = made.seen.round()  # at an edge, the loss of the truth is not zero
    return prior, replace(made, cam_T_part=poses, joint_state=state, box=box, seen=seen)


def raw_truth(prior: Prior, true: Crops) -> RawEstimate:
    """What the network would have to say."""
    cam_T_root = true.cam_T_part[:, 0]
    facing = egocentric_to_allocentric(cam_T_root[:, :3, :3], viewing_ray(true.box, true.K))
    phi, log_lambda = translation_targets(
        cam_T_root[:, :3, 3], true.box, true.K, prior.frontal_area
    )
    deformation = deformation_of(prior, true.box_center, true.box_size)
    return RawEstimate(
        up=0.3 * facing[..., 1],
        right=2.0 * facing[..., 0],
        phi=phi,
        log_lambda=log_lambda,
        joint_share=share_from_state(true.joint_state, prior.kinematics.limits),
        log_scale=deformation.log_scale,
        center_shift=deformation.center_shift,
        confidence_logit=torch.full(true.box_size.shape[:2], SURE),
    )


def some_views(n: int = 6) -> tuple[Views, torch.Tensor]:
    corner = 10 + 20 * torch.rand(n, 2)
    box = torch.cat([corner, corner + 10 + 20 * torch.rand(n, 2)], dim=1)
    seen = (torch.rand(n, 1, SIDE, SIDE) < 0.3).float()
    image = torch.zeros(n, 3, 64, 64)
    return Views(index=torch.arange(n), image=image, seen=seen, box=box), torch.arange(n) % 2


def right_output(raw: RawEstimate, true: Crops, views: Views, category) -> TrainingOutput:
    classes = torch.nn.functional.one_hot(part_classes(true), true.box_size.shape[1] + 1)
    of_crops = CropOutput(
        raw=raw,
        dense=DenseOutput(
            part_logits=SURE * classes.movedim(-1, 1).float(),
            coordinates=true.coordinates,
            log_deviation=torch.full_like(true.coordinates[:, 0], -1.0),
        ),
        object_logits=SURE * (2 * true.seen - 1),
    )
    return TrainingOutput(
        crops={NAME: of_crops},
        found_box=views.box,
        category_logits=SURE * torch.nn.functional.one_hot(category, 3).float(),
        object_logits=SURE * (2 * views.seen - 1),
    )


def asked(prior: Prior, output: TrainingOutput, true: Crops, *rest):
    """The objective of crops of one category."""
    return objective({NAME: prior}, output, {NAME: true}, *rest)


def test_the_estimate_of_the_true_numbers_is_the_truth(truth):
    prior, true = truth
    found = estimate(prior, raw_truth(prior, true), true.box, true.K)
    torch.testing.assert_close(found.cam_T_part, true.cam_T_part, rtol=0, atol=1e-4)
    torch.testing.assert_close(found.joint_state, true.joint_state, rtol=0, atol=1e-5)
    torch.testing.assert_close(found.shape.box_center, true.box_center, rtol=0, atol=1e-5)
    torch.testing.assert_close(found.shape.box_size, true.box_size, rtol=0, atol=1e-5)


def test_every_loss_vanishes_at_the_truth(truth):
    prior, true = truth
    views, category = some_views()
    output = right_output(raw_truth(prior, true), true, views, category)
    total, terms, _ = asked(prior, output, true, views, category, Weights(), None)
    assert set(terms) == set(WEIGHED) - {"cascade"}
    surest = float(terms.pop("correspondence"))  # of a density, whose logarithm has no bound
    assert surest == pytest.approx(0.1 * np.exp(-LOG_DEVIATION[0]) + 2 * LOG_DEVIATION[0], rel=0.01)
    for name, value in terms.items():
        assert abs(float(value)) < 1e-4, name
    assert float(total) == pytest.approx(Weights().correspondence * surest, abs=1e-3)


def test_places_are_to_know_how_far_off_they_are(truth):
    """Off by d px, the loss is least where they say d / 2; beyond the object they say nothing."""
    prior, true = truth
    views, category = some_views()
    output = right_output(raw_truth(prior, true), true, views, category)
    exact = output.crops[NAME].dense
    off = exact.coordinates + torch.tensor([0.1, 0, 0])[:, None, None]

    def losses_of(**said: torch.Tensor) -> dict[str, float]:
        terms = coordinate_losses(replace(exact, **said), true)
        return {k: float(v) for k, v in terms.items()}

    assert losses_of(coordinates=off)["coordinates"] > 0.01
    unsure = torch.zeros_like(exact.log_deviation)
    by_log = {s: losses_of(coordinates=off, log_deviation=unsure + s) for s in (-1.0, 0.5, 4.0)}
    assert by_log[0.5]["correspondence"] < min(by_log[s]["correspondence"] for s in (-1.0, 4.0))
    unknown = ~is_known(true.coordinates.movedim(1, -1))[:, None]
    assert unknown.any()
    beyond = torch.where(unknown, 9.0, exact.coordinates)
    assert losses_of(coordinates=beyond) == losses_of()


def test_no_place_shows_a_part(truth):
    prior, true = truth
    true = replace(true, part=torch.zeros_like(true.part))
    views, category = some_views()
    dense = right_output(raw_truth(prior, true), true, views, category).crops[NAME].dense
    terms = coordinate_losses(dense, true)
    assert float(terms["coordinates"]) == float(terms["correspondence"]) == 0


def part_centric_truth(prior: Prior, true: Crops, shape: Shape) -> RawEstimate:
    """What a part-centric network would have to say."""
    R, box, K = true.cam_T_part[:, 1:, :3, :3], true.box[:, None], true.K[:, None]
    center = se3.transform(true.cam_T_part, shape.box_center[:, :, None])[:, 1:, 0]
    facing = egocentric_to_allocentric(R, viewing_ray(box, K))
    phi, log_lambda = translation_targets(center, box, K, prior.frontal_area)
    nodes = NodePoses(up=facing[..., 1], right=facing[..., 0], phi=phi, log_lambda=log_lambda)
    return replace(raw_truth(prior, true), joint_share=torch.zeros(8, 1), nodes=nodes)


def test_every_part_centric_loss_vanishes_at_the_truth(truth):
    """All the losses but that of the joints, which are not asked; their states come out right."""
    prior, true = truth
    views, category = some_views()
    raw = part_centric_truth(prior, true, true_shape(prior, true))
    output = right_output(raw, true, views, category)
    _, terms, _ = asked(prior, output, true, views, category, Weights(), None)
    assert set(terms) == set(WEIGHED) - {"cascade", "joint"}
    del terms["correspondence"]  # not 0, see above
    for name, value in terms.items():
        assert abs(float(value)) < 1e-4, name
    found = estimate(prior, raw, true.box, true.K)
    torch.testing.assert_close(found.joint_state, true.joint_state, rtol=0, atol=1e-3)


def test_part_centric_losses_see_every_part(truth):
    prior, true = truth
    shape = true_shape(prior, true)
    right = part_centric_truth(prior, true, shape)
    assert right.nodes is not None
    for name, wrong in (("direction", "up"), ("offset", "phi"), ("depth", "log_lambda")):
        for j in range(right.nodes.phi.shape[1]):
            value = getattr(right.nodes, wrong).clone()
            value[:, j] += 0.3
            raw = replace(right, nodes=replace(right.nodes, **{wrong: value}))
            assert pose_losses(prior, raw, true, shape)[name] > 1e-3, (name, j)


def test_a_network_without_dense_heads_has_no_dense_losses(truth):
    prior, true = truth
    views, category = some_views()
    output = right_output(raw_truth(prior, true), true, views, category)
    of_crops = replace(output.crops[NAME], dense=None, object_logits=None)
    output = replace(output, crops={NAME: of_crops}, object_logits=None)
    _, terms, _ = asked(prior, output, true, views, category, Weights(), PIXELS)
    dense = {"part_mask", "coordinates", "correspondence", "object_mask", "photo_mask"}
    assert dense.isdisjoint(terms)
    assert {"cascade", "found_box", "joint"} <= set(terms)


def test_the_true_hinge_is_nearly_where_the_deformed_prior_has_it(photos):
    """With the rendered labels as they are: what the shape model cannot say is small."""
    for some in photos.values():
        prior = Prior.from_category(some.category)
        index = torch.arange(len(some))
        true = crops(some, index, 64, Chance(0, torch.device("cpu")), None, augment=False)
        found = estimate(prior, raw_truth(prior, true), true.box, true.K)
        off = (found.cam_T_part - true.cam_T_part)[..., :3, 3].norm(dim=-1)
        assert off.median() < 0.005
        assert off.max() < 0.03


def test_the_total_is_the_weighted_sum_of_the_terms(truth):
    prior, true = truth
    views, category = some_views()
    output = random_output(prior, true, views)
    weights = Weights(**{f.name: 0.1 * (i + 1) for i, f in enumerate(fields(Weights))})
    total, terms, stages = asked(prior, output, true, views, category, weights, PIXELS)
    expected = sum(getattr(weights, name) * terms[name] for name in WEIGHED)
    torch.testing.assert_close(total, expected)
    shares = torch.stack([terms.pop(f"stage_{s}") for s in (1, 2, 3)])
    assert shares.sum() == pytest.approx(1)
    assert (torch.bincount(stages[NAME], minlength=4)[1:] / 8).tolist() == shares.tolist()
    assert set(terms) == set(WEIGHED)


def random_output(prior: Prior, true: Crops, views: Views, spread: float = 1.0) -> TrainingOutput:
    """As far off as an untrained network is, with a gradient."""
    raw = raw_truth(prior, true)
    noisy = {
        k: v + spread * 0.3 * torch.randn_like(v) for k, v in vars(raw).items() if k != "nodes"
    }
    noisy["center_shift"] = raw.center_shift + 0.03 * torch.randn_like(raw.center_shift)
    raw = RawEstimate(**{k: v.detach().requires_grad_() for k, v in noisy.items()})
    n, num_parts = true.box_size.shape[:2]

    def leaf(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, requires_grad=True)

    box = (views.box + 3 * torch.randn_like(views.box)).requires_grad_()
    of_crops = CropOutput(
        raw=raw,
        dense=DenseOutput(
            part_logits=leaf(n, num_parts + 1, SIDE, SIDE),
            coordinates=leaf(n, 3, SIDE, SIDE),
            log_deviation=leaf(n, SIDE, SIDE),
        ),
        object_logits=leaf(n, 1, SIDE, SIDE),
        category_logits=leaf(n, 3),
    )
    return TrainingOutput(
        crops={NAME: of_crops},
        found_box=box,
        category_logits=leaf(len(box), 3),
        object_logits=leaf(len(box), 1, SIDE, SIDE),
    )


def test_crops_are_named_as_photos_are(truth):
    """A crop taken for the wrong category costs as much as a photo."""
    prior, true = truth
    views, category = some_views()
    right = right_output(raw_truth(prior, true), true, views, category)
    n = len(true.box)

    def loss(said: int) -> float:
        logits = SURE * torch.eye(3)[said].expand(n, 3)
        crop = replace(right.crops[NAME], category_logits=logits)
        output = replace(right, crops={NAME: crop})
        priors = {"another": prior, NAME: prior}
        _, terms, _ = objective(priors, output, {NAME: true}, views, category, Weights(), None)
        return float(terms["category"])

    assert loss(1) < 1e-6
    assert loss(0) == pytest.approx(SURE * n / (n + len(category)), rel=1e-3)
    assert loss(2) == pytest.approx(loss(0))


@pytest.mark.parametrize("pixels", [None, PIXELS])
def test_every_output_is_taught_with_finite_gradients(truth, pixels):
    prior, true = truth
    views, category = some_views()
    output = random_output(prior, true, views)
    total, terms, _ = asked(prior, output, true, views, category, Weights(), pixels)
    assert all(torch.isfinite(v) for v in terms.values())
    total.backward()
    of_crops = output.crops[NAME]
    leaves = {k: v for k, v in vars(of_crops.raw).items() if k != "nodes"}
    leaves |= vars(of_crops.dense) | {"mask": of_crops.object_logits}
    leaves |= {"category of crops": of_crops.category_logits}
    leaves |= {k: v for k, v in vars(output).items() if k != "crops"}
    for name, leaf in leaves.items():
        assert torch.isfinite(leaf.grad).all(), name
        assert leaf.grad.abs().max() > 0, name


def test_the_cascade_is_least_at_the_truth(truth):
    prior, true = truth
    shape, raw = true_shape(prior, true), raw_truth(prior, true)

    def loss(**changed):
        found = estimate(prior, replace(raw, **changed), true.box, true.K)
        return cascade_term(found, true, shape, PIXELS, CascadeOptions())

    least, stage = loss()
    assert torch.all(stage == 3)
    for changed in (
        {"log_lambda": raw.log_lambda + 0.03},
        {"phi": raw.phi + 0.03},
        {"up": raw.up + 0.1 * torch.randn_like(raw.up) * raw.up.norm(dim=-1, keepdim=True)},
        {"log_scale": raw.log_scale + 0.1},
    ):
        assert loss(**changed)[0] > least
    far, stage = loss(log_lambda=raw.log_lambda + 0.5)
    assert far > loss(log_lambda=raw.log_lambda + 0.2)[0]
    assert torch.all(stage == 1)


def test_confidence_is_about_what_the_photo_shows(truth):
    """Right up to a common scale of the scene; wrong once a part stands a tenth elsewhere."""
    prior, true = truth
    shape, raw = true_shape(prior, true), raw_truth(prior, true)
    found = estimate(prior, raw, true.box, true.K)
    assert is_right(found, true, shape).all()
    t = found.cam_T_part.clone()
    t[..., :3, 3] *= 1.3  # farther and as much larger: the same photo
    assert is_right(replace(found, cam_T_part=t), true, shape).all()
    diameter = true.box_size.norm(dim=-1)
    for k in range(diameter.shape[1]):
        moved = found.cam_T_part.clone()
        moved[:, k, 1, 3] += 0.5 * diameter[:, k]
        assert not is_right(replace(found, cam_T_part=moved), true, shape)[:, k].any()


def test_corners_are_carried_by_their_parts_pose(truth):
    prior, true = truth
    shape = true_shape(prior, true)
    at_rest = corners_in_camera(shape, torch.eye(4).expand_as(true.cam_T_part))
    moved = corners_in_camera(shape, true.cam_T_part).unflatten(1, (-1, 8))
    back = se3.transform(se3.inverse(true.cam_T_part), moved).flatten(1, 2)
    torch.testing.assert_close(back, at_rest, rtol=0, atol=1e-4)
    assert back.unflatten(1, (-1, 8)).amax(dim=2) == pytest.approx(
        true.box_center + true.box_size / 2, abs=1e-4
    )


def test_backdrop_and_surroundings_are_no_part(truth):
    _, true = truth
    num_parts = true.box_size.shape[1]
    part = torch.tensor([0, 1, num_parts, num_parts + 1, 255]).expand(8, 5, 5)
    classes = part_classes(replace(true, part=part))
    assert classes[0, 0].tolist() == [0, 1, num_parts, 0, 0]


def test_pictures_of_nothing_teach_the_category_alone(truth):
    prior, true = truth
    views, _ = some_views()
    nothing = torch.arange(6) >= 3
    views = replace(views, box=views.box.masked_fill(nothing[:, None], torch.nan))
    category = torch.where(nothing, 2, 0)
    found_box = views.box.nan_to_num(20.0) + torch.tensor([1.0, 2.0, 3.0, 4.0])
    output = replace(
        right_output(raw_truth(prior, true), true, views, category),
        found_box=found_box.requires_grad_(),
        category_logits=torch.zeros(6, 3, requires_grad=True),
    )
    loss, terms, _ = asked(prior, output, true, views, category, Weights(), None)
    loss.backward()
    assert terms["found_box"].isfinite()
    assert (output.found_box.grad[~nothing] != 0).any(dim=1).all()
    assert not output.found_box.grad[nothing].any()
    assert output.category_logits.grad[:, 2].sign().tolist() == [1, 1, 1, -1, -1, -1]


def test_the_mask_that_says_the_true_share_costs_least(truth):
    """Also where that is neither all nor nothing, for crops and whole photos alike."""
    prior, true = truth
    views, category = some_views()
    share = 0.02 + 0.96 * torch.rand_like(true.seen)
    true, views = replace(true, seen=share), replace(views, seen=share[: len(views.seen)])
    right = torch.logit(share)
    output = right_output(raw_truth(prior, true), true, views, category)

    def terms(logits: torch.Tensor) -> torch.Tensor:
        of_crops = replace(output.crops[NAME], object_logits=logits)
        said = replace(output, crops={NAME: of_crops}, object_logits=logits[: len(views.seen)])
        _, found, _ = asked(prior, said, true, views, category, Weights(), None)
        return torch.stack([found["object_mask"], found["photo_mask"]])

    least = terms(right)
    for off in (-1.0, -0.1, 0.1, 1.0):
        assert torch.all(terms(right + off) > least + 1e-4)
    assert torch.all(terms(-right) > least + 0.1)
    place = right.clone().requires_grad_()
    mask_loss(place, share).backward()
    torch.testing.assert_close(place.grad, torch.zeros_like(right), rtol=0, atol=1e-7)


@pytest.mark.parametrize("pixels", [None, PIXELS])
def test_losses_of_mixed_crops_are_means_over_the_categories(photos, pixels):
    """However many parts each has; those of whole photos, and of crops as photos, count once."""
    views, category = some_views()
    made = {name: exactly(some) for name, some in photos.items()}
    rest = (views, category, Weights(), pixels)
    outputs = {n: random_output(prior, true, views, 0.3) for n, (prior, true) in made.items()}
    outputs = {
        n: replace(o, crops={NAME: replace(o.crops[NAME], category_logits=None)})
        for n, o in outputs.items()
    }
    photo = outputs["laptop"]
    alone = {}
    for name, (prior, true) in made.items():
        said = replace(photo, crops=outputs[name].crops)
        alone[name] = asked(prior, said, true, *rest)
    together = replace(photo, crops={n: o.crops[NAME] for n, o in outputs.items()})
    priors, crops_by_name = ({n: pair[k] for n, pair in made.items()} for k in (0, 1))
    total, terms, stages = objective(priors, together, crops_by_name, *rest)
    torch.testing.assert_close(total, sum(t for t, *_ in alone.values()) / len(alone))
    for key, value in terms.items():
        expected = torch.stack([found[key] for _, found, _ in alone.values()]).mean()
        torch.testing.assert_close(value, expected, msg=key)
    assert set(stages) == (set() if pixels is None else set(made))
    for name, stage in stages.items():
        assert torch.equal(stage, alone[name][2][NAME])
