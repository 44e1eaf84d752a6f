"""Building blocks beyond boxes and plates: prisms, knobs, bow handles, ellipsoids."""

import numpy as np
from numpy.typing import ArrayLike

from r2art.data.procedural.solids import FRAMES, SQUARE, cap, skin
from r2art.data.shape import Material, Surface


def prism(
    polygon: ArrayLike,
    axis: int,
    span: tuple[float, float],
    material: Material,
    *,
    tile: float | None = None,
) -> tuple[Surface, ...]:
    """A convex (N, 2) polygon extruded along ``axis`` over ``span``, with hard edges.

    The polygon is counter-clockwise seen against ``axis``, in the two directions that are right
    and up there: (-z, y) for x, (x, -z) for y and (x, y) for z.
    """
    frame = FRAMES[axis]
    corners = np.asarray(polygon, dtype=np.float64)
    ends = np.array(span)
    base = corners @ frame[:2]
    ahead = np.roll(base, -1, axis=0)
    edge = ahead - base
    length = np.linalg.norm(edge, axis=-1)
    normals = np.cross(edge, frame[2]) / np.maximum(length, 1e-12)[:, None]
    offset = ends[:, None] * frame[2]
    quads = np.stack(
        [base + offset[0], ahead + offset[0], ahead + offset[1], base + offset[1]], axis=1
    )
    scale = tile or 1.0
    uv = SQUARE[None] * np.stack([length, np.full_like(length, np.ptp(ends))], -1)[:, None]
    first = np.arange(len(base))[:, None, None] * 4
    side = Surface(
        vertices=quads.reshape(-1, 3),
        faces=(first + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3),
        normals=np.repeat(normals, 4, axis=0),
        uv=uv.reshape(-1, 2) / scale,
        material=material,
    )
    cap_uv = (corners - corners.min(axis=0)) / scale
    return (
        side,
        cap(base + offset[0], -frame[2], cap_uv, material, flip=True),
        cap(base + offset[1], frame[2], cap_uv, material, flip=False),
    )


def revolved(
    profile: ArrayLike, center: ArrayLike, axis: int, material: Material, *, segments: int = 14
) -> Surface:
    """A knob: a (K, 2) profile of radius and height, bottom first, turned around ``axis``."""
    radius, height = np.asarray(profile, dtype=np.float64).T
    angle = np.arange(segments) * 2 * np.pi / segments
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    slope = np.stack([np.gradient(height), -np.gradient(radius)], axis=-1)
    slope /= np.maximum(np.linalg.norm(slope, axis=-1, keepdims=True), 1e-12)
    shape = (len(radius), segments, 1)
    rings = np.concatenate(
        [radius[:, None, None] * circle, np.broadcast_to(height[:, None, None], shape)], axis=-1
    )
    normals = np.concatenate(
        [slope[:, :1, None] * circle, np.broadcast_to(slope[:, 1:, None], shape)], axis=-1
    )
    frame = FRAMES[axis]
    uv = np.stack(np.broadcast_arrays(angle / (2 * np.pi), height[:, None]), axis=-1)
    world = np.asarray(center, dtype=np.float64) + rings @ frame
    return skin(world, normals @ frame, uv, material, wrap=True)


def tube(
    path: ArrayLike, radius: float, material: Material, *, up: ArrayLike, segments: int = 8
) -> Surface:
    """A bow handle: a circle swept along a planar (K, 3) path; ``up`` is the plane's normal."""
    path, up = np.array(path, dtype=np.float64), np.array(up, dtype=np.float64)
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    side = np.asarray(np.cross(up, tangent), dtype=np.float64)
    over = np.asarray(np.cross(tangent, side), dtype=np.float64)
    angle = np.arange(segments) * 2 * np.pi / segments
    normals = np.cos(angle)[:, None] * side[:, None] + np.sin(angle)[:, None] * over[:, None]
    uv = np.zeros((*normals.shape[:2], 2))
    return skin(path[:, None] + radius * normals, normals, uv, material, wrap=True)


def ellipsoid(
    center: ArrayLike,
    radii: ArrayLike,
    material: Material,
    *,
    polar: tuple[float, float] = (-np.pi / 2, np.pi / 2),
    around: tuple[float, float] = (0.0, 2 * np.pi),
    rings: int = 7,
    segments: int = 12,
) -> Surface:
    """An ellipsoid or a patch of it; ``polar`` is measured from the equator, along z."""
    latitude = np.linspace(*polar, rings)[:, None]
    longitude = np.linspace(*around, segments)[None]
    unit = np.stack(
        np.broadcast_arrays(
            np.cos(latitude) * np.cos(longitude),
            np.cos(latitude) * np.sin(longitude),
            np.sin(latitude),
        ),
        axis=-1,
    )
    radii = np.asarray(radii, dtype=np.float64)
    normals = unit / radii
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    uv = np.stack(np.broadcast_arrays(longitude, latitude), axis=-1)
    return skin(np.asarray(center) + unit * radii, normals, uv, material, wrap=False)
