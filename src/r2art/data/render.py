"""A small ray tracer on NVIDIA Warp: colour, part labels and depth of a scene.

One kernel source serves CPU and CUDA, from a pip wheel alone. Shading: soft-shadowed
directional lights with GGX highlights, image-based ambient light with one occlusion ray, and
environment reflections. Everything is given in the camera frame (OpenCV axes, metres).
Labels and depth come from the ray through the pixel's centre only; colour is refined with
more rays only where neighbouring pixels differ. Bit-identical for the same scene and seed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.data.shape import Surface

FloatArray = NDArray[np.floating]

wp.config.quiet = True
wp.config.enable_backward = False
wp.set_module_options({"fast_math": True})

GAMMA = 2.2
_TO_LINEAR = ((np.arange(256) / 255) ** GAMMA).astype(np.float32)
FAR = wp.constant(100.0)  # m, beyond which rays see the environment
OCCLUSION_REACH = wp.constant(0.7)  # m


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
    """

    surfaces: Sequence[Surface]
    labels: Sequence[int]
    lights: Sequence[Light]
    environment: FloatArray
    world_R_cam: FloatArray
    show_environment: bool = True


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


@wp.struct
class _Geometry:
    mesh: wp.uint64
    faces: wp.array(dtype=wp.int32)
    normals: wp.array(dtype=wp.vec3)
    uv: wp.array(dtype=wp.vec2)
    face_material: wp.array(dtype=wp.int32)
    face_label: wp.array(dtype=wp.int32)


@wp.struct
class _Materials:
    color: wp.array(dtype=wp.vec3)
    surface: wp.array(dtype=wp.vec3)  # roughness, metallic, emission
    texture: wp.array(dtype=wp.vec3i)  # first texel, width, height; width 0: none
    texels: wp.array(dtype=wp.vec3)  # linear


@wp.struct
class _Lighting:
    direction: wp.array(dtype=wp.vec3)
    color: wp.array(dtype=wp.vec3)
    radius: wp.array(dtype=wp.float32)
    sharp: wp.array2d(dtype=wp.vec3)
    diffuse: wp.array(dtype=wp.vec3)  # 9 spherical harmonics of the irradiance / π
    world_R_cam: wp.mat33
    behind: wp.float32  # 1 shows the environment behind everything, 0 black


@wp.func
def _base_color(m: _Materials, material: int, uv: wp.vec2):
    color = m.color[material]
    t = m.texture[material]
    width = t[1]
    height = t[2]
    if width > 0:
        x = (uv[0] - wp.floor(uv[0])) * float(width) - 0.5
        y = (1.0 - (uv[1] - wp.floor(uv[1]))) * float(height) - 0.5
        ax = x - wp.floor(x)
        ay = y - wp.floor(y)
        x0 = (int(wp.floor(x)) + width) % width
        y0 = (int(wp.floor(y)) + height) % height
        x1 = (x0 + 1) % width
        y1 = (y0 + 1) % height
        row0 = t[0] + y0 * width
        row1 = t[0] + y1 * width
        top = m.texels[row0 + x0] * (1.0 - ax) + m.texels[row0 + x1] * ax
        low = m.texels[row1 + x0] * (1.0 - ax) + m.texels[row1 + x1] * ax
        color = wp.cw_mul(color, top * (1.0 - ay) + low * ay)
    return color


@wp.func
def _environment(env: wp.array2d(dtype=wp.vec3), world_R_cam: wp.mat33, direction: wp.vec3):
    d = world_R_cam * direction
    height = env.shape[0]
    width = env.shape[1]
    x = (wp.atan2(d[0], -d[2]) / 6.2831853 + 0.5) * float(width) - 0.5
    y = wp.acos(wp.clamp(d[1], -1.0, 1.0)) / 3.14159265 * float(height) - 0.5
    ax = x - wp.floor(x)
    ay = y - wp.floor(y)
    x0 = (int(wp.floor(x)) + width) % width
    x1 = (x0 + 1) % width
    y0 = wp.clamp(int(wp.floor(y)), 0, height - 1)
    y1 = wp.clamp(int(wp.floor(y)) + 1, 0, height - 1)
    top = env[y0, x0] * (1.0 - ax) + env[y0, x1] * ax
    low = env[y1, x0] * (1.0 - ax) + env[y1, x1] * ax
    return top * (1.0 - ay) + low * ay


