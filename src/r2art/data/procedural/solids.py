"""Building blocks: simple solids as textured surfaces.

Every function takes the box ``lower``..``upper`` (m) that the solid fills, or a centre and its
measures, and returns one `Surface` (or several, where its faces differ in material). ``axis``
0, 1, 2 is the direction x, y, z in which a plate or a cylinder is extruded.

Texture coordinates run over [0, 1] on each face, or, where ``tile`` (m) is given, repeat every
``tile`` metres, so that wood grain has the same scale on every board.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from r2art.data.shape import Material, Surface

FloatArray = NDArray[np.floating]

# Right, up and outward directions of the face seen from +x, +y and +z.
FRAMES = np.array(
    [
        [[0, 0, -1], [0, 1, 0], [1, 0, 0]],
        [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    ],
    dtype=np.float64,
)
# The opposite face is seen from behind: +x, +z mirror their right, +y its up direction.
_BACK = np.array([[-1, 1, -1], [1, -1, -1], [-1, 1, -1]], dtype=np.float64)[:, :, None] * FRAMES
FACE_FRAMES = np.stack([FRAMES, _BACK], axis=1).reshape(6, 3, 3)  # +x -x +y -y +z -z
SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float64)
_BOX_CORNERS = (
    np.einsum("kc,fcd->fkd", SQUARE - 0.5, FACE_FRAMES[:, :2]) + 0.5 * FACE_FRAMES[:, None, 2]
).reshape(24, 3)
_BOX_NORMALS = np.repeat(FACE_FRAMES[:, 2], 4, axis=0)
_BOX_UV = np.tile(SQUARE, (6, 1))
_BOX_FACES = (np.arange(6)[:, None, None] * 4 + np.array([[0, 1, 2], [0, 2, 3]])).reshape(12, 3)
FACE_NAMES = ("right", "left", "top", "bottom", "front", "back")


def xyz(x: float, y: float, z: float) -> FloatArray:
    """A point or an offset (m)."""
    return np.array([x, y, z], dtype=np.float64)


def box(
    lower: ArrayLike,
    upper: ArrayLike,
    material: Material,
    *,
    tile: float | None = None,
    upright: bool = False,
    offset: tuple[float, float] = (0.0, 0.0),
) -> Surface:
    """A box with hard edges; ``upright`` turns a tiled texture by 90°, ``offset`` shifts it."""
    lower, upper = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    size, center = upper - lower, (lower + upper) / 2
    vertices = center + _BOX_CORNERS * size
    uv = _BOX_UV
    if tile is not None:
        extent = np.abs(FACE_FRAMES[:, :2] @ size)
        uv = (_BOX_UV.reshape(6, 4, 2) * extent[:, None] / tile).reshape(24, 2) + offset
    if upright:
        uv = uv[:, ::-1]
    return Surface(
        vertices=vertices, faces=_BOX_FACES, normals=_BOX_NORMALS, uv=uv, material=material
    )


def decal(
    lower: ArrayLike,
    upper: ArrayLike,
    side: str,
    material: Material,
    *,
    at: tuple[float, float] = (0.5, 0.5),
    size: tuple[float, float] | None = None,
    lift: float = 3e-4,
) -> Surface:
    """A rectangle on one side of a box, ``lift`` metres above it, its texture over [0, 1].

    Args:
        lower: Lower corner of the box.
        upper: Upper corner of the box.
        side: One of ``FACE_NAMES``.
        material: The rectangle's look.
        at: Its centre, right and up as fractions of the side seen from outside.
        size: Its width and height (m); by default all of the side.
        lift: Distance from the side (m).
    """
    lower, upper = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    right, up, out = FACE_FRAMES[FACE_NAMES.index(side)]
    extent = np.abs(np.stack([right, up, out]) @ (upper - lower))
    width, height = extent[:2] if size is None else size
    center = (
        (lower + upper) / 2
        + right * extent[0] * (at[0] - 0.5)
        + up * extent[1] * (at[1] - 0.5)
        + out * (extent[2] / 2 + lift)
    )
    corners = (SQUARE - 0.5) * (width, height)
    return Surface(
        vertices=center + corners @ np.stack([right, up]),
        faces=np.array([[0, 1, 2], [0, 2, 3]]),
        normals=np.tile(out, (4, 1)),
        uv=SQUARE,
        material=material,
    )


def skin(
    rings: FloatArray, normals: FloatArray, uv: FloatArray, material: Material, *, wrap: bool
) -> Surface:
    """Quads between consecutive (K, N, 3) rings that run counter-clockwise seen from the last."""
    count, around = rings.shape[:2]
    index = np.arange(count * around).reshape(count, around)
    here = index if wrap else index[:, :-1]
    ahead = np.roll(index, -1, axis=1) if wrap else index[:, 1:]
    a, b, c, d = here[:-1], ahead[:-1], ahead[1:], here[1:]
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    return Surface(
        vertices=rings.reshape(-1, 3),
        faces=faces,
        normals=normals.reshape(-1, 3),
        uv=uv.reshape(-1, 2),
        material=material,
    )


def cap(
    ring: FloatArray, normal: FloatArray, uv: FloatArray, material: Material, *, flip: bool
) -> Surface:
    """A fan over a convex ring."""
    around = len(ring)
    vertices = np.concatenate([ring, ring.mean(axis=0, keepdims=True)])
    here = np.arange(around)
    ahead = np.roll(here, -1)
    order = (ahead, here) if flip else (here, ahead)
    return Surface(
        vertices=vertices,
        faces=np.stack([*order, np.full(around, around)], axis=-1),
        normals=np.tile(normal, (around + 1, 1)),
        uv=np.concatenate([uv, uv.mean(axis=0, keepdims=True)]),
        material=material,
    )


def rounded_rectangle(
    width: float, height: float, radius: float, segments: int
) -> tuple[FloatArray, FloatArray]:
    """(N, 2) counter-clockwise outline around the origin and its outward normals."""
    corner = np.linspace(0, np.pi / 2, segments + 1)
    angle = (np.arange(4)[:, None] * np.pi / 2 + corner).ravel()
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    sign = np.repeat([[1, 1], [-1, 1], [-1, -1], [1, -1]], segments + 1, axis=0)
    centers = sign * (np.array([width, height]) / 2 - radius)
    return centers + radius * normals, normals


def _extrusion(
    outline: FloatArray,
    outline_normals: FloatArray,
    bevel: tuple[float, float],
    segments: int,
    depth: float,
) -> tuple[FloatArray, FloatArray]:
    """(K, N, 3) rings of a bevelled extrusion along z over [-depth/2, depth/2], and normals."""
    inset, height, slope = [], [], []
    for amount, sign in ((bevel[0], -1), (bevel[1], 1)):
        angle = np.linspace(0, np.pi / 2, segments + 1) if amount > 0 else np.zeros(1)
        angle = angle[::-1] if sign < 0 else angle
        inset.append(amount * (1 - np.cos(angle)))
        height.append(sign * (depth / 2 - amount + amount * np.sin(angle)))
        slope.append(sign * angle)
    inset, height, slope = map(np.concatenate, (inset, height, slope))
    shape = (len(inset), len(outline))
    flat = outline - inset[:, None, None] * outline_normals
    rings = np.concatenate([flat, np.broadcast_to(height[:, None, None], (*shape, 1))], axis=-1)
    normals = np.concatenate(
        [
            np.cos(slope)[:, None, None] * outline_normals,
            np.broadcast_to(np.sin(slope)[:, None, None], (*shape, 1)),
        ],
        axis=-1,
    )
    return rings, normals


def _closed_extrusion(
    center: FloatArray,
    rings: FloatArray,
    normals: FloatArray,
    axis: int,
    materials: tuple[Material, Material, Material],
    tile: float | None,
) -> tuple[Surface, ...]:
    """Skin and two caps of rings along z, turned so that z becomes ``axis``."""
    frame = FRAMES[axis]
    step = np.linalg.norm(np.diff(rings[0], axis=0, append=rings[0][:1]), axis=-1)
    along = np.cumsum(step) - step
    scale = tile or 1.0
    uv = np.stack(np.broadcast_arrays(along[None], rings[:, :1, 2]), axis=-1) / scale
    world = center + rings @ frame
    surfaces = [skin(world, normals @ frame, uv, materials[0], wrap=True)]
    for k, sign, material in ((0, -1, materials[1]), (-1, 1, materials[2])):
        flat = rings[k, :, :2]
        low, high = flat.min(axis=0), flat.max(axis=0)
        cap_uv = (flat - low) / (tile or (high - low))
        if sign < 0:  # seen from behind, so that images stay unmirrored
            mirrored = 1 if axis == 1 else 0
            cap_uv = cap_uv.copy()
            cap_uv[:, mirrored] = cap_uv[:, mirrored].max() - cap_uv[:, mirrored]
        surfaces.append(cap(world[k], sign * frame[2], cap_uv, material, flip=sign < 0))
    return tuple(surfaces)


def plate(
    lower: ArrayLike,
    upper: ArrayLike,
    axis: int,
    material: Material,
    *,
    radius: float = 0.0,
    bevel: float | tuple[float, float] = 0.0,
    segments: int = 3,
    top: Material | None = None,
    bottom: Material | None = None,
    tile: float | None = None,
) -> tuple[Surface, ...]:
    """A board or laptop shell: rounded corners around ``axis`` and rounded edges.

    Args:
        lower: Lower corner of its box.
        upper: Upper corner of its box.
        axis: Direction of its thickness.
        material: Look of its side, and of the caps where they have none of their own.
        radius: Radius of the corners (m).
        bevel: Radius of the edges (m): both, or those on the negative and the positive cap.
        segments: Of each rounded corner; edges take half.
        top: Look of the cap on the positive side of ``axis``.
        bottom: Look of the cap on the negative side.
        tile: See the module.
    """
    lower, upper = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    width, height, depth = np.abs(FRAMES[axis] @ (upper - lower))
    pair = (bevel, bevel) if isinstance(bevel, float | int) else bevel
    low, high = (min(b, 0.499 * depth, 0.3 * width, 0.3 * height) for b in pair)
    radius = min(max(radius, low + 2e-4, high + 2e-4), 0.499 * width, 0.499 * height)
    outline, outline_normals = rounded_rectangle(width, height, radius, segments)
    rings, normals = _extrusion(
        outline, outline_normals, (low, high), max(1, (segments + 1) // 2), depth
    )
    looks = (material, bottom or material, top or material)
    return _closed_extrusion((lower + upper) / 2, rings, normals, axis, looks, tile)


def cylinder(
    center: ArrayLike,
    axis: int,
    radius: float,
    length: float,
    material: Material,
    *,
    segments: int = 14,
    bevel: float = 0.0,
) -> tuple[Surface, ...]:
    """A closed cylinder along ``axis`` around ``center``."""
    angle = np.arange(segments) * 2 * np.pi / segments
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    bevel = min(bevel, 0.45 * length, 0.9 * radius)
    rings, normals = _extrusion(radius * circle, circle, (bevel, bevel), 2, length)
    looks = (material, material, material)
    return _closed_extrusion(np.asarray(center, dtype=np.float64), rings, normals, axis, looks, 1.0)


def merged(surfaces: Iterable[Surface]) -> tuple[Surface, ...]:
    """One surface per material, in the order in which the materials first appear."""
    groups: dict[int, list[Surface]] = {}
    for surface in surfaces:
        groups.setdefault(id(surface.material), []).append(surface)
    return tuple(_joined(group) for group in groups.values())


def _joined(surfaces: Sequence[Surface]) -> Surface:
    start = np.cumsum([0] + [len(s.vertices) for s in surfaces[:-1]])
    return replace(
        surfaces[0],
        vertices=np.concatenate([s.vertices for s in surfaces]),
        faces=np.concatenate([s.faces + k for s, k in zip(surfaces, start, strict=True)]),
        normals=np.concatenate([s.normals for s in surfaces]),
        uv=np.concatenate([s.uv for s in surfaces]),
    )
