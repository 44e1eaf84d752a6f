"""Every model of a folder, read by r2art and by MuJoCo: how far apart are their links?

python benchmarks/import_parity.py                              prints Markdown
python benchmarks/import_parity.py --results docs/results.md    writes the page's section
"""

import argparse
import time
from pathlib import Path

import mujoco

from r2art.core.errors import InputError
from r2art.data.models.build import Built
from r2art.data.models.parity import Parity, parity
from r2art.learn.results import write_section

ROOT = Path(__file__).resolve().parent.parent
DATA = ROOT.parent / "shared" / "data"
STATES = 100
HEAD = """| model | parts | joints | links compared | triangles | greatest deviation | s |
| --- | ---: | ---: | ---: | ---: | ---: | ---: |"""


def models(folder: Path) -> list[Path]:
    """All URDF and MJCF files below a folder, but not what others include."""
    scenes = [p for p in folder.rglob("*.xml") if "<mujoco " in p.read_text(encoding="utf-8")]
    return sorted([*folder.rglob("*.urdf"), *scenes])


def row(name: str, path: Path) -> str:
    """One line of the table; what cannot be read says why."""
    start = time.perf_counter()
    try:
        result, note = _compared(path)
    except InputError as error:
        return f"| {name} | {_short(error, path)} | | | | | |"
    seconds = time.perf_counter() - start
    built = result.built
    return (
        f"| {name}{note} | {len(built.instance.parts)} | {len(built.instance.joints)} | "
        f"{result.links} | {_triangles(built) if not note else ''} | {result.deviation:.1e} | "
        f"{seconds:.1f} |"
    )


def _compared(path: Path) -> tuple[Parity, str]:
    if path.suffix == ".xml":
        return parity(path, "mjcf", states=STATES), ""
    try:
        return parity(path, "urdf", states=STATES), ""
    except InputError as error:
        return parity(path, "urdf", states=STATES, shapes=False), f" ({_short(error, path)})"


def _short(error: InputError, path: Path) -> str:
    """What is wrong, without folders of this machine and without the remedy."""
    text = str(error).replace(f"{path.parent}/", "").removeprefix(f"{path.name}: ")
    return text.partition(";")[0].partition(" (looked")[0]


def _triangles(built: Built) -> int:
    return sum(len(s.faces) for part in built.instance.parts for s in part)


def report(folder: Path, flags: str) -> str:
    """The section of docs/results.md."""
    rows = [row(path.relative_to(folder).as_posix(), path) for path in models(folder)]
    facts = (
        f"Poses of all links at {STATES} random joint states, relative to the root part, against "
        f"MuJoCo {mujoco.__version__}; the greatest difference of any number of a pose (m, or "
        "part of a unit vector). Triangles are those left of the meshes; s is the time to read, "
        f"simplify and compare. Written by `python benchmarks/import_parity.py{flags}`."
    )
    return "\n".join(["## Imported models against MuJoCo", "", facts, "", HEAD, *rows])


def main() -> None:
    parser = argparse.ArgumentParser(description="Compare imported models with MuJoCo.")
    parser.add_argument("--data", type=Path, default=DATA, help="folder with models")
    parser.add_argument("--results", type=Path, help="write the section on imports of this page")
    args = parser.parse_args()
    section = report(args.data, " --results docs/results.md" if args.results else "")
    print(section)
    if args.results:
        write_section(args.results, "import_parity", section)


if __name__ == "__main__":
    main()
