"""The object that refinement moves: surface points on articulated parts.

NumPy alone. Letters: S starts, P parts, J joints, M points per part, D degrees of freedom:
rotation (3, rad, about the anchor, camera axes), the anchor's x/z, y/z and log z, joint states
(J), how far masks reach beyond the object (1), and optionally part log-scales (3 P). Metres,
OpenCV camera axes.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Category
from r2art.run.refinement.shell import Shell, shell_of

FloatArray = NDArray[np.floating]
IMAGE_FREEDOM = 6
"""Degrees of freedom of the root: they come first."""
OUTLINE_POINTS = 128
"""Per part, besides its tips."""


@dataclass(frozen=True, kw_only=True)
class Body:
    """An instance of a category at rest, in its root frame.

    Attributes:
        parent: Part that each joint hangs on.
        prismatic: (J,) whether it slides.
        axis: (J, 3) unit direction.
        pivot: (J, 3) a point on its line (m).
        limits: (J, 2) least and greatest state (rad, m).
        center: (P, 3) centre of each part's box (m).
        size: (P, 3) extents of each part's box (m).
        points: (P, 3, M) on the surface (m), in an order of which every beginning is spread, too.
        patches: (P, 3, M) unit normals times the surface (m²) that each point stands for.
        tips: (P, 3, V) points where the parts reach farthest, for their outlines.
        shell: Its surface as triangles, where the category has them.
    """

    parent: tuple[int, ...]
    prismatic: NDArray[np.bool_]
    axis: FloatArray
    pivot: FloatArray
    limits: FloatArray
    center: FloatArray
    size: FloatArray
    points: FloatArray
    patches: FloatArray
    tips: FloatArray
    shell: Shell | None = None

    @cached_property
    def anchor(self) -> FloatArray:
        """(3,) the root-frame point about which the object is turned: the middle of its boxes."""
        low, high = self.center - self.size / 2, self.center + self.size / 2
        return (low.min(axis=0) + high.max(axis=0)) / 2

    @cached_property
    def local(self) -> FloatArray:
        """(P, 3, M) the points from the centre of their part's box (m)."""
        return self.points - self.center[..., None]

    @property
    def freedom(self) -> int:
        """Degrees of freedom but for the parts' scales."""
        return self.border + 1

    @property
    def border(self) -> int:
        """The degree of freedom by which masks reach beyond the object."""
        return IMAGE_FREEDOM + len(self.parent)

    @cached_property
    def carried(self) -> NDArray[np.bool_]:
        """(J, P) whether a joint moves a part."""
        result = np.zeros((len(self.parent), len(self.center)), bool)
        for j, parent in enumerate(self.parent):
            result[:, j + 1] = result[:, parent]
            result[j, j + 1] = True
        return result

    @cached_property
    def turns(self) -> FloatArray:
        """(J, 3, 3) the matrix that multiplies by a joint's axis: ``axis × v``."""
        return np.cross(self.axis[:, None], np.eye(3)).swapaxes(-1, -2)

    def thinned(self, count: int) -> "Body":
        """The body by ``count`` points in all, each of which stands for those next to it."""
        keep = max(8, min(self.points.shape[2], round(count / len(self.points))))
        parts = [_thin(x.T, m.T, keep) for x, m in zip(self.points, self.patches, strict=True)]
        points, patches = (np.stack(a).transpose(0, 2, 1).copy() for a in zip(*parts, strict=True))
        return replace(self, points=points, patches=patches)

    def stretched(self, box_center: FloatArray, box_size: FloatArray) -> "Body":
        """The instance with these part boxes, as `r2art.method.shape.deform` makes it."""
        scale = box_size / self.size
        patches = self.patches * (scale.prod(axis=-1, keepdims=True) / scale)[..., None]
        pivot = box_center[1:] + scale[1:] * (self.pivot - self.center[1:])
        return replace(
            self,
            center=np.asarray(box_center, float),
            size=np.asarray(box_size, float),
            pivot=pivot,
            points=box_center[..., None] + scale[..., None] * self.local,
            patches=patches,
            tips=box_center[..., None] + scale[..., None] * (self.tips - self.center[..., None]),
            shell=self.shell and self.shell.stretched(self.center, box_center, scale),
        )

    def outlined(self) -> "Body":
        """The tips alone, with a few hundred of the points, as a body without surface."""
        points = np.concatenate([self.tips, self.points[..., :OUTLINE_POINTS]], axis=-1)
        return replace(self, points=points, patches=self.patches[..., :0], shell=None)

    def hollow(self) -> "Body":
        """The body without its points."""
        return replace(self, points=self.points[..., :0], patches=self.patches[..., :0])


