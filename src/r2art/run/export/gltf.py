"""A binary glTF 2.0 file as it is built: lists of things, and the one buffer they point into.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html. Written by hand because the files are
small and importing a mesh library takes longer than the prediction itself.
"""

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from r2art.core.palette import Color

FloatArray = NDArray[np.floating]

TRIANGLES, LINES = 4, 1
FLOAT, UINT16 = 5126, 5123
VERTICES, INDICES = 34962, 34963
WIDTHS = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}


class Document:
    """Collects nodes, meshes and animations; each method returns the index of what it adds."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._lists: dict[str, list[dict[str, Any]]] = {}

    def _add(self, kind: str, item: dict[str, Any]) -> int:
        items = self._lists.setdefault(kind, [])
        items.append(item)
        return len(items) - 1

    def node(self, name: str, matrix: FloatArray | None = None, **more: Any) -> int:
        """A node; one that moves has ``translation`` and ``rotation`` in place of a matrix."""
        if matrix is not None:
            more["matrix"] = np.asarray(matrix).T.ravel().tolist()  # column-major
        return self._add("nodes", {"name": name, **more})

    def adopt(self, parent: int, children: list[int]) -> None:
        """Hang nodes below another."""
        if children:
            self._lists["nodes"][parent].setdefault("children", []).extend(children)

    def mesh(self, name: str, primitives: list[dict[str, Any]]) -> int:
        """A mesh of some `primitive`."""
        return self._add("meshes", {"name": name, "primitives": primitives})

    def camera(self, yfov: float, aspect: float) -> int:
        """A perspective camera; ``yfov`` in radians."""
        view = {"yfov": yfov, "aspectRatio": aspect, "znear": 0.01}
        return self._add("cameras", {"type": "perspective", "perspective": view})

    def animation(
        self, name: str, node: int, path: str, seconds: FloatArray, values: FloatArray
    ) -> int:
        """Moves one node's ``path`` (translation or rotation) through values at (T,) times."""
        sampler = {
            "input": self._floats(seconds[:, None], bounded=True),
            "output": self._floats(values),
            "interpolation": "LINEAR",
        }
        channel = {"sampler": 0, "target": {"node": node, "path": path}}
        return self._add("animations", {"name": name, "samplers": [sampler], "channels": [channel]})

    def primitive(
        self,
        positions: FloatArray,
        indices: NDArray[np.integer],
        color: Color,
        alpha: float = 1.0,
        normals: FloatArray | None = None,
    ) -> dict[str, Any]:
        """Triangles (with normals) or lines (without) of one colour."""
        attributes = {"POSITION": self._floats(positions, bounded=True, target=VERTICES)}
        if normals is not None:
            attributes["NORMAL"] = self._floats(normals, target=VERTICES)
        corners = self._accessor(indices.astype("<u2").reshape(-1, 1), UINT16, INDICES)
        return {
            "attributes": attributes,
            "indices": corners,
            "material": self._material(color, alpha),
            "mode": LINES if normals is None else TRIANGLES,
        }

    def _floats(self, rows: FloatArray, *, bounded: bool = False, target: int | None = None) -> int:
        rows = rows.astype("<f4")
        limits = {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        return self._accessor(rows, FLOAT, target, **(limits if bounded else {}))

    def _accessor(
        self, rows: NDArray[Any], component: int, target: int | None, **limits: Any
    ) -> int:
        self._buffer.extend(bytes(-len(self._buffer) % 4))
        data = rows.tobytes()
        view = {"buffer": 0, "byteOffset": len(self._buffer), "byteLength": len(data)}
        if target is not None:
            view["target"] = target
        self._buffer.extend(data)
        accessor = {
            "bufferView": self._add("bufferViews", view),
            "componentType": component,
            "count": len(rows),
            "type": WIDTHS[rows.shape[1]],
            **limits,
        }
        return self._add("accessors", accessor)

    def _material(self, color: Color, alpha: float) -> int:
        # glTF wants linear light, the palette is sRGB.
        linear = [float(np.round((c / 255) ** 2.2, 4)) for c in color]
        surface = {
            "baseColorFactor": [*linear, alpha],
            "metallicFactor": 0.0,
            "roughnessFactor": 0.8,
        }
        material = {"pbrMetallicRoughness": surface, "doubleSided": True}
        if alpha < 1:
            material["alphaMode"] = "BLEND"
        return self._add("materials", material)

    def finish(self, roots: list[int]) -> bytes:
        """The bytes of the ``.glb`` file whose scene begins at these nodes."""
        self._buffer.extend(bytes(-len(self._buffer) % 4))
        document = {
            "asset": {"version": "2.0", "generator": "r2art"},
            "scene": 0,
            "scenes": [{"nodes": roots}],
            **self._lists,
            "buffers": [{"byteLength": len(self._buffer)}],
        }
        text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        body = _chunk(b"JSON", text) + _chunk(b"BIN\0", bytes(self._buffer))
        return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack("<I4s", len(data), kind) + data
