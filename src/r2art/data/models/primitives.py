"""Primitive shapes of model files as triangles; z is the axis of what has one."""

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh import creation

from r2art.data.models.model import Patch
from r2art.data.shape import Material

FloatArray = NDArray[np.floating]

ROUND = 32  # segments of a circle


def patch(corners: FloatArray, material: Material, uv: FloatArray | None = None) -> Patch:
    """Triangles (F, 3, 3) of one look; without ``uv`` (F, 3, 2) nothing is mapped on them."""
    corners = np.asarray(corners, dtype=np.float64)
    if uv is None:
        uv = np.zeros((len(corners), 3, 2))
    return Patch(corners=corners, uv=np.asarray(uv, dtype=np.float64), material=material)


def _patch(mesh: trimesh.Trimesh, material: Material) -> Patch:
    return patch(np.asarray(mesh.vertices)[np.asarray(mesh.faces)], material)


def box(size: FloatArray, material: Material) -> Patch:
    """A box of full extents ``size`` (m)."""
    return _patch(creation.box(extents=size), material)


def cylinder(radius: float, length: float, material: Material) -> Patch:
    """A closed cylinder."""
    return _patch(creation.cylinder(radius=radius, height=length, sections=ROUND), material)


def capsule(radius: float, length: float, material: Material) -> Patch:
    """A cylinder of ``length`` with half a ball on either end."""
    mesh = creation.capsule(height=length, radius=radius, count=(ROUND, ROUND // 2))
    centered = np.asarray(mesh.vertices) - mesh.bounds.mean(axis=0)
    return patch(centered[np.asarray(mesh.faces)], material)


def ellipsoid(radii: FloatArray, material: Material) -> Patch:
    """An ellipsoid of three half axes; a ball if they are alike."""
    ball = _patch(creation.icosphere(subdivisions=3), material)
    return patch(ball.corners * np.asarray(radii), material)


def box_mapped(corners: FloatArray, repeat: tuple[float, float], metric: bool) -> FloatArray:
    """(F, 3, 2) texture coordinates as if projected from the six sides of a box.

    Args:
        corners: (F, 3, 3) triangles.
        repeat: How often the picture repeats across ...
        metric: ... a metre, or else across the box around the triangles.
    """
    lower, upper = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    placed = corners if metric else (corners - lower) / np.maximum(upper - lower, 1e-9)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    across = np.array([(1, 2), (0, 2), (0, 1)])[np.abs(normal).argmax(axis=1)]
    return np.take_along_axis(placed, across[:, None, :], axis=2) * repeat