def body_of(category: Category) -> Body:
    """A category's mean object.

    Points drawn at random on a surface leave its corners out, so that the object would seem 1 to
    2 % smaller than it is. Its outline is that of the mesh; without one, the corners of the boxes
    that have a point near by stand in.
    """
    joints = category.joints
    points, normals = category.points.astype(float), category.normals.astype(float)
    areas = np.asarray(category.areas, float)[:, None, None] / points.shape[1]
    order = np.stack([_spread(x, n) for x, n in zip(points, normals, strict=True)])[..., None]
    normals = np.take_along_axis(normals, order, axis=1)
    points = np.take_along_axis(points, order, axis=1)
    spacing = 1.2 * np.sqrt(np.asarray(category.areas, float) / points.shape[1])
    if (mesh := category.mesh) is None:
        boxes = zip(points, category.box_center, category.box_size, spacing, strict=True)
        tips = [_corners(*box) for box in boxes]
    else:
        tips = [extremes(mesh.vertices[mesh.part == p]) for p in range(len(points))]
    return Body(
        parent=tuple(j.parent for j in joints),
        prismatic=np.array([j.kind == "prismatic" for j in joints], bool),
        axis=np.array([j.axis for j in joints], float).reshape(-1, 3),
        pivot=np.array([j.pivot for j in joints], float).reshape(-1, 3),
        limits=np.array([j.limits for j in joints], float).reshape(-1, 2),
        center=np.asarray(category.box_center, float),
        size=np.asarray(category.box_size, float),
        points=points.transpose(0, 2, 1).copy(),
        patches=(normals * areas).transpose(0, 2, 1).copy(),
        tips=_even(list(tips)).transpose(0, 2, 1).copy(),
        shell=category.mesh and shell_of(category.mesh),
    )


def extremes(points: FloatArray) -> FloatArray:
    """Those of (V, 3) points that reach farthest in some of 256 directions all around."""
    i = np.arange(256) + 0.5
    height, turn = 1 - i / 128, np.pi * (1 + 5**0.5) * i
    ring = np.sqrt(1 - height**2)
    directions = np.stack([ring * np.cos(turn), ring * np.sin(turn), height])
    return points[np.unique((points @ directions).argmax(axis=0))]


def _even(points: list[FloatArray]) -> FloatArray:
    """(P, V, 3) of arrays (V, 3); what is missing is repeated."""
    most = max(map(len, points))
    return np.stack([x[np.arange(most) % len(x)] for x in points])


def _corners(points: FloatArray, center: FloatArray, size: FloatArray, reach: float) -> FloatArray:
    """(8, 3) the corners of a part's box with a point within ``reach``; else that point itself."""
    signs = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T
    corners = center + signs * size
    gap = np.linalg.norm(points - corners[:, None], axis=-1)
    return np.where(gap.min(axis=-1)[:, None] < reach, corners, points[gap.argmin(axis=-1)])


def _place(points: FloatArray, normals: FloatArray) -> FloatArray:
    """Points in a space where two sides of a plate are far apart."""
    extent = np.linalg.norm(points.max(axis=0) - points.min(axis=0))
    return np.concatenate([points, 0.3 * extent * normals], axis=-1)


def _spread(points: FloatArray, normals: FloatArray) -> NDArray[np.intp]:
    """An order in which each point is the one farthest from all before it."""
    place = _place(points, normals)
    order = np.zeros(len(place), np.intp)
    distance = ((place - place[0]) ** 2).sum(axis=-1)
    for i in range(1, len(place)):
        order[i] = distance.argmax()
        distance = np.minimum(distance, ((place - place[order[i]]) ** 2).sum(axis=-1))
    return order


def _thin(points: FloatArray, patches: FloatArray, keep: int) -> tuple[FloatArray, FloatArray]:
    """The first ``keep`` points; each point's area goes to the nearest of them."""
    areas = np.linalg.norm(patches, axis=-1)
    normals = patches / np.maximum(areas, 1e-300)[:, None]
    place = _place(points, normals)
    gap = (place**2).sum(axis=-1)[:keep] - 2 * place @ place[:keep].T
    areas = np.bincount(gap.argmin(axis=-1), weights=areas, minlength=keep)
    return points[:keep], normals[:keep] * areas[:, None]
