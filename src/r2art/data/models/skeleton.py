"""Which links of a model move as one, and how these bodies hang together."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from r2art.core.errors import InputError
from r2art.data.models.model import MOVABLE, Link, Model, ModelJoint, parents_first


@dataclass(frozen=True, kw_only=True)
class Skeleton:
    """Bodies (links that fixed joints hold together) as a tree; a body is called by one link.

    Attributes:
        root: The body that all others hang on.
        joints: Joints between bodies, parents before children.
        links: The links of each body, the nearest to the root first.
    """

    root: str
    joints: tuple[ModelJoint, ...]
    links: dict[str, tuple[Link, ...]]


def skeleton(model: Model, root: str | None = None) -> Skeleton:
    """The tree of a model's visible bodies.

    The root is the body on which the others hang; where nothing is seen of it, the one that
    hangs on it. Bodies that are never seen and carry nothing are left out.

    Args:
        model: Its joints turn, slide, are fixed or free.
        root: A link to be (in) the root instead.

    Raises:
        InputError: Nothing moves, several objects do, or nothing is seen between two joints.
    """
    body = _bodies(model)
    links: dict[str, tuple[Link, ...]] = {}
    for link in _in_order(model):
        links[body[link.name]] = (*links.get(body[link.name], ()), link)
    joints = [
        replace(joint, parent=body[joint.parent], child=body[joint.child])
        for joint in model.joints
        if joint.kind in MOVABLE
    ]
    seen = {name for name, group in links.items() if any(link.visuals for link in group)}
    if root is None:
        top = _top(model, body, joints, seen)
    elif root in body:
        top = body[root]
        joints = _turned(joints, top)
    else:
        names = ", ".join(link.name for link in model.links)
        raise InputError(f"{model.files[0]} has no link {root!r} to be the root; it has {names}")
    ordered = _pruned(parents_first(joints, top), seen)
    _refuse_gaps(model, top, ordered, seen)
    kept = (top, *(joint.child for joint in ordered))
    return Skeleton(root=top, joints=tuple(ordered), links={name: links[name] for name in kept})


def _bodies(model: Model) -> dict[str, str]:
    """By link, the first link of its body."""
    body = {link.name: link.name for link in model.links}
    for joint in model.joints:  # parents come first, so theirs is known
        if joint.kind == "fixed":
            body[joint.child] = body[joint.parent]
    return body


def _in_order(model: Model) -> Iterable[Link]:
    """All links, those nearest to the model's root first."""
    children = [joint.child for joint in model.joints]
    by_name = {link.name: link for link in model.links}
    yield from (link for link in model.links if link.name not in children)
    yield from (by_name[child] for child in children)


def _top(model: Model, body: dict[str, str], joints: list[ModelJoint], seen: set[str]) -> str:
    file = model.files[0]
    hanging = {joint.child for joint in joints}
    tops = dict.fromkeys(name for name in body.values() if name not in hanging)
    moving = [top for top in tops if _pruned(parents_first(joints, top), seen)]
    if not moving:
        raise InputError(
            f"{file}: nothing that is seen turns or slides; a category needs at least one such "
            "joint"
        )
    if len(moving) > 1:
        raise InputError(
            f"{file} holds several objects ({', '.join(moving)}); choose one by its root: "
            f"--root {moving[0]}"
        )
    top = moving[0]
    while top not in seen:
        below = [joint for joint in _pruned(joints, seen) if joint.parent == top]
        if len(below) > 1:
            raise InputError(
                f"{file}: nothing is seen of the root {top!r}, on which {len(below)} joints hang; "
                f"give it a shape, or hold one of them still: --fix {below[0].name}"
            )
        top = below[0].child
    return top


def _pruned(joints: list[ModelJoint], seen: set[str]) -> list[ModelJoint]:
    """Joints that carry something visible, whatever far away."""
    while True:
        carrying = {joint.parent for joint in joints}
        kept = [joint for joint in joints if joint.child in seen or joint.child in carrying]
        if len(kept) == len(joints):
            return kept
        joints = kept


def _turned(joints: list[ModelJoint], root: str) -> list[ModelJoint]:
    """The joints with parent and child exchanged where the root now lies below them.

    The child sees its parent move the other way: the axis turns round, the state stays.
    """
    turned, reached, front = [], {root}, [root]
    for body in front:  # grows while it is walked along
        for joint in joints:
            if joint.parent == body and joint.child not in reached:
                turned.append(joint)
            elif joint.child == body and joint.parent not in reached:
                x, y, z = joint.axis
                back = replace(joint, parent=body, child=joint.parent, axis=(-x, -y, -z))
                turned.append(back)
            else:
                continue
            reached.add(turned[-1].child)
            front.append(turned[-1].child)
    return turned


def _refuse_gaps(model: Model, top: str, joints: list[ModelJoint], seen: set[str]) -> None:
    file = model.files[0]
    if top not in seen:
        raise InputError(f"{file}: nothing is seen of {top!r}; choose another --root")
    if not joints:
        raise InputError(
            f"{file}: nothing that is seen turns or slides on {top!r}; a category needs at least "
            "one such joint"
        )
    for joint in joints:
        if joint.child not in seen:
            after = next(j.name for j in joints if j.parent == joint.child)
            raise InputError(
                f"{file}: nothing is seen between the joints {joint.name!r} and {after!r}, but "
                f"every joint must move a visible part; hold one still: --fix {joint.name}"
            )
