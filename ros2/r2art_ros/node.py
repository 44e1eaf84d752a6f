"""The node: subscribes to image and camera_info, publishes what `Estimator` says.

The only module that needs ROS.
"""

import importlib
import re
from typing import Any

import rclpy
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.executors import ExternalShutdownException
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState
from tf2_msgs.msg import TFMessage
from vision_msgs.msg import Detection3DArray

from r2art.core.errors import R2ArtError
from r2art_ros.estimate import Estimator
from r2art_ros.pairing import Pairing
from r2art_ros.results import USED
from r2art_ros.settings import Settings, parameters

EVERY = 10.0  # s between repetitions of one and the same warning
NUMBER = re.compile(r"\d[\d.]*")


def message_types() -> dict[str, Any]:
    """The classes of the messages that are published, and of what they are made of."""
    found = {}
    for name in USED:
        package, _, message = name.split("/")
        found[name] = getattr(importlib.import_module(f"{package}.msg"), message)
    return found


class EstimateNode(Node):
    """Poses of parts and states of joints, for every image that it can keep up with."""

    def __init__(self) -> None:
        super().__init__("r2art")
        for name, default, about in parameters():
            described = ParameterDescriptor(description=about, read_only=True)
            self.declare_parameter(name, default, described)
        told = {name: self.get_parameter(name).value for name, *_ in parameters()}
        settings = Settings(**told)
        self._estimator = Estimator(settings, message_types())
        self._pairing = Pairing(settings.slop)
        self._said: dict[str, float] = {}
        self._detections = self.create_publisher(Detection3DArray, "~/detections", 10)
        self._joint_states = self.create_publisher(JointState, "~/joint_states", 10)
        self._tf = None
        if settings.publish_tf:
            self._tf = self.create_publisher(TFMessage, "/tf", QoSProfile(depth=100))
        kind = CompressedImage if settings.compressed else Image
        # Best effort and short queues: while one image is worked on, others are dropped.
        self.create_subscription(kind, "image", self._on_image, qos_profile_sensor_data)
        self.create_subscription(CameraInfo, "camera_info", self._on_info, qos_profile_sensor_data)

    def _on_image(self, image: Any) -> None:
        self._publish(self._pairing.add_image(image))

    def _on_info(self, info: Any) -> None:
        self._publish(self._pairing.add_info(info))

    def _publish(self, pair: tuple[Any, Any] | None) -> None:
        if pair is None:
            return
        try:
            seen = self._estimator.estimate(*pair)
        except R2ArtError as error:
            self._say(str(error))
            return
        if not self.context.ok():  # stopped meanwhile: nothing can be published any more
            return
        for warning in seen.warnings:
            self._say(warning)
        self._detections.publish(seen.detections)
        if seen.joint_states is not None:
            self._joint_states.publish(seen.joint_states)
        if seen.frames is not None and self._tf is not None:
            self._tf.publish(seen.frames)

    def _say(self, warning: str) -> None:
        """Log a warning, unless it was logged a moment ago, perhaps with other numbers."""
        now = self.get_clock().now().nanoseconds * 1e-9
        kind = NUMBER.sub("#", warning)
        if abs(now - self._said.get(kind, -EVERY)) >= EVERY:
            self._said[kind] = now
            self.get_logger().warning(warning)


def main(args: list[str] | None = None) -> int:
    """Run the node until it is stopped; 2 to 4, as `r2art`, where it cannot start."""
    rclpy.init(args=args)
    try:
        rclpy.spin(EstimateNode())
    except R2ArtError as error:
        get_logger("r2art").fatal(str(error))
        return error.exit_code
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()
    return 0
