"""PartNet-Mobility folders: ``mobility.urdf`` for the geometry, ``mobility_v2.json`` for the names.

The URDF has names like ``link_3``; the JSON says that this is a drawer, and what its joint is
meant to be. The fixed joint below the URDF's ``base`` turns the object upright (z up; its front
then looks to -x), so nothing about axes is assumed beyond that.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from r2art.core.errors import InputError
from r2art.data.models.model import MOVABLE, Model, ModelJoint
from r2art.data.models.urdf import read_urdf

STILL = ("junk", "heavy", "static", "fixed", "free")
"""Kinds of the JSON that move nothing an object does by itself."""


def read_partnet(folder: Path) -> Model:
    """A model from the folder of one object.

    Where two joints move one link (a lid that is lifted and spun), the URDF has a helper link
    between; the joint that the JSON names stays, the other is held still.

    Raises:
        InputError: One of the two files is missing or cannot be meant.
    """
    urdf, notes = folder / "mobility.urdf", folder / "mobility_v2.json"
    if not urdf.is_file() or not notes.is_file():
        missing = urdf if not urdf.is_file() else notes
        raise InputError(
            f"{missing} is not there; a PartNet-Mobility folder holds mobility.urdf and "
            "mobility_v2.json: give one object's folder"
        )
    model, entries = read_urdf(urdf), _entries(notes)
    unseen = {link.name for link in model.links if not link.visuals}
    joints = tuple(_as_meant(joint, entries, unseen) for joint in model.joints)
    labels = {name: str(entry.get("name") or name) for name, entry in entries.items()}
    return replace(
        model,
        name=_category(folder) or model.name,
        links=tuple(replace(k, label=labels.get(k.name, k.name)) for k in model.links),
        joints=joints,
        files=(*model.files, notes),
        front="-x",
        by_place=True,
    )


def _entries(path: Path) -> dict[str, dict[str, Any]]:
    """What the JSON tells of each link, by the link's name in the URDF."""
    try:
        entries = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(entries, list):
            raise TypeError("no list")
        return {f"link_{entry['id']}": entry for entry in entries}
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise InputError(
            f"{path} is not a list of parts with an id each ({error}); get it anew"
        ) from None


def _category(folder: Path) -> str | None:
    """The category's name, where the folder's ``meta.json`` tells it."""
    try:
        return json.loads((folder / "meta.json").read_text(encoding="utf-8"))["model_cat"].lower()
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return None


def _as_meant(
    joint: ModelJoint, entries: dict[str, dict[str, Any]], unseen: set[str]
) -> ModelJoint:
    helper = next((end for end in (joint.parent, joint.child) if _is_helper(end, unseen)), None)
    moved = (helper or joint.child).removesuffix("_helper")
    entry = entries.get(moved)
    if entry is None or joint.kind == "fixed":
        return joint
    meant = {"hinge": "revolute", "slider": "prismatic"}.get(str(entry.get("joint")), joint.kind)
    if entry.get("joint") in STILL or (helper is not None and joint.kind != meant):
        return replace(joint, kind="fixed")
    if joint.limits is None and joint.kind in MOVABLE:
        return replace(joint, limits=_limits(entry))
    return joint


def _is_helper(link: str, unseen: set[str]) -> bool:
    return link.endswith("_helper") and link in unseen


def _limits(entry: dict[str, Any]) -> tuple[float, float] | None:
    """A joint's range (rad, m): the JSON has a hinge's in degrees; None where it has none."""
    limit = (entry.get("jointData") or {}).get("limit") or {}
    try:
        a, b = sorted((float(limit["a"]), float(limit["b"])))
    except (KeyError, TypeError, ValueError):
        return None
    if limit.get("noLimit") or not np.isfinite([a, b]).all():
        return None
    return (
        (a, b) if entry.get("joint") == "slider" else (float(np.radians(a)), float(np.radians(b)))
    )
