"""A photo in a mirror shows an object of the category, and the labels say which."""

from dataclasses import fields, replace

import numpy as np
import pytest
import torch
from test_equivalent import DOUBLE, SIZE, random_crops

from r2art.core.category import Category, Joint, Mirror
from r2art.core.prior_text import from_text, to_text
from r2art.data.categories import CATEGORIES, make_instance, mirror, staging, with_symmetries
from r2art.data.prior import category_prior
from r2art.learn.augment import Views
from r2art.learn.chance import Chance
from r2art.learn.mirror import mirrored, some_mirrored, some_views_mirrored
from r2art.learn.objective import true_shape
from r2art.method import se3
from r2art.method.kinematics import forward_kinematics
from r2art.method.projection import project
from r2art.method.shape import Prior, box_corners

MIRRORED = tuple(name for name in CATEGORIES if mirror(name))
CPU = torch.device("cpu")


@pytest.fixture(scope="module", params=MIRRORED)
def category(request) -> Category:
    name = request.param
    return category_prior([make_instance(name, s) for s in range(4)], staging(name))


def parents(category: Category) -> list[int]:
    return [joint.parent for joint in category.joints]


def corners_seen(crops) -> torch.Tensor:
    corners = se3.transform(crops.cam_T_part, box_corners(crops.box_center, crops.box_size))
    return project(corners, crops.K[:, None])


def test_which_categories_have_one():
    alike = {"box", "dishwasher", "drawer", "drawer_single", "eyeglasses", "laptop", "stapler"}
    assert set(MIRRORED) == alike  # hinges of microwaves are on the left, cutters cut on one side


def test_the_prior_has_it_and_keeps_it(category, tmp_path):
    assert category.mirror == mirror(category.name)
    category.save(tmp_path / "prior.npz")
    assert Category.load(tmp_path / "prior.npz").mirror == category.mirror
    assert from_text(to_text(category)).mirror == category.mirror
    assert with_symmetries(replace(category, mirror=None)).mirror == category.mirror


def test_boxes_are_seen_where_the_mirror_shows_them(category):
    crops = random_crops(category)
    other = mirrored(crops, category.mirror, parents(category))
    seen, expected = corners_seen(other), corners_seen(crops)[:, list(category.mirror.swap)]
    expected = torch.stack([SIZE - expected[..., 0], expected[..., 1]], dim=-1)
    gap = torch.cdist(seen, expected).amin(dim=-1)
    assert gap.max() < 1e-6  # each corner lies on one of the mirrored part's
    assert torch.linalg.det(other.cam_T_part[..., :3, :3]).allclose(torch.ones((), dtype=DOUBLE))


def test_the_mirrored_object_moves_as_the_category_does(category):
    prior = Prior.from_category(category, dtype=DOUBLE)
    crops = random_crops(category, varied=False)
    other = mirrored(crops, category.mirror, parents(category))
    shape = true_shape(prior, other)
    moved = other.cam_T_part[:, :1] @ forward_kinematics(shape.kinematics, other.joint_state)
    corners = box_corners(shape.box_center, shape.box_size)
    gap = se3.transform(moved, corners) - se3.transform(other.cam_T_part, corners)
    # The mean of a few objects is not quite alike on both sides.
    assert torch.linalg.vector_norm(gap, dim=-1).max() < 0.03 * category.diagonal


def test_twice_mirrored_is_as_before(category):
    crops = random_crops(category)
    image = torch.rand(len(crops.image), 3, SIZE, SIZE)
    crops = replace(crops, image=image, seen=torch.rand_like(crops.seen))
    once = mirrored(crops, category.mirror, parents(category))
    twice = mirrored(once, category.mirror, parents(category))
    for f in fields(crops):
        torch.testing.assert_close(getattr(twice, f.name), getattr(crops, f.name))
    assert torch.equal(once.image[..., 0], image[..., -1])
    for new, old in enumerate(category.mirror.swap):
        assert torch.equal(once.part == new + 1, (crops.part == old + 1).flip(-1))


def test_about_half_are_mirrored_and_whole(category):
    crops = random_crops(category)
    other = mirrored(crops, category.mirror, parents(category))
    some = some_mirrored(crops, category, Chance(0, CPU))
    which = (some.K != crops.K).any((1, 2)) | (some.box != crops.box).any(1)
    assert 0 < which.sum() < len(which)
    for f in fields(crops):
        for i, turned in enumerate(which.tolist()):
            source = other if turned else crops
            assert torch.equal(getattr(some, f.name)[i], getattr(source, f.name)[i])
    without = replace(category, mirror=None)
    assert some_mirrored(crops, without, Chance(0, CPU)) is crops


def test_whole_photos_are_mirrored_with_their_boxes():
    n = 16
    image = torch.zeros(n, 3, SIZE, SIZE)
    image[:, :, 10:20, 4:12] = 1
    box = torch.tensor([4.0, 10.0, 12.0, 20.0]).repeat(n, 1)
    box[-4:] = torch.nan  # of nothing known
    seen = torch.zeros(n, 1, SIZE // 4, SIZE // 4)
    seen[:, :, 3:5, 1:3] = 1
    views = Views(index=torch.arange(n), image=image, seen=seen, box=box)
    some = some_views_mirrored(views, Chance(1, CPU))
    turned = (some.image != image).any((1, 2, 3))
    assert 0 < turned.sum() < n
    for i in range(n - 4):
        x1, y1, x2, y2 = some.box[i].int().tolist()
        assert some.image[i, :, y1:y2, x1:x2].min() == 1
        assert some.image[i].sum() == image[i].sum()
        assert some.seen[i, 0, :, x1 // 4 : x2 // 4].sum() == 4
    assert torch.isnan(some.box[-4:]).all()


@pytest.mark.parametrize(
    ("swap", "axis"),
    [
        ((0, 1), (0.0, 1.0, 0.0)),  # opens to the side: in the mirror, to the other
        ((1, 0), (1.0, 0.0, 0.0)),  # the root's frame would move
        ((0, 1, 2), (1.0, 0.0, 0.0)),  # a part that is not there
    ],
)
def test_a_mirror_that_does_not_fit_is_refused(swap, axis):
    hinge = Joint(
        name="hinge", kind="revolute", parent=0, axis=axis, pivot=(0, 0, 0), limits=(0, 1)
    )
    assert not Mirror(swap=swap).fits([hinge])
    size = np.ones((2, 3))
    with pytest.raises(ValueError, match="trade left parts for right ones"):
        Category(
            name="thing",
            part_names=("a", "b"),
            joints=(hinge,),
            box_center=np.zeros((2, 3)),
            box_size=size,
            points=np.zeros((2, 4, 3)),
            normals=np.ones((2, 4, 3)),
            areas=np.ones(2),
            frontal_area=1.0,
            mirror=Mirror(swap=swap),
        )
