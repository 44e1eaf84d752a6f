"""ArtImage: what is written in its form, by its conventions, reads back as it was."""

import json

import numpy as np
import pytest
from adapter_scenes import (
    drawers,
    laptop,
    one_drawer,
    photograph,
    points_fall_on_masks,
    same,
    shears,
)
from artimage_files import Model, write

from r2art.core.errors import InputError
from r2art.data.adapters import open_source
from r2art.data.adapters.artimage import open_artimage
from r2art.data.adapters.convention import Convention
from r2art.data.checking.sample_faults import sample_faults
from r2art.data.sample import BACKDROP

AS_OURS = np.eye(3)
# Their x is our front, their y our up: so "front" is "+x" and their z is our left.
TURNED = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
SHIFT = np.array([0.11, -0.23, 0.31])


def laptops(raw_R_ours=AS_OURS) -> list:
    """Three objects, two photos each; the second object's axis is stored the other way round."""
    photos = []
    for seed, urdf_id in enumerate((9748, 9912, 10040)):
        model = Model(
            urdf_id=urdf_id,
            raw_R_ours=raw_R_ours,
            shift=SHIFT,
            rest=(35.0 - 20 * seed,),
            against=seed == 1,
        )
        for state, azimuth in ((1.9, 0.4), (1.1, -0.5)):
            photos.append((model, photograph(laptop(seed), np.array([state]), azimuth=azimuth)))
    return photos


@pytest.fixture(scope="module")
def photos() -> list:
    return laptops()


@pytest.mark.parametrize("nested", [False, True])
@pytest.mark.parametrize("three_channels", [False, True])
def test_both_layouts_and_both_depth_forms_read_back_as_written(
    tmp_path, photos, nested, three_channels
):
    write(tmp_path, "laptop", photos, test=(4, 5), nested=nested, three_channels=three_channels)
    for split, written in (("train", photos[:4]), ("test", photos[4:]), (None, photos)):
        source = open_source(tmp_path, "laptop", split)
        assert len(source) == len(written)
        for index, (_, truth) in enumerate(written):
            sample = source[index]
            same(sample, truth)
            points_fall_on_masks(sample, truth.instance)
            assert sample_faults(sample, source.category) == []
            assert f"{index + (4 if split == 'test' else 0):06d}.json" in source.file(index)


def test_the_background_may_be_replaced_and_parts_are_as_visible_as_they_are(tmp_path, photos):
    write(tmp_path, "laptop", photos[:1])
    sample = open_source(tmp_path)[0]
    np.testing.assert_array_equal(sample.mask == BACKDROP, photos[0][1].mask == 0)
    assert sample.visible.min() > 0.5  # an open laptop from the front
    assert sample.visible.max() <= 1


def test_another_object_frame_is_told_by_a_file_in_the_folder(tmp_path):
    photos = laptops(TURNED)
    home = write(tmp_path, "laptop", photos[:2])
    (home / "r2art.json").write_text(json.dumps({"up": "+y", "front": "+x"}))
    same(open_source(tmp_path)[0], photos[0][1])
    (home / "r2art.json").unlink()
    (tmp_path / "r2art.json").write_text(json.dumps({"laptop": {"front": "+x"}, "drawer": {}}))
    same(open_source(tmp_path)[1], photos[1][1])
    straight = open_artimage(tmp_path, convention=Convention())[0]
    assert np.abs(straight.cam_T_part - photos[0][1].cam_T_part).max() > 0.1


def test_lengths_scale_with_the_unit(tmp_path, photos):
    home = write(tmp_path, "laptop", photos[:2])
    (home / "r2art.json").write_text('{"unit": 0.25}')
    source = open_source(home)
    same(source[0], photos[0][1], unit=0.25)
    points_fall_on_masks(source[0], photos[0][1].instance, unit=0.25)
    assert sample_faults(source[0], source.category) == []


def test_drawers_slide(tmp_path):
    truth = photograph(drawers(3), np.array([0.12, 0.02, 0.2]))
    model = Model(urdf_id=1, raw_R_ours=TURNED, shift=SHIFT, rest=(0.04, -0.3, 0.0))
    write(tmp_path, "drawer", [(model, truth)])
    source = open_artimage(tmp_path, "drawer", "train", Convention(front="+x"))
    same(source[0], truth)
    points_fall_on_masks(source[0], truth.instance)
    assert sample_faults(source[0], source.category) == []
    assert source.category.part_names[0] == "cabinet"
    assert [joint.kind for joint in source.category.joints] == ["prismatic"] * 3


def test_a_category_that_nobody_published_is_read_by_the_same_rules(tmp_path):
    truth = photograph(one_drawer(2), np.array([0.15]))
    write(
        tmp_path, "desk", [(Model(urdf_id=7, raw_R_ours=AS_OURS, shift=SHIFT, rest=(0.0,)), truth)]
    )
    source = open_source(tmp_path, "desk", "train")
    same(source[0], truth)
    assert source.category.part_names == ("part_0", "part_1")
    assert sample_faults(source[0], source.category) == []


