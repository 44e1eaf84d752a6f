"""Reading other people's files so that whatever is wrong in one is named by file and field."""

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from r2art.data.source import Fault

FloatArray = NDArray[np.float64]
LARGEST = 2**53
SAME_ROTATION = 1e-3  # how far R Rᵀ of a stored transformation may be from the identity


@dataclass(frozen=True)
class Node:
    """A value of a JSON file that knows where it stands.

    Every accessor raises a `Fault` that names the file and the field where the value is not
    what it must be.
    """

    value: Any
    file: Path
    field: str = ""

    def fault(self, problem: str) -> Fault:
        """What to raise if something is wrong here."""
        return Fault(str(self.file), self.field, problem)

    def get(self, key: str) -> "Node | None":
        """The entry of an object, or None where there is none."""
        if not isinstance(self.value, dict):
            raise self.fault(f"must be an object, is {_kind(self.value)}")
        if key not in self.value:
            return None
        return Node(self.value[key], self.file, f"{self.field}.{key}" if self.field else key)

    def __getitem__(self, key: str) -> "Node":
        found = self.get(key)
        if found is None:
            raise Fault(str(self.file), f"{self.field}.{key}" if self.field else key, "is missing")
        return found

    def items(self, count: int | None = None) -> list["Node"]:
        """The entries of a list; ``count`` of them if that is given."""
        if not isinstance(self.value, list):
            raise self.fault(f"must be a list, is {_kind(self.value)}")
        if count not in (None, len(self.value)):
            raise self.fault(f"must have {count} entries, has {len(self.value)}")
        return [Node(v, self.file, f"{self.field}[{i}]") for i, v in enumerate(self.value)]

    def whole(self) -> int:
        """An integer; 3.0 and "3" count."""
        value = self.value
        if isinstance(value, str) and len(value) < 19 and value.strip().isdecimal():
            return int(value)
        if isinstance(value, bool) or not isinstance(value, int | float) or value % 1 != 0:
            raise self.fault(f"must be an integer, is {_shown(value)}")
        if abs(value) > LARGEST:
            raise self.fault(f"is {value:.2g}, which is no number of anything here")
        return int(value)

    def number(self) -> float:
        """A finite number."""
        return float(self.array())

    def text(self) -> str:
        """A string that is not empty."""
        if not isinstance(self.value, str) or not self.value.strip():
            raise self.fault(f"must be a text, is {_shown(self.value)}")
        return self.value

    def array(self, *shape: int) -> FloatArray:
        """Finite numbers of the given shape; -1 stands for any length."""
        for leaf in _leaves(self.value):
            if isinstance(leaf, bool) or not isinstance(leaf, int | float):
                raise self.fault(f"must hold numbers only, holds {_shown(leaf)}")
        try:
            array = np.array(self.value, np.float64)
        except (ValueError, OverflowError):
            raise self.fault(f"must be {_shape(shape)}, its rows differ in length") from None
        if array.ndim != len(shape) or any(
            w not in (-1, n) for w, n in zip(shape, array.shape, strict=True)
        ):
            raise self.fault(f"must be {_shape(shape)}, is {_shape(array.shape)}")
        if not np.isfinite(array).all():
            raise self.fault("holds a NaN or an infinity")
        if (most := np.abs(array).max(initial=0)) > LARGEST:
            raise self.fault(f"holds {most:.2g}, which is no number of anything here")
        return array

    def rigid(self) -> FloatArray:
        """(4, 4) rotation and translation; the rotation is made exact."""
        return exactly_rigid(self.array(4, 4), str(self.file), self.field)


def exactly_rigid(T: FloatArray, file: str, field: str) -> FloatArray:
    """A stored (4, 4) transformation with the nearest true rotation in it.

    Raises:
        Fault: It is not a rotation and a translation (within `SAME_ROTATION`).
    """
    R = T[:3, :3]
    if not np.allclose(T[3], (0, 0, 0, 1), atol=1e-6):
        raise Fault(file, field, f"last row must be 0 0 0 1, is {' '.join(f'{x:g}' for x in T[3])}")
    off = float(np.abs(R @ R.T - np.eye(3)).max())
    if not off < SAME_ROTATION:
        raise Fault(file, field, f"upper left 3 × 3 is no rotation: R Rᵀ is off by {off:.2g}")
    u, _, vt = np.linalg.svd(R)
    if np.linalg.det(R) < 0:
        raise Fault(file, field, "upper left 3 × 3 mirrors (determinant -1); it must rotate only")
    exact = np.eye(4)
    exact[:3, :3], exact[:3, 3] = u @ vt, T[:3, 3]
    return exact


def exists(path: Path) -> bool:
    """Whether there is a file, of a name that may be no name at all."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def read_json(path: Path) -> Node:
    """A JSON file, to be read through its `Node`.

    Raises:
        Fault: It is missing, unreadable or not JSON.
    """
    try:
        return Node(json.loads(read_text(path)), path)
    except (ValueError, RecursionError) as error:
        if isinstance(error, Fault):
            raise
        raise Fault(str(path), "", f"is not JSON ({error})") from None


def read_text(path: Path) -> str:
    """A UTF-8 text file.

    Raises:
        Fault: It is missing, unreadable or not text.
    """
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise Fault(str(path), "", "is missing" if _absent(error) else str(error)) from None
    except ValueError:
        raise Fault(str(path), "", "is not a text file") from None


def read_lines(path: Path) -> list[str]:
    """The lines of a list of names, empty ones left out."""
    return [line.strip() for line in read_text(path).splitlines() if line.strip()]


def read_points(path: Path) -> FloatArray:
    """(N, 3) points of an ``.xyz`` file; further columns are left out.

    Raises:
        Fault: It is missing or holds anything else.
    """
    rows = [line.split() for line in read_lines(path)]
    try:
        points = np.array(rows, np.float64)
    except ValueError:
        raise Fault(str(path), "", "must hold three numbers a line") from None
    if points.ndim != 2 or points.shape[1] < 3 or len(points) < 4:
        raise Fault(str(path), "", "must hold at least four lines of three numbers")
    if not np.isfinite(points).all():
        raise Fault(str(path), "", "holds a NaN or an infinity")
    return points[:, :3]


def read_xml(path: Path) -> ElementTree.Element:
    """The root of an XML file.

    Raises:
        Fault: It is missing or not XML.
    """
    try:
        return ElementTree.fromstring(read_text(path))
    except ElementTree.ParseError as error:
        raise Fault(str(path), "", f"is not XML ({error})") from None


def _absent(error: OSError) -> bool:
    return isinstance(error, FileNotFoundError | NotADirectoryError)


def _leaves(value: Any) -> Iterator[Any]:
    if isinstance(value, list):
        for entry in value:
            yield from _leaves(entry)
    else:
        yield value


def _kind(value: Any) -> str:
    names = {dict: "an object", list: "a list", str: "a text", bool: "true or false"}
    if value is None:
        return "null"
    return names.get(type(value), "a number")


def _shown(value: Any) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        return "not finite"
    text = json.dumps(value)
    return text if len(text) < 40 else f"{_kind(value)} of {len(text)} characters"


def _shape(shape: tuple[int, ...]) -> str:
    sizes = " × ".join("n" if n == -1 else str(n) for n in shape)
    return f"{sizes} numbers" if shape else "a number"
