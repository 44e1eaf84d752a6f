"""ReArtMix: what is written in its form, by its conventions, reads back as it was."""

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
    together,
)
from reart_files import Model, entry, instance, write_camera, write_frame, write_metas

from r2art.core.errors import InputError
from r2art.data.adapters import open_source
from r2art.data.adapters.convention import Convention
from r2art.data.adapters.reartmix import open_reartmix
from r2art.data.checking.sample_faults import sample_faults

AS_OURS = np.eye(3)
TURNED = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])  # their x is our front
SHIFT = np.array([0.02, -0.05, 0.31])
LID = Model(urdf_id=3, theirs_R_ours=AS_OURS, shift=SHIFT)
AGAINST = Model(urdf_id=4, theirs_R_ours=AS_OURS, shift=-SHIFT, against=True)
CHEST = Model(urdf_id=20, theirs_R_ours=AS_OURS, shift=SHIFT)
BOX, DRAWER = 1, 4


@pytest.fixture(scope="module")
def photos() -> list:
    """An open box (a laptop plays it) before a chest that it partly hides, and two alone."""
    front = photograph(laptop(0), np.array([1.2]), place=(-0.09, 0.02), backdrop=True)
    chest = photograph(one_drawer(1), np.array([0.11]), place=(0.12, -0.05), backdrop=True)
    first, second = together(front, chest)
    assert (second.mask > 0).sum() < (chest.mask > 0).sum()  # something is hidden
    alone = photograph(laptop(1), np.array([0.8]), azimuth=-0.3, backdrop=True)
    return [(LID, first), (CHEST, second), (AGAINST, alone)]


def write(root, photos, *, numbering: int = 0, **options) -> None:
    """Frame 1 with a box and a chest, frame 2 with a box; as sets box_train and box_val."""
    (lid, first), (chest, second), (other, alone) = photos
    labels = {BOX: (1, 1), DRAWER: (1, 7)}
    write_metas(root, [entry(model, truth, **options) for model, truth in photos])
    write_camera(root, first)
    both = [
        instance(chest, second, DRAWER, labels[DRAWER][numbering]),
        instance(lid, first, BOX, number=1),
    ]
    write_frame(root / "mix_train", "scene_1/000001", first, both)
    write_frame(root / "mix_val", "scene_2/000007", alone, [instance(other, alone, BOX)])


@pytest.mark.parametrize("numbering", [0, 1])
@pytest.mark.parametrize("options", [{}, {"nested": False, "named": True}])
def test_every_instance_reads_back_as_written(tmp_path, photos, numbering, options):
    write(tmp_path, photos, numbering=numbering, **options)
    for category, split, (_, truth) in (
        ("box", "train", photos[0]),
        ("drawer", "train", photos[1]),
        ("box", "test", photos[2]),
    ):
        source = open_source(tmp_path, category, split)
        assert len(source) == 1
        assert source.category.name == category
        sample = source[0]
        same(sample, truth)
        if category == "box":
            points_fall_on_masks(sample, truth.instance)
            assert sample_faults(sample, source.category) == []


def test_both_splits_together_and_a_set_by_itself(tmp_path, photos):
    write(tmp_path, photos)
    source = open_source(tmp_path, "box")
    assert [source.file(i).split("/")[-1] for i in range(len(source))] == [
        "000001.json, instance 1",
        "000007.json, instance 0",
    ]
    same(source[1], photos[2][1])
    alone = open_source(tmp_path / "mix_val")
    assert alone.category.name == "box"
    same(alone[0], photos[2][1])


def test_what_hides_an_object_is_surroundings(tmp_path, photos):
    write(tmp_path, photos)
    sample = open_source(tmp_path, "drawer")[0]
    hidden_by = photos[0][1].mask > 0
    assert (sample.mask[hidden_by] == 0).all()
    assert (sample.mask < 3).all()


