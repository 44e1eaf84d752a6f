"""Images are found as a shell user expects, and no result ever hides another or half of itself."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from r2art.core.errors import InputError, UsageError
from r2art.run.files import find_images, find_predictions, make_folder, result_names, write_whole


@pytest.fixture
def album(tmp_path):
    for name in ("b.JPG", "a.png", "a.overlay.png", "notes.txt", "deep/c.webp", "deep/x[1].png"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.touch()
    return tmp_path


@pytest.mark.parametrize(
    ("pattern", "found"),
    [
        ("", ["a.png", "b.JPG"]),
        ("*.png", ["a.png"]),
        ("**/*", ["a.png", "b.JPG", "deep/c.webp", "deep/x[1].png"]),
        ("deep/x[1].png", ["deep/x[1].png"]),
        ("notes.txt", ["notes.txt"]),
        ("missing.png", ["missing.png"]),
    ],
)
def test_files_folders_and_globs(album, pattern, found):
    paths = find_images(f"{album}/{pattern}")
    assert [p.relative_to(album).as_posix() for p in paths] == found


def test_predictions_are_found_like_images(album):
    for name in ("a.json", "b.JSONL", "deep/c.json"):
        (album / name).touch()
    for pattern, found in (("", ["a.json", "b.JSONL"]), ("**/*.json", ["a.json", "deep/c.json"])):
        paths = find_predictions(f"{album}/{pattern}")
        assert [p.relative_to(album).as_posix() for p in paths] == found
    with pytest.raises(InputError, match="no predictions match"):
        find_predictions(f"{album}/*.urdf")


@pytest.mark.parametrize("pattern", ["empty", "*.gif", "nowhere/*.png"])
def test_a_folder_or_glob_without_images_is_an_error(album, pattern):
    (album / "empty").mkdir()
    with pytest.raises(InputError, match="no images"):
        find_images(f"{album}/{pattern}")


names = st.text("aAb.-_1", min_size=1, max_size=3).filter(lambda s: s.strip("."))


@given(st.lists(st.builds(lambda d, f: Path("/", d, f), names, names), unique=True, max_size=12))
def test_no_two_images_share_their_results(images):
    results = result_names(images)
    assert len({name.casefold() for name in results}) == len(images)
    assert all("/" not in name for name in results)


def test_results_are_named_after_the_file_and_where_needed_its_folder():
    images = [Path("a/cup.jpg"), Path("b/cup.jpg"), Path("b/cup.png"), Path("b/mug.png")]
    assert result_names(images) == ["a_cup.jpg", "b_cup.jpg", "b_cup.png", "mug"]


def test_a_file_is_replaced_whole_and_leaves_no_trace(tmp_path):
    write_whole(tmp_path / "x.json", b"old")
    write_whole(tmp_path / "x.json", b"new")
    assert [p.name for p in tmp_path.iterdir()] == ["x.json"]
    assert (tmp_path / "x.json").read_bytes() == b"new"


def test_what_cannot_be_written_is_told_in_one_line(tmp_path):
    (tmp_path / "taken").mkdir()
    with pytest.raises(UsageError, match="taken"):
        write_whole(tmp_path / "taken", b"data")
    assert [p.name for p in tmp_path.iterdir()] == ["taken"]
    (tmp_path / "file").touch()
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(UsageError, match="file"):
            make_folder(folder)