@wp.func
def _pow5(x: float):
    return x * x * x * x * x


@wp.func
def _diffuse(sh: wp.array(dtype=wp.vec3), world_R_cam: wp.mat33, direction: wp.vec3):
    d = world_R_cam * direction
    x = d[0]
    y = d[1]
    z = d[2]
    flat = sh[0] + sh[1] * y + sh[2] * z + sh[3] * x + sh[4] * (x * y) + sh[5] * (y * z)
    flat += sh[6] * (3.0 * z * z - 1.0) + sh[7] * (x * z) + sh[8] * (x * x - y * y)
    return wp.vec3(wp.max(flat[0], 0.0), wp.max(flat[1], 0.0), wp.max(flat[2], 0.0))


@wp.func
def _ggx(n: wp.vec3, v: wp.vec3, to_light: wp.vec3, f0: wp.vec3, roughness: float):
    h = wp.normalize(v + to_light)
    nl = wp.max(wp.dot(n, to_light), 0.0)
    nv = wp.max(wp.dot(n, v), 1.0e-3)
    nh = wp.max(wp.dot(n, h), 0.0)
    vh = wp.max(wp.dot(v, h), 0.0)
    a2 = roughness * roughness * roughness * roughness
    d = nh * nh * (a2 - 1.0) + 1.0
    k = (roughness + 1.0) * (roughness + 1.0) / 8.0
    g = (nl / (nl * (1.0 - k) + k)) * (nv / (nv * (1.0 - k) + k))
    fresnel = f0 + (wp.vec3(1.0, 1.0, 1.0) - f0) * _pow5(1.0 - vh)
    return fresnel * (a2 / (3.14159265 * d * d) * g / wp.max(4.0 * nv, 1.0e-3))


@wp.func
def _shade(
    g: _Geometry,
    m: _Materials,
    light: _Lighting,
    d: wp.vec3,
    q: wp.MeshQueryRay,
    openness: float,
    rng: wp.uint32,
):
    """Radiance towards the camera; a negative ``openness`` is sampled with one ray.

    Returns the radiance without ambient light, the ambient light if nothing were near, and
    the openness that dims it.
    """
    i0 = g.faces[q.face * 3]
    i1 = g.faces[q.face * 3 + 1]
    i2 = g.faces[q.face * 3 + 2]
    w = 1.0 - q.u - q.v
    n = wp.normalize(g.normals[i0] * q.u + g.normals[i1] * q.v + g.normals[i2] * w)
    if wp.dot(n, d) > 0.0:
        n = -n
    flat = q.normal
    if wp.dot(flat, d) > 0.0:
        flat = -flat
    material = g.face_material[q.face]
    base = _base_color(m, material, g.uv[i0] * q.u + g.uv[i1] * q.v + g.uv[i2] * w)
    roughness = m.surface[material][0]
    metallic = m.surface[material][1]
    point = d * q.t + flat * (1.0e-4 + 1.0e-4 * q.t)
    v = -d
    f0 = wp.vec3(0.04, 0.04, 0.04) * (1.0 - metallic) + base * metallic
    albedo = base * (1.0 - metallic)

    open_sky = openness
    if open_sky < 0.0:
        # A cosine-weighted ray of random reach: near surfaces darken more than far ones.
        r = wp.sqrt(wp.randf(rng))
        phi = 6.2831853 * wp.randf(rng)
        side = wp.normalize(wp.cross(n, wp.vec3(0.31, 0.77, 0.55)))
        across = side * wp.cos(phi) + wp.cross(n, side) * wp.sin(phi)
        bounce = n * wp.sqrt(1.0 - r * r) + across * r
        open_sky = 1.0
        if wp.mesh_query_ray_anyhit(g.mesh, point, bounce, OCCLUSION_REACH * wp.randf(rng)):
            open_sky = 0.25
    ambient = wp.cw_mul(albedo, _diffuse(light.diffuse, light.world_R_cam, n))
    mirror = d - n * (2.0 * wp.dot(n, d))
    soft = wp.clamp(roughness * 1.6, 0.0, 1.0)
    reflected = _diffuse(light.diffuse, light.world_R_cam, mirror) * soft
    if soft < 1.0:
        reflected += _environment(light.sharp, light.world_R_cam, mirror) * (1.0 - soft)
    glance = _pow5(1.0 - wp.max(wp.dot(n, v), 0.0)) * (1.0 - roughness)
    fresnel = f0 + (wp.vec3(1.0, 1.0, 1.0) - f0) * glance
    color = wp.cw_mul(fresnel, reflected) + base * m.surface[material][2]

    half = wp.vec3(0.5, 0.5, 0.5)
    for i in range(light.direction.shape[0]):
        s = light.radius[i]
        to_light = wp.normalize(
            light.direction[i]
            + (wp.vec3(wp.randf(rng), wp.randf(rng), wp.randf(rng)) - half) * (3.0 * s)
        )
        facing = wp.dot(n, to_light)
        if facing > 0.0:
            if not wp.mesh_query_ray_anyhit(g.mesh, point, to_light, FAR):
                lit = albedo * (facing / 3.14159265) + _ggx(n, v, to_light, f0, roughness)
                color += wp.cw_mul(lit, light.color[i])
    return color, ambient, open_sky