def test_real_videos_lists_and_cameras_of_scenes(tmp_path, photos):
    """Frames below SCENE/VIDEO, their images beside; lists name the instances."""
    model, truth = photos[2]
    write_metas(tmp_path, [entry(model, truth)])
    write_camera(tmp_path / "camera_intrinsic" / "desk", truth)
    one = instance(model, truth, BOX)
    for video in ("000", "001"):
        write_frame(tmp_path, f"desk/{video}/000010", truth, [one], paths=False)
    (tmp_path / "train.txt").write_text("desk/000/000010_0.h5\n")
    (tmp_path / "test.txt").write_text("desk/001/000010_0.h5\ndesk/001/000011_0.h5\n")
    assert len(open_source(tmp_path, "box", "train")) == 1
    test = open_source(tmp_path, "box", "test")
    same(test[0], truth)
    with pytest.raises(InputError, match=r"test.txt: desk/001/000011: is named, but .* is missing"):
        test[1]


def test_the_box_set_is_split_at_frame_5000(tmp_path, photos):
    model, truth = photos[2]
    write_metas(tmp_path, [entry(model, truth)])
    write_camera(tmp_path, truth)
    for frame in ("000012", "004999", "005000"):
        home = tmp_path / "box_train_v2"
        write_frame(home, f"a/{frame}", truth, [instance(model, truth, BOX)])
    assert len(open_source(tmp_path, "box", "train")) == 2
    test = open_source(tmp_path, "box", "test")
    assert [test.file(0).split("/")[-1]] == ["005000.json, instance 0"]


def test_drawers_of_four_parts_are_a_category_of_their_own(tmp_path):
    truth = photograph(drawers(3), np.array([0.12, 0.02, 0.2]), backdrop=True)
    four = Model(urdf_id=52, theirs_R_ours=TURNED, shift=SHIFT)
    write_metas(tmp_path, [entry(four, truth)])
    write_camera(tmp_path, truth)
    write_frame(tmp_path / "drawer_train", "s/000001", truth, [instance(four, truth, DRAWER)])
    source = open_reartmix(tmp_path, "drawer", "train", Convention(parts=4, front="+x"))
    same(source[0], truth)
    with pytest.raises(InputError, match="shows no drawer of 2 parts"):
        open_source(tmp_path, "drawer")


def test_axes_with_a_wrong_component_are_told_by_the_check(tmp_path):
    """An older reader negates the axes' second component; the poses settle what is right."""
    truth = photograph(laptop(0), np.array([1.2]), backdrop=True)
    skew = Model(
        urdf_id=3, theirs_R_ours=np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]]), shift=SHIFT
    )
    write_metas(tmp_path, [entry(skew, truth)])
    write_camera(tmp_path, truth)
    write_frame(tmp_path / "box_train", "s/000001", truth, [instance(skew, truth, BOX)])
    axes = {"up": "-z", "front": "+x"}
    right = open_reartmix(tmp_path, "box", None, Convention(**axes))
    same(right[0], truth)
    assert sample_faults(right[0], right.category) == []
    turned = open_reartmix(tmp_path, "box", None, Convention(negate_second=True, **axes))
    # The axis is along the negated one here: the same line, so only the sign may differ.
    same(turned[0], truth)


def test_the_category_is_the_mean_of_the_boxes_with_points_on_them(tmp_path, photos):
    write(tmp_path, photos)
    category = open_source(tmp_path, "box", "train").category
    _, size = laptop(0).part_boxes()
    np.testing.assert_allclose(category.box_size, size, rtol=1e-6)
    on_side = np.abs((category.points - category.box_center[:, None]) / category.box_size[:, None])
    np.testing.assert_allclose(on_side.max(axis=-1), 0.5, atol=1e-6)
    box = 2 * (size[:, 0] * size[:, 1] + size[:, 1] * size[:, 2] + size[:, 2] * size[:, 0])
    np.testing.assert_allclose(category.areas, box, rtol=0.5)
    assert json.dumps(category.joints[0].axis) == json.dumps([-1.0, 0.0, 0.0])
