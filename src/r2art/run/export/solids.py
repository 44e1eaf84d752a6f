"""What URDF and MJCF share: a guess at masses, distinct names, and numbers as XML text."""

from collections.abc import Iterable
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from r2art.core.prediction import PartEstimate

FloatArray = NDArray[np.floating]

CAMERA = "opencv_camera"
"""Name of the camera's frame, whose axes are those of the prediction."""
OPACITY = 0.8
"""Of part boxes, so that one sees what is inside."""
DENSITY = 300.0
"""kg/m³ of every part's box. A photo tells no mass; physics engines want one all the same."""
THINNEST = 1e-3
"""m; boxes are taken to be at least so thick where masses are reckoned."""


def mass_and_inertia(part: PartEstimate) -> tuple[float, FloatArray]:
    """Mass (kg) of a part's box, and its moments (3,) of inertia about its centre (kg m²)."""
    size = np.maximum(part.box_size, THINNEST)
    mass = DENSITY * float(np.prod(size))
    squares = size**2
    return mass, mass / 12 * (squares.sum() - squares)


def distinct(name: str, taken: Iterable[str]) -> str:
    """The name, with underscores appended until it is none of those taken."""
    known = set(taken)
    while name in known:
        name += "_"
    return name


def numbers(*values: float) -> str:
    """Numbers as an XML attribute holds them, to twelve digits."""
    return " ".join(f"{float(v) + 0.0:.12g}" for v in values)


def document(root: ElementTree.Element) -> bytes:
    """The bytes of an indented XML file."""
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n"
