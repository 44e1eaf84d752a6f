"""The real message definitions, without ROS: rosbags has them all but those of vision_msgs."""

import sys

import numpy as np
import pytest
from ros_messages import PACKAGE
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

sys.path.insert(0, str(PACKAGE))

# vision_msgs 4, that of ROS 2 Humble and later.
VISION_MSGS = {
    "BoundingBox3D": "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size",
    "ObjectHypothesis": "string class_id\nfloat64 score",
    "ObjectHypothesisWithPose": (
        "vision_msgs/ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose"
    ),
    "Detection3D": (
        "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\n"
        "vision_msgs/BoundingBox3D bbox\nstring id"
    ),
    "Detection3DArray": "std_msgs/Header header\nvision_msgs/Detection3D[] detections",
}


class Definitions:
    """Message classes by name, as strict as rclpy's about what their fields are given."""

    def __init__(self):
        self.store = get_typestore(Stores.ROS2_HUMBLE)
        for name, text in VISION_MSGS.items():
            full = f"vision_msgs/msg/{name}"
            self.store.register(get_types_from_msg(text, full))

    def __getitem__(self, name):
        make = self.store.types[name]
        kinds = make.__annotations__

        def message(**fields):
            assert set(fields) == {k for k in kinds if not k.startswith("__")}
            for key, value in fields.items():
                kind = str(kinds[key])
                if "ndarray" in kind:
                    assert isinstance(value, list)
                    assert all(isinstance(v, float) for v in value)
                    fields[key] = np.array(value, np.float64)
                elif kind in ("float", "str", "int"):
                    assert type(value).__name__ == kind, (name, key, value)
            return make(**fields)

        return message

    def there_and_back(self, message):
        """The message as another process receives it."""
        data = self.store.serialize_cdr(message, message.__msgtype__)
        return self.store.deserialize_cdr(data, message.__msgtype__)


@pytest.fixture(scope="session")
def types():
    return Definitions()


@pytest.fixture(scope="session")
def raw(types):
    """Makes messages of arrays and numbers as they are."""
    return types.store.types


@pytest.fixture(scope="session")
def header(raw):
    stamp = raw["builtin_interfaces/msg/Time"](sec=1_700_000_000, nanosec=123_456_789)
    return raw["std_msgs/msg/Header"](stamp=stamp, frame_id="camera_optical_frame")
