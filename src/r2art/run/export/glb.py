"""A prediction as a 3D scene: one GLB file (binary glTF 2.0) any viewer opens and plays.

glTF looks along -z with y up, OpenCV along +z with y down. One node, ``opencv_camera``, turns the
one into the other (half a turn about x). In it every part is a node of its own name whose matrix
is exactly the ``cam_T_part`` of the prediction, holding the part's box, and every joint an arrow at
its pivot along its axis. ``photo_camera`` is the camera that took the photo.

Every joint has an animation of its name that takes it from its lower limit to its upper and back.
What a joint moves hangs below its arrow, in a node that carries the camera's frame along; as long
as no animation plays, that frame is the camera's own. So chains move as chains, animations may
play together, and all poses can still be written in the camera's frame.
"""

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.palette import WHITE, part_color
from r2art.core.prediction import JointEstimate, PartEstimate, Prediction
from r2art.run.export.gltf import Document
from r2art.run.export.mechanism import inverse
from r2art.run.export.rotations import quaternion
from r2art.run.export.shapes import arrow, box, box_edges

FloatArray = NDArray[np.floating]

GLTF_T_OPENCV = np.diag([1.0, -1.0, -1.0, 1.0])
FACE_ALPHA = 0.4
SECONDS = 2.0
"""From one limit of a joint to the other."""
STEP = np.pi / 4
"""rad between keys; viewers turn the short way from one key to the next."""


def to_glb(prediction: Prediction) -> bytes:
    """The bytes of a ``.glb`` file with all parts and joints of a prediction, in metres."""
    scene = Document()
    frame = scene.node("opencv_camera", GLTF_T_OPENCV)
    index = {part.name: p for p, part in enumerate(prediction.parts)}
    frames = [frame]
    scene.adopt(frame, [_part(scene, prediction.parts[0], 0)])
    for j, joint in enumerate(prediction.joints):
        part = prediction.parts[j + 1]
        moving = _joint(scene, joint, part)
        carried = scene.node(f"carried_by_{joint.name}", inverse(_pose_along(joint)))
        scene.adopt(frames[index[joint.parent]], [moving])
        scene.adopt(moving, [carried])
        scene.adopt(carried, [_part(scene, part, j + 1)])
        frames.append(carried)
    return scene.finish(roots=[frame, _camera(scene, prediction.camera)])


def _part(scene: Document, part: PartEstimate, index: int) -> int:
    low, high = part.box_center - part.box_size / 2, part.box_center + part.box_size / 2
    positions, normals, triangles = box(low, high)
    solid = scene.primitive(positions, triangles, part_color(index), FACE_ALPHA, normals)
    corners, edges = box_edges(low, high)
    outline = scene.primitive(corners, edges, part_color(index))
    return scene.node(part.name, part.cam_T_part, mesh=scene.mesh(part.name, [solid, outline]))


def _joint(scene: Document, joint: JointEstimate, child: PartEstimate) -> int:
    """The joint's arrow, and its animation."""
    length = 0.6 * float(np.linalg.norm(child.box_size))
    positions, normals, triangles = arrow(length, radius=0.008 * length)
    mesh = scene.mesh(joint.name, [scene.primitive(positions, triangles, WHITE, 1.0, normals)])
    pose = _pose_along(joint)
    place = {"translation": pose[:3, 3].tolist(), "rotation": _xyzw(quaternion(pose[:3, :3]))}
    facts = {"kind": joint.kind, "state": joint.state, "limits": list(joint.limits)}
    node = scene.node(joint.name, **place, mesh=mesh, extras=facts)
    low, high = joint.limits
    if low < high:
        _animate(scene, node, joint, pose)
    return node


def _animate(scene: Document, node: int, joint: JointEstimate, pose: FloatArray) -> None:
    """From the lower limit to the upper and back, each at a steady pace."""
    low, high = joint.limits
    turns = joint.kind == "revolute"
    keys = int(np.ceil((high - low) / STEP)) + 1 if turns else 2
    there = np.linspace(low, high, keys)
    states = np.concatenate([there, there[-2::-1]])
    seconds = np.linspace(0, 2 * SECONDS, len(states))
    away = states - joint.state
    if turns:
        path, values = "rotation", _turned(quaternion(pose[:3, :3]), away)
    else:
        path, values = "translation", pose[:3, 3] + away[:, None] * pose[:3, 2]
    scene.animation(joint.name, node, path, seconds, values)


def _turned(q: FloatArray, angles: FloatArray) -> FloatArray:
    """(T, 4) x y z w of the quaternion w x y z, turned about its own z axis by (T,) angles."""
    w, x, y, z = q
    c, s = np.cos(angles / 2), np.sin(angles / 2)
    return np.stack([c * x + s * y, c * y - s * x, c * z + s * w, c * w - s * z], axis=-1)


def _xyzw(q: FloatArray) -> list[float]:
    return np.roll(q, -1).tolist()


def _camera(scene: Document, camera: Camera) -> int:
    return scene.node("photo_camera", camera=scene.camera(camera.fov_y, camera.aspect))


def _pose_along(joint: JointEstimate) -> FloatArray:
    """A (4, 4) pose at the joint's pivot whose z axis is the joint's."""
    axis = joint.axis / np.linalg.norm(joint.axis)
    helper = np.eye(3)[np.argmin(np.abs(axis))]
    x = np.cross(helper, axis)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x, np.cross(axis, x), axis], axis=1)
    pose[:3, 3] = joint.pivot
    return pose
