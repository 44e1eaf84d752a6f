"""Datasets in memory, and the batch of every step."""

from dataclasses import replace

import pytest
import torch
from PIL import Image

from r2art.core.errors import InputError
from r2art.data import shards
from r2art.data.shards import Dataset
from r2art.learn import augment
from r2art.learn.batches import (
    OTHERS_HELD_OUT,
    Ahead,
    Batch,
    Batches,
    load_backdrops,
    load_photos,
    open_datasets,
    placed,
)
from r2art.learn.chance import Chance
from r2art.learn.memory import Photos, joined
from r2art.learn.recipes import Recipe

RECIPE = Recipe(input_size=64, crops=3, photos=3)
CPU = torch.device("cpu")
GROUPS = pytest.mark.parametrize("groups", [1, 2])


def batches(given, /, rank: int = 0, backdrops=None, **changes) -> Batches:
    return Batches(replace(RECIPE, **changes), given, backdrops, CPU, rank)


def assert_same(first: Batch, second: Batch) -> None:
    assert first.names == second.names
    assert torch.equal(first.category, second.category)
    pairs = [(first.crops[name], second.crops[name]) for name in first.names]
    for a, b in [*pairs, (first.views, second.views)]:
        for field, value in vars(a).items():
            torch.testing.assert_close(value, getattr(b, field), rtol=0, atol=0, equal_nan=True)


@GROUPS
def test_a_batch_depends_on_its_step_alone(photos, groups):
    made, of_other_rank = (batches(photos, rank=rank, groups=groups) for rank in (0, 1))
    batch = made(3)
    made(1)
    assert_same(made(3), batch)
    assert of_other_rank(3).names == batch.names  # processes of a step train the same heads
    for different in (made(5), of_other_rank(3)):
        assert not torch.equal(different.views.image, batch.views.image)
        for name in set(different.names) & set(batch.names):
            assert not torch.equal(different.crops[name].image, batch.crops[name].image)


@GROUPS
def test_the_batch_of_two_processes_is_that_of_one_with_two_shares(photos, groups):
    halves = [batches(photos, rank=rank, groups=groups)(3) for rank in (0, 1)]
    whole = batches(photos, shares=2, groups=groups)(3)
    assert len(whole.names) == groups
    assert all(half.names == whole.names for half in halves)
    parts = Batch(
        crops={n: joined([half.crops[n] for half in halves]) for n in whole.names},
        views=joined([half.views for half in halves]),
        category=torch.cat([half.category for half in halves]),
    )
    assert_same(whole, parts)
    further = batches(photos, rank=1, shares=2, groups=groups)(3)
    for name, crops in whole.crops.items():
        assert not torch.equal(further.crops[name].index, crops.index)


def test_a_mixed_batch_has_equally_many_crops_of_every_category(photos):
    for step in range(4):
        batch = batches(photos, groups=2)(step)
        assert set(batch.names) == set(photos)
        for name, crops in batch.crops.items():
            parts = len(photos[name].category.part_names)
            assert crops.cam_T_part.shape == (RECIPE.crops, parts, 4, 4)
        image, box, K, photo = batch.inputs()
        assert len(image) == len(box) == len(K) == 2 * RECIPE.crops
        for k, crops in enumerate(batch.crops.values()):  # in the order of their names
            rows = slice(k * RECIPE.crops, (k + 1) * RECIPE.crops)
            assert torch.equal(image[rows], crops.image)
            assert torch.equal(box[rows], crops.box)
            assert torch.equal(K[rows], crops.K)
        assert torch.equal(photo, batch.views.image)
    assert set(batches(photos, groups=5)(0).names) == set(photos)  # all, as there are fewer


PICTURES = ("image", "mask", "coordinates")


