"""A prediction as a URDF file, at home in ROS, yourdfpy, MuJoCo, PyBullet and Isaac.

The tree starts at the camera's frame: link ``opencv_camera``, then the root part, fixed where it
is seen. A URDF joint must turn about the origin of the link it moves, which the frames of parts do
not; so a joint moves a link ``PART_body``, with origin on the axis, that carries box and mass, and
fixed to it is a link ``PART``, whose frame is the part's. Every part is thus a link of its name
posed as the prediction says, once the joints stand where the prediction says.

URDF itself knows no state. It stands where ros2_control looks for it (``initial_value`` of the
joint's position), which all other programs skip.
"""

from collections.abc import Mapping
from types import MappingProxyType
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from numpy.typing import NDArray

from r2art.core.palette import part_color
from r2art.core.prediction import JointEstimate, PartEstimate, Prediction
from r2art.run.export.mechanism import Link, links, rigid, translation
from r2art.run.export.rotations import roll_pitch_yaw
from r2art.run.export.solids import CAMERA, OPACITY, distinct, document, mass_and_inertia, numbers

FloatArray = NDArray[np.floating]

EFFORT, VELOCITY = 1000.0, 10.0
"""URDF demands both of every limited joint; no photo tells them."""
WEIGHTLESS = (1e-6, np.full(3, 1e-9))
"""kg, kg m²: of a moving link that is a mere frame. PyBullet gives 1 kg to one without masses."""
AT_ORIGIN = MappingProxyType({"xyz": "0 0 0"})
ABOUT = (
    " Estimated by r2art from one photo. Metres, radians. The states of the joints in the photo "
    "are their initial_value below. Masses, effort and velocity are placeholders. "
)


def to_urdf(prediction: Prediction) -> bytes:
    """The bytes of a ``.urdf`` file; see the module for its links."""
    robot = Element("robot", name=prediction.category)
    robot.append(ElementTree.Comment(ABOUT))
    robot.append(_for_mujoco())
    names = [part.name for part in prediction.parts]
    camera = distinct(CAMERA, names)
    root = prediction.parts[0]
    _link(robot, camera)
    _fill(_link(robot, root.name), root, 0, np.zeros(3))
    joint_names = [joint.name for joint in prediction.joints]
    fixed = distinct(f"{camera}_to_{root.name}", joint_names)
    _joint(robot, fixed, "fixed", camera, root.name, rigid(root.cam_T_part))
    for link in links(prediction):
        _moving(robot, link, prediction.parts, [*names, camera], [*joint_names, fixed])
    if prediction.joints:
        robot.append(_states(prediction))
    return document(robot)


def _moving(
    robot: Element,
    link: Link,
    parts: tuple[PartEstimate, ...],
    links_taken: list[str],
    joints_taken: list[str],
) -> None:
    """Add a joint, the body it moves, and fixed to that the part's frame."""
    part, joint = parts[link.child], link.joint
    body = distinct(f"{part.name}_body", links_taken)
    _fill(_link(robot, body), part, link.child, link.pivot)
    rest = link.parent_T_rest @ translation(link.pivot)
    element = _joint(robot, joint.name, joint.kind, parts[link.parent].name, body, rest)
    SubElement(element, "axis", xyz=numbers(*link.axis))
    lower, upper = joint.limits
    limit = {"lower": lower, "upper": upper, "effort": EFFORT, "velocity": VELOCITY}
    SubElement(element, "limit", {k: numbers(v) for k, v in limit.items()})
    _inertial(_link(robot, part.name), *WEIGHTLESS)
    fixed = distinct(f"{body}_to_{part.name}", joints_taken)
    _joint(robot, fixed, "fixed", body, part.name, translation(-link.pivot))


def _link(robot: Element, name: str) -> Element:
    return SubElement(robot, "link", name=name)


def _fill(link: Element, part: PartEstimate, index: int, origin: FloatArray) -> None:
    """Give a link the box of a part; the link's origin is a point of the part's frame."""
    place = {"xyz": numbers(*(part.box_center - origin))}
    _inertial(link, *mass_and_inertia(part), place)
    for use in ("visual", "collision"):
        element = SubElement(link, use)
        SubElement(element, "origin", place)
        SubElement(SubElement(element, "geometry"), "box", size=numbers(*part.box_size))
        if use == "visual":
            rgba = [c / 255 for c in part_color(index)]
            material = SubElement(element, "material", name=f"{link.get('name')}_color")
            SubElement(material, "color", rgba=numbers(*np.round(rgba, 3), OPACITY))


def _inertial(
    link: Element, mass: float, inertia: FloatArray, place: Mapping[str, str] = AT_ORIGIN
) -> None:
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "origin", dict(place))
    SubElement(inertial, "mass", value=numbers(mass))
    ixx, iyy, izz = inertia
    moments = {"ixx": ixx, "ixy": 0, "ixz": 0, "iyy": iyy, "iyz": 0, "izz": izz}
    SubElement(inertial, "inertia", {k: numbers(v) for k, v in moments.items()})


def _joint(
    robot: Element, name: str, kind: str, parent: str, child: str, pose: FloatArray
) -> Element:
    joint = SubElement(robot, "joint", name=name, type=kind)
    xyz, rpy = numbers(*pose[:3, 3]), numbers(*roll_pitch_yaw(pose[:3, :3]))
    SubElement(joint, "origin", xyz=xyz, rpy=rpy)
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    return joint


def _for_mujoco() -> Element:
    """MuJoCo's own element within URDF: without it it would merge the fixed links away."""
    mujoco = Element("mujoco")
    SubElement(mujoco, "compiler", fusestatic="false", discardvisual="false")
    return mujoco


def _states(prediction: Prediction) -> Element:
    """The states, as ros2_control and its mock hardware read them."""
    element = Element("ros2_control", {"name": prediction.category, "type": "system"})
    hardware = SubElement(element, "hardware")
    SubElement(hardware, "plugin").text = "mock_components/GenericSystem"
    for joint in prediction.joints:
        _state(element, joint)
    return element


def _state(control: Element, joint: JointEstimate) -> None:
    element = SubElement(control, "joint", name=joint.name)
    command = SubElement(element, "command_interface", name="position")
    for name, value in zip(("min", "max"), joint.limits, strict=True):
        SubElement(command, "param", name=name).text = numbers(value)
    state = SubElement(element, "state_interface", name="position")
    SubElement(state, "param", name="initial_value").text = numbers(joint.state)
