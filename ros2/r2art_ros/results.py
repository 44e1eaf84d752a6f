"""Predictions to ROS messages.

The camera frame of a prediction (x right, y down, z forward) is the optical frame of REP 103,
which an image's ``header.frame_id`` names; poses need no turning. Metres and radians on both
sides.

Messages are made by classes that are handed in, by keyword, every field given and no array but
lists: rclpy's classes take that, and so do those of any other library of message definitions.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from r2art.core.prediction import PartEstimate, Prediction
from r2art.run.export.rotations import quaternion

Types = Mapping[str, Callable[..., Any]]
"""Message classes by name, such as ``"sensor_msgs/msg/JointState"``; see ``USED``."""

USED = (
    "geometry_msgs/msg/Point",
    "geometry_msgs/msg/Pose",
    "geometry_msgs/msg/PoseWithCovariance",
    "geometry_msgs/msg/Quaternion",
    "geometry_msgs/msg/Transform",
    "geometry_msgs/msg/TransformStamped",
    "geometry_msgs/msg/Vector3",
    "sensor_msgs/msg/JointState",
    "tf2_msgs/msg/TFMessage",
    "vision_msgs/msg/BoundingBox3D",
    "vision_msgs/msg/Detection3D",
    "vision_msgs/msg/Detection3DArray",
    "vision_msgs/msg/ObjectHypothesis",
    "vision_msgs/msg/ObjectHypothesisWithPose",
)
NOT_KNOWN = [0.0] * 36  # a covariance; what the prediction tells instead is the confidence


def frame_of(prediction: Prediction, part: PartEstimate, prefix: str = "") -> str:
    """Name of a part's frame: ``laptop/lid``."""
    return f"{prefix}{prediction.category}/{part.name}"


def detections(types: Types, prediction: Prediction | None, header: Any, prefix: str = "") -> Any:
    """A ``vision_msgs/Detection3DArray``: one detection for each part, none for no prediction.

    ``results[0]`` has the part's class (``laptop/lid``), confidence and pose (of its frame, not
    of its box); ``bbox`` is its box; ``id`` the name of its frame.
    """
    parts = () if prediction is None else prediction.parts
    return types["vision_msgs/msg/Detection3DArray"](
        header=header,
        detections=[_detection(types, prediction, part, header, prefix) for part in parts],
    )


def _detection(types: Types, prediction: Any, part: PartEstimate, header: Any, prefix: str) -> Any:
    in_camera = np.array(part.cam_T_part, float)
    of_box = in_camera.copy()
    of_box[:3, 3] += in_camera[:3, :3] @ part.box_center
    hypothesis = types["vision_msgs/msg/ObjectHypothesis"](
        class_id=frame_of(prediction, part), score=float(part.confidence)
    )
    pose = types["geometry_msgs/msg/PoseWithCovariance"](
        pose=_pose(types, in_camera), covariance=list(NOT_KNOWN)
    )
    result = types["vision_msgs/msg/ObjectHypothesisWithPose"](hypothesis=hypothesis, pose=pose)
    box = types["vision_msgs/msg/BoundingBox3D"](
        center=_pose(types, of_box), size=_xyz(types, "Vector3", part.box_size)
    )
    return types["vision_msgs/msg/Detection3D"](
        header=header, results=[result], bbox=box, id=frame_of(prediction, part, prefix)
    )


def joint_states(types: Types, prediction: Prediction, header: Any, prefix: str = "") -> Any:
    """A ``sensor_msgs/JointState``: name and position of every joint, rad or m, 0 for closed."""
    return types["sensor_msgs/msg/JointState"](
        header=header,
        name=[prefix + joint.name for joint in prediction.joints],
        position=[float(joint.state) for joint in prediction.joints],
        velocity=[],
        effort=[],
    )


def frames(types: Types, prediction: Prediction, header: Any, prefix: str = "") -> Any:
    """A ``tf2_msgs/TFMessage``: the frame of every part, below the camera's."""
    return types["tf2_msgs/msg/TFMessage"](
        transforms=[
            types["geometry_msgs/msg/TransformStamped"](
                header=header,
                child_frame_id=frame_of(prediction, part, prefix),
                transform=types["geometry_msgs/msg/Transform"](
                    translation=_xyz(types, "Vector3", part.cam_T_part[:3, 3]),
                    rotation=_rotation(types, part.cam_T_part[:3, :3]),
                ),
            )
            for part in prediction.parts
        ]
    )


def _pose(types: Types, pose: NDArray[np.floating]) -> Any:
    return types["geometry_msgs/msg/Pose"](
        position=_xyz(types, "Point", pose[:3, 3]), orientation=_rotation(types, pose[:3, :3])
    )


def _xyz(types: Types, name: str, values: NDArray[np.floating]) -> Any:
    x, y, z = (float(v) for v in values)
    return types[f"geometry_msgs/msg/{name}"](x=x, y=y, z=z)


def _rotation(types: Types, R: NDArray[np.floating]) -> Any:
    w, x, y, z = (float(v) for v in quaternion(R))
    return types["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w)
