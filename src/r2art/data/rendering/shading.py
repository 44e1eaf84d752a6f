"""Radiance of a surface point towards the camera, as Warp functions.

Directional lights with soft shadows and GGX highlights, image-based ambient light with one
occlusion ray, and reflections of the environment. Everything is in the camera frame, metres.
"""

# pyright: reportArgumentType=false, reportAssignmentType=false, reportAttributeAccessIssue=false
# pyright: reportCallIssue=false, reportGeneralTypeIssues=false, reportInvalidTypeForm=false
# pyright: reportOperatorIssue=false
# Kernels are written in Warp's own language, which type checkers take for Python.

import warp as wp

FAR = wp.constant(100.0)  # m, beyond which rays see the environment
OCCLUSION_REACH = wp.constant(0.7)  # m


@wp.struct
class Geometry:
    """All triangles of a scene; ``faces`` index the vertices' ``normals`` and ``uv``."""

    mesh: wp.uint64
    faces: wp.array(dtype=wp.int32)
    normals: wp.array(dtype=wp.vec3)
    uv: wp.array(dtype=wp.vec2)
    face_material: wp.array(dtype=wp.int32)
    face_label: wp.array(dtype=wp.int32)


@wp.struct
class Hit:
    """Where a ray meets a face: distance, weights of its three corners, its own normal."""

    face: wp.int32
    t: wp.float32
    u: wp.float32
    v: wp.float32
    w: wp.float32
    normal: wp.vec3


@wp.struct
class Materials:
    """Looks, one per surface; texels of all textures lie in one row."""

    color: wp.array(dtype=wp.vec3)
    surface: wp.array(dtype=wp.vec3)  # roughness, metallic, emission
    texture: wp.array(dtype=wp.vec3i)  # first texel, width, height; width 0: none
    texels: wp.array(dtype=wp.vec3ub)  # sRGB
    linear: wp.array(dtype=wp.float32)  # of the 256 values of a channel


@wp.struct
class Lighting:
    """Directional lights, and the environment: sharp for mirrors, blurred for ambient light."""

    direction: wp.array(dtype=wp.vec3)
    color: wp.array(dtype=wp.vec3)
    radius: wp.array(dtype=wp.float32)
    sharp: wp.array2d(dtype=wp.vec3)
    diffuse: wp.array(dtype=wp.vec3)  # 9 spherical harmonics of the irradiance / π
    world_R_cam: wp.mat33
    behind: wp.float32  # 1 shows the environment behind everything, 0 black


@wp.func
def texel(m: Materials, i: int):
    """Linear colour of a texel."""
    t = m.texels[i]
    return wp.vec3(m.linear[int(t[0])], m.linear[int(t[1])], m.linear[int(t[2])])


@wp.func
def base_color(m: Materials, material: int, uv: wp.vec2):
    """Linear colour, times the bilinear texture; uv (0, 0) is its lower left corner."""
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
        top = texel(m, row0 + x0) * (1.0 - ax) + texel(m, row0 + x1) * ax
        low = texel(m, row1 + x0) * (1.0 - ax) + texel(m, row1 + x1) * ax
        color = wp.cw_mul(color, top * (1.0 - ay) + low * ay)
    return color


@wp.func
def quick_atan2(y: float, x: float):
    """To 3e-4 rad, several times faster than the exact one."""
    ax = wp.abs(x)
    ay = wp.abs(y)
    a = wp.min(ax, ay) / wp.max(wp.max(ax, ay), 1.0e-12)
    s = a * a
    r = ((-0.0464964749 * s + 0.15931422) * s - 0.327622764) * s * a + a
    r = wp.where(ay > ax, 1.57079637 - r, r)
    r = wp.where(x < 0.0, 3.14159274 - r, r)
    return wp.where(y < 0.0, -r, r)


@wp.func
def quick_acos(x: float):
    """To 1e-4 rad (Abramowitz and Stegun 4.4.45)."""
    a = wp.min(wp.abs(x), 1.0)
    r = wp.sqrt(1.0 - a) * (1.5707288 + a * (-0.2121144 + a * (0.0742610 - 0.0187293 * a)))
    return wp.where(x < 0.0, 3.14159274 - r, r)


