"""ros2 launch r2art_ros r2art.launch.py image:=/camera/image_raw camera_info:=/camera/camera_info

Other parameters: params_file:=my.yaml, a copy of config/r2art.yaml.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

ARGUMENTS = {
    "image": ("/camera/image_raw", "topic of the images"),
    "camera_info": ("/camera/camera_info", "topic of their camera_info"),
    "joint_states": ("/r2art/joint_states", "topic of the joint states"),
    "detections": ("/r2art/detections", "topic of the detections"),
}


def generate_launch_description() -> LaunchDescription:
    """One node, with its topics and its file of parameters."""
    config = Path(get_package_share_directory("r2art_ros")) / "config" / "r2art.yaml"
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=about)
        for name, (default, about) in ARGUMENTS.items()
    ]
    declared.append(
        DeclareLaunchArgument(
            "params_file", default_value=str(config), description="the node's parameters"
        )
    )
    node = Node(
        package="r2art_ros",
        executable="estimate",
        name="r2art",
        output="screen",
        parameters=[LaunchConfiguration("params_file")],
        remappings=[
            ("image", LaunchConfiguration("image")),
            ("camera_info", LaunchConfiguration("camera_info")),
            ("~/joint_states", LaunchConfiguration("joint_states")),
            ("~/detections", LaunchConfiguration("detections")),
        ],
    )
    return LaunchDescription([*declared, node])
