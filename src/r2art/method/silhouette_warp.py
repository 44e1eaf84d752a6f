"""Kernels of the fast silhouettes: posing, projecting and splatting in one pass; its adjoint.

One source in NVIDIA Warp serves CPU and CUDA, from a wheel alone. A patch is spread over ``TAPS``
pixels of a row at once: the canvas is seen as overlapping vectors, one from every pixel on, so
that a row of a splat is a single vector to add (forward) or to read (adjoint), which processors
do in one instruction. A margin of unused pixels before every row takes what falls beside the image.

A thread takes a whole image on a CPU, where Warp's threads run one after another, and a share of
its points on a GPU. Points that are not before the camera, not in the image or not finite are
skipped: they contribute nothing and get no gradient.
"""

# pyright: reportArgumentType=false, reportAttributeAccessIssue=false, reportCallIssue=false
# pyright: reportGeneralTypeIssues=false, reportInvalidTypeForm=false, reportOperatorIssue=false
# pyright: reportAssignmentType=false, reportIndexIssue=false
# Kernels are written in Warp's own language, which type checkers take for Python.

import warp as wp

TAPS = 8
"""Pixels that a vector holds; a kernel of radius 4 or less needs one vector per row."""

wp.config.log_level = wp.LOG_ERROR  # that there is no GPU is no news
wp.set_module_options({"enable_backward": False})

taps = wp.types.vector(length=TAPS, dtype=wp.float32)
ONES = wp.constant(taps(*[1.0] * TAPS))
ZEROS = wp.constant(taps(*[0.0] * TAPS))
FOUR = wp.constant(wp.vec4(0.5, 1.5, 2.5, 3.5))
CENTERS = wp.constant(taps(*[k + 0.5 for k in range(TAPS)]))


@wp.struct
class Surface:
    """(N, M) points (m), normals and areas (m²) of N part images, at rest."""

    points: wp.array2d(dtype=wp.vec3)
    normals: wp.array2d(dtype=wp.vec3)
    areas: wp.array2d(dtype=wp.float32)


@wp.struct
class Canvas:
    """N images of ``height`` × ``width``, each row after ``margin`` unused pixels.

    ``rows[k]`` are the ``TAPS`` pixels from the k-th on. ``radius`` is that of the kernel (px);
    what is not farther than ``near`` (m) is not seen.
    """

    rows: wp.array(dtype=taps)
    height: int
    width: int
    margin: int
    radius: float
    near: float


@wp.struct
class Patch:
    """A posed point: its place (m) and normal in the camera frame, its pixel and square pixels."""

    x: wp.vec3
    n: wp.vec3
    u: float
    v: float
    area: float
    seen: bool


@wp.func
def posed(T: wp.mat44, K: wp.mat33, point: wp.vec3, normal: wp.vec3, area: float, c: Canvas):
    """`projection.project` and `silhouette.patch_areas` of one point."""
    p = Patch()
    p.x = wp.transform_point(T, point)
    p.n = wp.transform_vector(T, normal)
    z = p.x[2]
    if z > c.near:
        p.u = K[0, 0] * p.x[0] / z + K[0, 2]
        p.v = K[1, 1] * p.x[1] / z + K[1, 2]
        p.area = K[0, 0] * K[1, 1] * area * wp.abs(wp.dot(p.n, p.x)) / (z * z * z)
        r = c.radius
        inside = p.u > -r and p.u < float(c.width) + r and p.v > -r and p.v < float(c.height) + r
        p.seen = inside and p.area >= 0.0
    return p


@wp.func
def first_tap(position: float, radius: float):
    """The first pixel that a kernel around ``position`` may reach."""
    return int(wp.floor(position - radius + 0.5))


@wp.func
def distances(u: float, first: int, radius: float):
    """From ``u`` to the centres of the pixels from ``first`` on, in radii."""
    return (CENTERS + ONES * (float(first) - u)) / radius


@wp.func
def falloff(distance: taps):
    """``(1 − d²)₊`` per tap; the kernel is its square, and ``4 d (1 − d²)₊ / r`` its slope."""
    return wp.max(ONES - wp.cw_mul(distance, distance), ZEROS)


