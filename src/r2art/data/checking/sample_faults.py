"""What is wrong with one labelled photo: every rule that `Sample` and `Category` state, tested.

The rules come in four stages (shapes, numbers, each field by itself, fields against each other);
a stage is only entered by what has passed the one before. Comparisons are written so that NaN
fails them.
"""

from collections.abc import Iterator

import numpy as np

from r2art.core.category import Category
from r2art.data.checking.agreement import TOLERANCE, Checked, Problem, disagreements, listed
from r2art.data.sample import BACKDROP, Sample

FLOATS = (
    *("depth", "box", "cam_T_part", "joint_state"),
    *("box_center", "box_size", "axis", "pivot", "visible"),
)
BEYOND_LIMITS = 0.1
"""How far an instance may open beyond its category's limits, as a share of their range."""


def sample_faults(
    sample: Sample, category: Category, tolerance: float = TOLERANCE
) -> list[Problem]:
    """All that is wrong with a sample, by field; nothing where it is sound."""
    checked = Checked(sample, category, tolerance)
    with np.errstate(all="ignore"):
        for stage in (_shapes, _numbers, _fields, disagreements):
            if found := list(stage(checked)):
                return found
    return []


def _shapes(c: Checked) -> Iterator[Problem]:
    s, parts, joints = c.sample, len(c.names), len(c.category.joints)
    height, width = s.camera.height, s.camera.width
    wanted = {
        "image": (height, width, 3),
        "mask": (height, width),
        "depth": (height, width),
        "box": (4,),
        "cam_T_part": (parts, 4, 4),
        "joint_state": (joints,),
        "box_center": (parts, 3),
        "box_size": (parts, 3),
        "axis": (joints, 3),
        "pivot": (joints, 3),
        "visible": (parts,),
    }
    for name, shape in wanted.items():
        array = getattr(s, name)
        if array.shape != shape:
            yield name, f"has shape {array.shape}, a {c.category.name} needs {shape}"
        elif name in ("image", "mask") and array.dtype != np.uint8:
            yield name, f"is {array.dtype}, must be uint8"
    if s.amodal is not None and (s.amodal.shape, s.amodal.dtype) != ((height, width), np.uint16):
        yield "amodal", f"is {s.amodal.dtype} {s.amodal.shape}, must be uint16 {(height, width)}"


def _numbers(c: Checked) -> Iterator[Problem]:
    for name in FLOATS:
        if bad := np.count_nonzero(~np.isfinite(getattr(c.sample, name))):
            yield name, f"holds {bad} values that are NaN or infinite"


def _fields(c: Checked) -> Iterator[Problem]:
    for rule in (_camera, _image, _mask, _depth, _box, _poses, _states, _boxes, _joints, _visible):
        yield from rule(c)


def _camera(c: Checked) -> Iterator[Problem]:
    k = c.sample.camera
    if not 0.5 <= k.fx / k.fy <= 2:
        yield "camera", f"fx = {k.fx:g} and fy = {k.fy:g} differ by more than a factor of 2"
    fov = 2 * np.degrees(np.arctan(max(k.width / k.fx, k.height / k.fy) / 2))
    if not 1 <= fov <= 170:
        yield "camera", f"fx = {k.fx:g}, fy = {k.fy:g} give a field of view of {fov:.2g}°"
    for name, value, side in (("cx", k.cx, k.width), ("cy", k.cy, k.height)):
        if not -side <= value <= 2 * side:
            yield "camera", f"{name} = {value:g} is far outside an image of {side} px"


def _image(c: Checked) -> Iterator[Problem]:
    if np.ptp(c.sample.image) == 0:
        yield "image", f"every pixel is {c.sample.image.flat[0]}"


def _mask(c: Checked) -> Iterator[Problem]:
    values = np.unique(c.sample.mask)
    if odd := [int(v) for v in values if v > len(c.names) and v != BACKDROP]:
        yield "mask", f"holds {odd[:5]}, only 0 to {len(c.names)} and {BACKDROP} mean anything"


def _depth(c: Checked) -> Iterator[Problem]:
    if not (least := c.sample.depth.min()) >= 0:
        yield "depth", f"is negative ({least:g} m) somewhere"


def _box(c: Checked) -> Iterator[Problem]:
    x1, y1, x2, y2 = c.sample.box
    if not (x1 < x2 and y1 < y2):
        yield "box", f"{listed(c.sample.box)} is empty; x1 y1 x2 y2 in order are meant"
    elif not (x1 < c.sample.camera.width and y1 < c.sample.camera.height and min(x2, y2) > 0):
        yield "box", f"{listed(c.sample.box)} is outside the image"


def _poses(c: Checked) -> Iterator[Problem]:
    for name, T in zip(c.names, c.sample.cam_T_part, strict=True):
        R = T[:3, :3]
        skew = np.abs(R.T @ R - np.eye(3)).max()
        if not np.array_equal(T[3], [0, 0, 0, 1]):
            yield "cam_T_part", f"{name}: the last row is {listed(T[3])}, not 0 0 0 1"
        if not skew <= c.tolerance:
            yield "cam_T_part", f"{name}: the rotation is not orthonormal (off by {skew:.2g})"
        elif not (det := np.linalg.det(R)) > 0:
            yield "cam_T_part", f"{name}: the rotation mirrors (determinant {det:.0f})"


def _states(c: Checked) -> Iterator[Problem]:
    for joint, state in zip(c.category.joints, c.sample.joint_state, strict=True):
        low, high = joint.limits
        slack = BEYOND_LIMITS * (high - low)
        if not low - slack <= state <= high + slack:
            yield "joint_state", f"{joint.name}: {state:g} is outside {low:g} to {high:g}"


def _boxes(c: Checked) -> Iterator[Problem]:
    for name, size in zip(c.names, c.sample.box_size, strict=True):
        if not size.min() > 0:
            yield "box_size", f"{name}: {listed(size)} must be positive"
    ratio = c.diagonal / c.category.diagonal
    if not 0.1 <= ratio <= 10:
        yield "box_size", f"the object is {ratio:.2g} times the category's mean; metres are meant"
    if not (off := np.linalg.norm(c.sample.box_center[0])) <= c.tolerance * c.diagonal:
        yield "box_center", f"{c.names[0]}: must be the origin, is {off:.2g} m off"
    for name, center in zip(c.names, c.sample.box_center, strict=True):
        if not (far := np.linalg.norm(center)) <= 20 * c.category.diagonal:
            yield "box_center", f"{name}: is {far:.2g} m away from the root"


def _joints(c: Checked) -> Iterator[Problem]:
    for j, joint in enumerate(c.category.joints):
        axis, pivot = c.sample.axis[j], c.sample.pivot[j]
        if not abs((length := np.linalg.norm(axis)) - 1) <= c.tolerance:
            yield "axis", f"{joint.name}: has length {length:.4g}, must be a unit vector"
        elif not axis @ joint.axis > 0:
            yield "axis", f"{joint.name}: {listed(axis)} points against the category's"
        away = np.linalg.norm(pivot - c.sample.box_center[j + 1])
        if not away <= 2 * c.diagonal:
            yield "pivot", f"{joint.name}: is {away:.2g} m away from the part it moves"


def _visible(c: Checked) -> Iterator[Problem]:
    for name, share in zip(c.names, c.sample.visible, strict=True):
        if not 0 <= share <= 1:
            yield "visible", f"{name}: {share:g} is no share of 1"
