"""Sections of docs/results.md are replaced in place."""

import pytest

from r2art.core.errors import UsageError
from r2art.learn.results import with_section, write_section


def test_a_section_is_added_then_replaced_and_the_rest_kept():
    page = with_section("", "a", "one")
    page = with_section(page, "b", "two")
    again = with_section(page, "a", "three")
    assert again == page.replace("\none\n", "\nthree\n")
    assert again.index("three") < again.index("two")


def test_writing_the_same_twice_changes_nothing(tmp_path):
    path = tmp_path / "results.md"
    write_section(path, "a", "text\n\n")
    first = path.read_text()
    write_section(path, "a", "text")
    assert path.read_text() == first
    assert [p.name for p in tmp_path.iterdir()] == ["results.md"]


@pytest.mark.parametrize(
    "page",
    [
        "<!-- begin a -->",
        "<!-- end a -->",
        "<!-- end a --> <!-- begin a -->",
        2 * "<!-- begin a --> <!-- end a -->",
    ],
)
def test_broken_comments_are_refused(page):
    with pytest.raises(UsageError, match="broken"):
        with_section(page, "a", "text")
