"""The ray tracer's kernels: camera rays, ambient light, finer rays, labels alone."""

# pyright: reportArgumentType=false, reportAssignmentType=false, reportAttributeAccessIssue=false
# pyright: reportCallIssue=false, reportGeneralTypeIssues=false, reportInvalidTypeForm=false
# pyright: reportOperatorIssue=false
# Kernels are written in Warp's own language, which type checkers take for Python.

import warp as wp

from r2art.data.shading import FAR, Geometry, Lighting, Materials, environment, shade

wp.set_module_options({"fast_math": True, "enable_backward": False})


@wp.func
def ray(k: wp.vec4, x: float, y: float):
    """Unit direction through a point of the image; ``k`` is fx fy cx cy."""
    return wp.normalize(wp.vec3((x - k[2]) / k[0], (y - k[3]) / k[1], 1.0))


@wp.kernel
def trace_centers(
    g: Geometry,
    m: Materials,
    light: Lighting,
    k: wp.vec4,
    seed: int,
    rgb: wp.array2d(dtype=wp.vec3),
    ambient: wp.array2d(dtype=wp.vec3),
    openness: wp.array2d(dtype=wp.float32),
    coverage: wp.array2d(dtype=wp.float32),
    label: wp.array2d(dtype=wp.uint8),
    depth: wp.array2d(dtype=wp.float32),
):
    """Shade, label and measure what the ray through each pixel's centre hits."""
    y, x = wp.tid()
    rng = wp.rand_init(seed, y * label.shape[1] + x)
    d = ray(k, float(x) + 0.5, float(y) + 0.5)
    q = wp.mesh_query_ray(g.mesh, wp.vec3(), d, FAR)
    if q.result:
        color, near, open_sky = shade(g, m, light, d, q, -1.0, rng)
        rgb[y, x] = color
        ambient[y, x] = near
        openness[y, x] = open_sky
        coverage[y, x] = 1.0
        label[y, x] = wp.uint8(g.face_label[q.face])
        depth[y, x] = q.t * d[2]
    else:
        rgb[y, x] = environment(light.sharp, light.world_R_cam, d) * light.behind


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
            lit, near, _ = shade(g, m, light, d, q, open_sky, wp.rand_init(seed + s + 1, i))
            color += lit + near * open_sky
            covered += 1.0
        else:
            color += environment(light.sharp, light.world_R_cam, d) * light.behind
    rgb[y, x] = color / float(rays + 1)
    coverage[y, x] = covered / float(rays + 1)


@wp.kernel
def trace_labels(
    mesh: wp.uint64,
    face_label: wp.array(dtype=wp.int32),
    k: wp.vec4,
    label: wp.array2d(dtype=wp.uint8),
):
    """Label what the ray through each pixel's centre hits, and nothing else."""
    y, x = wp.tid()
    q = wp.mesh_query_ray(mesh, wp.vec3(), ray(k, float(x) + 0.5, float(y) + 0.5), FAR)
    if q.result:
        label[y, x] = wp.uint8(face_label[q.face])
