"""The 3D scene of one prediction: camera, photo, parts, axes.

The scene's frame is the camera's (OpenCV axes). Every part is a node of its own with its box
below it; a joint's arrow hangs on the joint's parent. So a slider moves frames and nothing else.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from viser import (
    ArrowsHandle,
    CameraFrustumHandle,
    ClientHandle,
    FrameHandle,
    LabelHandle,
    SceneApi,
    SceneNodeHandle,
)

from r2art.core.draw import EDGES, joint_arrow
from r2art.core.legend import state_text
from r2art.core.palette import AXIS_COLORS, GREY, WHITE, Color, part_color
from r2art.core.prediction import PartEstimate, Prediction
from r2art.run.export.mechanism import inverse, part_poses, rigid
from r2art.run.export.rotations import quaternion

FloatArray = NDArray[np.floating]

BEHIND = 1.08
"""Where the photo stands, in units of the distance of the object's farthest corner."""
OPACITY = 0.45
BESIDE = (1.0, -0.65, -0.75)
"""The first view's place in the camera frame, in units of the object's distance."""
FOV = float(np.radians(43))
AHEAD = np.array([0.0, 0.0, 1.0])


class Scene:
    """One prediction in 3D, on one browser tab.

    Attributes:
        parts: A frame for every part; its ``wxyz`` and ``position`` are the part's pose.
    """

    def __init__(
        self, client: ClientHandle, prediction: Prediction, picture: NDArray[np.uint8], name: str
    ) -> None:
        """Show a prediction.

        Args:
            client: The tab.
            prediction: What to show.
            picture: (H, W, 3) its photo, at any size.
            name: Of the node that holds all; no two scenes of a tab may share it, so that what
                the browser still knows of the last one never mixes with this one.
        """
        scene = client.scene
        self._root = scene.add_frame(name, show_axes=False)
        self._client = client
        self._prediction = prediction
        self._center = _corners(prediction).mean(axis=0)
        self._photo = _camera(scene, name, prediction, picture)
        self.parts: list[FrameHandle] = []
        self._boxes: list[SceneNodeHandle] = []
        for p, part in enumerate(prediction.parts):
            frame, *box = _part(scene, f"{name}/{p}", part, part_color(p))
            self.parts.append(frame)
            self._boxes += box
        self._axes: list[SceneNodeHandle] = [_root_axes(scene, name, prediction.parts[0])]
        self._labels: list[LabelHandle] = []
        for j in range(len(prediction.joints)):
            arrow, label = _joint(scene, name, prediction, j)
            self._axes += [arrow, label]
            self._labels.append(label)
        self.move({})

    def move(self, states: Mapping[str, float]) -> None:
        """Set joints, by name, to other states (rad, m); those left out stay as predicted."""
        poses = part_poses(self._prediction, states)
        with self._client.atomic():
            for frame, pose in zip(self.parts, poses, strict=True):
                frame.wxyz = quaternion(pose[:3, :3])
                frame.position = pose[:3, 3]
            for label, joint in zip(self._labels, self._prediction.joints, strict=True):
                state = states.get(joint.name, joint.state)
                label.text = f"{joint.name} {state_text(joint, state)}"

    def remove(self) -> None:
        """Take all of it away."""
        self._root.remove()

    def show(self, *, photo: bool, boxes: bool, axes: bool) -> None:
        """Show or hide what there is."""
        self._photo.visible = photo
        for node in self._boxes:
            node.visible = boxes
        for node in self._axes:
            node.visible = axes

    def look_from_camera(self) -> None:
        """Look as the photo was taken: the parts lie on their pictures."""
        camera = self._prediction.camera
        self._look(0.001 * AHEAD, AHEAD, 1.03 * camera.fov_y, camera.aspect)

    def look_from_beside(self) -> None:
        """Look from beside the camera, so that depth shows."""
        distance = float(np.linalg.norm(self._center))
        self._look(distance * np.array(BESIDE), 0.7 * self._center, FOV, aspect=1.0)

    def _look(self, position: FloatArray, at: FloatArray, fov: float, aspect: float) -> None:
        """Look so that the tab shows all of a field of view, ``fov`` (rad) high."""
        camera = self._client.camera
        across = max(1.0, aspect / camera.aspect)
        with self._client.atomic():
            camera.up_direction = (0.0, -1.0, 0.0)
            camera.position = position
            camera.look_at = at
            camera.fov = 2 * float(np.arctan(np.tan(fov / 2) * across))