@wp.func
def place(c: Canvas, image: int, row: int, column: int):
    """Where the pixels from (row, column) on lie among ``c.rows``."""
    return (image * c.height + row) * (c.width + c.margin) + c.margin + column


@wp.func_native(
    """
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
    asm volatile("red.global.add.v4.f32 [%0], {%1, %2, %3, %4};"
        :: "l"(pixels.data + at), "f"(value[0]), "f"(value[1]), "f"(value[2]), "f"(value[3])
        : "memory");
#else
    for (int k = 0; k < 4; ++k)
        if (value[k] != 0.0f) wp::atomic_add(pixels.data + at + k, value[k]);
#endif
    """
)
def add_four(pixels: wp.array(dtype=wp.float32), at: int, value: wp.vec4):
    """Add to four pixels from an ``at`` that is a multiple of 4, in one instruction on Hopper."""


@wp.func_native(
    """
#if defined(__CUDA_ARCH__)
    const unsigned all = 0xffffffffu;
    bool together = __activemask() == all;
    if (together) together = __all_sync(all, image == __shfl_sync(all, image, 0));
    if (together) {
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 4; ++j) {
                float sum = value.data[i][j];
                for (int far = 16; far > 0; far /= 2) sum += __shfl_down_sync(all, sum, far);
                if (threadIdx.x % 32 == 0) wp::atomic_add(&gradient.data[image].data[i][j], sum);
            }
        return;
    }
#endif
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 4; ++j)
            wp::atomic_add(&gradient.data[image].data[i][j], value.data[i][j]);
    """
)
def add_to_pose(gradient: wp.array(dtype=wp.mat44), image: int, value: wp.mat44):
    """Add the first three rows; on a GPU 32 threads with the same image add up theirs before."""


@wp.kernel
def splat(
    pose: wp.array(dtype=wp.mat44),
    K: wp.array(dtype=wp.mat33),
    surface: Surface,
    c: Canvas,
    threads: int,
):
    """Add the patches of all points to the canvas. Threads: images × shares of their points."""
    image, share = wp.tid()
    T = pose[image]
    camera = K[image]
    height = 0.9375 / c.radius
    for i in range(share, surface.points.shape[1], threads):
        p = posed(
            T, camera, surface.points[image, i], surface.normals[image, i],
            surface.areas[image, i], c,
        )  # fmt: skip
        if p.seen:
            top = first_tap(p.v, c.radius)
            bottom = top + int(wp.ceil(2.0 * c.radius))
            left = first_tap(p.u, c.radius)
            for block in range(0, c.margin, TAPS):
                across = falloff(distances(p.u, left + block, c.radius))
                across = wp.cw_mul(across, across) * (p.area * height * height)
                for y in range(wp.max(top, 0), wp.min(bottom, c.height)):
                    d = (float(y) + 0.5 - p.v) / c.radius
                    down = wp.max(1.0 - d * d, 0.0)
                    wp.atomic_add(c.rows, place(c, image, y, left + block), across * (down * down))


@wp.kernel
def splat_in_fours(
    pose: wp.array(dtype=wp.mat44),
    K: wp.array(dtype=wp.mat33),
    surface: Surface,
    c: Canvas,
    threads: int,
    pixels: wp.array(dtype=wp.float32),
):
    """`splat` for GPUs, by aligned groups of four ``pixels``."""
    image, share = wp.tid()
    T = pose[image]
    camera = K[image]
    height = 0.9375 / c.radius
    for i in range(share, surface.points.shape[1], threads):
        p = posed(
            T, camera, surface.points[image, i], surface.normals[image, i],
            surface.areas[image, i], c,
        )  # fmt: skip
        if p.seen:
            top = first_tap(p.v, c.radius)
            reach = int(wp.ceil(2.0 * c.radius))
            left = first_tap(p.u, c.radius)
            value = p.area * height * height
            for y in range(wp.max(top, 0), wp.min(top + reach, c.height)):
                d = (float(y) + 0.5 - p.v) / c.radius
                down = wp.max(1.0 - d * d, 0.0)
                begin = place(c, image, y, left)
                before = begin % 4
                for group in range(0, before + reach, 4):
                    first = float(left - before + group) - p.u
                    x = (FOUR + wp.vec4(first, first, first, first)) / c.radius
                    across = wp.max(wp.vec4(1.0, 1.0, 1.0, 1.0) - wp.cw_mul(x, x), wp.vec4())
                    across = wp.cw_mul(across, across) * (value * down * down)
                    add_four(pixels, begin - before + group, across)