@wp.func
def environment(env: wp.array2d(dtype=wp.vec3), world_R_cam: wp.mat33, direction: wp.vec3):
    """Radiance that comes from a direction; the middle of the picture is -z, its top y."""
    d = world_R_cam * direction
    height = env.shape[0]
    width = env.shape[1]
    x = (quick_atan2(d[0], -d[2]) / 6.2831853 + 0.5) * float(width) - 0.5
    y = quick_acos(d[1]) / 3.14159265 * float(height) - 0.5
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
def pow5(x: float):
    """Schlick's fifth power."""
    return x * x * x * x * x


@wp.func
def diffuse(sh: wp.array(dtype=wp.vec3), world_R_cam: wp.mat33, direction: wp.vec3):
    """Cosine-weighted mean radiance about a direction, see `render.diffuse_environment`."""
    d = world_R_cam * direction
    x = d[0]
    y = d[1]
    z = d[2]
    flat = sh[0] + sh[1] * y + sh[2] * z + sh[3] * x + sh[4] * (x * y) + sh[5] * (y * z)
    flat += sh[6] * (3.0 * z * z - 1.0) + sh[7] * (x * z) + sh[8] * (x * x - y * y)
    return wp.vec3(wp.max(flat[0], 0.0), wp.max(flat[1], 0.0), wp.max(flat[2], 0.0))


@wp.func
def ggx(n: wp.vec3, v: wp.vec3, to_light: wp.vec3, f0: wp.vec3, roughness: float):
    """Light reflected by a rough surface, cosine included (Walter et al. 2007)."""
    h = wp.normalize(v + to_light)
    nl = wp.max(wp.dot(n, to_light), 0.0)
    nv = wp.max(wp.dot(n, v), 1.0e-3)
    nh = wp.max(wp.dot(n, h), 0.0)
    vh = wp.max(wp.dot(v, h), 0.0)
    a2 = roughness * roughness * roughness * roughness
    d = nh * nh * (a2 - 1.0) + 1.0
    k = (roughness + 1.0) * (roughness + 1.0) / 8.0
    g = (nl / (nl * (1.0 - k) + k)) * (nv / (nv * (1.0 - k) + k))
    fresnel = f0 + (wp.vec3(1.0, 1.0, 1.0) - f0) * pow5(1.0 - vh)
    return fresnel * (a2 / (3.14159265 * d * d) * g / wp.max(4.0 * nv, 1.0e-3))


@wp.func
def shade(
    g: Geometry,
    m: Materials,
    light: Lighting,
    d: wp.vec3,
    q: Hit,
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
    n = wp.normalize(g.normals[i0] * q.u + g.normals[i1] * q.v + g.normals[i2] * q.w)
    if wp.dot(n, d) > 0.0:
        n = -n
    flat = q.normal
    if wp.dot(flat, d) > 0.0:
        flat = -flat
    material = g.face_material[q.face]
    base = base_color(m, material, g.uv[i0] * q.u + g.uv[i1] * q.v + g.uv[i2] * q.w)
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
    ambient = wp.cw_mul(albedo, diffuse(light.diffuse, light.world_R_cam, n))
    mirror = d - n * (2.0 * wp.dot(n, d))
    soft = wp.clamp(roughness * 1.6, 0.0, 1.0)
    reflected = diffuse(light.diffuse, light.world_R_cam, mirror) * soft
    if soft < 1.0:
        reflected += environment(light.sharp, light.world_R_cam, mirror) * (1.0 - soft)
    glance = pow5(1.0 - wp.max(wp.dot(n, v), 0.0)) * (1.0 - roughness)
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
        if facing > 0.0:  # noqa: SIM102 (the ray is traced only if it matters)
            if not wp.mesh_query_ray_anyhit(g.mesh, point, to_light, FAR):
                lit = albedo * (facing / 3.14159265) + ggx(n, v, to_light, f0, roughness)
                color += wp.cw_mul(lit, light.color[i])
    return color, ambient, open_sky