def _camera(
    scene: SceneApi, root: str, prediction: Prediction, picture: NDArray[np.uint8]
) -> CameraFrustumHandle:
    """The camera's pyramid, with the photo for a base right behind the object."""
    camera = prediction.camera
    fov, aspect = camera.fov_y, camera.aspect
    distance = BEHIND * float(_corners(prediction)[:, 2].max())
    # viser gives a pyramid of scale 1 the volume 4, whatever its proportions.
    height = np.tan(fov / 2)
    return scene.add_camera_frustum(
        f"{root}/camera",
        fov=fov,
        aspect=aspect,
        scale=distance * float(np.cbrt(height * aspect * height / 3)),
        thickness=1.5,
        thickness_units="screen",
        color=GREY,
        image=picture,
        cast_shadow=False,
        receive_shadow=False,
    )


def _part(
    scene: SceneApi, name: str, part: PartEstimate, color: Color
) -> tuple[FrameHandle, SceneNodeHandle, SceneNodeHandle]:
    """A part's frame, and below it its box: solid and edges."""
    frame = scene.add_frame(name, show_axes=False)
    solid = scene.add_box(
        f"{name}/box",
        color=color,
        dimensions=part.box_size,
        position=part.box_center,
        opacity=OPACITY,
        side="double",
        cast_shadow=False,
        receive_shadow=False,
    )
    signs = np.array(EDGES) * 2 - 1
    edges = scene.add_line_segments(
        f"{name}/edges",
        points=part.box_center + signs * part.box_size / 2,
        colors=color,
        thickness=2.5,
        thickness_units="screen",
    )
    return frame, solid, edges


def _joint(
    scene: SceneApi, root: str, prediction: Prediction, index: int
) -> tuple[ArrowsHandle, LabelHandle]:
    """An arrow along a joint's axis and its label, fixed to the part that the joint hangs on."""
    joint, child = prediction.joints[index], prediction.parts[index + 1]
    parent = [part.name for part in prediction.parts].index(joint.parent)
    tail, tip = joint_arrow(joint, child)
    parent_T_cam = inverse(rigid(prediction.parts[parent].cam_T_part))
    ends = np.stack([tail, joint.pivot, tip]) @ parent_T_cam[:3, :3].T + parent_T_cam[:3, 3]
    radius = 0.007 * float(np.linalg.norm(child.box_size))
    name = f"{root}/{parent}/joint_{index}"
    arrow = scene.add_arrows(
        name,
        points=ends[None, ::2],
        colors=WHITE,
        shaft_radius=radius,
        head_radius=3 * radius,
        head_length=9 * radius,
    )
    scene.add_icosphere(f"{name}/pivot", radius=2.2 * radius, color=WHITE, position=ends[1])
    label = scene.add_label(f"{name}/label", joint.name, position=ends[2], anchor="bottom-center")
    return arrow, label


def _root_axes(scene: SceneApi, root: str, part: PartEstimate) -> ArrowsHandle:
    """Right, up and front of the root part in red, green and blue."""
    length = 0.3 * float(np.linalg.norm(part.box_size))
    points = np.stack([np.zeros((3, 3)), length * np.eye(3)], axis=1)
    radius = 0.02 * length
    return scene.add_arrows(
        f"{root}/0/axes",
        points=points,
        colors=np.array(AXIS_COLORS),
        shaft_radius=radius,
        head_radius=3 * radius,
        head_length=9 * radius,
    )


def _corners(prediction: Prediction) -> FloatArray:
    """(8 P, 3) corners of all boxes in the camera frame."""
    return np.concatenate([part.corners().reshape(8, 3) for part in prediction.parts])
