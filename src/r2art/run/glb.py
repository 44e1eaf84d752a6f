"""A prediction as a 3D scene: one GLB file (binary glTF 2.0) any viewer opens.

glTF looks along -z with y up, OpenCV along +z with y down. One node, ``opencv_camera``, turns the
one into the other (half a turn about x); below it every part is a node of its own name whose
matrix is exactly the ``cam_T_part`` of the prediction, holding the part's box, and every joint is
an arrow at its pivot along its axis. ``photo_camera`` is the camera that took the photo.

Written by hand because the file is small and importing a mesh library takes longer than the
prediction itself.
"""

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.palette import WHITE, Color, part_color
from r2art.core.prediction import JointEstimate, PartEstimate, Prediction

FloatArray = NDArray[np.floating]

TRIANGLES, LINES = 4, 1
FLOAT, UINT16 = 5126, 5123
VERTICES, INDICES = 34962, 34963
GLTF_T_OPENCV = np.diag([1.0, -1.0, -1.0, 1.0])
FACE_ALPHA = 0.4


def to_glb(prediction: Prediction) -> bytes:
    """The bytes of a ``.glb`` file with all parts and joints of a prediction, in metres."""
    scene = _Scene()
    parts = [scene.part(part, i) for i, part in enumerate(prediction.parts)]
    joints = [
        scene.joint(joint, part)
        for joint, part in zip(prediction.joints, prediction.parts[1:], strict=True)
    ]
    camera = scene.node("opencv_camera", GLTF_T_OPENCV, children=parts + joints)
    eye = scene.camera(prediction.camera)
    return scene.finish(roots=[camera, eye])


class _Scene:
    """The lists of a glTF document as they grow, and the one buffer they point into."""

    def __init__(self) -> None:
        self.buffer = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []
        self.materials: list[dict[str, Any]] = []
        self.meshes: list[dict[str, Any]] = []
        self.nodes: list[dict[str, Any]] = []
        self.cameras: list[dict[str, Any]] = []

    def node(self, name: str, matrix: FloatArray, **more: Any) -> int:
        column_major = np.asarray(matrix).T.ravel().tolist()
        return _append(self.nodes, {"name": name, "matrix": column_major, **more})

    def part(self, part: PartEstimate, index: int) -> int:
        low, high = part.box_center - part.box_size / 2, part.box_center + part.box_size / 2
        positions, normals, triangles = _box(low, high)
        solid = self.primitive(positions, triangles, part_color(index), FACE_ALPHA, normals)
        corners, edges = _box_edges(low, high)
        outline = self.primitive(corners, edges, part_color(index))
        mesh = _append(self.meshes, {"name": part.name, "primitives": [solid, outline]})
        return self.node(part.name, part.cam_T_part, mesh=mesh)

    def joint(self, joint: JointEstimate, child: PartEstimate) -> int:
        length = 0.6 * float(np.linalg.norm(child.box_size))
        positions, normals, triangles = _arrow(length, radius=0.008 * length)
        arrow = self.primitive(positions, triangles, WHITE, 1.0, normals)
        mesh = _append(self.meshes, {"name": joint.name, "primitives": [arrow]})
        facts = {"kind": joint.kind, "state": joint.state, "limits": list(joint.limits)}
        return self.node(joint.name, _pose_along(joint.axis, joint.pivot), mesh=mesh, extras=facts)

    def camera(self, camera: Camera) -> int:
        view = {
            "yfov": 2 * float(np.arctan(camera.height / 2 / camera.fy)),
            "aspectRatio": camera.width / camera.height * camera.fy / camera.fx,
            "znear": 0.01,
        }
        index = _append(self.cameras, {"type": "perspective", "perspective": view})
        return self.node("photo_camera", np.eye(4), camera=index)

    def primitive(
        self,
        positions: FloatArray,
        indices: NDArray[np.integer],
        color: Color,
        alpha: float = 1.0,
        normals: FloatArray | None = None,
    ) -> dict[str, Any]:
        """Triangles (with normals) or lines (without) of one colour."""
        attributes = {"POSITION": self.vertices(positions)}
        if normals is not None:
            attributes["NORMAL"] = self.vertices(normals)
        return {
            "attributes": attributes,
            "indices": self.indices(indices),
            "material": self.material(color, alpha),
            "mode": LINES if normals is None else TRIANGLES,
        }

    def vertices(self, array: FloatArray) -> int:
        array = array.astype("<f4")
        limits = {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        return self.accessor(array.tobytes(), VERTICES, FLOAT, len(array), "VEC3", **limits)

    def indices(self, array: NDArray[np.integer]) -> int:
        data = array.astype("<u2").tobytes()
        return self.accessor(data, INDICES, UINT16, array.size, "SCALAR")

    def accessor(
        self, data: bytes, target: int, component: int, count: int, kind: str, **limits: Any
    ) -> int:
        self.buffer.extend(bytes(-len(self.buffer) % 4))
        view = {
            "buffer": 0,
            "byteOffset": len(self.buffer),
            "byteLength": len(data),
            "target": target,
        }
        self.buffer.extend(data)
        accessor = {
            "bufferView": _append(self.views, view),
            "componentType": component,
            "count": count,
            "type": kind,
            **limits,
        }
        return _append(self.accessors, accessor)

    def material(self, color: Color, alpha: float) -> int:
        # glTF wants linear light, the palette is sRGB.
        linear = [float(np.round((c / 255) ** 2.2, 4)) for c in color]
        surface = {
            "baseColorFactor": [*linear, alpha],
            "metallicFactor": 0.0,
            "roughnessFactor": 0.8,
        }
        material = {"pbrMetallicRoughness": surface, "doubleSided": True}
        if alpha < 1:
            material["alphaMode"] = "BLEND"
        return _append(self.materials, material)

    def finish(self, roots: list[int]) -> bytes:
        self.buffer.extend(bytes(-len(self.buffer) % 4))
        document = {
            "asset": {"version": "2.0", "generator": "r2art"},
            "scene": 0,
            "scenes": [{"nodes": roots}],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "cameras": self.cameras,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": len(self.buffer)}],
        }
        text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        body = _chunk(b"JSON", text) + _chunk(b"BIN\0", bytes(self.buffer))
        return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack("<I4s", len(data), kind) + data


def _append(items: list, item: Any) -> int:
    items.append(item)
    return len(items) - 1


def _pose_along(axis: FloatArray, origin: FloatArray) -> FloatArray:
    """A (4, 4) pose at ``origin`` whose z axis is ``axis``."""
    helper = np.eye(3)[np.argmin(np.abs(axis))]
    x = np.cross(helper, axis)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x, np.cross(axis, x), axis], axis=1)
    pose[:3, 3] = origin
    return pose


