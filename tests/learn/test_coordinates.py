"""What a pixel is said to show projects to that pixel, in every view that training makes of it."""

from dataclasses import replace

import pytest
import torch

from r2art.data.shards import Dataset
from r2art.learn.augment import MASK_STRIDE, Crops, crops
from r2art.learn.chance import Chance
from r2art.learn.coordinates import UNKNOWN, is_known, part_coordinates
from r2art.learn.mirror import mirrored
from r2art.method import se3
from r2art.method.projection import project

S = 64


@pytest.fixture(params=["laptop", "drawer"])
def some(request, photos):
    return photos[request.param]


def views(some, *, augment: bool) -> Crops:
    chance = Chance(0, torch.device("cpu"))
    return crops(some, torch.arange(len(some)), S, chance, None, augment=augment)


def off(crops: Crops) -> torch.Tensor:
    """How far (px) from the middles of places the points lie that they show."""
    coordinates = crops.coordinates.movedim(1, -1)
    is_part = (crops.part > 0) & (crops.part <= crops.box_size.shape[1])
    known = is_part & is_known(coordinates)
    assert known.sum() > 0.95 * is_part.sum() > 100
    sample, row, column = known.nonzero(as_tuple=True)
    part = crops.part[known] - 1
    at_rest = crops.box_center[sample, part] + coordinates[known] * crops.box_size[sample, part]
    seen = project(se3.transform(crops.cam_T_part[sample, part], at_rest[:, None]), crops.K[sample])
    middle = (torch.stack([column, row], dim=-1) + 0.5) * MASK_STRIDE
    return (seen[:, 0] - middle).norm(dim=-1)


def test_places_show_what_they_say(some):
    made = views(some, augment=False)
    assert off(made).max() < 2
    assert off(made).median() < 0.7
    mirror = some.category.mirror
    if mirror is not None:
        parents = [joint.parent for joint in some.category.joints]
        again = mirrored(made, mirror, parents)
        torch.testing.assert_close(off(again).sort()[0], off(made).sort()[0], rtol=0, atol=1e-3)


def test_labels_follow_the_crop_through_augmentation(some):
    """Seen through a wrongly guessed camera they are off by what that camera is."""
    made = views(some, augment=True)
    assert not torch.equal(made.part, views(some, augment=False).part)
    assert off(made).median() < MASK_STRIDE


def test_what_is_not_of_the_part_is_unknown(datasets):
    """A depth of something behind it, and none at all."""
    sample = next(iter(Dataset.open(datasets["laptop"])))
    shown = (sample.mask > 0) & (sample.mask <= len(sample.cam_T_part))
    assert (part_coordinates(sample) != UNKNOWN).all(axis=0)[shown].mean() > 0.95
    assert (part_coordinates(sample)[:, ~shown] == UNKNOWN).all()
    for depth in (0 * sample.depth, 3 * sample.depth):
        assert (part_coordinates(replace(sample, depth=depth)) == UNKNOWN).all()
