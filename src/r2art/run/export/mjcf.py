"""A prediction as an MJCF file, the format of MuJoCo.

The world is the camera's frame, every part a body of its name whose frame is the part's, and the
keyframe ``photo`` the states in the photo. Gravity pulls along the object's own −y, for so it
would stand in use. The boxes collide with all else but not with one another: a drawer's box lies
within its cabinet's.
"""

from collections.abc import Sequence
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.palette import part_color
from r2art.core.prediction import PartEstimate, Prediction
from r2art.run.export.mechanism import Link, links, rigid
from r2art.run.export.rotations import quaternion
from r2art.run.export.solids import OPACITY, document, mass_and_inertia, numbers

FloatArray = NDArray[np.floating]

GRAVITY = 9.81
"""m/s²."""
KEYFRAME = "photo"
KINDS = {"revolute": "hinge", "prismatic": "slide"}
ABOUT = (
    " Estimated by r2art from one photo. Metres, radians. The world is the camera's frame (x "
    "right, y down, z forward). Masses are placeholders. "
)


def to_mjcf(prediction: Prediction) -> bytes:
    """The bytes of an MJCF ``.xml`` file; see the module for its bodies."""
    root = Element("mujoco", model=prediction.category)
    root.append(ElementTree.Comment(ABOUT))
    SubElement(root, "compiler", angle="radian")
    cam_T_root = rigid(prediction.parts[0].cam_T_part)
    SubElement(root, "option", gravity=numbers(*(-GRAVITY * cam_T_root[:3, 1])))
    world = SubElement(root, "worldbody")
    _camera(world, prediction.camera)
    bodies = [_body(world, prediction.parts[0], 0, cam_T_root)]
    for link in links(prediction):
        part = prediction.parts[link.child]
        body = _body(bodies[link.parent], part, link.child, link.parent_T_rest)
        # The joint comes first within its body.
        body.insert(0, _joint(link))
        bodies.append(body)
    if prediction.joints:
        _keyframe(root, _in_order_of_bodies(links(prediction)))
    return document(root)


def _camera(world: Element, camera: Camera) -> None:
    """The camera that took the photo; MuJoCo's look along -z with y up, hence the half turn."""
    fovy = np.degrees(camera.fov_y)
    resolution = f"{camera.width} {camera.height}"
    place = {"quat": "0 1 0 0", "fovy": numbers(fovy), "resolution": resolution}
    SubElement(world, "camera", {"name": "photo_camera", **place})


def _body(parent: Element, part: PartEstimate, index: int, pose: FloatArray) -> Element:
    place = {"pos": numbers(*pose[:3, 3]), "quat": numbers(*quaternion(pose[:3, :3]))}
    body = SubElement(parent, "body", {"name": part.name, **place})
    mass, inertia = mass_and_inertia(part)
    center = {"pos": numbers(*part.box_center)}
    moments = {"mass": numbers(mass), "diaginertia": numbers(*inertia)}
    SubElement(body, "inertial", {**center, **moments})
    rgba = [c / 255 for c in part_color(index)]
    box = {
        "name": part.name,
        "type": "box",
        **center,
        "size": numbers(*part.box_size / 2),
        "rgba": numbers(*np.round(rgba, 3), OPACITY),
        # Of two boxes with contype 1 and conaffinity 0 neither answers the other.
        "conaffinity": "0",
    }
    SubElement(body, "geom", box)
    return body


def _joint(link: Link) -> Element:
    lower, upper = link.joint.limits
    place = {"pos": numbers(*link.pivot), "axis": numbers(*link.axis)}
    attributes = {"name": link.joint.name, "type": KINDS[link.joint.kind], **place}
    if lower < upper:
        attributes["range"] = numbers(lower, upper)
    return Element("joint", attributes)


def _in_order_of_bodies(found: Sequence[Link]) -> list[Link]:
    """Depth first, as MuJoCo numbers its bodies and with them ``qpos``."""

    def below(part: int) -> list[Link]:
        return [x for link in found if link.parent == part for x in (link, *below(link.child))]

    return below(0)


def _keyframe(root: Element, ordered: Sequence[Link]) -> None:
    qpos = numbers(*(link.joint.state for link in ordered))
    SubElement(SubElement(root, "keyframe"), "key", name=KEYFRAME, qpos=qpos)
