"""A prediction drawn on its photo: part boxes, joint axes, the root frame, and a legend below.

Edges of a box that face away from the camera are thin and dim.
"""

from itertools import product

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from r2art.core.errors import InputError
from r2art.core.image import Photo
from r2art.core.legend import legend, state_text
from r2art.core.palette import AXIS_COLORS, RIM, WHITE, Color, part_color
from r2art.core.pen import RIM_WIDTH, Pen
from r2art.core.prediction import JointEstimate, PartEstimate, Prediction

FloatArray = NDArray[np.floating]
Corner = tuple[int, int, int]
Face = tuple[int, int]

# The drawing's longer side (px): small photos are enlarged until labels fit, large ones reduced.
SMALLEST, LARGEST = 960, 1600
AXIS_NAMES = ("right", "up", "front")

# A box's corners are (x, y, z), each 0 (lower side) or 1 (upper side); a face is (axis, side).
CORNERS: tuple[Corner, ...] = tuple((x, y, z) for x, y, z in product((0, 1), repeat=3))
EDGES = tuple(
    (a, b) for a, b in product(CORNERS, CORNERS) if a < b and np.abs(np.subtract(a, b)).sum() == 1
)
FACES: tuple[Face, ...] = tuple(product(range(3), (0, 1)))


def draw(prediction: Prediction, photo: Photo) -> Image.Image:
    """The photo with the prediction drawn on it and a legend below, RGB.

    Raises:
        InputError: The photo is not the size of the one predicted from.
    """
    return legend(prediction, annotated(prediction, photo))


def annotated(prediction: Prediction, photo: Photo) -> Image.Image:
    """The same without a legend."""
    camera = prediction.camera
    if (photo.width, photo.height) != (camera.width, camera.height):
        raise InputError(
            f"the photo has {photo.width}×{photo.height} px, but the prediction is of one with "
            f"{camera.width}×{camera.height}"
        )
    longer = max(photo.width, photo.height)
    scale = float(np.clip(longer, SMALLEST, LARGEST)) / longer
    size = (max(1, round(photo.width * scale)), max(1, round(photo.height * scale)))
    picture = Image.fromarray(photo.pixels).resize(size, Image.Resampling.BICUBIC)

    depth = float(prediction.parts[0].cam_T_part[2, 3])
    pen = Pen(picture, camera.resize(*size), near=max(1e-3, 0.05 * depth))
    _draw_boxes(pen, prediction.parts)
    _draw_root_frame(pen, prediction.parts[0])
    for j, joint in enumerate(prediction.joints):
        _draw_joint(pen, joint, prediction.parts[j + 1], part_color(j + 1))
    return pen.finish()


def facing(part: PartEstimate) -> frozenset[Face]:
    """The faces of a part's box whose outside the camera sees."""
    corners = part.corners()
    center = corners.mean(axis=(0, 1, 2))
    middle = {f: corners.take(f[1], axis=f[0]).mean(axis=(0, 1)) for f in FACES}
    return frozenset(f for f, m in middle.items() if (m - center) @ m < 0)


def joint_arrow(joint: JointEstimate, child: PartEstimate) -> tuple[FloatArray, FloatArray]:
    """Tail and tip, (3,) each, of the arrow that shows a joint's axis, in the camera frame (m).

    It goes through all of a hinge, and from a slide's pivot out of the object. ``child`` is the
    part that the joint moves.
    """
    reach = (child.corners().reshape(8, 3) - joint.pivot) @ joint.axis
    low, high = float(reach.min()), float(reach.max())
    beyond = 0.12 * (high - low)
    start = low - beyond if joint.kind == "revolute" else 0.0
    return joint.pivot + start * joint.axis, joint.pivot + (high + beyond) * joint.axis


def _draw_boxes(pen: Pen, parts: tuple[PartEstimate, ...]) -> None:
    far_to_near = sorted(range(len(parts)), key=lambda p: -parts[p].corners()[..., 2].mean())
    seen = [facing(part) for part in parts]
    for p in far_to_near:
        corners = parts[p].corners()
        for axis, side in seen[p]:
            ring = corners.take(side, axis=axis).reshape(4, 3)[[0, 1, 3, 2]]
            pen.fill(ring, part_color(p), alpha=50)
    for p in far_to_near:
        hidden = [e for e in EDGES if not _is_seen(e, seen[p])]
        _draw_edges(pen, parts[p], hidden, (part_color(p), 1.6, 180))
    for p in far_to_near:
        visible = [e for e in EDGES if _is_seen(e, seen[p])]
        _draw_edges(pen, parts[p], visible, (RIM, 3 + 2 * RIM_WIDTH, 255), (part_color(p), 3, 255))


def _is_seen(edge: tuple[Corner, Corner], faces: frozenset[Face]) -> bool:
    """Whether one of the two faces that meet in an edge is seen."""
    a, b = edge
    return any(a[axis] == b[axis] == side for axis, side in faces)


def _draw_edges(pen: Pen, part: PartEstimate, edges: list, *strokes: tuple) -> None:
    corners = part.corners()
    for color, width, alpha in strokes:
        for a, b in edges:
            pen.line(corners[a], corners[b], color, width, alpha)


def _draw_root_frame(pen: Pen, root: PartEstimate) -> None:
    origin = root.cam_T_part[:3, 3]
    length = 0.3 * float(np.linalg.norm(root.box_size))
    # The farthest tip first, so that nearer arrows lie over it.
    for axis in np.argsort(-root.cam_T_part[2, :3]):
        tip = origin + length * root.cam_T_part[:3, axis]
        pen.arrow(origin, tip, AXIS_COLORS[axis], 3, AXIS_NAMES[axis])
    pen.dot(origin, WHITE, 3)


def _draw_joint(pen: Pen, joint: JointEstimate, child: PartEstimate, color: Color) -> None:
    tail, tip = joint_arrow(joint, child)
    pen.arrow(tail, tip, WHITE, 2.2, f"{joint.name} {state_text(joint)}", color)
    pen.dot(joint.pivot, WHITE, 4)
