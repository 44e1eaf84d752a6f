"""An object of another dataset, carried over to our root frame and rest pose."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Joint
from r2art.data.adapters.convention import Convention
from r2art.data.pose import root_T_part

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True)
class Model:
    """One object at rest in its root frame.

    Attributes:
        joints: Its joints; limits are (0, 0) where the dataset gives none.
        part_T_link: (P, 4, 4) from the coordinates the dataset gives a part in, to ours.
        points: For each part (N, 3) points on it, in the root frame; None where only boxes are
            known.
        box_center: (P, 3) part boxes.
        box_size: (P, 3) their extents.
        sign: (J,) -1 for joints that open against the axis the dataset gives, else 1.
    """

    joints: tuple[Joint, ...]
    part_T_link: FloatArray
    points: tuple[FloatArray, ...] | None
    box_center: FloatArray
    box_size: FloatArray
    sign: FloatArray

    @property
    def diagonal(self) -> float:
        """Diagonal (m) of the box around the whole object at rest."""
        lower = (self.box_center - self.box_size / 2).min(axis=0)
        upper = (self.box_center + self.box_size / 2).max(axis=0)
        return float(np.linalg.norm(upper - lower))

    def surface(self, part: int) -> FloatArray:
        """(N, 3) points on a part, or on its box where no better is known."""
        if self.points is not None:
            return self.points[part]
        side = np.linspace(-0.5, 0.5, 9)
        grid = np.stack(np.meshgrid(side, side, side), axis=-1).reshape(-1, 3)
        on_side = np.abs(grid).max(axis=1) > 0.499
        return self.box_center[part] + self.box_size[part] * grid[on_side]


def model(
    joints: Sequence[Joint],
    rest_T_link: FloatArray,
    points: Sequence[FloatArray],
    convention: Convention,
    *,
    only_boxes: bool = False,
) -> Model:
    """Turn an object at the dataset's rest into ours.

    Args:
        joints: In the dataset's frame of the whole object, at its rest.
        rest_T_link: (P, 4, 4) from each part's own coordinates to that frame.
        points: For each part (N, 3), in its own coordinates (the corners of its box if
            ``only_boxes``).
        convention: Which way is up and front, and where the joints are closed.
        only_boxes: Whether the points are no more than corners of boxes.
    """
    shut = root_T_part(tuple(joints), convention.closed_state(len(joints)))
    R = convention.rotation()
    closed_T_link = _rotated(R) @ shut @ rest_T_link
    placed = [p @ T[:3, :3].T + T[:3, 3] for p, T in zip(points, closed_T_link, strict=True)]
    lower = np.stack([p.min(axis=0) for p in placed])
    upper = np.stack([p.max(axis=0) for p in placed])
    center, size = (lower + upper) / 2, np.maximum(upper - lower, 1e-6)
    origin = center[0]
    part_T_link = closed_T_link.copy()
    part_T_link[:, :3, 3] -= origin
    parents = [joint.parent for joint in joints]
    return Model(
        joints=tuple(
            _placed(joint, _rotated(R) @ shut[parent], origin, center[j + 1] - origin)
            for j, (joint, parent) in enumerate(zip(joints, parents, strict=True))
        ),
        part_T_link=part_T_link,
        points=None if only_boxes else tuple(p - origin for p in placed),
        box_center=center - origin,
        box_size=size,
        sign=np.ones(len(joints)),
    )


def _rotated(R: FloatArray) -> FloatArray:
    T = np.eye(4)
    T[:3, :3] = R
    return T


def _placed(joint: Joint, T: FloatArray, origin: FloatArray, child: FloatArray) -> Joint:
    """A joint in the root frame, its pivot the point of its axis that is nearest to its part."""
    axis = T[:3, :3] @ joint.axis
    axis /= np.linalg.norm(axis)
    pivot = T[:3, :3] @ joint.pivot + T[:3, 3] - origin
    pivot = child if joint.kind == "prismatic" else pivot + axis * (axis @ (child - pivot))
    return replace(joint, axis=triple(axis), pivot=triple(pivot))


def triple(vector: FloatArray) -> tuple[float, float, float]:
    """Three numbers as floats."""
    x, y, z = (np.asarray(vector, float) + 0.0).tolist()
    return x, y, z


def flipped(joints: Sequence[Joint], flip: Sequence[bool]) -> tuple[Joint, ...]:
    """The joints, some with their axis the other way round."""
    return tuple(
        replace(
            joint,
            axis=triple(-np.asarray(joint.axis)),
            limits=(-joint.limits[1], -joint.limits[0]),
        )
        if turn
        else joint
        for joint, turn in zip(joints, flip, strict=True)
    )


def measured_state(joints: Sequence[Joint], cam_T_part: FloatArray) -> FloatArray:
    """(J,) the joint states that come nearest to some part poses."""
    states = []
    for j, joint in enumerate(joints):
        T = np.linalg.inv(cam_T_part[joint.parent]) @ cam_T_part[j + 1]
        states.append(_slide(joint, T) if joint.kind == "prismatic" else _turn(joint, T))
    return np.array(states)


def _slide(joint: Joint, T: FloatArray) -> float:
    return float(np.asarray(joint.axis) @ T[:3, 3])


def _turn(joint: Joint, T: FloatArray) -> float:
    """The angle about the axis of the rotation about it that is nearest to a rotation."""
    R, axis = T[:3, :3], np.asarray(joint.axis)
    twice_sine = axis @ (R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1])
    twice_cosine = np.trace(R) - axis @ R @ axis
    return float(np.arctan2(twice_sine, twice_cosine))
