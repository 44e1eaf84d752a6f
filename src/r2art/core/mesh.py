"""Triangles of an object's parts. Data, never code."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Mesh:
    """All parts of an object at rest, in its root frame (m).

    Attributes:
        vertices: (V, 3).
        faces: (F, 3) their indices, counter-clockwise seen from outside.
        part: (V,) which part each vertex belongs to.
    """

    vertices: NDArray[np.floating]
    faces: NDArray[np.integer]
    part: NDArray[np.integer]
