"""Boxes and arrows as positions, normals and indices."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.floating]


def box(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.integer]]:
    """Positions and normals (24, 3), four corners for each face, and triangles (12, 3)."""
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    positions, normals = [], []
    for axis in range(3):
        for side in (-1, 1):
            normal = side * np.eye(3)[axis]
            u = np.eye(3)[(axis + 1) % 3]
            positions.append(normal + square @ np.stack([u, np.cross(normal, u)]))
            normals.append(np.tile(normal, (4, 1)))
    corners = np.concatenate(positions)
    faces = 4 * np.arange(6)[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
    triangles = faces.reshape(12, 3)
    return (low + high) / 2 + corners * (high - low) / 2, np.concatenate(normals), triangles


def box_edges(low: FloatArray, high: FloatArray) -> tuple[FloatArray, NDArray[np.integer]]:
    """The 8 corners of a box and the 12 edges (12, 2) between them."""
    bits = np.array([(i & 1, i >> 1 & 1, i >> 2 & 1) for i in range(8)])
    edges = [(i, i | b) for i in range(8) for b in (1, 2, 4) if not i & b]
    return np.where(bits, high, low), np.array(edges)


def arrow(length: float, radius: float) -> tuple[FloatArray, FloatArray, NDArray[np.integer]]:
    """A thin arrow from the origin along z: shaft and head, revolved in 16 steps."""
    neck = 0.88 * length
    slope = np.array([length - neck, 3 * radius])  # the head's normal, (radial, along z)
    slope /= np.linalg.norm(slope)
    # (radius, z, radial normal, normal along z), pairs that span one band each
    profile = [
        [(radius, 0, 1, 0), (radius, neck, 1, 0)],
        [(0, neck, 0, -1), (3 * radius, neck, 0, -1)],
        [(3 * radius, neck, *slope), (0, length, *slope)],
    ]
    angles = np.linspace(0, 2 * np.pi, 17)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    positions, normals, triangles = [], [], []
    for band in profile:
        first = sum(map(len, positions))
        for r, z, radial, along in band:
            positions.append(np.c_[r * ring, np.full(17, z)])
            normals.append(np.c_[radial * ring, np.full(17, along)])
        steps = first + np.arange(16)[:, None, None]
        triangles.append((steps + np.array([[0, 1, 17], [1, 18, 17]])).reshape(-1, 3))
    return np.concatenate(positions), np.concatenate(normals), np.concatenate(triangles)
