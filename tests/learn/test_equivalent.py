"""A label that no photo tells from another one teaches nothing else than that one."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from r2art.core.camera import Camera
from r2art.core.category import Category, Joint, Symmetry
from r2art.data.categories import make_instance, staging
from r2art.data.prior import category_prior
from r2art.data.sample import Sample
from r2art.learn.augment import Crops
from r2art.learn.equivalent import LABELS, better_labels, relabelled
from r2art.learn.evaluation import equivalent as of_evaluation
from r2art.learn.objective import WHOLE_CASCADE, corners_in_camera, crop_losses, true_shape
from r2art.method import se3
from r2art.method.depth import translation_targets, viewing_ray
from r2art.method.estimate import Estimate, estimate, share_from_state
from r2art.method.kinematics import forward_kinematics
from r2art.method.outputs import CropOutput, DenseOutput, RawEstimate
from r2art.method.projection import box_of_points, project
from r2art.method.rotation import egocentric_to_allocentric
from r2art.method.shape import Deformation, Prior, deform, deformation_of

B, SIZE = 12, 64
SIDE = SIZE // 4
DOUBLE = torch.float64


@pytest.fixture(scope="module")
def category() -> Category:
    return category_prior([make_instance("scissors", s) for s in range(6)], staging("scissors"))


@pytest.fixture(scope="module")
def glasses() -> Category:
    """Two arms on the sides of a bar, exactly alike upside down."""
    center = np.array([[0, 0, 0], [-0.06, 0, -0.06], [0.06, 0, -0.06]])
    size = np.array([[0.14, 0.04, 0.01], [0.01, 0.01, 0.11], [0.01, 0.01, 0.11]])
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (3, 64, 3)) * size[:, None]
    joints = tuple(
        Joint(
            name=f"hinge_{side}",
            kind="revolute",
            parent=0,
            axis=(0.0, float(-side), 0.0),
            pivot=(0.06 * side, 0.0, 0.0),
            limits=(-1.5, 0.5),
        )
        for side in (-1, 1)
    )
    return Category(
        name="specs",
        part_names=("frame", "left", "right"),
        joints=joints,
        box_center=center,
        box_size=size,
        points=center[:, None] + points,
        normals=np.tile([0.0, 1, 0], (3, 64, 1)),
        areas=np.ones(3),
        frontal_area=0.01,
        symmetry=Symmetry(swap=(0, 2, 1), axis="z"),
    )


def random_crops(category: Category, seed: int = 0, *, varied: bool = True) -> Crops:
    """Crops of the prior, deformed if they are to be varied, in no photo."""
    torch.manual_seed(seed)
    prior = Prior.from_category(category, dtype=DOUBLE)
    parts = len(category.part_names)
    amount = 1.0 if varied else 0.0
    shift = amount * 0.02 * category.diagonal * torch.randn(B, parts, 3, dtype=DOUBLE)
    shift[:, 0] = 0
    scale = amount * 0.1 * torch.randn(B, parts, 3, dtype=DOUBLE)
    shape = deform(prior, Deformation(log_scale=scale, center_shift=shift))
    low, high = prior.kinematics.limits.T
    state = low + torch.rand(B, parts - 1, dtype=DOUBLE) * (high - low)
    turn = torch.as_tensor(Rotation.random(B, rng=np.random.default_rng(seed)).as_matrix())
    place = torch.randn(B, 3, dtype=DOUBLE) * 0.02 + torch.tensor([0, 0, 4 * category.diagonal])
    cam_T_root = se3.from_rotation_translation(turn, place)[:, None]
    poses = cam_T_root @ forward_kinematics(shape.kinematics, state)
    K = torch.tensor([[150.0, 0, 32], [0, 150, 32], [0, 0, 1]], dtype=DOUBLE).expand(B, 3, 3)
    box = box_of_points(project(corners_in_camera(shape, poses), K))
    values = torch.tensor([*range(parts + 1), parts + 1, 255])
    return Crops(
        index=torch.arange(B),
        image=torch.zeros(B, 3, SIZE, SIZE),
        part=values[torch.randint(len(values), (B, SIDE, SIDE))],
        seen=torch.zeros(B, 1, SIDE, SIDE),
        coordinates=torch.rand(B, 3, SIDE, SIDE, dtype=DOUBLE) - 0.5,
        K=K,
        box=box,
        cam_T_part=poses,
        joint_state=state,
        box_center=shape.box_center,
        box_size=shape.box_size,
    )


def perfect(prior: Prior, true: Crops) -> Estimate:
    """The estimate whose every number is right, but for the joints' place, which labels lack."""
    shape = true_shape(prior, true)
    joints = torch.zeros(B, len(prior.kinematics.parent), 3, dtype=DOUBLE)
    return Estimate(
        cam_T_part=true.cam_T_part,
        joint_state=true.joint_state,
        shape=shape,
        axis=joints,
        pivot=joints,
    )


