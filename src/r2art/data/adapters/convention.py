"""What outsiders cannot know of a dataset's conventions: stated, with the likeliest values.

Look at ``r2art data show``: where its arrows point wrongly, write what is right into
``r2art.json`` in the dataset's folder, and every command follows.
"""

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from r2art.core.errors import R2ArtError, UsageError
from r2art.data.adapters.reading import Node, read_json
from r2art.data.source import Fault

FILE = "r2art.json"
Direction = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
DIRECTIONS = get_args(Direction)
_LISTS = {"flip": bool, "closed": float, "order": int, "fix": str}


@dataclass(frozen=True, kw_only=True)
class Convention:
    """How to read a dataset where its files leave it open.

    Attributes:
        up: Direction of the dataset's object frame that points up ...
        front: ... and that points to the front, towards the object's user.
        left_handed: Whether annotated angles turn by the left-hand rule (Unity's).
        negate_second: Whether the second component of every joint axis changes its sign.
        order: The dataset's part at each of our places; empty: as they are numbered.
        flip: Per joint, whether its positive side is that against the dataset's axis; empty:
            none's is; None: it is the side on which most of an object's annotated states lie.
        closed: Per joint, the state (rad or m, our sign) at which it is closed; empty: the
            dataset's rest pose is.
        unit: Metres per unit of length.
        fix: Joints of a URDF that are held still (a gripper's fingers, say).
        parts: Of the drawers of ReArt: 2 or 4; objects of the other number are left out.
        file: Where all this is written; empty if it is not.
    """

    up: Direction = "+y"
    front: Direction = "+z"
    left_handed: bool = True
    negate_second: bool = False
    order: tuple[int, ...] = ()
    flip: tuple[bool, ...] | None = None
    closed: tuple[float, ...] = ()
    unit: float = 1.0
    fix: tuple[str, ...] = ()
    parts: int = 2
    file: str = ""

    def __post_init__(self) -> None:
        if self.up not in DIRECTIONS or self.front not in DIRECTIONS:
            raise UsageError(f"up and front must be of {', '.join(DIRECTIONS)}")
        if self.up[1] == self.front[1]:
            raise UsageError(f"up {self.up} and front {self.front} must not lie on one axis")
        if not self.unit > 0:
            raise UsageError(f"unit must be positive metres, is {self.unit:g}")

    def rotation(self) -> NDArray[np.float64]:
        """(3, 3) from the dataset's axes to ours: x right, y up, z front."""
        up, front = (
            (1.0 if d[0] == "+" else -1.0) * np.eye(3)["xyz".index(d[1])]
            for d in (self.up, self.front)
        )
        return np.stack([np.cross(up, front), up, front])

    def check(self, parts: int) -> None:
        """Hold it against the number of parts of a category.

        Raises:
            UsageError: ``order``, ``flip`` or ``closed`` is of another length; `Fault` if a file
                says so.
        """
        if sorted(self.order) not in ([], list(range(parts))):
            raise self._wrong("order", f"must name parts 0 to {parts - 1} once each")
        for name in ("closed", "flip"):
            if len(getattr(self, name) or ()) not in (0, parts - 1):
                raise self._wrong(
                    name, f"must have as many entries as there are joints: {parts - 1}"
                )

    def _wrong(self, name: str, problem: str) -> R2ArtError:
        return Fault(self.file, name, problem) if self.file else UsageError(f"{name} {problem}")

    def links(self, parts: int) -> list[int]:
        """The dataset's number of each of our parts."""
        return list(self.order or range(parts))

    def closed_state(self, joints: int) -> NDArray[np.float64]:
        """(J,) the closed states."""
        return np.array(self.closed or [0.0] * joints, np.float64)


def convention_of(
    folders: tuple[Path, ...],
    category: str,
    default: Convention = Convention(),
) -> Convention:
    """What the ``r2art.json`` of the first of some folders says, the rest as in ``default``.

    The file holds the fields of `Convention`, or such an object for each category.

    Raises:
        Fault: It holds anything else.
    """
    for path in (folder / FILE for folder in folders):
        if path.exists():
            return _read(path, category, default)
    return default


def _read(path: Path, category: str, default: Convention) -> Convention:
    node = read_json(path)
    node = node.get(category) or node
    known = {f.name: f for f in fields(Convention) if f.name != "file"}
    values = {}
    for key in node.value:
        field = node[key]
        if key not in known:
            if isinstance(field.value, dict):  # of another category
                continue
            raise field.fault(f"is unknown; known: {', '.join(known)}")
        values[key] = _value(field, key)
    try:
        return replace(default, file=str(path), **values)
    except UsageError as error:
        raise Fault(str(path), "", str(error)) from None


def _value(field: Node, key: str) -> object:
    if key in _LISTS:
        return tuple(_scalar(entry, _LISTS[key]) for entry in field.items())
    default = getattr(Convention(), key)
    return _scalar(field, type(default))


def _scalar(field: Node, kind: type) -> object:
    if kind is float:
        return field.number()
    if kind is int:
        return field.whole()
    if kind is str:
        return field.text()
    if not isinstance(field.value, bool):
        raise field.fault("must be true or false")
    return field.value
