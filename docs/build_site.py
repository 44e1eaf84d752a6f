"""Builds the docs site, strictly, and checks what it says to a browser.

After `pip install -e '.[docs]'`, from the repository's root:

    python docs/build_site.py                 writes site/
    python docs/build_site.py --out FOLDER

Pages in docs/ link to files of the repository that are no pages, such as a JSON Schema or a
module. On the site such a file has its place below source/: JSON as it is, all else as a page that
shows it. Then every link to a missing page, file or heading is an error, and so is everything that
would make a browser ask another host than the site's own.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from html.parser import HTMLParser
from pathlib import Path, PurePosixPath
from urllib.parse import unquote, urlsplit

ROOT = Path(__file__).resolve().parent.parent
LINK = re.compile(r"(?<=\]\()([^)#:\s]+)(?=[)#])")
CODE = re.compile(r"(^```.*?^```$|`[^`\n]+`)", re.DOTALL | re.MULTILINE)
LANGUAGES = {".py": "python", ".toml": "toml", ".urdf": "xml", ".yaml": "yaml"}
# Attributes whose address a browser fetches by itself, by tag; `link` unless it is only a name.
FETCHED = {
    "img": ("src", "srcset"),
    "script": ("src",),
    "iframe": ("src",),
    "source": ("src", "srcset"),
    "video": ("src", "poster"),
    "audio": ("src",),
    "embed": ("src",),
    "object": ("data",),
    "link": ("href",),
    "use": ("href", "xlink:href"),
}
NAMES = ("canonical", "license", "author", "me")
IN_CSS = re.compile(r"""(?:url\(\s*['"]?|@import\s+['"])((?:https?:)?//[^'")\s]+)""")


def stage(repository: Path, folder: Path) -> None:
    """Lay out what zensical builds from: the pages, and the files that they link to."""
    shutil.copytree(
        repository / "docs", folder / "docs", ignore=shutil.ignore_patterns("*.py", "__pycache__")
    )
    shutil.copy(repository / "zensical.toml", folder)
    (folder / "src").symlink_to(repository / "src", target_is_directory=True)
    waiting = sorted((repository / "docs").rglob("*.md"))
    done: set[Path] = set()
    while waiting:
        source = waiting.pop()
        if source in done:
            continue
        done.add(source)
        target = folder / "docs" / _place(source.relative_to(repository))
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.suffix == ".md":
            links: list[Path] = []
            target.write_text(_relinked(source, repository, links), encoding="utf-8")
            waiting += links
        elif target.suffix == ".md":
            target.write_text(_shown(source, repository), encoding="utf-8")
        else:
            shutil.copy(source, target)


def _place(path: Path) -> PurePosixPath:
    """Where a file of the repository lies below the site's docs."""
    name = PurePosixPath(path.as_posix())
    if name.parts[0] == "docs":
        return name.relative_to("docs")
    as_it_is = name.suffix in {".md", ".json", ".png", ".jpg", ".ipynb"}
    return PurePosixPath("source") / (name if as_it_is else name.with_name(f"{name.name}.md"))


def _relinked(page: Path, repository: Path, links: list[Path]) -> str:
    """A page whose links out of docs/ lead to the places below source/; notes what they need."""
    here = _place(page.relative_to(repository)).parent

    def place(match: re.Match[str]) -> str:
        target = (page.parent / unquote(match[1])).resolve()
        if not target.exists():
            raise SystemExit(f"{page}: links to {match[1]}, which is not there")
        inside = (repository / "docs") in target.parents
        if target.is_dir():
            raise SystemExit(f"{page}: links to the folder {match[1]}; link to a file in it")
        if not inside:
            links.append(target)
        return os.path.relpath(_place(target.relative_to(repository)), here).replace(os.sep, "/")

    pieces = CODE.split(page.read_text(encoding="utf-8"))
    pieces[::2] = [LINK.sub(place, piece) for piece in pieces[::2]]
    return "".join(pieces)


def _shown(source: Path, repository: Path) -> str:
    """A page that shows a text file."""
    name, language = source.relative_to(repository).as_posix(), LANGUAGES.get(source.suffix, "text")
    return f"# {source.name}\n\n`{name}`\n\n````{language}\n{source.read_text('utf-8')}````\n"


class Page(HTMLParser):
    """What one page of the site asks for, links to, and can be linked at."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.fetched: list[str] = []
        self.links: list[str] = []
        self.anchors: set[str] = {""}
        self._style = False
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note the addresses and names of an element."""
        given = {name: value or "" for name, value in attrs}
        self.anchors |= {given[name] for name in ("id", "name") if name in given}
        self._style = tag == "style"
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        if tag == "link" and set(given.get("rel", "").split()) & set(NAMES):
            return
        for name in FETCHED.get(tag, ()):
            if name in given:
                self.fetched += [part.split()[0] for part in given[name].split(",") if part.strip()]
        self.fetched += IN_CSS.findall(given.get("style", ""))

    def handle_data(self, data: str) -> None:
        """Note the addresses in a style sheet."""
        if self._style:
            self.fetched += IN_CSS.findall(data)


def faults(site: Path) -> Iterator[str]:
    """Everything on the site that leads nowhere, or to another host without being clicked."""
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in sorted(site.rglob("*.html"))}
    for path, page in pages.items():
        name = path.relative_to(site)
        for address in page.fetched:
            if _is_foreign(address):
                yield f"{name} asks another host: {address}"
        if name.name == "404.html":  # its addresses begin at the site's root, wherever that is
            continue
        for address in {*page.links, *page.fetched}:
            if not _leads_somewhere(address, path, pages.get):
                yield f"{name} leads nowhere: {address}"
    for path in sorted(site.rglob("*.css")):
        for address in IN_CSS.findall(path.read_text(encoding="utf-8")):
            yield f"{path.relative_to(site)} asks another host: {address}"


def _is_foreign(address: str) -> bool:
    return bool(urlsplit(address).netloc)


def _leads_somewhere(address: str, page: Path, page_at: Callable[[Path], Page | None]) -> bool:
    parts = urlsplit(address)
    if parts.scheme or parts.netloc:
        return True
    target = page if not parts.path else Path(os.path.normpath(page.parent / unquote(parts.path)))
    if target.is_dir():
        target /= "index.html"
    if not target.is_file():
        return False
    found = page_at(target)
    return found is None or unquote(parts.fragment) in found.anchors


def build(out: Path, repository: Path = ROOT) -> list[str]:
    """Build the site into the folder ``out`` and say what is wrong with it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name).resolve()
        stage(repository, folder)
        command = [sys.executable, "-m", "zensical", "build", "--strict"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        if done.returncode:
            return [done.stdout + done.stderr]
        shutil.rmtree(out, ignore_errors=True)
        shutil.copytree(folder / "site", out)
    return list(faults(out))


def main() -> int:
    """Build, check, and tell."""
    parser = argparse.ArgumentParser(description="Build and check the docs site.")
    parser.add_argument("--out", type=Path, default=ROOT / "site", help="folder of the site")
    out = parser.parse_args().out
    found = build(out)
    for fault in found:
        print(fault, file=sys.stderr)
    print(f"{len(list(out.rglob('*.html')))} pages in {out}, {len(found)} faults")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