@wp.func
def _ray(k: wp.vec4, x: float, y: float):
    return wp.normalize(wp.vec3((x - k[2]) / k[0], (y - k[3]) / k[1], 1.0))


@wp.kernel
def _trace_centers(
    g: _Geometry,
    m: _Materials,
    light: _Lighting,
    k: wp.vec4,
    seed: int,
    rgb: wp.array2d(dtype=wp.vec3),
    ambient: wp.array2d(dtype=wp.vec3),
    openness: wp.array2d(dtype=wp.float32),
    coverage: wp.array2d(dtype=wp.float32),
    label: wp.array2d(dtype=wp.uint8),
    depth: wp.array2d(dtype=wp.float32),
):
    y, x = wp.tid()
    rng = wp.rand_init(seed, y * label.shape[1] + x)
    d = _ray(k, float(x) + 0.5, float(y) + 0.5)
    q = wp.mesh_query_ray(g.mesh, wp.vec3(), d, FAR)
    if q.result:
        color, near, open_sky = _shade(g, m, light, d, q, -1.0, rng)
        rgb[y, x] = color
        ambient[y, x] = near
        openness[y, x] = open_sky
        coverage[y, x] = 1.0
        label[y, x] = wp.uint8(g.face_label[q.face])
        depth[y, x] = q.t * d[2]
    else:
        rgb[y, x] = _environment(light.sharp, light.world_R_cam, d) * light.behind


@wp.kernel
def _add_ambient(
    ambient: wp.array2d(dtype=wp.vec3),
    openness: wp.array2d(dtype=wp.float32),
    label: wp.array2d(dtype=wp.uint8),
    depth: wp.array2d(dtype=wp.float32),
    rgb: wp.array2d(dtype=wp.vec3),
    smooth: wp.array2d(dtype=wp.float32),
):
    """Average the openness over neighbours on the same surface, and let ambient light in."""
    y, x = wp.tid()
    if depth[y, x] > 0.0:
        total = float(0.0)
        count = float(0.0)
        for dy in range(-3, 4):
            for dx in range(-3, 4):
                v = wp.clamp(y + dy, 0, label.shape[0] - 1)
                u = wp.clamp(x + dx, 0, label.shape[1] - 1)
                near = wp.abs(depth[v, u] - depth[y, x]) < 0.03 * depth[y, x]
                if near and label[v, u] == label[y, x]:
                    total += openness[v, u]
                    count += 1.0
        smooth[y, x] = total / count
        rgb[y, x] += ambient[y, x] * (total / count)
    else:
        smooth[y, x] = 1.0


