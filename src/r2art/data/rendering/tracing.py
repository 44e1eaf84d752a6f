"""The ray tracer's kernels: what camera rays see, ambient light, finer rays, labels."""

# pyright: reportArgumentType=false, reportAssignmentType=false, reportAttributeAccessIssue=false
# pyright: reportCallIssue=false, reportGeneralTypeIssues=false, reportInvalidTypeForm=false
# pyright: reportOperatorIssue=false
# Kernels are written in Warp's own language, which type checkers take for Python.

import warp as wp

from r2art.data.rendering.rasteriser import NOTHING, face_of
from r2art.data.rendering.shading import FAR, Geometry, Hit, Lighting, Materials, environment, shade

wp.set_module_options({"fast_math": True, "enable_backward": False})

UNKNOWN = wp.constant(-1.0)  # openness where no ray has probed it


@wp.func
def ray(k: wp.vec4, x: float, y: float):
    """Unit direction through a point of the image; ``k`` is fx fy cx cy."""
    return wp.normalize(wp.vec3((x - k[2]) / k[0], (y - k[3]) / k[1], 1.0))


@wp.func
def hit_by(g: Geometry, face: int, d: wp.vec3):
    """Where a ray from the origin meets the plane of a face."""
    mesh = wp.mesh_get(g.mesh)
    a = mesh.points[g.faces[3 * face]]
    ab = mesh.points[g.faces[3 * face + 1]] - a
    ac = mesh.points[g.faces[3 * face + 2]] - a
    n = wp.cross(ab, ac)
    hit = Hit()
    hit.face = face
    hit.normal = wp.normalize(n)
    hit.t = wp.dot(n, a) / wp.dot(n, d)
    p = d * hit.t - a
    scale = 1.0 / wp.dot(n, n)
    hit.v = wp.dot(wp.cross(p, ac), n) * scale
    hit.w = wp.dot(wp.cross(ab, p), n) * scale
    hit.u = 1.0 - hit.v - hit.w
    return hit


@wp.kernel
def shade_centers(
    g: Geometry,
    m: Materials,
    light: Lighting,
    k: wp.vec4,
    seed: int,
    nearest: wp.array2d(dtype=wp.uint64),
    rgb: wp.array2d(dtype=wp.vec3),
    ambient: wp.array2d(dtype=wp.vec3),
    openness: wp.array2d(dtype=wp.float32),
    coverage: wp.array2d(dtype=wp.float32),
    label: wp.array2d(dtype=wp.uint8),
    depth: wp.array2d(dtype=wp.float32),
):
    """Shade, label and measure what the ray through each pixel's centre hits first."""
    y, x = wp.tid()
    rng = wp.rand_init(seed, y * label.shape[1] + x)
    d = ray(k, float(x) + 0.5, float(y) + 0.5)
    openness[y, x] = UNKNOWN
    if nearest[y, x] != NOTHING:
        hit = hit_by(g, face_of(nearest[y, x]), d)
        probe = wp.where((x + y) % 2 == 0, UNKNOWN, 1.0)
        color, near, open_sky = shade(g, m, light, d, hit, probe, rng)
        rgb[y, x] = color
        ambient[y, x] = near
        if probe < 0.0:
            openness[y, x] = open_sky
        coverage[y, x] = 1.0
        label[y, x] = wp.uint8(g.face_label[hit.face])
        depth[y, x] = hit.t * d[2]
    elif light.behind > 0.0:
        rgb[y, x] = environment(light.sharp, light.world_R_cam, d)


@wp.kernel
def add_ambient(
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
        total = float(0.0)  # noqa: UP018 (a literal would be constant in the loop)
        count = float(0.0)  # noqa: UP018
        for dy in range(-3, 4):
            v = wp.clamp(y + dy, 0, label.shape[0] - 1)
            for i in range(4):  # every second pixel has been probed
                dx = 2 * i - 3 + (x + y + dy + 1) % 2
                u = wp.clamp(x + dx, 0, label.shape[1] - 1)
                near = wp.abs(depth[v, u] - depth[y, x]) < 0.03 * depth[y, x]
                if near and openness[v, u] >= 0.0 and label[v, u] == label[y, x]:
                    total += openness[v, u]
                    count += 1.0
        if count > 0.0:
            total /= count
        else:
            total = 1.0
        smooth[y, x] = total
        rgb[y, x] += ambient[y, x] * total
    else:
        smooth[y, x] = 1.0


@wp.kernel
def refine(
    g: Geometry,
    m: Materials,
    light: Lighting,
    k: wp.vec4,
    seed: int,
    rays: int,
    pixels: wp.array(dtype=wp.vec2i),
    openness: wp.array2d(dtype=wp.float32),
    rgb: wp.array2d(dtype=wp.vec3),
    coverage: wp.array2d(dtype=wp.float32),
):
    """Average more rays into the given pixels."""
    i = wp.tid()
    x = pixels[i][0]
    y = pixels[i][1]
    rng = wp.rand_init(seed, i)
    color = rgb[y, x]
    covered = coverage[y, x]
    for s in range(rays):
        d = ray(k, float(x) + wp.randf(rng), float(y) + wp.randf(rng))
        q = wp.mesh_query_ray(g.mesh, wp.vec3(), d, FAR)
        if q.result:
            open_sky = openness[y, x]
            hit = Hit(q.face, q.t, q.u, q.v, 1.0 - q.u - q.v, q.normal)
            lit, near, _ = shade(g, m, light, d, hit, open_sky, wp.rand_init(seed + s + 1, i))
            color += lit + near * open_sky
            covered += 1.0
        elif light.behind > 0.0:
            color += environment(light.sharp, light.world_R_cam, d)
    rgb[y, x] = color / float(rays + 1)
    coverage[y, x] = covered / float(rays + 1)
