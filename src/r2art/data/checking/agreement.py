"""Whether the labels of one photo agree: kinematics, 2D box, mask, depth, visible shares."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Category
from r2art.data.checking.boxes import (
    corners,
    faces_in_image,
    pixel_rays,
    rays_meet_box,
    reach_outside_box,
)
from r2art.data.pose import root_T_part
from r2art.data.sample import BACKDROP, Sample

FloatArray = NDArray[np.floating]
Problem = tuple[str, str]
"""Name of a field, and what is wrong with it."""

TOLERANCE = 1e-3
"""Default for geometry: in rotations absolute, in lengths as a share of the object's diagonal."""
FEW = 0.02
"""The share of a part's pixels that may lie wrong: the border of a mask drawn by hand."""
PIXELS = 2.0
"""How exact a box or mask drawn by hand is (px)."""


@dataclass(frozen=True)
class Checked:
    """A sample, its category, and how exact its geometry must be (see `TOLERANCE`)."""

    sample: Sample
    category: Category
    tolerance: float

    @property
    def names(self) -> tuple[str, ...]:
        """Of the parts."""
        return self.category.part_names

    @property
    def diagonal(self) -> float:
        """Of the box around the object at rest (m)."""
        center, size = self.sample.box_center, self.sample.box_size
        return float(np.linalg.norm(np.ptp([center - size / 2, center + size / 2], axis=(0, 1))))

    def seen(self, part: int) -> NDArray[np.bool_]:
        """(H, W) where the mask shows a part."""
        return self.sample.mask == part + 1


def disagreements(c: Checked) -> Iterator[Problem]:
    """What is wrong with fields that are well formed, each by itself."""
    yield from _kinematics(c)
    yield from _in_front(c)
    yield from _box_bounds(c)
    for part in range(len(c.names)):
        yield from _part_pixels(c, part)


def _kinematics(c: Checked) -> Iterator[Problem]:
    """The poses follow from the root's pose, axes, pivots and states."""
    s = c.sample
    joints = tuple(
        replace(joint, axis=tuple(axis), pivot=tuple(pivot))
        for joint, axis, pivot in zip(c.category.joints, s.axis, s.pivot, strict=True)
    )
    expected = s.cam_T_part[0] @ root_T_part(joints, s.joint_state)
    error = np.abs(expected - s.cam_T_part)
    turned = error[:, :3, :3].max(axis=(1, 2))
    moved = error[:, :3, 3].max(axis=1)
    for name, angle, distance in zip(c.names, turned, moved, strict=True):
        if not (angle <= 2 * c.tolerance and distance <= 2 * c.tolerance * c.diagonal):
            yield (
                "cam_T_part",
                f"{name}: is {distance * 1e3:.3g} mm and {np.degrees(angle):.2g}° off what axis, "
                "pivot and joint_state say",
            )


def _in_front(c: Checked) -> Iterator[Problem]:
    if not (z := c.sample.cam_T_part[0, 2, 3]) > 0:
        yield "cam_T_part", f"{c.names[0]}: is behind the camera (z = {z:g} m)"


def _box_bounds(c: Checked) -> Iterator[Problem]:
    """The 2D box holds what is seen, and is as large as the part boxes allow and demand."""
    s = c.sample
    slack = PIXELS + c.tolerance * float(np.linalg.norm(s.box[2:] - s.box[:2]))
    ys, xs = np.nonzero((s.mask > 0) & (s.mask != BACKDROP))
    if len(xs):
        seen = np.array([xs.min(), ys.min(), xs.max() + 1, ys.max() + 1])
        if not _within(seen, s.box, slack):
            yield "box", f"{listed(s.box)} leaves out parts that the mask shows ({listed(seen)})"
    points = np.stack([corners(*part) for part in _posed(c)])
    if not points[..., 2].min() > 0:
        return
    faces = faces_in_image(s.camera, points)
    largest = np.concatenate([faces[0].min(axis=0), faces[1].max(axis=0)])
    smallest = np.concatenate([faces[1].min(axis=0), faces[0].max(axis=0)])
    if not _within(s.box, largest, slack):
        yield "box", f"{listed(s.box)} is larger than the part boxes' {listed(largest)}"
    elif not _within(smallest, s.box, slack):
        yield "box", f"{listed(s.box)} is smaller than the part boxes' {listed(smallest)}"


def _within(inner: FloatArray, outer: FloatArray, slack: float) -> bool:
    return bool((inner[:2] >= outer[:2] - slack).all() and (inner[2:] <= outer[2:] + slack).all())


def _posed(c: Checked) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    s = c.sample
    return zip(s.cam_T_part, s.box_center, s.box_size, strict=True)


def _part_pixels(c: Checked, part: int) -> Iterator[Problem]:
    """Pixels of a part look at its box, at the depth where it is, and are as many as said."""
    s, name = c.sample, c.names[part]
    ys, xs = np.nonzero(c.seen(part))
    yield from _pixel_count(c, part, len(xs))
    yield from _amodal(c, part)
    if not len(xs):
        return
    T, center, size = s.cam_T_part[part], s.box_center[part], s.box_size[part]
    rays = pixel_rays(s.camera, xs, ys)
    z = abs(float(T[2, :3] @ center + T[2, 3]))
    slack = c.tolerance * c.diagonal + PIXELS * z / min(s.camera.fx, s.camera.fy)
    astray = ~rays_meet_box(rays, T, center, size + 2 * slack)
    if not astray.mean() <= FEW and astray.sum() > 2:
        yield "mask", f"{name}: {astray.mean():.0%} of its pixels lie outside its part box"
        return
    depth = s.depth[ys, xs]
    known = depth > 0
    if not known.any():
        return
    outside = reach_outside_box(rays[known] * depth[known, None], T, center, size)
    wrong = ~(outside <= slack + 10 * c.tolerance * c.diagonal)
    if not wrong.mean() <= FEW and wrong.sum() > 2:
        yield (
            "depth",
            f"{name}: {wrong.mean():.0%} of its pixels lie outside its part box "
            f"(typically {np.median(outside[wrong]) * 1e3:.0f} mm)",
        )


def _pixel_count(c: Checked, part: int, count: int) -> Iterator[Problem]:
    share, name = c.sample.visible[part], c.names[part]
    if count == 0 and share > 0.05:
        yield "visible", f"{name}: {share:.0%} is said to be seen, but the mask shows none of it"
    elif count > 64 and share == 0:
        yield "visible", f"{name}: 0 % is said to be seen, but the mask shows {count} pixels"


def _amodal(c: Checked, part: int) -> Iterator[Problem]:
    """The whole silhouette holds what is seen of it, and the visible share is their ratio."""
    if c.sample.amodal is None:
        return
    name, seen = c.names[part], c.seen(part)
    whole = (c.sample.amodal >> part) & 1 == 1
    total, count = int(whole.sum()), int(seen.sum())
    if astray := int((seen & ~whole).sum()):
        if astray > max(2, FEW * count):
            yield "amodal", f"{name}: leaves out {astray} of {count} pixels that the mask shows"
    elif total > 64 and not abs(count / total - (share := c.sample.visible[part])) <= 0.1:
        yield "visible", f"{name}: is {share:.0%}, mask and amodal say {count / total:.0%}"


def listed(values: FloatArray) -> str:
    """Numbers in a message."""
    return " ".join(f"{v:.4g}" for v in values)