def test_scissors_are_aligned_by_their_two_urdfs(tmp_path):
    base = ((0.05, -0.02, 0.03), (0.2, -0.5, 0.9))
    model = Model(urdf_id=10448, raw_R_ours=AS_OURS, shift=SHIFT, rest=(12.0,), base=base)
    truth = photograph(shears(), np.array([0.7]))
    write(tmp_path, "scissors", [(model, truth)])
    source = open_source(tmp_path, "scissors", "train")
    same(source[0], truth)
    points_fall_on_masks(source[0], truth.instance)


def test_angles_of_the_wrong_hand_are_told_by_the_check(tmp_path, photos):
    write(tmp_path, "laptop", photos[:1])
    source = open_artimage(tmp_path, convention=Convention(left_handed=False))
    found = sample_faults(source[0], source.category)
    assert [field for field, _ in found] == ["cam_T_part"]


def test_closed_may_lie_elsewhere_than_the_datasets_rest(tmp_path, photos):
    """Shift what counts as closed, and pixels, joints and boxes still close."""
    write(tmp_path, "laptop", photos[:2])
    sample = open_artimage(tmp_path, convention=Convention(closed=(0.4,), flip=(False,)))[0]
    assert sample.joint_state[0] == pytest.approx(photos[0][1].joint_state[0] - 0.4)
    source = open_artimage(tmp_path, convention=Convention(closed=(0.4,)))
    assert sample_faults(source[0], source.category) == []


def test_parts_may_be_put_in_another_order(tmp_path):
    truth = photograph(drawers(3), np.array([0.12, 0.02, 0.2]))
    model = Model(urdf_id=1, raw_R_ours=AS_OURS, shift=SHIFT, rest=(0.0, 0.0, 0.0))
    write(tmp_path, "drawer", [(model, truth)])
    source = open_artimage(tmp_path, "drawer", None, Convention(order=(0, 3, 1, 2)))
    sample = source[0]
    np.testing.assert_allclose(sample.joint_state, truth.joint_state[[2, 0, 1]], atol=1e-9)
    np.testing.assert_allclose(sample.cam_T_part, truth.cam_T_part[[0, 3, 1, 2]], atol=1e-6)
    assert sample_faults(sample, source.category) == []


def test_the_category_is_the_mean_of_the_training_objects(tmp_path, photos):
    write(tmp_path, "laptop", photos, test=(4, 5))
    test = open_source(tmp_path, "laptop", "test").category
    train = open_source(tmp_path, "laptop", "train").category
    sizes = np.log([laptop(seed).part_boxes()[1] for seed in (0, 1)])
    np.testing.assert_allclose(train.box_size, np.exp(sizes.mean(axis=0)), rtol=1e-6)
    np.testing.assert_array_equal(test.box_size, train.box_size)
    assert test.frontal_area == train.frontal_area
    areas = []
    for _, truth in photos[:4]:
        x1, y1, x2, y2 = truth.box
        z = truth.cam_T_part[0, 2, 3]
        areas.append((x2 - x1) * (y2 - y1) * z**2 / (truth.camera.fx * truth.camera.fy))
    assert train.frontal_area == pytest.approx(np.exp(np.mean(np.log(areas))))
    np.testing.assert_allclose(train.joints[0].axis, laptop(0).joints[0].axis, atol=1e-9)
    assert train.joints[0].limits == pytest.approx((0.0, 1.9))
    lower = train.box_center - train.box_size / 2
    assert (train.points >= lower[:, None] - 1e-9).all()


def test_objects_of_the_other_split_are_left_out_though_listed(tmp_path, photos):
    """Where videos use the same names, the objects decide, as the published split has them."""
    home = write(tmp_path, "laptop", photos[3:5])
    (home / "test.txt").write_text((home / "train.txt").read_text())
    assert len(open_source(tmp_path, "laptop", "train")) == 1
    assert len(open_source(tmp_path, "laptop", "test")) == 1


def test_what_cannot_be_opened_is_told_in_one_line(tmp_path, photos):
    write(tmp_path, "laptop", photos[:1])
    with pytest.raises(InputError, match=r"give one of its categories .*: laptop"):
        open_source(tmp_path, "drawer")
    with pytest.raises(InputError, match="no split 'val'"):
        open_source(tmp_path, "laptop", "val")
    with pytest.raises(InputError, match="no photo of split test"):
        open_source(tmp_path, "laptop", "test")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="is no dataset that r2art knows"):
        open_source(tmp_path / "empty")
    with pytest.raises(InputError, match="no folder"):
        open_source(tmp_path / "nothing")