def raw_of(prior: Prior, true: Crops) -> RawEstimate:
    """What a network would say that knows these labels."""
    pose = true.cam_T_part[:, 0]
    facing = egocentric_to_allocentric(pose[:, :3, :3], viewing_ray(true.box, true.K))
    phi, log_lambda = translation_targets(pose[:, :3, 3], true.box, true.K, prior.frontal_area)
    deformation = deformation_of(prior, true.box_center, true.box_size)
    return RawEstimate(
        up=facing[..., 1],
        right=facing[..., 0],
        phi=phi,
        log_lambda=log_lambda,
        joint_share=share_from_state(true.joint_state, prior.kinematics.limits),
        log_scale=deformation.log_scale,
        center_shift=deformation.center_shift,
        confidence_logit=torch.zeros(B, true.box_size.shape[1], dtype=DOUBLE),
    )


def same(a: Crops, b: Crops) -> None:
    for name, value in vars(a).items():
        torch.testing.assert_close(getattr(b, name), value, rtol=0, atol=1e-9, msg=name)


@pytest.mark.parametrize("name", ["category", "glasses"])
def test_labels_agree_with_those_of_the_evaluation(request, name):
    known = request.getfixturevalue(name)
    crops = random_crops(known)
    other = relabelled(crops, known.symmetry, [j.parent for j in known.joints])
    of_objects = [label for label in LABELS if label not in ("part", "coordinates")]
    for b in range(B):
        sample = Sample(
            image=np.zeros((SIDE, SIDE, 3), np.uint8),
            mask=crops.part[b].numpy().astype(np.uint8),
            depth=np.zeros((SIDE, SIDE)),
            camera=Camera(50, 50, 8, 8, SIDE, SIDE),
            axis=np.array([j.axis for j in known.joints]),
            pivot=np.array([j.pivot for j in known.joints]),
            visible=np.ones(len(known.part_names)),
            box=crops.box[b].numpy(),
            **{label: getattr(crops, label)[b].numpy() for label in of_objects},
        )
        expected = of_evaluation.relabelled(sample, known)
        assert np.array_equal(other.part[b].numpy(), expected.mask)
        for label in of_objects:
            actual = getattr(other, label)[b].numpy()
            np.testing.assert_allclose(actual, getattr(expected, label), atol=1e-12, err_msg=label)


@pytest.mark.parametrize("name", ["category", "glasses"])
def test_places_show_the_same_points_under_other_names(request, name):
    known = request.getfixturevalue(name)
    crops = random_crops(known)
    other = relabelled(crops, known.symmetry, [j.parent for j in known.joints])
    torch.testing.assert_close(points_of(other), points_of(crops), rtol=0, atol=1e-9)


def points_of(crops: Crops) -> torch.Tensor:
    """(N, 3) what all places that are of a part show, in the camera frame."""
    is_part = (crops.part > 0) & (crops.part <= crops.box_size.shape[1])
    sample, part = is_part.nonzero()[:, 0], crops.part[is_part] - 1
    share = crops.coordinates.movedim(1, -1)[is_part]
    at_rest = crops.box_center[sample, part] + share * crops.box_size[sample, part]
    return se3.transform(crops.cam_T_part[sample, part], at_rest[:, None])[:, 0]


@pytest.mark.parametrize("name", ["category", "glasses"])
def test_twice_relabelled_is_the_first(request, name):
    known = request.getfixturevalue(name)
    crops, parents = random_crops(known), [j.parent for j in known.joints]
    once = relabelled(crops, known.symmetry, parents)
    assert (once.cam_T_part - crops.cam_T_part).abs().amax((1, 2, 3)).min() > 0.1
    assert not torch.equal(once.part, crops.part)
    same(crops, relabelled(once, known.symmetry, parents))


