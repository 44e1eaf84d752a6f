"""Kernels that fill faces into pixels: what is nearest, and whole silhouettes.

Filling finds what the rays through the pixels' centres hit several times faster than tracing
them one by one. Its result does not depend on the order of the faces, on any device.
"""

# pyright: reportArgumentType=false, reportAssignmentType=false, reportAttributeAccessIssue=false
# pyright: reportCallIssue=false, reportGeneralTypeIssues=false, reportInvalidTypeForm=false
# pyright: reportOperatorIssue=false
# Kernels are written in Warp's own language, which type checkers take for Python.

import warp as wp

wp.set_module_options({"fast_math": True, "enable_backward": False})

NOTHING = wp.constant(wp.uint64(0xFFFFFFFFFFFFFFFF))  # a pixel in which no face is seen


@wp.struct
class Face:
    """A triangle seen from the origin, and the pixels (both ends included) that it may cover.

    A ray d = α a + β b + γ c through a triangle abc has d · (a × b) = γ det(a b c), and so on: it
    hits where all three are of the determinant's sign. That holds for faces beside and behind
    the camera too.
    """

    ab: wp.vec3  # a × b, and so on, with the determinant's sign
    bc: wp.vec3
    ca: wp.vec3
    normal: wp.vec3
    offset: wp.float32  # normal · a: 0 where the face is seen edge on
    x: wp.vec2i
    y: wp.vec2i


@wp.func
def range_of(values: wp.vec3, size: int):
    """First and last pixel whose centre lies between the least and the greatest value."""
    low = wp.clamp(wp.ceil(wp.min(values) - 0.502), 0.0, float(size))
    high = wp.clamp(wp.floor(wp.max(values) - 0.498), -1.0, float(size - 1))
    return wp.vec2i(int(low), int(high))


@wp.func
def face_at(
    points: wp.array(dtype=wp.vec3),
    indices: wp.array(dtype=wp.int32),
    f: int,
    k: wp.vec4,
    height: int,
    width: int,
):
    """A face made ready; ``k`` is fx fy cx cy."""
    a = points[indices[3 * f]]
    b = points[indices[3 * f + 1]]
    c = points[indices[3 * f + 2]]
    face = Face()
    face.normal = wp.cross(b - a, c - a)
    face.offset = wp.dot(face.normal, a)
    turn = wp.where(face.offset > 0.0, 1.0, -1.0)
    face.ab = wp.cross(a, b) * turn
    face.bc = wp.cross(b, c) * turn
    face.ca = wp.cross(c, a) * turn
    face.x = wp.vec2i(0, width - 1)
    face.y = wp.vec2i(0, height - 1)
    if wp.min(wp.min(a[2], b[2]), c[2]) > 1.0e-6:
        u = wp.vec3(a[0] / a[2], b[0] / b[2], c[0] / c[2]) * k[0]
        v = wp.vec3(a[1] / a[2], b[1] / b[2], c[1] / c[2]) * k[1]
        face.x = range_of(u + wp.vec3(k[2], k[2], k[2]), width)
        face.y = range_of(v + wp.vec3(k[3], k[3], k[3]), height)
    return face


@wp.func
def through(x: int, y: int, k: wp.vec4):
    """Direction of depth 1 through a pixel's centre."""
    return wp.vec3((float(x) + 0.5 - k[2]) / k[0], (float(y) + 0.5 - k[3]) / k[1], 1.0)


@wp.func
def covers(face: Face, d: wp.vec3):
    """Whether a ray from the origin hits the face."""
    return wp.dot(d, face.ab) >= 0.0 and wp.dot(d, face.bc) >= 0.0 and wp.dot(d, face.ca) >= 0.0


@wp.func
def face_of(nearest: wp.uint64):
    """The face of a pixel of `nearest_faces`."""
    return int(nearest & wp.uint64(0xFFFFFFFF))


@wp.kernel
def nearest_faces(
    points: wp.array(dtype=wp.vec3),
    indices: wp.array(dtype=wp.int32),
    k: wp.vec4,
    nearest: wp.array2d(dtype=wp.uint64),
):
    """Depth (its bits, above) and number (below) of the nearest face of each pixel."""
    f = wp.tid()
    face = face_at(points, indices, f, k, nearest.shape[0], nearest.shape[1])
    if face.offset != 0.0:
        for y in range(face.y[0], face.y[1] + 1):
            for x in range(face.x[0], face.x[1] + 1):
                d = through(x, y, k)
                if covers(face, d):
                    depth = face.offset / wp.dot(face.normal, d)
                    if depth > 0.0:
                        key = wp.uint64(wp.cast(depth, wp.uint32)) << wp.uint64(32)
                        wp.atomic_min(nearest, y, x, key | wp.uint64(f))


@wp.kernel
def silhouettes(
    points: wp.array(dtype=wp.vec3),
    indices: wp.array(dtype=wp.int32),
    face_bit: wp.array(dtype=wp.int32),
    k: wp.vec4,
    bits: wp.array2d(dtype=wp.int32),
):
    """Set the bit of each face in the pixels that it covers, whatever is before it."""
    f = wp.tid()
    face = face_at(points, indices, f, k, bits.shape[0], bits.shape[1])
    if face.offset != 0.0:
        for y in range(face.y[0], face.y[1] + 1):
            for x in range(face.x[0], face.x[1] + 1):
                if covers(face, through(x, y, k)):
                    wp.atomic_or(bits, y, x, face_bit[f])


@wp.kernel
def labels_of(
    nearest: wp.array2d(dtype=wp.uint64),
    face_label: wp.array(dtype=wp.int32),
    label: wp.array2d(dtype=wp.uint8),
):
    """The label of what is nearest, 0 where nothing is."""
    y, x = wp.tid()
    if nearest[y, x] != NOTHING:
        label[y, x] = wp.uint8(face_label[face_of(nearest[y, x])])
