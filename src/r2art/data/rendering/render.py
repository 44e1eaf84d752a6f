"""A small ray tracer on NVIDIA Warp: colour, part labels and depth of a scene.

One kernel source serves CPU and CUDA, from a pip wheel alone. Shading: soft-shadowed
directional lights with GGX highlights, image-based ambient light with one occlusion ray in
every second pixel, and environment reflections. Everything is given in the camera frame (OpenCV
axes, metres). Labels and depth are those of the rays through the pixels' centres, found by filling
faces; colour is refined with more rays only where neighbouring pixels differ. Bit-identical for
the same scene and seed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.quiet import stderr_closed
from r2art.data.rendering import rasteriser, tracing
from r2art.data.rendering.shading import Geometry, Lighting, Materials
from r2art.data.shape import Surface

FloatArray = NDArray[np.floating]

wp.config.log_level = wp.LOG_WARNING
with stderr_closed():
    wp.init()

GAMMA = 2.2
TO_LINEAR = ((np.arange(256) / 255) ** GAMMA).astype(np.float32)
"""Linear radiance of the 256 values of an sRGB channel."""


@dataclass(frozen=True, kw_only=True)
class Light:
    """A far lamp or sun: unit ``direction`` towards it, linear ``color``, soft ``radius`` (rad)."""

    direction: tuple[float, float, float]
    color: tuple[float, float, float]
    radius: float = 0.03


@dataclass(frozen=True, kw_only=True)
class Scene:
    """What a frame shows.

    Attributes:
        surfaces: Surfaces, already posed in the camera frame.
        labels: One label per surface: 0 for surroundings, k + 1 for part k of the object.
        lights: Directional lights.
        environment: (h, w, 3) linear radiance around the scene, latitude-longitude, y up.
        world_R_cam: (3, 3) rotation from the camera frame to the environment's frame.
        show_environment: Whether rays that miss everything see it, or black.
        diffuse: The environment's `diffuse_environment`, where it is known already.
    """

    surfaces: Sequence[Surface]
    labels: Sequence[int]
    lights: Sequence[Light]
    environment: FloatArray
    world_R_cam: FloatArray
    show_environment: bool = True
    diffuse: FloatArray | None = None


@dataclass(frozen=True, kw_only=True)
class Frame:
    """A rendered scene.

    Attributes:
        rgb: (H, W, 3) linear radiance; black behind everything if the environment is hidden,
            so that a backdrop is added as ``rgb + (1 - coverage) * backdrop``.
        coverage: (H, W) share of each pixel that shows geometry.
        label: (H, W) label at the pixel's centre.
        depth: (H, W) z in metres there, 0 where nothing was hit.
    """

    rgb: FloatArray
    coverage: FloatArray
    label: NDArray[np.uint8]
    depth: FloatArray


def _merge(surfaces: Sequence[Surface]) -> tuple[FloatArray, NDArray[np.int32]]:
    ends = np.cumsum([len(s.vertices) for s in surfaces])
    starts = ends - [len(s.vertices) for s in surfaces]
    vertices = np.concatenate([s.vertices for s in surfaces]).astype(np.float32)
    faces = np.concatenate([s.faces + o for s, o in zip(surfaces, starts, strict=True)])
    return vertices, faces.astype(np.int32).ravel()


def _per_face(surfaces: Sequence[Surface], values: Sequence[int]) -> NDArray[np.int32]:
    return np.repeat(np.asarray(values, np.int32), [len(s.faces) for s in surfaces])


def _mesh(surfaces: Sequence[Surface], device: str) -> wp.Mesh:
    vertices, faces = _merge(surfaces)
    return wp.Mesh(
        points=_array(vertices, wp.vec3, device), indices=_array(faces, wp.int32, device)
    )


def _array(values: NDArray[Any], dtype: Any, device: str) -> wp.array:
    """On the device; without a copy where that is the CPU."""
    return wp.array(values, dtype=dtype, device=device, copy=False)


def _geometry(scene: Scene, mesh: wp.Mesh, device: str) -> Any:
    g = Geometry()
    g.mesh = mesh.id
    g.faces = mesh.indices
    normals = np.concatenate([s.normals for s in scene.surfaces]).astype(np.float32)
    uv = np.concatenate([s.uv for s in scene.surfaces]).astype(np.float32)
    g.normals = _array(normals, wp.vec3, device)
    g.uv = _array(uv, wp.vec2, device)
    ids = range(len(scene.surfaces))
    g.face_material = _array(_per_face(scene.surfaces, list(ids)), wp.int32, device)
    g.face_label = _array(_per_face(scene.surfaces, scene.labels), wp.int32, device)
    return g


def _materials(scene: Scene, device: str) -> Any:
    looks = [s.material for s in scene.surfaces]
    place: dict[int, tuple[int, int, int]] = {}
    texels = [np.zeros((1, 3), np.uint8)]
    count = 1
    for t in (x.texture for x in looks):
        if t is not None and id(t) not in place:
            place[id(t)] = (count, t.shape[1], t.shape[0])
            texels.append(t.reshape(-1, 3))
            count += t.shape[0] * t.shape[1]
    m = Materials()
    color = np.array([x.color for x in looks], np.float32) ** GAMMA
    surface = np.array(
        [(max(x.roughness, 0.05), x.metallic, x.emission) for x in looks], np.float32
    )
    texture = np.array(
        [(0, 0, 0) if x.texture is None else place[id(x.texture)] for x in looks], np.int32
    )
    m.color = _array(color, wp.vec3, device)
    m.surface = _array(surface, wp.vec3, device)
    m.texture = _array(texture, wp.vec3i, device)
    m.texels = _array(np.concatenate(texels), wp.vec3ub, device)
    m.linear = _array(TO_LINEAR, wp.float32, device)
    return m


def diffuse_environment(environment: FloatArray) -> FloatArray:
    """(9, 3) second-order spherical harmonics of the cosine-weighted mean radiance.

    Ramamoorthi and Hanrahan 2001; the factors of the basis functions are folded in.
    """
    h, w = environment.shape[:2]
    step = max(1, h // 32)
    coarse = environment[: h // step * step, : w // step * step]
    coarse = coarse.reshape(h // step, step, w // step, step, 3).mean(axis=(1, 3)).reshape(-1, 3)
    theta = (np.arange(h // step) + 0.5) / (h // step) * np.pi
    phi = ((np.arange(w // step) + 0.5) / (w // step) - 0.5) * 2 * np.pi
    theta, phi = (a.ravel() for a in np.meshgrid(theta, phi, indexing="ij"))
    x, y, z = np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)
    one = np.ones_like(x)
    basis = np.stack([one, y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y])
    scale = np.array([0.282095, *[0.488603] * 3, *[1.092548] * 2, 0.315392, 1.092548, 0.546274])
    band = np.array([1, *[2 / 3] * 3, *[1 / 4] * 5])
    solid_angle = np.sin(theta) * (4 * np.pi / np.sin(theta).sum())
    coefficients = (basis * solid_angle) @ coarse * (scale**2 * band)[:, None]
    return coefficients.astype(np.float32)


def _lighting(scene: Scene, device: str) -> Any:
    light = Lighting()
    direction = np.array([x.direction for x in scene.lights], np.float32).reshape(-1, 3)
    color = np.array([x.color for x in scene.lights], np.float32).reshape(-1, 3)
    radius = np.array([x.radius for x in scene.lights], np.float32)
    light.direction = _array(direction, wp.vec3, device)
    light.color = _array(color, wp.vec3, device)
    light.radius = _array(radius, wp.float32, device)
    sharp = np.ascontiguousarray(scene.environment, np.float32)
    light.sharp = _array(sharp, wp.vec3, device)
    ambient = diffuse_environment(sharp) if scene.diffuse is None else scene.diffuse
    light.diffuse = _array(ambient.astype(np.float32), wp.vec3, device)
    light.world_R_cam = wp.mat33(np.asarray(scene.world_R_cam, np.float32))
    light.behind = float(scene.show_environment)
    return light


def _busy_pixels(rgb: FloatArray, label: NDArray[np.uint8], threshold: float) -> NDArray[np.int32]:
    """(n, 2) x, y of pixels that differ visibly from a neighbour."""
    tone = np.clip(rgb, 0, 2).mean(axis=-1) ** (1 / GAMMA)
    busy = np.zeros(label.shape, bool)
    for axis in (0, 1):
        jump = np.abs(np.diff(tone, axis=axis)) > threshold
        jump |= np.diff(label.astype(np.int16), axis=axis) != 0
        first = [slice(None), slice(None)]
        second = [slice(None), slice(None)]
        first[axis], second[axis] = slice(None, -1), slice(1, None)
        busy[tuple(first)] |= jump
        busy[tuple(second)] |= jump
    return np.argwhere(busy)[:, ::-1].astype(np.int32)


def render(
    scene: Scene, camera: Camera, *, seed: int = 0, refine_rays: int = 2, device: str = "cpu"
) -> Frame:
    """Trace a frame of ``camera.width`` × ``camera.height``.

    Args:
        scene: Posed surfaces, lights and surroundings, in the camera frame.
        camera: Intrinsics of the frame.
        seed: Of the light and occlusion rays; the same seed gives the same bytes.
        refine_rays: Extra rays in pixels that differ from a neighbour; 0 leaves edges jagged.
        device: A Warp device, ``"cpu"`` or ``"cuda"``.
    """
    size = (camera.height, camera.width)
    seed = seed % (2**30)
    mesh = _mesh(scene.surfaces, device)
    inputs = [
        _geometry(scene, mesh, device),
        _materials(scene, device),
        _lighting(scene, device),
        _intrinsics(camera),
    ]
    rgb = wp.zeros(size, dtype=wp.vec3, device=device)
    ambient = wp.zeros(size, dtype=wp.vec3, device=device)
    openness = wp.zeros(size, dtype=wp.float32, device=device)
    smooth = wp.zeros(size, dtype=wp.float32, device=device)
    coverage = wp.zeros(size, dtype=wp.float32, device=device)
    label = wp.zeros(size, dtype=wp.uint8, device=device)
    depth = wp.zeros(size, dtype=wp.float32, device=device)
    nearest = _nearest(mesh.points, mesh.indices, camera, device)
    centers = [rgb, ambient, openness, coverage, label, depth]
    wp.launch(tracing.shade_centers, size, [*inputs, seed, nearest], centers, device=device)
    surface = [ambient, openness, label, depth]
    wp.launch(tracing.add_ambient, size, surface, [rgb, smooth], device=device)
    if refine_rays > 0:
        busy = _busy_pixels(_copied(rgb), _copied(label), threshold=0.15)
        pixels = _array(busy, wp.vec2i, device)
        finer = [*inputs, seed + 7, refine_rays, pixels, smooth]
        wp.launch(tracing.refine, len(busy), finer, [rgb, coverage], device=device)
    return Frame(
        rgb=_copied(rgb), coverage=_copied(coverage), label=_copied(label), depth=_copied(depth)
    )


def render_labels(
    surfaces: Sequence[Surface], labels: Sequence[int], camera: Camera, device: str = "cpu"
) -> NDArray[np.uint8]:
    """(H, W) labels of the given surfaces alone, 0 where none is seen; as in `render`."""
    vertices, faces = _merge(surfaces)
    indices = _array(faces, wp.int32, device)
    nearest = _nearest(_array(vertices, wp.vec3, device), indices, camera, device)
    face_label = _array(_per_face(surfaces, labels), wp.int32, device)
    out = wp.zeros(nearest.shape, dtype=wp.uint8, device=device)
    wp.launch(rasteriser.labels_of, out.shape, [nearest, face_label], [out], device=device)
    return _copied(out)


def render_silhouettes(
    groups: Sequence[Sequence[Surface]], camera: Camera, device: str = "cpu"
) -> NDArray[np.uint16]:
    """(H, W) whole silhouettes of up to 16 groups of surfaces.

    Bit k is set where group k would be seen if it were alone: amodal masks.
    """
    surfaces = [s for group in groups for s in group]
    vertices, faces = _merge(surfaces)
    bits = _per_face(surfaces, [1 << k for k, group in enumerate(groups) for _ in group])
    out = wp.zeros((camera.height, camera.width), dtype=wp.int32, device=device)
    inputs = [
        _array(vertices, wp.vec3, device),
        _array(faces, wp.int32, device),
        _array(bits, wp.int32, device),
        _intrinsics(camera),
    ]
    wp.launch(rasteriser.silhouettes, len(bits), inputs, [out], device=device)
    return out.numpy().astype(np.uint16)


def _intrinsics(camera: Camera) -> wp.vec4:
    return wp.vec4(camera.fx, camera.fy, camera.cx, camera.cy)


def _nearest(points: wp.array, indices: wp.array, camera: Camera, device: str) -> wp.array:
    """What is seen in each pixel, see `rasteriser.nearest_faces`."""
    size = (camera.height, camera.width)
    out = wp.full(size, rasteriser.NOTHING, dtype=wp.uint64, device=device)
    inputs = [points, indices, _intrinsics(camera)]
    wp.launch(rasteriser.nearest_faces, len(indices) // 3, inputs, [out], device=device)
    return out


def _copied(array: wp.array) -> NDArray[Any]:
    return np.array(array.numpy())
