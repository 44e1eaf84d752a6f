"""Few triangles that look like many: the mesh by which refinement knows an object's outline.

Edges collapse onto one of their ends, cheapest first (Garland and Heckbert, *Surface
Simplification Using Quadric Error Metrics*, 1997). Planes count by their area, so what is tiny
goes first, and ends are vertices of the mesh, so that corners stay where they are.
"""

import heapq
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from r2art.core.mesh import Mesh
from r2art.data.shape import Surface

FloatArray = NDArray[np.floating]
Indices = NDArray[np.integer]

FACES = 500
"""Triangles of a part."""
WELDED = 1e-5
"""Vertices this near, as a share of the part's longest side, are one."""
STRAIGHT = 0.2
"""Least cosine between a triangle's normals before and after a collapse."""


def coarse_mesh(parts: Sequence[Sequence[Surface]], faces: int = FACES) -> Mesh:
    """All parts as one mesh of at most about ``faces`` triangles each."""
    meshes = [simplified(*_welded(part), faces) for part in parts]
    start = np.cumsum([0, *(len(v) for v, _ in meshes)])
    return Mesh(
        vertices=np.concatenate([v for v, _ in meshes]),
        faces=np.concatenate([f + s for (_, f), s in zip(meshes, start, strict=False)]),
        part=np.repeat(np.arange(len(meshes)), np.diff(start)),
    )


def _welded(part: Sequence[Surface]) -> tuple[FloatArray, Indices]:
    """Vertices and faces of a part, without seams between surfaces."""
    vertices = np.concatenate([s.vertices for s in part])
    start = np.cumsum([0, *(len(s.vertices) for s in part)])
    faces = np.concatenate([s.faces + n for s, n in zip(part, start, strict=False)])
    steps = np.round(vertices / (WELDED * np.ptp(vertices, axis=0).max())).astype(np.int64)
    _, first, place = np.unique(steps, axis=0, return_index=True, return_inverse=True)
    return vertices[first], _proper(place.reshape(-1)[faces])


def simplified(vertices: FloatArray, faces: Indices, count: int) -> tuple[FloatArray, Indices]:
    """At most ``count`` triangles, or somewhat more where no further edge can collapse.

    Args:
        vertices: (V, 3).
        faces: (F, 3) of three different vertices each.
        count: How many triangles may stay.
    """
    if len(faces) > count:
        faces = _Collapse(vertices, faces).until(count)
    kept, faces = np.unique(faces, return_inverse=True)
    return vertices[kept], faces.reshape(-1, 3)


class _Collapse:
    """A mesh while its edges collapse."""

    def __init__(self, vertices: FloatArray, faces: Indices) -> None:
        self.place: list[list[float]] = vertices.tolist()
        self.faces: list[list[int]] = faces.tolist()
        self.around: dict[int, set[int]] = {v: set() for v in np.unique(faces).tolist()}
        for i, face in enumerate(self.faces):
            for v in face:
                self.around[v].add(i)
        self.quadric = _quadrics(vertices, faces).tolist()
        self.age = [0] * len(vertices)
        self.heap: list[tuple[float, int, int, int, int]] = []
        for v in self.around:
            self._offer(v, {w for w in self._beside(v) if w > v})

    def until(self, count: int) -> Indices:
        """Collapse the cheapest edges while there are more than ``count`` faces."""
        left = len(self.faces)
        while left > count and self.heap:
            _, gone, kept, *ages = heapq.heappop(self.heap)
            if ages == [self.age[gone], self.age[kept]] and self._may(gone, kept):
                left -= self._merge(gone, kept)
        kept = sorted(set[int]().union(*self.around.values()))
        return np.array([self.faces[i] for i in kept])

    def _beside(self, v: int) -> set[int]:
        return {w for i in self.around[v] for w in self.faces[i]} - {v}

    def _offer(self, v: int, others: set[int]) -> None:
        """Put both ways in which the edges from ``v`` can collapse on the heap."""
        for w in others:
            q = _sum(self.quadric[v], self.quadric[w])
            for gone, kept in ((v, w), (w, v)):
                cost = _cost(q, self.place[kept])
                heapq.heappush(self.heap, (cost, gone, kept, self.age[gone], self.age[kept]))

    def _may(self, gone: int, kept: int) -> bool:
        """Whether no triangle turns over."""
        for i in self.around[gone]:
            face = self.faces[i]
            if kept in face:
                continue
            before = _normal(*[self.place[v] for v in face])
            after = _normal(*[self.place[kept if v == gone else v] for v in face])
            product = sum(a * b for a, b in zip(before, after, strict=True))
            lengths = sum(a * a for a in before) * sum(a * a for a in after)
            if product <= STRAIGHT * lengths**0.5:
                return False
        return True

    def _merge(self, gone: int, kept: int) -> int:
        """Let ``gone`` fall into ``kept``; how many faces vanish."""
        vanished = self.around[gone] & self.around[kept]
        for i in vanished:
            for v in self.faces[i]:
                self.around[v].discard(i)
        for i in self.around.pop(gone):
            self.faces[i] = [kept if v == gone else v for v in self.faces[i]]
            self.around[kept].add(i)
        self.quadric[kept] = _sum(self.quadric[gone], self.quadric[kept])
        self.age[gone] += 1
        self.age[kept] += 1
        self._offer(kept, self._beside(kept))
        return len(vanished)


def _quadrics(vertices: FloatArray, faces: Indices) -> FloatArray:
    """(V, 10) of every vertex, the sum over its triangles' planes n·x + d = 0 of area times the
    products of (n, d): the upper triangle of a symmetric matrix.

    An edge without a triangle on its other side has one more plane, at a right angle to it.
    """
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-300)
    normal, area = normal / length, length[:, 0] / 2
    planes = [_products(normal, corners[:, 0]) * area[:, None]] * 3
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    low, high = np.sort(ends, axis=1).T
    _, place, count = np.unique(low * len(vertices) + high, return_inverse=True, return_counts=True)
    open_edges = np.flatnonzero(count[place.reshape(-1)] == 1)
    a, b = ends[open_edges].T
    along = vertices[b] - vertices[a]
    across = np.cross(along, normal[open_edges // 3])
    size = np.linalg.norm(across, axis=-1, keepdims=True)
    fence = _products(across / np.maximum(size, 1e-300), vertices[a]) * size**2
    quadrics = np.zeros((len(vertices), 10))
    np.add.at(quadrics, faces.T.ravel(), np.concatenate(planes))
    np.add.at(quadrics, np.concatenate([a, b]), np.concatenate([fence, fence]))
    return quadrics


def _products(normal: FloatArray, point: FloatArray) -> FloatArray:
    """(N, 10) of planes through points."""
    plane = np.concatenate([normal, -(normal * point).sum(axis=-1, keepdims=True)], axis=-1)
    i, j = np.triu_indices(4)
    return plane[:, i] * plane[:, j]


def _cost(q: list[float], x: list[float]) -> float:
    a, b, c = x
    return (
        q[0] * a * a + q[4] * b * b + q[7] * c * c + q[9]
        + 2 * (q[1] * a * b + q[2] * a * c + q[5] * b * c + q[3] * a + q[6] * b + q[8] * c)
    )  # fmt: skip


def _sum(a: list[float], b: list[float]) -> list[float]:
    return [x + y for x, y in zip(a, b, strict=True)]


def _normal(a: list[float], b: list[float], c: list[float]) -> tuple[float, float, float]:
    """Of a triangle, as long as it is large."""
    px, py, pz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    qx, qy, qz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    return py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx


def _proper(faces: Indices) -> Indices:
    """Triangles of three different vertices."""
    return faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
