"""A model's object as one of a category that is defined elsewhere: closed at rest, its names."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Joint
from r2art.core.errors import InputError
from r2art.data.pose import root_T_part, transformed
from r2art.data.shape import Instance
from r2art.data.staging import about

FloatArray = NDArray[np.floating]

ALIKE = float(np.cos(np.radians(20)))
"""A joint's axis points where its category's does, up to so much."""


def turned(instance: Instance, degrees: tuple[float, float, float]) -> Instance:
    """The object, turned about its root frame's x, y and z, in this order; its root frame is not.

    The frame's origin is the centre of the root part's box as it then is.
    """
    T = np.eye(4)
    for axis, angle in enumerate(np.radians(degrees)):
        T[:3, :3] = about(axis, angle) @ T[:3, :3]
    if np.array_equal(T, np.eye(4)):
        return instance
    parts = tuple(tuple(transformed(s, T) for s in part) for part in instance.parts)
    T[:3, 3] = -replace(instance, parts=parts).part_boxes()[0][0]
    joints = tuple(
        replace(
            joint,
            axis=_triple(T[:3, :3] @ joint.axis),
            pivot=_triple(T[:3, :3] @ joint.pivot + T[:3, 3]),
        )
        for joint in instance.joints
    )
    parts = tuple(tuple(transformed(s, T) for s in part) for part in instance.parts)
    return replace(instance, parts=parts, joints=joints)


def closed_at(instance: Instance, closed: FloatArray, opened: FloatArray) -> Instance:
    """The object with its rest where it is closed, and states that grow from 0 as it opens.

    Args:
        instance: Its rest may be any state, its joints may run either way.
        closed: (J,) states in which it is closed ...
        opened: (J,) ... and open as far as it goes.
    """
    root_T = root_T_part(instance.joints, closed)
    parts = tuple(
        tuple(transformed(s, T) for s in part)
        for part, T in zip(instance.parts, root_T, strict=True)
    )
    moved = replace(instance, parts=parts)
    centers, _ = moved.part_boxes()
    joints = []
    for j, joint in enumerate(instance.joints):
        T = root_T[joint.parent]
        sign = 1.0 if opened[j] > closed[j] else -1.0
        pivot = T[:3, :3] @ joint.pivot + T[:3, 3]
        if joint.kind == "prismatic":
            pivot = centers[j + 1]
        axis = _triple(sign * T[:3, :3] @ joint.axis)
        span = abs(float(opened[j] - closed[j]))
        joints.append(replace(joint, axis=axis, pivot=_triple(pivot), limits=(0.0, span)))
    return replace(moved, joints=tuple(joints))


def as_one_of(instance: Instance, like: Instance, who: str) -> Instance:
    """The object under the names of a category.

    Args:
        instance: Closed at rest, its joints in the category's order.
        like: Any object of the category.
        who: What to call it in an error.

    Raises:
        InputError: Its parts, joints or axes are others.
    """
    ours, theirs = ([(j.kind, j.parent) for j in i.joints] for i in (instance, like))
    if ours != theirs:
        raise InputError(
            f"{who} has the joints {ours} (kind, parent), a {like.category} has {theirs}; "
            "leave it out"
        )
    joints = tuple(
        _named(joint, wanted, who)
        for joint, wanted in zip(instance.joints, like.joints, strict=True)
    )
    return replace(instance, category=like.category, part_names=like.part_names, joints=joints)


def in_order(instance: Instance, names: Sequence[str]) -> Instance:
    """The object with its joints, and the parts that they move, in another order.

    Args:
        instance: An object whose joints are named uniquely.
        names: Its joints' names in the new order, parents before children.
    """
    place = {joint.name: j for j, joint in enumerate(instance.joints)}
    order = [0, *(place[name] + 1 for name in names)]
    joints = (instance.joints[k - 1] for k in order[1:])
    return replace(
        instance,
        part_names=tuple(instance.part_names[k] for k in order),
        parts=tuple(instance.parts[k] for k in order),
        joints=tuple(replace(j, parent=order.index(j.parent)) for j in joints),
    )


def _named(joint: Joint, like: Joint, who: str) -> Joint:
    if (cosine := float(np.dot(joint.axis, like.axis))) < ALIKE:
        away = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
        raise InputError(
            f"{who}: the axis of {joint.name!r} points {away:.0f}° away from that of a "
            f"{like.name!r}; correct up, front, closed or opened"
        )
    return replace(joint, name=like.name)


def _triple(values: FloatArray) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
