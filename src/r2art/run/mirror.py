"""A second look, in a mirror: of objects that are alike on both sides it errs in other ways."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.category import Mirror
from r2art.core.confidence import log_odds
from r2art.core.image import Box, View
from r2art.run.model import MASK
from r2art.run.refinement.body import Body
from r2art.run.refinement.pose import difference, moved, pose_of, posed

Outputs = Mapping[str, NDArray[np.floating]]

FLIPPED = float(np.radians(60))
"""Looks that are turned farther apart have no sensible middle."""


def in_mirror(view: View, box: Box) -> tuple[View, Box]:
    """What the mirror shows of a crop, and of the object's box (px) in it.

    ``corner`` stays, and means nothing there.
    """
    size, camera = view.pixels.shape[1], view.camera
    x1, y1, x2, y2 = box
    seen = Camera(camera.fx, camera.fy, size - camera.cx, camera.cy, camera.width, camera.height)
    pixels = np.ascontiguousarray(view.pixels[:, ::-1])
    return replace(view, pixels=pixels, camera=seen), (size - x2, y1, size - x1, y2)


def out_of_mirror(outputs: Outputs, mirror: Mirror, parents: tuple[int, ...]) -> Outputs:
    """What was estimated in the mirror, as it is before it; without joints' axes and pivots.

    Args:
        outputs: See `r2art.run.model.Model.pose`.
        mirror: Of the category.
        parents: The part on which each joint hangs.
    """
    parts, joints = list(mirror.swap), list(mirror.joint_swap(parents))
    M = np.diag([-1.0, 1.0, 1.0, 1.0])
    found = {
        "cam_T_part": M @ outputs["cam_T_part"][parts] @ M,
        "box_center": outputs["box_center"][parts] * M.diagonal()[:3],
        "box_size": outputs["box_size"][parts],
        "confidence": outputs["confidence"][parts],
        "joint_state": outputs["joint_state"][joints],
    }
    return found | ({MASK: outputs[MASK][:, ::-1]} if MASK in outputs else {})


def between(body: Body, one: Outputs, other: Outputs) -> Outputs:
    """The middle of two looks; the surer one where they are too far apart to have any.

    Args:
        body: The category's mean object.
        one: A look, with axes and pivots where there are joints ...
        other: ... and another, of which only angles of joints are known.
    """
    center = (one["box_center"] + other["box_center"]) / 2
    size = np.sqrt(one["box_size"] * other["box_size"])
    own = body.hollow().stretched(center, size)
    first, second = (pose_of(own, o["cam_T_part"][0], o["joint_state"]) for o in (one, other))
    step = difference(own, second, first, scale=False)
    odds = [log_odds(o["confidence"]) for o in (one, other)]
    share = 0.5
    if np.linalg.norm(step[0, :3]) > FLIPPED:
        share = float(odds[1].mean() > odds[0].mean())
    middle = moved(own, first, share * step)
    at = posed(own, middle)
    poses = np.tile(np.eye(4), (len(center), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = at.rotation[0], at.translation[0]
    found = {
        "cam_T_part": poses,
        "box_center": center,
        "box_size": size,
        "confidence": 1 / (1 + np.exp(-((1 - share) * odds[0] + share * odds[1]))),
        "joint_state": middle.joint_state[0],
        "axis": at.axis[0],
        "pivot": at.pivot[0],
    }
    return found | ({MASK: (one[MASK] + other[MASK]) / 2} if MASK in one else {})