@GROUPS
def test_crops_and_views_know_their_photos(photos, groups):
    """Also where the photos of two categories differ in size."""
    low = photos["drawer"]
    low = replace(low, **{k: getattr(low, k)[..., :48, :] for k in PICTURES})
    for given in (photos, photos | {"drawer": low}):
        made = batches(given, groups=groups, photos=4, offline_features=True)  # not augmented
        for step in range(3):
            batch = made(step)
            for name, crops in batch.crops.items():
                expected = augment.crops(
                    given[name], crops.index, 64, Chance(0, CPU), None, augment=False
                )
                for field, value in vars(expected).items():
                    torch.testing.assert_close(getattr(crops, field), value, msg=field)
            assert batch.category.tolist() == [0, 0, 1, 1]
            for c, some in enumerate(given.values()):
                shown = batch.category == c
                picked = some.pick(batch.views.index[shown], CPU)
                expected = augment.views(picked, 64, Chance(0, CPU), None, augment=False)
                torch.testing.assert_close(batch.views.image[shown], expected.image)
                torch.testing.assert_close(batch.views.box[shown], expected.box)


@GROUPS
def test_photos_of_two_sizes_are_augmented_to_one(photos, groups):
    low = photos["drawer"]
    low = replace(low, **{k: getattr(low, k)[..., :48] for k in PICTURES})
    made = batches(photos | {"drawer": low}, groups=groups, others=1)
    for step in range(4):
        image, _, _, photo = made(step).inputs()
        assert image.shape == (RECIPE.crops * groups, 3, 64, 64)
        assert photo.shape == (RECIPE.photos + 1, 3, 64, 64)
        assert image.isfinite().all()
        assert photo.isfinite().all()


@GROUPS
def test_batches_made_ahead_are_the_same(photos, groups):
    made = batches(photos, groups=groups)
    ahead = Ahead(made)
    assert (ahead.recipe, ahead.photos) == (made.recipe, made.photos)
    for step in (2, 3, 4, 4, 0, 1):  # also where the one begun is not the one asked for
        assert_same(ahead(step), made(step))


def test_what_fails_in_a_batch_made_ahead_is_said(photos):
    def broken(step: int) -> Batch:
        raise InputError(f"no batch of step {step}")

    made = batches(photos)
    ahead = Ahead(made)
    ahead._batches = broken
    with pytest.raises(InputError, match="no batch of step 7"):
        ahead(7)


def test_categories_take_turns_in_proportion_to_their_parts(photos):
    made = batches(photos)
    turns = [made.turn(step) for step in range(240)]
    assert turns[7] == made(7).names
    parts = {name: len(p.category.part_names) for name, p in photos.items()}
    for name, count in parts.items():
        share = turns.count((name,)) / 240
        assert share == pytest.approx(count / sum(parts.values()), abs=0.1)
    never = batches(photos, groups=2, turns={"laptop": 0})
    assert {never.turn(step) for step in range(20)} == {("drawer",)}


def test_photos_are_of_all_categories(photos):
    made = [batches(photos)(step) for step in range(4)]
    for batch in made:
        for name, crops in batch.crops.items():
            assert crops.cam_T_part.shape[1] == len(photos[name].category.part_names)
        assert len(batch.views.image) == len(batch.category) == RECIPE.photos
        assert set(batch.category.tolist()) == {0, 1}
    assert {sum(batch.category.tolist()) for batch in made} == {1, 2}  # of three photos


def test_photos_that_were_moved_are_the_same(photos):
    moved = placed(photos, CPU)
    assert moved is photos  # no GPU to place them on
    for some in photos.values():
        copy = some.to(CPU)
        assert copy.category is some.category
        assert torch.equal(copy.image, some.image)


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
    shown = [batches(photos, photos=1)(step).category.tolist() for step in range(4)]
    assert [len(s) for s in shown] == [1] * 4
    assert {s[0] for s in shown} == {0, 1}


def test_pictures_of_nothing_known_are_the_last_answer(photos):
    backdrops = torch.zeros(10, 3, 32, 32, dtype=torch.uint8)
    backdrops[::OTHERS_HELD_OUT, 0] = 255  # red ones, which are never shown as such
    batch = batches(photos, backdrops=backdrops, others=40)(1)
    views, nothing = batch.views, batch.category == len(photos)
    assert nothing.tolist() == [False] * 3 + [True] * 40
    assert views.box[nothing].isnan().all()
    assert views.box[~nothing].isfinite().all()
    assert not views.seen[nothing].any()
    assert views.image.isfinite().all()
    red = views.image[nothing] - views.image[nothing].mean(dim=1, keepdim=True)
    assert (red[:, 0].mean(dim=(1, 2)) < 0.9).all()
    assert len(views.image[nothing].flatten(1).unique(dim=0)) > 30  # two may both be white
