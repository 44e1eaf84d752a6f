"""Ways to spoil a JSON file: every one of them must be noticed, by name."""

import copy
import json
from collections.abc import Iterator
from typing import Any

import numpy as np

Path = tuple[str | int, ...]
NOTHING = object()
WRONG = [
    None,
    "",
    "what",
    [],
    {},
    True,
    float("nan"),
    float("inf"),
    -1e308,
    [[1, 2], [3]],
    {"a": 1},
]


def at(tree: Any, path: Path) -> Any:
    for step in path:
        tree = tree[step]
    return tree


def changed(tree: Any, path: Path, value: Any) -> Any:
    """A copy with one value replaced, or removed if it is ``NOTHING``."""
    tree = copy.deepcopy(tree)
    if not path:
        return value
    home = at(tree, path[:-1])
    if value is NOTHING:
        del home[path[-1]]
    else:
        home[path[-1]] = value
    return tree


def paths(tree: Any, skip: tuple[str, ...], path: Path = ()) -> Iterator[Path]:
    """Where all values stand, but not inside arrays of numbers nor below some keys."""
    yield path
    if isinstance(tree, dict):
        for key, value in tree.items():
            if key not in skip:
                yield from paths(value, skip, (*path, key))
    elif isinstance(tree, list) and any(isinstance(value, dict) for value in tree):
        for index, value in enumerate(tree):
            yield from paths(value, skip, (*path, index))


def wrong_values(tree: Any, skip: tuple[str, ...] = ()) -> Iterator[tuple[Path, Any]]:
    """Each value removed, and replaced by each of `WRONG` that is of another type or size."""
    for path in paths(tree, skip):
        value = at(tree, path)
        if path and isinstance(path[-1], str):
            yield path, changed(tree, path, NOTHING)
        for wrong in WRONG:
            if isinstance(value, str) and isinstance(wrong, str) and wrong:
                continue  # a name; whether it leads anywhere is another matter
            if wrong != value:
                yield path, changed(tree, path, wrong)


def wrong_arrays(tree: Any, skip: tuple[str, ...] = ()) -> Iterator[tuple[Path, Any]]:
    """Each array of numbers cut, grown, with one entry spoilt."""
    for path in paths(tree, skip):
        value = at(tree, path)
        if not isinstance(value, list) or not value or isinstance(value[0], str | dict):
            continue
        yield path, changed(tree, path, value[:-1])
        yield path, changed(tree, path, [*value, value[0]])
        yield path, changed(tree, path, [value])
        array = np.array(value, dtype=object)
        for spoilt in (float("nan"), None, "1.0", float("-inf"), [1.0], False):
            other = array.copy()
            entry = np.unravel_index(array.size // 2, array.shape)
            other[tuple(int(i) for i in entry)] = spoilt
            yield path, changed(tree, path, other.tolist())


def wrong_transformations(tree: Any, path: Path) -> Iterator[tuple[Path, Any]]:
    """A 4 × 4 that is no pose, or that of something else."""
    T = np.array(at(tree, path), float)
    turn = np.eye(4)
    turn[:2, :2] = [[0, -1], [1, 0]]
    changes = {
        "scaled": T @ np.diag([1.02, 1.02, 1.02, 1]),
        "sheared": T @ (np.eye(4) + np.eye(4, k=1) * [[0.02], [0], [0], [0]]),
        "mirrored": T @ np.diag([-1, 1, 1, 1]),
        "in another row": T[[1, 0, 2, 3]],
        "transposed": T.T,
        "no last row": np.vstack([T[:3], [0, 0, 0, 0]]),
        "inverse": np.linalg.inv(T),
        "elsewhere": T + np.eye(4, k=3) * 0.3,
        "turned": T @ turn,
        "behind": np.diag([1, 1, -1, 1]) @ T @ np.diag([1, 1, -1, 1]),
        "in millimetres": np.vstack([np.hstack([T[:3, :3], 1000 * T[:3, 3:]]), T[3:]]),
        "flat": T.ravel(),
    }
    for change in changes.values():
        yield path, changed(tree, path, change.tolist())


def wrong_text(tree: Any) -> Iterator[tuple[Path, bytes]]:
    """Files that are cut off, or no JSON at all."""
    text = json.dumps(tree)
    for share in np.linspace(0, 0.999, 23):
        yield (), text[: int(share * len(text))].encode()
    for content in (b"\xff\xfe\x00junk", b"null", b"[]", b"3", b'"text"', b"{", b"[" * 100000):
        yield (), content
    yield (), text.replace(":", "=", 1).encode()
    yield (), text.replace('"', "'").encode()
    yield (), text.encode("utf-16")


def name_of(path: Path) -> str:
    """A path as r2art's faults write it."""
    text = ""
    for step in path:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else step
    return text
