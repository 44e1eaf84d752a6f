"""Reading XML that people wrote: every fault is one line that names file, element and remedy."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from r2art.core.errors import InputError
from r2art.data.models.model import rigid

FloatArray = NDArray[np.floating]


def parse(path: Path, tag: str) -> ET.Element:
    """The root element of a file, which must be a ``tag``.

    Raises:
        InputError: The file cannot be read, is not XML, or its root is another element.
    """
    try:
        root = ET.parse(path).getroot()
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}; give an existing file") from None
    except (ET.ParseError, UnicodeError, ValueError) as error:
        raise InputError(f"{path} is not XML ({error}); repair it") from None
    if root.tag != tag:
        raise InputError(f"{path} is a <{root.tag}>, not a <{tag}>; give another file")
    return root


def numbers(
    element: ET.Element | None, attribute: str, default: str | None, count: int, where: str
) -> FloatArray:
    """(count,) finite numbers of an attribute.

    Args:
        element: Its element; None: there is none.
        attribute: Its name.
        default: Its value where it is missing; None: it must not be.
        count: How many numbers there must be.
        where: File and element, for the message.

    Raises:
        InputError: It is missing, or not so many finite numbers.
    """
    text = default if element is None else element.get(attribute, default)
    if text is None:
        raise InputError(f"{where}: {attribute!r} is missing; give {_many(count)}")
    try:
        values = np.array([float(word) for word in text.replace(",", " ").split()])
    except ValueError:
        values = np.array([np.nan])
    if len(values) != count or not np.isfinite(values).all():
        raise InputError(f"{where}: {attribute}={text!r} must be {_many(count)}")
    return values


def number(element: ET.Element | None, attribute: str, default: str | None, where: str) -> float:
    """One finite number, see `numbers`."""
    return float(numbers(element, attribute, default, 1, where)[0])


def _many(count: int) -> str:
    return "a finite number" if count == 1 else f"{count} finite numbers"


def named(element: ET.Element | None, attribute: str, where: str) -> str:
    """An attribute's text.

    Raises:
        InputError: There is none.
    """
    text = None if element is None else element.get(attribute)
    if not text:
        raise InputError(f"{where}: {attribute!r} is missing; name it")
    return text


def origin(element: ET.Element, where: str) -> FloatArray:
    """(4, 4) pose of an element's ``<origin xyz rpy>``; the identity without one."""
    child = element.find("origin")
    xyz = numbers(child, "xyz", "0 0 0", 3, f"{where}, origin")
    roll, pitch, yaw = numbers(child, "rpy", "0 0 0", 3, f"{where}, origin")
    return rigid(_turn(2, yaw) @ _turn(1, pitch) @ _turn(0, roll), xyz)


def _turn(axis: int, angle: float) -> FloatArray:
    R = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[i, i] = R[j, j] = np.cos(angle)
    R[j, i], R[i, j] = np.sin(angle), -np.sin(angle)
    return R


def unit(axis: FloatArray, where: str) -> FloatArray:
    """The unit vector along an axis.

    Raises:
        InputError: It is zero.
    """
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        raise InputError(f"{where}: the axis is zero; give a direction such as '0 0 1'")
    return axis / length