@wp.kernel
def _refine(
    g: _Geometry,
    m: _Materials,
    light: _Lighting,
    k: wp.vec4,
    seed: int,
    rays: int,
    pixels: wp.array(dtype=wp.vec2i),
    openness: wp.array2d(dtype=wp.float32),
    rgb: wp.array2d(dtype=wp.vec3),
    coverage: wp.array2d(dtype=wp.float32),
):
    i = wp.tid()
    x = pixels[i][0]
    y = pixels[i][1]
    rng = wp.rand_init(seed, i)
    color = rgb[y, x]
    covered = coverage[y, x]
    for s in range(rays):
        d = _ray(k, float(x) + wp.randf(rng), float(y) + wp.randf(rng))
        q = wp.mesh_query_ray(g.mesh, wp.vec3(), d, FAR)
        if q.result:
            open_sky = openness[y, x]
            lit, near, _ = _shade(g, m, light, d, q, open_sky, wp.rand_init(seed + s + 1, i))
            color += lit + near * open_sky
            covered += 1.0
        else:
            color += _environment(light.sharp, light.world_R_cam, d) * light.behind
    rgb[y, x] = color / float(rays + 1)
    coverage[y, x] = covered / float(rays + 1)


@wp.kernel
def _trace_labels(
    mesh: wp.uint64,
    face_label: wp.array(dtype=wp.int32),
    k: wp.vec4,
    label: wp.array2d(dtype=wp.uint8),
):
    y, x = wp.tid()
    q = wp.mesh_query_ray(mesh, wp.vec3(), _ray(k, float(x) + 0.5, float(y) + 0.5), FAR)
    if q.result:
        label[y, x] = wp.uint8(face_label[q.face])


def _merge(surfaces: Sequence[Surface]) -> tuple[FloatArray, NDArray[np.int32]]:
    offsets = np.cumsum([0] + [len(s.vertices) for s in surfaces])
    vertices = np.concatenate([s.vertices for s in surfaces]).astype(np.float32)
    faces = np.concatenate([s.faces + o for s, o in zip(surfaces, offsets, strict=False)])
    return vertices, faces.astype(np.int32).ravel()


def _per_face(surfaces: Sequence[Surface], values: Sequence[int]) -> NDArray[np.int32]:
    return np.repeat(np.asarray(values, np.int32), [len(s.faces) for s in surfaces])


def _mesh(surfaces: Sequence[Surface], device: str) -> wp.Mesh:
    vertices, faces = _merge(surfaces)
    return wp.Mesh(
        points=wp.array(vertices, dtype=wp.vec3, device=device),
        indices=wp.array(faces, dtype=wp.int32, device=device),
    )


def _geometry(scene: Scene, mesh: wp.Mesh, device: str) -> _Geometry:
    g = _Geometry()
    g.mesh = mesh.id
    g.faces = mesh.indices
    normals = np.concatenate([s.normals for s in scene.surfaces]).astype(np.float32)
    uv = np.concatenate([s.uv for s in scene.surfaces]).astype(np.float32)
    g.normals = wp.array(normals, dtype=wp.vec3, device=device)
    g.uv = wp.array(uv, dtype=wp.vec2, device=device)
    ids = range(len(scene.surfaces))
    g.face_material = wp.array(_per_face(scene.surfaces, list(ids)), dtype=wp.int32, device=device)
    g.face_label = wp.array(_per_face(scene.surfaces, scene.labels), dtype=wp.int32, device=device)
    return g