@wp.kernel
def splat_adjoint(
    pose: wp.array(dtype=wp.mat44),
    K: wp.array(dtype=wp.mat33),
    surface: Surface,
    c: Canvas,
    threads: int,
    pose_gradient: wp.array(dtype=wp.mat44),
    gradient: Surface,
):
    """Carry the canvas's gradient, which ``c`` holds, back to poses and points."""
    image, share = wp.tid()
    T = pose[image]
    camera = K[image]
    height = 0.9375 / c.radius
    from_x = wp.mat33()
    from_n = wp.mat33()
    from_t = wp.vec3()
    for i in range(share, surface.points.shape[1], threads):
        point = surface.points[image, i]
        normal = surface.normals[image, i]
        p = posed(T, camera, point, normal, surface.areas[image, i], c)
        if p.seen:
            top = first_tap(p.v, c.radius)
            bottom = top + int(wp.ceil(2.0 * c.radius))
            left = first_tap(p.u, c.radius)
            by_area = float(0.0)  # noqa: UP018 (a literal would be constant in the loop)
            by_u = float(0.0)  # noqa: UP018
            by_v = float(0.0)  # noqa: UP018
            for block in range(0, c.margin, TAPS):
                weighted = taps()
                sloped = taps()
                for y in range(wp.max(top, 0), wp.min(bottom, c.height)):
                    d = (float(y) + 0.5 - p.v) / c.radius
                    down = wp.max(1.0 - d * d, 0.0)
                    row = c.rows[place(c, image, y, left + block)]
                    weighted += row * (down * down)
                    sloped += row * (down * d)
                d_across = distances(p.u, left + block, c.radius)
                across = falloff(d_across)
                squared = wp.cw_mul(across, across)
                by_area += wp.dot(weighted, squared)
                by_u += wp.dot(weighted, wp.cw_mul(across, d_across))
                by_v += wp.dot(sloped, squared)
            by_area *= height * height
            slope = 4.0 / c.radius * p.area * height * height
            by_u *= slope
            by_v *= slope
            x, n = to_camera_frame(p, camera, surface.areas[image, i], by_u, by_v, by_area)
            from_x += wp.outer(x, point)
            from_n += wp.outer(n, normal)
            from_t += x
            gradient.points[image, i] = wp.transform_vector(wp.transpose(T), x)
            gradient.normals[image, i] = wp.transform_vector(wp.transpose(T), n)
            gradient.areas[image, i] = by_area * unit_area(p, camera)
    R = from_x + from_n
    add_to_pose(
        pose_gradient,
        image,
        wp.mat44(
            R[0, 0], R[0, 1], R[0, 2], from_t[0],
            R[1, 0], R[1, 1], R[1, 2], from_t[1],
            R[2, 0], R[2, 1], R[2, 2], from_t[2],
            0.0, 0.0, 0.0, 0.0,
        ),
    )  # fmt: skip


@wp.func
def unit_area(p: Patch, K: wp.mat33):
    """Square pixels that a square metre of the patch covers."""
    z = p.x[2]
    return K[0, 0] * K[1, 1] * wp.abs(wp.dot(p.n, p.x)) / (z * z * z)


@wp.func
def to_camera_frame(p: Patch, K: wp.mat33, area: float, by_u: float, by_v: float, by_area: float):
    """The gradient of a patch's place and normal from that of its pixel and square pixels."""
    z = p.x[2]
    fu = K[0, 0] * by_u
    fv = K[1, 1] * by_v
    slant = wp.sign(wp.dot(p.n, p.x)) * by_area * K[0, 0] * K[1, 1] * area / (z * z * z)
    x = wp.vec3(fu / z, fv / z, -(fu * p.x[0] + fv * p.x[1]) / (z * z) - 3.0 * by_area * p.area / z)
    return x + slant * p.n, slant * p.x
