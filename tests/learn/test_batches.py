"""Datasets in memory, and the batch of every step."""

from dataclasses import replace

import pytest
import torch
from PIL import Image

from r2art.core.errors import InputError
from r2art.data import shards
from r2art.data.shards import Dataset
from r2art.learn.batches import OTHERS_HELD_OUT, Batches, load_backdrops, load_photos, open_datasets
from r2art.learn.memory import Photos
from r2art.learn.recipes import Recipe

RECIPE = Recipe(input_size=64, crops=3, photos=3)


def test_a_batch_depends_on_its_step_alone(photos):
    batches = Batches(RECIPE, photos, None, torch.device("cpu"), 0)
    other_rank = replace(batches, rank=1)
    name, crops, views, category = batches(3)
    batches(1)
    again = batches(3)
    assert again[0] == name
    assert torch.equal(again[1].image, crops.image)
    assert torch.equal(again[2].image, views.image)
    assert torch.equal(again[3], category)
    assert other_rank(3)[0] == name  # processes that share a step train the same heads
    for different in (batches(5), other_rank(3)):
        assert not torch.equal(different[1].image, crops.image)


def test_the_batch_of_two_processes_is_that_of_one_with_two_shares(photos):
    halves = [Batches(RECIPE, photos, None, torch.device("cpu"), rank)(3) for rank in (0, 1)]
    recipe = replace(RECIPE, shares=2)
    name, crops, views, category = Batches(recipe, photos, None, torch.device("cpu"), 0)(3)
    assert halves[0][0] == halves[1][0] == name
    for k, whole in ((1, crops), (2, views)):
        for field, value in vars(whole).items():
            parts = torch.cat([getattr(half[k], field) for half in halves])
            assert torch.equal(value, parts), field
    assert torch.equal(category, torch.cat([half[3] for half in halves]))
    further = Batches(recipe, photos, None, torch.device("cpu"), 1)(3)
    assert not torch.equal(further[1].index, crops.index)


def test_crops_and_views_know_their_photos(photos):
    recipe = replace(RECIPE, offline_features=True)  # no augmentation
    name, crops, _, _ = Batches(recipe, photos, None, torch.device("cpu"), 0)(2)
    assert torch.equal(crops.cam_T_part, photos[name].cam_T_part[crops.index])
    assert torch.equal(crops.box_size, photos[name].box_size[crops.index])


def test_categories_take_turns_in_proportion_to_their_parts(photos):
    batches = Batches(RECIPE, photos, None, torch.device("cpu"), 0)
    turns = [batches.turn(step) for step in range(240)]
    assert turns[7] == batches(7)[0]
    parts = {name: len(p.category.part_names) for name, p in photos.items()}
    for name, count in parts.items():
        assert turns.count(name) / 240 == pytest.approx(count / sum(parts.values()), abs=0.1)


def test_photos_are_of_all_categories(photos):
    batches = Batches(RECIPE, photos, None, torch.device("cpu"), 0)
    made = [batches(step) for step in range(4)]
    for name, crops, views, category in made:
        assert crops.cam_T_part.shape[1] == len(photos[name].category.part_names)
        assert len(views.image) == len(category) == RECIPE.photos
        assert set(category.tolist()) == {0, 1}
    assert {sum(category.tolist()) for *_, category in made} == {1, 2}  # of three photos


def test_two_datasets_of_a_category_are_refused(datasets):
    with pytest.raises(InputError, match="two datasets of laptop"):
        open_datasets([datasets["laptop"], datasets["drawer"], datasets["laptop"]])
    assert list(load_photos([datasets["laptop"], datasets["drawer"]])) == ["drawer", "laptop"]


def test_photos_keep_what_the_dataset_says(datasets, photos):
    for name, some in photos.items():
        samples = [shards.from_row(row) for row in Dataset.open(datasets[name]).rows()]
        assert len(some) == len(samples)
        for i, sample in enumerate(samples):
            assert torch.equal(
                some.image[i], torch.from_numpy(sample.image.copy()).permute(2, 0, 1)
            )
            assert torch.equal(some.mask[i], torch.from_numpy(sample.mask.copy()))
            assert some.K[i].numpy() == pytest.approx(sample.camera.K)
            assert some.cam_T_part[i].numpy() == pytest.approx(sample.cam_T_part, abs=1e-6)
            assert some.box[i].numpy() == pytest.approx(sample.box, rel=1e-6)


def test_photos_of_two_sizes_do_not_stack(photos, datasets):
    samples = [shards.from_row(row) for row in Dataset.open(datasets["drawer"]).rows()][:2]
    small = replace(samples[1], image=samples[1].image[:32, :32], mask=samples[1].mask[:32, :32])
    with pytest.raises(InputError, match=r"sample 1 is \(32, 32\) px, others are \(64, 64\)"):
        Photos.from_samples(photos["drawer"].category, [samples[0], small], 2)
    with pytest.raises(InputError, match="dataset of drawer is empty"):
        Photos.from_samples(photos["drawer"].category, [], 0)


def test_backdrops_are_square_cuts_of_the_photos(tmp_path):
    assert load_backdrops(None) is None
    assert load_backdrops(tmp_path) is None
    folder = tmp_path / "some"
    folder.mkdir()
    Image.new("RGB", (40, 30), (10, 200, 30)).save(folder / "a.png")
    made = load_backdrops(folder, 16)
    assert made.shape == (1, 3, 16, 16)
    assert made[0, :, 3, 3].tolist() == [10, 200, 30]


def test_with_more_categories_than_photos_some_wait_their_turn(photos):
    recipe = replace(RECIPE, photos=1)
    batches = Batches(recipe, photos, None, torch.device("cpu"), 0)
    shown = [batches(step)[3].tolist() for step in range(4)]
    assert [len(s) for s in shown] == [1] * 4
    assert {s[0] for s in shown} == {0, 1}


def test_pictures_of_nothing_known_are_the_last_answer(photos):
    backdrops = torch.zeros(10, 3, 32, 32, dtype=torch.uint8)
    backdrops[::OTHERS_HELD_OUT, 0] = 255  # red ones, which are never shown as such
    recipe = replace(RECIPE, others=40)
    _, _, views, category = Batches(recipe, photos, backdrops, torch.device("cpu"), 0)(0)
    nothing = category == len(photos)
    assert nothing.tolist() == [False] * 3 + [True] * 40
    assert views.box[nothing].isnan().all()
    assert views.box[~nothing].isfinite().all()
    assert not views.seen[nothing].any()
    assert views.image.isfinite().all()
    red = views.image[nothing] - views.image[nothing].mean(dim=1, keepdim=True)
    assert (red[:, 0].mean(dim=(1, 2)) < 0.9).all()
    assert len(views.image[nothing].flatten(1).unique(dim=0)) > 30  # two may both be white
