"""A box with a cavity anywhere in one face: ovens, tubs, recessed grips, framed windows."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from r2art.data.procedural.solids import FRAMES, cap, rounded_rectangle, skin
from r2art.data.shape import Material, Surface

FloatArray = NDArray[np.floating]


def carved(
    box: tuple[ArrayLike, ArrayLike],
    cavity: tuple[ArrayLike, ArrayLike],
    axis: int,
    material: Material,
    *,
    inside: Material | None = None,
    floor: Material | None = None,
    rim: Material | None = None,
    radius: float = 0.0,
    inner_radius: float = 0.0,
    segments: int = 4,
    tile: float | None = None,
) -> tuple[Surface, ...]:
    """A box with a cavity that opens towards positive ``axis``.

    Args:
        box: Lower and upper corner of the box.
        cavity: Lower and upper corner of the cavity within; along ``axis`` it ends with the box.
        axis: Direction into which the cavity opens.
        material: Look of the outside.
        inside: Look of the cavity's walls.
        floor: Look of the cavity's floor, whose texture covers it once; by default ``inside``.
        rim: Look of the face around the opening; its texture would cover the whole face once.
        radius: Of the box's four edges along ``axis`` (m).
        inner_radius: Of the cavity's.
        segments: Of each rounded edge.
        tile: Metres after which the texture of the outside and of the walls repeats.
    """
    frame = FRAMES[axis]
    low, high = _in_frame(box, frame)
    inner_low, inner_high = _in_frame(cavity, frame)
    outer, outward = _outline(low, high, radius, segments)
    inner, away = _outline(inner_low, inner_high, inner_radius, segments)
    walls = inside or material
    face = np.stack([_at(outer, high[2]), _at(inner, high[2])])
    face_uv = (face[..., :2] - low[:2]) / (high - low)[:2]
    up = np.broadcast_to(frame[2], face.shape)
    bottom, floor_at = _at(outer, low[2]) @ frame, _at(inner, inner_low[2]) @ frame
    bottom_uv = (outer - low[:2]) / (tile or (high - low)[:2])
    floor_uv = (inner - inner_low[:2]) / (inner_high - inner_low)[:2]
    return (
        _wall(frame, outer, outward, (low[2], high[2]), material, tile),
        cap(bottom, -frame[2], bottom_uv, material, flip=True),
        skin(face @ frame, up, face_uv, rim or material, wrap=True),
        _wall(frame, inner, -away, (high[2], inner_low[2]), walls, tile),
        cap(floor_at, frame[2], floor_uv, floor or walls, flip=False),
    )


def _in_frame(
    corners: tuple[ArrayLike, ArrayLike], frame: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corner of a box, seen against the axis."""
    turned = np.stack([np.asarray(c, dtype=np.float64) for c in corners]) @ frame.T
    return turned.min(axis=0), turned.max(axis=0)


def _outline(
    low: FloatArray, high: FloatArray, radius: float, segments: int
) -> tuple[FloatArray, FloatArray]:
    width, height = (high - low)[:2].tolist()
    radius = min(max(radius, 1e-5), 0.499 * width, 0.499 * height)
    outline, normals = rounded_rectangle(width, height, radius, segments)
    return outline + (low + high)[:2] / 2, normals


def _at(outline: FloatArray, height: float) -> FloatArray:
    return np.concatenate([outline, np.full((len(outline), 1), height)], axis=-1)


def _wall(
    frame: FloatArray,
    outline: FloatArray,
    normals: FloatArray,
    ends: tuple[float, float],
    material: Material,
    tile: float | None,
) -> Surface:
    step = np.linalg.norm(np.diff(outline, axis=0, append=outline[:1]), axis=-1)
    along = np.cumsum(step) - step
    uv = np.stack(np.broadcast_arrays(along, np.array(ends)[:, None]), axis=-1) / (tile or 1.0)
    rings = np.stack([_at(outline, end) for end in ends]) @ frame
    return skin(rings, np.tile(_at(normals, 0.0) @ frame, (2, 1, 1)), uv, material, wrap=True)
