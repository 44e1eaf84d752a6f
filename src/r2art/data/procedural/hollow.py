"""Hollow solids with round corners: a tub, open on one side, and a collar, open on two."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from r2art.data.procedural.solids import FACE_FRAMES, FACE_NAMES, cap, rounded_rectangle, skin
from r2art.data.shape import Material, Surface

FloatArray = NDArray[np.floating]


def tub(
    lower: ArrayLike,
    upper: ArrayLike,
    wall: float,
    material: Material,
    *,
    opens: str = "top",
    floor: float | None = None,
    inside: Material | None = None,
    rim: Material | None = None,
    radius: float = 0.0,
    edge: float = 0.0,
    draft: float = 0.0,
    segments: int = 4,
    tile: float | None = None,
) -> tuple[Surface, ...]:
    """A box without one side.

    Args:
        lower: Lower corner of its box.
        upper: Upper corner of its box.
        wall: Thickness of its walls (m) ...
        material: Look of its outside.
        opens: Which side is missing, one of ``FACE_NAMES``.
        floor: ... and of the side opposite the opening, by default the same.
        inside: Look of its walls and floor within.
        rim: Look of the edge around the opening.
        radius: Of the corners (m), seen through the opening.
        edge: Radius (m) of the edge around the floor.
        draft: How much narrower each side is at the floor than at the opening (m).
        segments: Of each rounded corner.
        tile: See `r2art.data.procedural.solids`.
    """
    lower, upper = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    frame, center = FACE_FRAMES[FACE_NAMES.index(opens)], (lower + upper) / 2
    width, height, depth = np.abs(frame @ (upper - lower))
    floor = wall if floor is None else floor
    scale, within_look = tile or 1.0, inside or material
    edge = min(edge, 0.45 * depth)
    radius = min(max(radius, edge + 2e-4, 3e-4), 0.499 * width, 0.499 * height)
    outer = _loop(width, height, radius, segments)
    within = _loop(width - 2 * wall, height - 2 * wall, max(radius - wall, 2e-4), segments)
    shapes = (_rising(outer, edge, depth, 0.0, draft), _rising(within, edge, depth, floor, draft))

    def placed(rings: FloatArray) -> FloatArray:
        return center + rings @ frame

    (out, out_normals), (inn, inn_normals) = shapes
    out_uv, inn_uv = _uv(out, scale), _uv(inn, scale)
    lip = np.stack([out[-1], inn[-1]])
    flat = np.broadcast_to(frame[2], lip.shape)
    flat_uv = out[0, :-1, :2] / scale
    return (
        skin(placed(out), out_normals @ frame, out_uv, material, wrap=False),
        cap(placed(out[0, :-1]), -frame[2], flat_uv * (-1, 1), material, flip=True),
        skin(placed(lip), flat, lip[..., :2] / scale, rim or material, wrap=False),
        skin(placed(inn[::-1]), -inn_normals[::-1] @ frame, inn_uv[::-1], within_look, wrap=False),
        cap(placed(inn[0, :-1]), frame[2], inn[0, :-1, :2] / scale, within_look, flip=False),
    )


def collar(
    lower: ArrayLike,
    upper: ArrayLike,
    wall: float,
    axis: int,
    material: Material,
    *,
    radius: float = 0.0,
    segments: int = 4,
) -> tuple[Surface, ...]:
    """A frame around a hole along ``axis``: a flange, a gasket, a picture frame.

    Args:
        lower: Lower corner of its box.
        upper: Upper corner of its box.
        wall: How wide the frame is (m).
        axis: Direction of the hole.
        material: Its look.
        radius: Of its outer corners (m).
        segments: Of each rounded corner.
    """
    lower, upper = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    frame, center = FACE_FRAMES[2 * axis], (lower + upper) / 2
    width, height, depth = np.abs(frame @ (upper - lower))
    radius = min(max(radius, 3e-4), 0.499 * width, 0.499 * height)
    outer = _loop(width, height, radius, segments)
    inner = _loop(width - 2 * wall, height - 2 * wall, max(radius - wall, 2e-4), segments)
    (out, out_normals), (inn, inn_normals) = (
        _rising(loop, 0.0, depth, 0.0, 0.0) for loop in (outer, inner)
    )
    rings = np.stack([out[0], out[1], inn[1], inn[0], out[0]])
    up = np.broadcast_to(frame[2], out[0].shape)
    normals = (out_normals[0] @ frame, up, -inn_normals[0] @ frame, -up)
    uv = _uv(out, 1.0)
    return tuple(
        skin(center + rings[k : k + 2] @ frame, np.stack([normal] * 2), uv, material, wrap=False)
        for k, normal in enumerate(normals)
    )


def _loop(
    width: float, height: float, radius: float, segments: int
) -> tuple[FloatArray, FloatArray]:
    """A closed outline and its normals, the first point again at the end."""
    radius = min(radius, 0.499 * width, 0.499 * height)
    points, normals = rounded_rectangle(width, height, radius, segments)
    return np.concatenate([points, points[:1]]), np.concatenate([normals, normals[:1]])


def _rising(
    loop: tuple[FloatArray, FloatArray], edge: float, depth: float, floor: float, draft: float
) -> tuple[FloatArray, FloatArray]:
    """(K, N, 3) rings from the floor to the opening, and their outward normals."""
    points, normals = loop
    edge = max(edge - floor, 0.0)
    angle = np.linspace(np.pi / 2, 0, 4) if edge > 0 else np.zeros(1)
    height = np.append(floor - depth / 2 + edge * (1 - np.sin(angle)), depth / 2)
    inset = np.append(edge * (1 - np.cos(angle)), 0.0)
    narrower = draft * (0.5 - height / depth)
    slope = np.append(-angle, 0.0)
    shape = (len(height), len(points), 1)
    rings = np.concatenate(
        [
            points - inset[:, None, None] * normals - narrower[:, None, None] * np.sign(points),
            np.broadcast_to(height[:, None, None], shape),
        ],
        axis=-1,
    )
    outward = np.concatenate(
        [
            np.cos(slope)[:, None, None] * normals,
            np.broadcast_to(np.sin(slope)[:, None, None], shape),
        ],
        axis=-1,
    )
    return rings, outward


def _uv(rings: FloatArray, scale: float) -> FloatArray:
    """Along the outline, and up."""
    step = np.linalg.norm(np.diff(rings[-1], axis=0), axis=-1)
    along = np.concatenate([[0.0], np.cumsum(step)])
    return np.stack(np.broadcast_arrays(along, rings[..., 2]), axis=-1) / scale
