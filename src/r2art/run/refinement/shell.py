"""The surface of a body as triangles, and which of their edges make its outline.

Letters: S starts, P parts, V vertices, F faces, E edges, N edges on outlines.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from r2art.core.mesh import Mesh

FloatArray = NDArray[np.floating]
Indices = NDArray[np.integer]


@dataclass(frozen=True, kw_only=True, eq=False)
class Shell:
    """Triangles at rest, in the root frame (m).

    Attributes:
        vertices: (V, 3).
        part: (V,) that each belongs to, in ascending order.
        edges: (E, 2) vertices.
        beside: (E, 2) the face that has the edge in this direction, and one that has it in the
            other; F: none has.
        face_part: (F + 1,) the part of each face, likewise.
        normals: (F + 1, 3) outward, of any length; 0 of the face that is none ...
        offsets: (F + 1,) ... and the coordinate of its plane along it.
    """

    vertices: FloatArray
    part: Indices
    edges: Indices
    beside: Indices
    face_part: Indices
    normals: FloatArray
    offsets: FloatArray

    @cached_property
    def of_part(self) -> tuple[tuple[slice, slice], ...]:
        """The vertices and the faces of every part."""
        parts = np.arange(self.part.max() + 2)
        vertices, faces = (np.searchsorted(a, parts) for a in (self.part, self.face_part))
        return tuple(
            (slice(vertices[p], vertices[p + 1]), slice(faces[p], faces[p + 1])) for p in parts[:-1]
        )

    def placed(self, at_rest: FloatArray, rotation: FloatArray, shift: FloatArray) -> FloatArray:
        """(S, 3, V) the vertices where (S, P, 3, 3) rotations and (S, P, 3) shifts have them.

        Args:
            at_rest: (S or 1, 3, V) the vertices, scaled.
            rotation: Of every part ...
            shift: ... and where its origin goes (m).
        """
        result = np.empty((len(rotation), *at_rest.shape[1:]))
        for p, (own, _) in enumerate(self.of_part):
            result[..., own] = rotation[:, p] @ at_rest[..., own] + shift[:, p, :, None]
        return result

    def stretched(self, old: FloatArray, new: FloatArray, scale: FloatArray) -> "Shell":
        """With every part, (P, 3) of it at ``old``, scaled about its centre and put to ``new``."""
        by_vertex, by_face = scale[self.part], scale[self.face_part]
        normals = self.normals / by_face
        inside = self.offsets - (self.normals * old[self.face_part]).sum(axis=-1)
        return replace(
            self,
            vertices=new[self.part] + by_vertex * (self.vertices - old[self.part]),
            normals=normals,
            offsets=inside + (normals * new[self.face_part]).sum(axis=-1),
        )

    def outline(self, eye: FloatArray) -> tuple[Indices, Indices, FloatArray]:
        """Edges between faces seen from the front and others.

        The faces that a camera sees from the front cover a closed surface's silhouette; the
        edges at which they end, with the faces to their left, bound it. Further ones bound what
        is seen of a hollow or a bump inside it.

        Args:
            eye: (S, P, 3) the camera's place in the frame of every part.

        Returns:
            (N,) start and edge, and +1 or −1 where the edge runs the other way round.
        """
        front = np.empty((len(eye), len(self.offsets)), bool)
        for p, (_, own) in enumerate(self.of_part):
            front[:, own] = eye[:, p] @ self.normals[own].T > self.offsets[own]
        first, second = front[:, self.beside[:, 0]], front[:, self.beside[:, 1]]
        start, edge = np.nonzero(first != second)
        return start, edge, np.where(first[start, edge], 1.0, -1.0)


def shell_of(mesh: Mesh) -> Shell:
    """The triangles of a category's mean object, with what is next to what."""
    order = np.argsort(mesh.part, kind="stable")
    part = np.asarray(mesh.part, np.intp)[order]
    vertices = np.asarray(mesh.vertices, float)[order]
    faces = np.argsort(order)[np.asarray(mesh.faces, np.intp)]
    faces = faces[np.argsort(part[faces[:, 0]], kind="stable")]
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    offsets = (normals * corners[:, 0]).sum(axis=-1)
    edges, beside = _edges(faces)
    return Shell(
        vertices=vertices,
        part=part,
        edges=edges,
        beside=beside,
        face_part=np.append(part[faces[:, 0]], part[-1]),
        normals=np.concatenate([normals, np.zeros((1, 3))]),
        offsets=np.append(offsets, 0.0),
    )


def _edges(faces: Indices) -> tuple[Indices, Indices]:
    """(E, 2) edges and the faces beside them, ``len(faces)`` where there is none.

    Where more than two faces meet, they are paired in any order: outlines add up to the same.
    """
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    low, high = ends.min(axis=1), ends.max(axis=1)
    turned = ends[:, 0] > ends[:, 1]
    order = np.lexsort([turned, high, low])
    waiting: dict[tuple[int, int], list[int]] = {}
    edges, beside = [], []
    for half in order.tolist():
        key = (int(low[half]), int(high[half]))
        if turned[half] and waiting.get(key):
            beside[waiting[key].pop()][1] = half // 3
            continue
        if not turned[half]:
            waiting.setdefault(key, []).append(len(edges))
        edges.append(ends[half].tolist())
        beside.append([half // 3, len(faces)])
    return np.array(edges, np.intp), np.array(beside, np.intp)
