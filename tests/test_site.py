"""The docs site's builder finds dead links, and whatever a browser would ask another host for."""

import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
SITE = runpy.run_path(str(ROOT / "docs" / "build_site.py"))
faults, stage = SITE["faults"], SITE["stage"]

GOOD = """<html><head><link rel="stylesheet" href="a/site.css"><link rel="canonical"
href="https://example.org/"></head><body id="top"><a href="https://example.org/">elsewhere</a>
<a href="a/#here">there</a><a href="#top">up</a><img src="picture.png"></body></html>"""
BAD = {
    '<img src="https://example.org/x.png">': "asks another host: https://example.org/x.png",
    '<img srcset="b.png 1x, //example.org/x.png 2x">': "asks another host: //example.org/x.png",
    '<script src="//example.org/x.js"></script>': "asks another host: //example.org/x.js",
    '<link rel="preconnect" href="https://fonts.example.org">': "asks another host",
    '<style>@import "https://example.org/x.css";</style>': "asks another host",
    '<p style="background: url(https://example.org/x.png)">': "asks another host",
    '<a href="nowhere/">': "leads nowhere: nowhere/",
    '<a href="a/#not-here">': "leads nowhere: a/#not-here",
    '<img src="none.png">': "leads nowhere: none.png",
}


@pytest.fixture
def site(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "index.html").write_text(GOOD)
    (tmp_path / "a" / "index.html").write_text('<h1 id="here">A</h1><a href="../">back</a>')
    (tmp_path / "a" / "site.css").write_text("h1 { background: url(picture.png) }")
    (tmp_path / "picture.png").touch()
    (tmp_path / "b.png").touch()
    return tmp_path


def test_a_good_site_has_no_fault(site):
    assert list(faults(site)) == []


@pytest.mark.parametrize("element", BAD)
def test_a_bad_element_is_found(site, element):
    (site / "index.html").write_text(GOOD.replace("</body>", element + "</body>"))
    (found,) = faults(site)
    assert BAD[element] in found


def test_style_sheets_are_read_too(site):
    (site / "a" / "site.css").write_text("@import url('https://fonts.example.org/x.css');")
    (found,) = faults(site)
    assert found.startswith("a/site.css asks another host")


def test_links_out_of_the_docs_lead_to_copies(tmp_path):
    repository, folder = tmp_path / "repository", tmp_path / "staged"
    for name, text in {
        "docs/page.md": "[code](../src/x.py), [it](other.md#a) and `[not](a link)`\n",
        "docs/other.md": "# A\n",
        "src/x.py": "x = 1\n",
        "zensical.toml": "",
    }.items():
        (repository / name).parent.mkdir(parents=True, exist_ok=True)
        (repository / name).write_text(text)
    stage(repository, folder)
    page = (folder / "docs" / "page.md").read_text()
    assert page == "[code](source/src/x.py.md), [it](other.md#a) and `[not](a link)`\n"
    assert "```python\nx = 1\n" in (folder / "docs" / "source" / "src" / "x.py.md").read_text()
    (repository / "docs" / "page.md").write_text("[gone](../src/y.py)\n")
    with pytest.raises(SystemExit, match=r"y\.py, which is not there"):
        stage(repository, tmp_path / "again")


def test_all_of_our_pages_can_be_laid_out(tmp_path):
    stage(ROOT, tmp_path)
    pages = {p.name for p in (tmp_path / "docs").glob("*.md")}
    assert pages == {p.name for p in (ROOT / "docs").glob("*.md")}