def _box(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.integer]]:
    """Positions and normals (24, 3), four corners for each face, and triangles (12, 3)."""
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    positions, normals = [], []
    for axis in range(3):
        for side in (-1, 1):
            normal = side * np.eye(3)[axis]
            u = np.eye(3)[(axis + 1) % 3]
            positions.append(normal + square @ np.stack([u, np.cross(normal, u)]))
            normals.append(np.tile(normal, (4, 1)))
    corners = np.concatenate(positions)
    faces = 4 * np.arange(6)[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
    triangles = faces.reshape(12, 3)
    return (low + high) / 2 + corners * (high - low) / 2, np.concatenate(normals), triangles


def _box_edges(low: FloatArray, high: FloatArray) -> tuple[FloatArray, NDArray[np.integer]]:
    """The 8 corners of a box and the 12 edges (12, 2) between them."""
    bits = np.array([(i & 1, i >> 1 & 1, i >> 2 & 1) for i in range(8)])
    edges = [(i, i | b) for i in range(8) for b in (1, 2, 4) if not i & b]
    return np.where(bits, high, low), np.array(edges)


def _arrow(length: float, radius: float) -> tuple[FloatArray, FloatArray, NDArray[np.integer]]:
    """A thin arrow from the origin along z: shaft and head, revolved in 16 steps."""
    neck = 0.88 * length
    slope = np.array([length - neck, 3 * radius])  # the head's normal, (radial, along z)
    slope /= np.linalg.norm(slope)
    # (radius, z, radial normal, normal along z), pairs that span one band each
    profile = [
        [(radius, 0, 1, 0), (radius, neck, 1, 0)],
        [(0, neck, 0, -1), (3 * radius, neck, 0, -1)],
        [(3 * radius, neck, *slope), (0, length, *slope)],
    ]
    angles = np.linspace(0, 2 * np.pi, 17)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    positions, normals, triangles = [], [], []
    for band in profile:
        first = sum(map(len, positions))
        for r, z, radial, along in band:
            positions.append(np.c_[r * ring, np.full(17, z)])
            normals.append(np.c_[radial * ring, np.full(17, along)])
        steps = first + np.arange(16)[:, None, None]
        triangles.append((steps + np.array([[0, 1, 17], [1, 18, 17]])).reshape(-1, 3))
    return np.concatenate(positions), np.concatenate(normals), np.concatenate(triangles)
