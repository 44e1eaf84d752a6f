"""Making joints of a model rigid: those that a user names, and those that cannot move."""

from collections.abc import Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Joint
from r2art.core.errors import InputError, UsageError
from r2art.data.models.model import MOVABLE, Model, ModelJoint, triple
from r2art.data.pose import joint_matrix

FloatArray = NDArray[np.floating]

STILL = 1e-6
"""Range (rad, m) of a joint that does not move."""


def welded(model: Model, fix: Sequence[str]) -> Model:
    """The model with some joints held still, and all that they carry where it then is.

    Joints without a range are held too, and those that mimic one that is held.

    Args:
        model: The model.
        fix: Names of joints (``*`` and ``?`` stand for any letters), or ``NAME=STATE``; a joint
            without a state is held as near to zero as its limits let it.

    Raises:
        InputError: No joint is named so, or a joint that is left is of an unknown kind.
    """
    held = _named(model, fix)
    for joint in model.joints:
        if joint.name not in held and joint.kind in MOVABLE and _is_still(joint):
            held[joint.name] = _nearest_to_zero(joint)
    _add_followers(model, held)
    for joint in model.joints:
        if joint.kind not in (*MOVABLE, "fixed", "free") and joint.name not in held:
            raise InputError(
                f"{model.files[0]}: joint {joint.name!r} is {joint.kind}, but only joints that "
                f"turn or slide can be estimated; hold it still: --fix {joint.name}"
            )
    moved = _moved(model, held)
    joints = (replace(j, kind="fixed") if j.name in held else j for j in moved.joints)
    return replace(moved, joints=tuple(joints))


def as_joint(joint: ModelJoint, parent: int = 0) -> Joint:
    """A joint of a model as one of an instance; without limits it turns all round."""
    assert joint.kind == "revolute" or joint.kind == "prismatic"
    return Joint(
        name=joint.name,
        kind=joint.kind,
        parent=parent,
        axis=joint.axis,
        pivot=joint.pivot,
        limits=joint.limits or (-np.pi, np.pi),
    )


def _named(model: Model, fix: Sequence[str]) -> dict[str, float]:
    held = {}
    free = [joint for joint in model.joints if joint.kind not in ("fixed", "free")]
    for text in fix:
        pattern, given, value = text.partition("=")
        chosen = [joint for joint in free if fnmatchcase(joint.name, pattern)]
        if not chosen:
            names = ", ".join(joint.name for joint in free) or "none"
            raise InputError(f"{model.files[0]} has no joint {pattern!r} to fix; it has {names}")
        for joint in chosen:
            held[joint.name] = _state(text, value) if given else _nearest_to_zero(joint)
    return held


def _state(text: str, value: str) -> float:
    try:
        state = float(value)
    except ValueError:
        state = np.nan
    if not np.isfinite(state):
        raise UsageError(f"--fix {text}: {value!r} must be a number (rad or m)")
    return state


def _is_still(joint: ModelJoint) -> bool:
    return joint.limits is not None and joint.limits[1] - joint.limits[0] <= STILL


def _nearest_to_zero(joint: ModelJoint) -> float:
    return 0.0 if joint.limits is None else float(np.clip(0.0, *joint.limits))


def _add_followers(model: Model, held: dict[str, float]) -> None:
    """Hold joints that mimic held ones, too, however long the chain."""
    for _ in model.joints:
        for joint in model.joints:
            rule = joint.mimic
            if rule is not None and rule.leader in held and joint.name not in held:
                held[joint.name] = rule.multiplier * held[rule.leader] + rule.offset


def _moved(model: Model, states: dict[str, float]) -> Model:
    """The model with its links, axes and pivots where some joint states bring them."""
    motion: dict[str, FloatArray] = {}
    joints = []
    for joint in model.joints:
        before = motion.get(joint.parent, np.eye(4))
        state = states.get(joint.name, 0.0)
        movable = joint.kind in MOVABLE
        own = joint_matrix(as_joint(joint), state) if movable and state else np.eye(4)
        motion[joint.child] = before @ own
        axis = before[:3, :3] @ joint.axis
        pivot = before[:3, :3] @ joint.pivot + before[:3, 3]
        joints.append(replace(joint, axis=triple(axis), pivot=triple(pivot)))
    links = (
        replace(link, base_T_link=motion.get(link.name, np.eye(4)) @ link.base_T_link)
        for link in model.links
    )
    return replace(model, links=tuple(links), joints=tuple(joints))