def _materials(scene: Scene, device: str) -> _Materials:
    looks = [s.material for s in scene.surfaces]
    place: dict[int, tuple[int, int, int]] = {}
    texels = [np.zeros((1, 3), np.float32)]
    count = 1
    for t in (x.texture for x in looks):
        if t is not None and id(t) not in place:
            place[id(t)] = (count, t.shape[1], t.shape[0])
            texels.append(_TO_LINEAR[t.reshape(-1, 3)])
            count += t.shape[0] * t.shape[1]
    m = _Materials()
    color = np.array([x.color for x in looks], np.float32) ** GAMMA
    surface = np.array([(max(x.roughness, 0.05), x.metallic, x.emission) for x in looks], np.float32)
    texture = np.array(
        [(0, 0, 0) if x.texture is None else place[id(x.texture)] for x in looks], np.int32
    )
    m.color = wp.array(color, dtype=wp.vec3, device=device)
    m.surface = wp.array(surface, dtype=wp.vec3, device=device)
    m.texture = wp.array(texture, dtype=wp.vec3i, device=device)
    m.texels = wp.array(np.concatenate(texels), dtype=wp.vec3, device=device)
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


def _lighting(scene: Scene, device: str) -> _Lighting:
    light = _Lighting()
    direction = np.array([x.direction for x in scene.lights], np.float32).reshape(-1, 3)
    color = np.array([x.color for x in scene.lights], np.float32).reshape(-1, 3)
    radius = np.array([x.radius for x in scene.lights], np.float32)
    light.direction = wp.array(direction, dtype=wp.vec3, device=device)
    light.color = wp.array(color, dtype=wp.vec3, device=device)
    light.radius = wp.array(radius, dtype=wp.float32, device=device)
    sharp = np.ascontiguousarray(scene.environment, np.float32)
    light.sharp = wp.array(sharp, dtype=wp.vec3, device=device)
    light.diffuse = wp.array(diffuse_environment(sharp), dtype=wp.vec3, device=device)
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
    mesh = _mesh(scene.surfaces, device)
    inputs = [
        _geometry(scene, mesh, device),
        _materials(scene, device),
        _lighting(scene, device),
        wp.vec4(camera.fx, camera.fy, camera.cx, camera.cy),
    ]
    rgb = wp.zeros(size, dtype=wp.vec3, device=device)
    ambient = wp.zeros(size, dtype=wp.vec3, device=device)
    openness = wp.zeros(size, dtype=wp.float32, device=device)
    smooth = wp.zeros(size, dtype=wp.float32, device=device)
    coverage = wp.zeros(size, dtype=wp.float32, device=device)
    label = wp.zeros(size, dtype=wp.uint8, device=device)
    depth = wp.zeros(size, dtype=wp.float32, device=device)
    seed = seed % (2**30)
    centers = [rgb, ambient, openness, coverage, label, depth]
    wp.launch(_trace_centers, size, [*inputs, seed], centers, device=device)
    surface = [ambient, openness, label, depth]
    wp.launch(_add_ambient, size, surface, [rgb, smooth], device=device)
    if refine_rays > 0:
        pixels = _busy_pixels(rgb.numpy(), label.numpy(), threshold=0.1)
        if len(pixels):
            wp.launch(
                _refine,
                len(pixels),
                [
                    *inputs,
                    seed + 7,
                    refine_rays,
                    wp.array(pixels, dtype=wp.vec2i, device=device),
                    smooth,
                ],
                [rgb, coverage],
                device=device,
            )
    return Frame(
        rgb=rgb.numpy().copy(),
        coverage=coverage.numpy().copy(),
        label=label.numpy().copy(),
        depth=depth.numpy().copy(),
    )


def render_labels(
    surfaces: Sequence[Surface], labels: Sequence[int], camera: Camera, device: str = "cpu"
) -> NDArray[np.uint8]:
    """(H, W) labels of the given surfaces alone: amodal masks, whatever stands before them."""
    mesh = _mesh(surfaces, device)
    out = wp.zeros((camera.height, camera.width), dtype=wp.uint8, device=device)
    face_label = wp.array(_per_face(surfaces, labels), dtype=wp.int32, device=device)
    k = wp.vec4(camera.fx, camera.fy, camera.cx, camera.cy)
    wp.launch(_trace_labels, out.shape, [mesh.id, face_label, k], [out], device=device)
    return out.numpy().copy()
