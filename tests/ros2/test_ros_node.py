"""The node itself, where there is a ROS 2 to run it: what it hears and says over the wire."""

import threading
import time

import numpy as np
import pytest
from ros_messages import PACKAGE

import r2art
from r2art.core.camera import Camera
from r2art.core.image import read_image

rclpy = pytest.importorskip("rclpy", reason="needs ROS 2")
pytest.importorskip("vision_msgs.msg", reason="needs ROS 2 with vision_msgs")


@pytest.fixture
def heard():
    """The node and a driver in two threads, and what comes of some images."""
    from r2art_ros.node import EstimateNode
    from rclpy.executors import MultiThreadedExecutor
    from rclpy.node import Node
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import CameraInfo, Image, JointState
    from tf2_msgs.msg import TFMessage
    from vision_msgs.msg import Detection3DArray

    rclpy.init(args=["--ros-args", "-p", "size:=0.3", "-r", "image:=/cam/image"])
    driver, node = Node("driver"), EstimateNode()
    images = driver.create_publisher(Image, "/cam/image", qos_profile_sensor_data)
    infos = driver.create_publisher(CameraInfo, "/camera_info", qos_profile_sensor_data)
    heard = {name: [] for name in ("detections", "joint_states", "tf")}
    for topic, kind in (
        ("/r2art/detections", Detection3DArray),
        ("/r2art/joint_states", JointState),
        ("/tf", TFMessage),
    ):
        driver.create_subscription(kind, topic, heard[topic.rpartition("/")[2]].append, 10)
    executor = MultiThreadedExecutor(2)
    executor.add_node(node)
    executor.add_node(driver)
    spinning = threading.Thread(target=executor.spin, daemon=True)
    spinning.start()
    photo = read_image(PACKAGE.parent / "examples" / "laptop.png")
    image = Image(height=photo.height, width=photo.width, encoding="rgb8", step=3 * photo.width)
    image.data = photo.pixels.tobytes()
    image.header.frame_id = "optical"
    info = CameraInfo(height=photo.height, width=photo.width)
    info.k = [600.0, 0.0, 319.5, 0.0, 600.0, 239.5, 0.0, 0.0, 1.0]
    sent = []
    end = time.monotonic() + 60
    while not heard["tf"] and time.monotonic() < end:
        stamp = driver.get_clock().now().to_msg()
        image.header.stamp = info.header.stamp = stamp
        sent.append((stamp.sec, stamp.nanosec))
        infos.publish(info)
        images.publish(image)
        time.sleep(0.3)
    time.sleep(0.3)
    executor.shutdown()
    rclpy.try_shutdown()
    spinning.join(10)
    camera = Camera(600, 600, 320, 240, photo.width, photo.height)
    return heard, sent, r2art.load().predict(photo, camera, size=0.3)


def test_the_node_publishes_what_the_predictor_says(heard):
    heard, sent, expected = heard
    joints, frames, found = (heard[n][0] for n in ("joint_states", "tf", "detections"))
    for message in (joints, found, *frames.transforms):
        stamp = message.header.stamp
        assert (stamp.sec, stamp.nanosec) in sent
        assert message.header.frame_id == "optical"
    assert list(joints.name) == [j.name for j in expected.joints]
    np.testing.assert_allclose(joints.position, [j.state for j in expected.joints], atol=1e-9)
    for frame, detection, part in zip(
        frames.transforms, found.detections, expected.parts, strict=True
    ):
        assert frame.child_frame_id == detection.id == f"{expected.category}/{part.name}"
        at = frame.transform.translation
        np.testing.assert_allclose([at.x, at.y, at.z], part.cam_T_part[:3, 3], atol=1e-9)
        size = detection.bbox.size
        np.testing.assert_allclose([size.x, size.y, size.z], part.box_size, atol=1e-9)