@pytest.mark.parametrize("name", ["category", "glasses"])
def test_each_sample_gets_the_label_that_its_estimate_is_nearer_to(request, name):
    known = request.getfixturevalue(name)
    prior = Prior.from_category(known, dtype=DOUBLE)
    given = random_crops(known)
    other = relabelled(given, prior.symmetry, prior.kinematics.parent)
    says_other = torch.arange(B) % 3 == 0

    def mixed(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
        return torch.where(says_other.reshape(-1, *(1,) * (a.ndim - 1)), a, b)

    said = replace(
        given, **{label: mixed(getattr(other, label), getattr(given, label)) for label in LABELS}
    )
    for labels in (given, other):
        same(said, better_labels(prior, perfect(prior, said), labels))


@pytest.fixture(scope="module")
def even(category) -> Category:
    """Scissors that are exactly the same turned over, so that their prior is, too."""
    size = category.box_size.mean(axis=0)
    turn = np.diag([-1.0, -1.0, 1.0])
    pivot = np.array(category.joints[0].pivot)
    center = np.stack([np.zeros(3), pivot - turn @ pivot])
    points = category.points[0] * size / category.box_size[0]
    return replace(
        category,
        box_center=center,
        box_size=np.stack([size, size]),
        points=np.stack([points, center[1] + points @ turn]),
        normals=np.stack([category.normals[0], category.normals[0] @ turn]),
        areas=np.full(2, category.areas[0]),
    )


def loss_terms(prior: Prior, said: Crops, given: Crops, part_logits: torch.Tensor) -> dict:
    """Of a network that says one label and is taught another."""
    log_deviation = torch.zeros(B, SIDE, SIDE, dtype=DOUBLE)
    dense = DenseOutput(
        part_logits=part_logits, coordinates=said.coordinates, log_deviation=log_deviation
    )
    output = CropOutput(raw=raw_of(prior, said), dense=dense, object_logits=None)
    return crop_losses(prior, output, given, None, WHOLE_CASCADE)[0]


def test_the_loss_does_not_depend_on_which_label_is_given_or_said(even):
    prior = Prior.from_category(even, dtype=DOUBLE)
    crops = random_crops(even, varied=False)
    other = relabelled(crops, prior.symmetry, prior.kinematics.parent)
    torch.testing.assert_close(other.box_center, crops.box_center, rtol=0, atol=1e-9)
    torch.testing.assert_close(other.box_size, crops.box_size)
    logits = torch.randn(B, 3, SIDE, SIDE, dtype=DOUBLE)
    swapped = logits[:, [0, 2, 1]]
    first = loss_terms(prior, crops, crops, logits)
    assert {"direction", "offset", "joint", "shape", "reprojection", "part_mask"} < set(first)
    assert {"coordinates", "correspondence"} < set(first)
    assert max(first["direction"], first["coordinates"]) < 1e-6
    for again in (
        loss_terms(prior, crops, other, logits),
        loss_terms(prior, other, crops, swapped),
        loss_terms(prior, other, other, swapped),
    ):
        assert set(again) == set(first)
        for name, value in first.items():
            torch.testing.assert_close(again[name], value, rtol=0, atol=1e-6, msg=name)
    bound = replace(prior, symmetry=None)
    assert loss_terms(bound, other, crops, swapped)["direction"] > 1


def test_no_gradient_goes_through_the_choice(category):
    prior = Prior.from_category(category, dtype=DOUBLE)
    crops = random_crops(category)
    raw = raw_of(prior, crops)
    raw = replace(raw, up=raw.up.requires_grad_())
    chosen = better_labels(prior, estimate(prior, raw, crops.box, crops.K), crops)
    assert not any(getattr(chosen, name).requires_grad for name in LABELS)


def test_an_estimate_that_is_not_finite_leaves_the_label_as_given(category):
    prior = Prior.from_category(category, dtype=DOUBLE)
    crops = random_crops(category)
    found = perfect(prior, crops)
    lost = replace(found, cam_T_part=torch.full_like(found.cam_T_part, torch.nan))
    same(crops, better_labels(prior, lost, crops))


def test_without_a_symmetry_the_crops_are_the_given_ones(category):
    prior = replace(Prior.from_category(category, dtype=DOUBLE), symmetry=None)
    crops = random_crops(category)
    assert better_labels(prior, perfect(prior, crops), crops) is crops
