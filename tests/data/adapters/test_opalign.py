"""OP-Align: what is written in its form reads back as it was; no pickle is trusted."""

import json
import os
import pickle

import numpy as np
import pytest
from adapter_scenes import laptop, one_drawer, photograph, points_fall_on_masks, same
from opalign_files import arrays, write

from r2art.core.errors import InputError
from r2art.data.adapters import open_source
from r2art.data.adapters.convention import Convention
from r2art.data.adapters.opalign import open_opalign
from r2art.data.checking.sample_faults import sample_faults
from r2art.data.source import Fault

LAPTOP = "laptop_output/train/cup/60_box/input_2"
TURNED = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])  # their x is our front


@pytest.fixture(scope="module")
def truth():
    return photograph(laptop(0), np.array([1.8]), backdrop=True)


@pytest.mark.parametrize("axes", [(1, 1, 1), (1, -1, -1), (1, 1, -1)])
@pytest.mark.parametrize("pickled", [True, False])
def test_every_camera_frame_reads_back_as_written(tmp_path, truth, axes, pickled):
    """OpenCV's axes, OpenGL's, and a mirrored frame are told apart by the points themselves."""
    write(tmp_path / LAPTOP / "1.5.npz", arrays(truth, axes=axes), pickled=pickled)
    source = open_source(tmp_path, "laptop", "train")
    sample = source[0]
    found, camera = sample.camera, truth.camera
    np.testing.assert_allclose(found.K, camera.K, rtol=1e-6)
    same(sample, truth)
    points_fall_on_masks(sample, truth.instance)
    assert sample_faults(sample, source.category) == []


def test_units_axes_order_of_columns_and_colours(tmp_path, truth):
    content = arrays(
        truth, ours_R_theirs=TURNED, scale=10.0, direction_first=True, bytes_of_color=True
    )
    write(tmp_path / LAPTOP / "1.5.npz", content)
    (tmp_path / "r2art.json").write_text(json.dumps({"laptop": {"front": "+x", "unit": 0.1}}))
    source = open_source(tmp_path)
    same(source[0], truth)
    assert sample_faults(source[0], source.category) == []


def test_drawers_slide_from_where_they_are_said_to_be_closed(tmp_path):
    truth = photograph(one_drawer(1), np.array([0.16]), backdrop=True)
    write(tmp_path / "drawer_output/test/a/b/input_2/1.npz", arrays(truth))
    center, _ = truth.instance.part_boxes()
    closed = float(center[1] @ truth.instance.joints[0].axis)
    source = open_opalign(tmp_path, "drawer", "test", Convention(closed=(closed,)))
    same(source[0], truth)
    assert sample_faults(source[0], source.category) == []


def test_parts_may_be_counted_the_other_way_round(tmp_path, truth):
    content = arrays(truth)
    content["part"] = content["part"][::-1].copy()
    content["segmentation"] = np.array([0, 2, 1], np.uint8)[content["segmentation"]]
    write(tmp_path / LAPTOP / "1.npz", content)
    same(open_opalign(tmp_path, convention=Convention(order=(1, 0)))[0], truth)


def test_a_pickle_that_wants_more_than_arrays_is_not_run(tmp_path, truth):
    class Trap:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "sprung"),)

    path = tmp_path / LAPTOP / "1.npz"
    write(path, {**arrays(truth), "extra": Trap()})
    source = open_source(tmp_path)
    with pytest.raises(Fault, match=r"no arrays that can be read .*mkdir, which no array needs"):
        source[0]
    assert not (tmp_path / "sprung").exists()
    with pytest.raises(FileNotFoundError):  # it would have sprung otherwise
        os.rmdir(tmp_path / "sprung")
    pickle.loads(pickle.dumps(Trap()))
    assert (tmp_path / "sprung").exists()


@pytest.mark.parametrize(
    ("name", "change", "problem"),
    [
        ("pc", lambda a: a[:-1], "must be (480 * 640, 3)"),
        ("pc", lambda a: np.where(np.arange(len(a))[:, None] % 2, a, -a), "both sides"),
        ("pc", lambda a: np.random.default_rng(0).permutation(a), "not what one camera sees"),
        ("pc", lambda a: a * 0, "only 0 pixels"),
        ("color", lambda a: a[:, :2], "must be"),
        ("color", lambda a: a * 500, "between 0 and 1"),
        ("segmentation", lambda a: a * 0, "no pixel of the object"),
        ("segmentation", lambda a: a + 2, "labels are 0 to 2"),
        ("part", lambda a: a[:1], "must be (2, 15)"),
        ("part", lambda a: a * np.nan, "NaN"),
        ("part", lambda a: a * 2, "no rotation"),
        ("part", lambda a: a * np.r_[-np.ones(9), np.ones(6)], "mirrors"),
        ("part", lambda a: a * np.r_[np.ones(12), -np.ones(3)], "positive"),
        ("part", lambda a: a * np.r_[np.ones(9), -np.ones(3), np.ones(3)], "behind"),
        ("joint", lambda a: a[:, :5], "must be (1, 6)"),
        ("joint", lambda a: a * np.r_[np.ones(3), np.zeros(3)], "length 0"),
        ("joint", lambda a: a[:, [0, 1, 2, 4, 5, 3]], "otherwise than about its joint"),
        ("joint", lambda a: a.astype(str), "must hold numbers"),
    ],
)
def test_whatever_is_wrong_with_an_array_is_named(tmp_path, truth, name, change, problem):
    content = arrays(truth)
    content[name] = change(content[name])
    write(tmp_path / LAPTOP / "1.npz", content)
    with pytest.raises(Fault) as caught:
        open_source(tmp_path)[0]
    assert problem in caught.value.problem
    assert caught.value.field.partition("[")[0] in (name, "part")
    assert caught.value.file.endswith("1.npz")


def test_damaged_and_missing_files_are_named(tmp_path, truth):
    path = tmp_path / LAPTOP / "1.npz"
    write(path, arrays(truth))
    source = open_source(tmp_path)
    whole = path.read_bytes()
    for content in (b"", whole[: len(whole) // 2], b"PK" + whole[2:300], whole[:-30]):
        path.write_bytes(content)
        with pytest.raises(Fault, match="no arrays that can be read"):
            source[0]
    content = arrays(truth)
    del content["joint"]
    write(path, content)
    with pytest.raises(Fault, match="joint: is missing"):
        source[0]
    path.unlink()
    with pytest.raises(Fault, match="is missing"):
        source[0]
    with pytest.raises(InputError, match="give one of its categories"):
        open_opalign(tmp_path, "drawer")
