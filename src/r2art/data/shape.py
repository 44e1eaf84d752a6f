"""An object instance as geometry: parts made of textured surfaces, and the joints between.

Everything is given at rest in the root frame (see `r2art.core.category`), in metres.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Joint
from r2art.data.staging import Rest

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True)
class Material:
    """How a surface looks.

    Attributes:
        color: sRGB base colour, each channel in [0, 1].
        roughness: GGX roughness in [0.05, 1].
        metallic: 0 for dielectrics, 1 for metals.
        texture: (H, W, 3) uint8 sRGB image that multiplies ``color``; uv (0, 0) is its lower
            left corner, and it repeats.
        emission: Share of the base colour that glows by itself (a lit screen), 0 to 1+.
    """

    color: tuple[float, float, float] = (0.7, 0.7, 0.7)
    roughness: float = 0.5
    metallic: float = 0.0
    texture: NDArray[np.uint8] | None = field(default=None, repr=False)
    emission: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Surface:
    """Triangles of one material.

    Attributes:
        vertices: (V, 3) at rest, in the root frame.
        faces: (F, 3) vertex indices, counter-clockwise seen from outside.
        normals: (V, 3) unit shading normals (split vertices where an edge is hard).
        uv: (V, 2) texture coordinates.
        material: Its look.
    """

    vertices: FloatArray
    faces: NDArray[np.integer]
    normals: FloatArray
    uv: FloatArray
    material: Material


@dataclass(frozen=True, kw_only=True)
class Instance:
    """One object: P parts of one or more surfaces each, and P - 1 joints.

    The root frame's origin must be the centre of part 0's box (`assembled` sees to it).
    ``rests`` are the ways in which this one may lie on the ground, where its category's
    staging does not fit it.
    """

    category: str
    part_names: tuple[str, ...]
    parts: tuple[tuple[Surface, ...], ...]
    joints: tuple[Joint, ...]
    rests: tuple[Rest, ...] = ()

    def part_boxes(self) -> tuple[FloatArray, FloatArray]:
        """Centre and size, (P, 3) each, of the axis-aligned box of every part at rest."""
        lower = np.stack([np.concatenate([s.vertices for s in p]).min(axis=0) for p in self.parts])
        upper = np.stack([np.concatenate([s.vertices for s in p]).max(axis=0) for p in self.parts])
        return (lower + upper) / 2, upper - lower
