"""URDF to a `Model`, strictly: what the format does not allow is refused, in one clear line.

A parser of its own, on the standard library: URDF is small, and the usual ones bring a viewer
along and let a missing mesh or a cycle pass.
"""

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from r2art.core.errors import InputError
from r2art.data.models import primitives
from r2art.data.models.elements import named, number, numbers, origin, parse, unit
from r2art.data.models.model import (
    Link,
    MeshFile,
    Mimic,
    Model,
    ModelJoint,
    Patch,
    Visual,
    parents_first,
    triple,
)
from r2art.data.models.paths import companions, model_file, resolve
from r2art.data.models.textures import read_texture
from r2art.data.shape import Material

FloatArray = NDArray[np.floating]
Look = tuple[tuple[float, float, float] | None, Path | None]

KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
_NOTHING: Look = (None, None)


@dataclass(frozen=True)
class _File:
    """A URDF file, open: its tree, and the looks that it has names for."""

    path: Path
    robot: ET.Element
    looks: dict[str, Look]


def read_urdf(path: Path) -> Model:
    """A model from a URDF file, or from the only one in a folder.

    Raises:
        InputError: It is no valid URDF, or a file that it names is missing.
    """
    path = model_file(path, ".urdf")
    file = _open(path)
    joints = [_joint(file, element) for element in file.robot.findall("joint")]
    names = [named(link, "name", f"{path}, a link") for link in file.robot.findall("link")]
    _refuse_duplicates(path, "links", names)
    _refuse_duplicates(path, "joints", [joint.name for joint, _ in joints])
    ordered = parents_first([j for j, _ in joints], _root(path, names, [j for j, _ in joints]))
    _refuse_cycles(path, names, ordered)
    _refuse_lost_leaders(path, ordered)

    parent_T_child = {joint.child: T for joint, T in joints}
    base_T_link: dict[str, FloatArray] = dict.fromkeys(names, np.eye(4))
    for joint in ordered:
        base_T_link[joint.child] = base_T_link[joint.parent] @ parent_T_child[joint.child]
    links = _links(file, base_T_link)
    return Model(
        name=file.robot.get("name") or path.stem,
        links=links,
        joints=tuple(_in_base(joint, base_T_link[joint.child]) for joint in ordered),
        files=_files(file, links),
    )


def _open(path: Path) -> _File:
    robot = parse(path, "robot")
    if any(element.tag.startswith("{") and "xacro" in element.tag for element in robot.iter()):
        raise InputError(f"{path} still holds xacro macros; expand it: xacro in.xacro > out.urdf")
    looks = {}
    for element in robot.iter("material"):
        look = _own_look(path, element)
        if look != _NOTHING and (name := element.get("name")):
            looks.setdefault(name, look)
    return _File(path, robot, looks)


def _own_look(path: Path, element: ET.Element) -> Look:
    where = f"{path}, material {element.get('name', '')!r}"
    color, texture = element.find("color"), element.find("texture")
    rgb, picture = None, None
    if color is not None:
        rgb = triple(np.clip(numbers(color, "rgba", None, 4, where)[:3], 0, 1))
    if texture is not None and texture.get("filename"):
        picture = resolve(texture.get("filename", ""), path, where)
    return rgb, picture


def _joint(file: _File, element: ET.Element) -> tuple[ModelJoint, FloatArray]:
    """A joint, its axis still in its child's frame, and ``parent_T_child``."""
    name = named(element, "name", f"{file.path}, a joint")
    where = f"{file.path}, joint {name!r}"
    kind = named(element, "type", where)
    if kind not in KINDS:
        raise InputError(f"{where}: unknown type {kind!r}; there are {', '.join(KINDS)}")
    axis = numbers(element.find("axis"), "xyz", "1 0 0", 3, where)
    turns = kind in ("revolute", "continuous")
    joint = ModelJoint(
        name=name,
        kind="revolute" if turns else kind,
        parent=named(element.find("parent"), "link", f"{where}, parent"),
        child=named(element.find("child"), "link", f"{where}, child"),
        axis=triple(unit(axis, where) if turns or kind == "prismatic" else (0, 0, 1)),
        limits=_limits(element, where) if kind in ("revolute", "prismatic") else None,
        mimic=_mimic(element.find("mimic"), where),
    )
    return joint, origin(element, where)


def _limits(element: ET.Element, where: str) -> tuple[float, float]:
    limit = element.find("limit")
    if limit is None:
        raise InputError(
            f"{where} has no <limit>; give its lower and upper, or make it continuous or fixed"
        )
    lower, upper = (number(limit, name, "0", where) for name in ("lower", "upper"))
    if lower > upper:
        raise InputError(f"{where}: lower={lower} is above upper={upper}; swap them")
    return lower, upper


def _mimic(element: ET.Element | None, where: str) -> Mimic | None:
    if element is None:
        return None
    return Mimic(
        leader=named(element, "joint", f"{where}, mimic"),
        multiplier=number(element, "multiplier", "1", where),
        offset=number(element, "offset", "0", where),
    )


def _in_base(joint: ModelJoint, base_T_child: FloatArray) -> ModelJoint:
    axis = base_T_child[:3, :3] @ joint.axis
    return ModelJoint(**{**vars(joint), "axis": triple(axis), "pivot": triple(base_T_child[:3, 3])})


def _refuse_duplicates(path: Path, what: str, names: list[str]) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"{path} has several {what} named {twice[0]!r}; rename all but one")


def _root(path: Path, names: list[str], joints: list[ModelJoint]) -> str:
    """The one link that hangs on no other."""
    if not names:
        raise InputError(f"{path} has no links; give a robot with at least two")
    parents: dict[str, str] = {}
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in names:
                raise InputError(f"{path}, joint {joint.name!r}: there is no link {link!r}; add it")
        if joint.child in parents:
            raise InputError(
                f"{path}: link {joint.child!r} is the child of the joints "
                f"{parents[joint.child]!r} and {joint.name!r}; a link has one parent: remove one"
            )
        parents[joint.child] = joint.name
    roots = [name for name in names if name not in parents]
    if not roots:
        raise InputError(f"{path}: its joints go round in a cycle; remove one of them")
    if len(roots) > 1:
        raise InputError(
            f"{path}: the links {roots[0]!r} and {roots[1]!r} both have no parent; "
            "join them with a fixed joint"
        )
    return roots[0]


def _refuse_cycles(path: Path, names: list[str], reached: list[ModelJoint]) -> None:
    lost = set(names[1:]) - {joint.child for joint in reached}
    if len(reached) < len(names) - 1:
        link = sorted(lost)[0] if lost else names[0]
        raise InputError(
            f"{path}: link {link!r} hangs in a cycle of joints, apart from the root; "
            "remove one of them"
        )


def _refuse_lost_leaders(path: Path, joints: list[ModelJoint]) -> None:
    names = {joint.name for joint in joints}
    for joint in joints:
        if joint.mimic is not None and joint.mimic.leader not in names - {joint.name}:
            raise InputError(
                f"{path}: joint {joint.name!r} mimics {joint.mimic.leader!r}, which is no other "
                "joint; name one"
            )


def _links(file: _File, base_T_link: dict[str, FloatArray]) -> tuple[Link, ...]:
    """All links; where there is nothing else to see, by their collision shapes.

    That is: all links if none has a visual, else those without one between joints that move,
    for every joint needs visible parts on both sides.
    """
    ends = [
        named(joint.find(side), "link", file.path.name)
        for joint in file.robot.findall("joint")
        if joint.get("type") not in ("fixed", "floating", "planar")
        for side in ("parent", "child")
    ]
    blind = next(file.robot.iter("visual"), None) is None

    def tag(link: ET.Element) -> str:
        needed = blind or ends.count(link.get("name", "")) > 1
        return "collision" if needed and link.find("visual") is None else "visual"

    return tuple(
        Link(
            name=name,
            base_T_link=base_T_link[name],
            visuals=tuple(
                _visual(file, visual, f"{file.path}, link {name!r}")
                for visual in element.findall(tag(element))
            ),
        )
        for element in file.robot.findall("link")
        for name in [element.get("name", "")]
    )


def _visual(file: _File, element: ET.Element, where: str) -> Visual:
    geometry = element.find("geometry")
    shape = None if geometry is None else next(iter(geometry), None)
    if shape is None:
        raise InputError(f"{where}: a {element.tag} has no geometry; add a shape or remove it")
    color, picture = _look(file, element.find("material"))
    link_T_visual = origin(element, where)
    if shape.tag == "mesh":
        return Visual(link_T_visual=link_T_visual, shape=_mesh(file, shape, color, where))
    patch = _primitive(shape, Material(color=color) if color else Material(), where)
    if picture is not None:
        uv = primitives.box_mapped(patch.corners, (1.0, 1.0), metric=False)
        look = Material(color=color or (1.0, 1.0, 1.0), texture=read_texture(picture))
        patch = primitives.patch(patch.corners, look, uv)
    return Visual(link_T_visual=link_T_visual, shape=(patch,))


def _look(file: _File, element: ET.Element | None) -> Look:
    if element is None:
        return _NOTHING
    own = _own_look(file.path, element)
    return own if own != _NOTHING else file.looks.get(element.get("name", ""), _NOTHING)


def _mesh(
    file: _File, shape: ET.Element, color: tuple[float, float, float] | None, where: str
) -> MeshFile:
    name = named(shape, "filename", f"{where}, mesh")
    link = where.rpartition(", ")[2]
    scale = triple(numbers(shape, "scale", "1 1 1", 3, where))
    if not np.prod(scale):
        raise InputError(f"{where}: scale={shape.get('scale')!r} flattens the mesh; no zero")
    return MeshFile(path=resolve(name, file.path, link), scale=scale, color=color)


def _primitive(shape: ET.Element, material: Material, where: str) -> Patch:
    where = f"{where}, {shape.tag}"
    measures = {"box": ("size",), "sphere": ("radius",)}.get(shape.tag, ("radius", "length"))
    if shape.tag not in ("box", "sphere", "cylinder", "capsule"):
        raise InputError(f"{where}: unknown shape; use box, cylinder, sphere, capsule or mesh")
    count = 3 if shape.tag == "box" else 1
    sizes = np.concatenate([numbers(shape, name, None, count, where) for name in measures])
    if (sizes < 0).any():
        raise InputError(f"{where}: a measure is negative; make it positive")
    if shape.tag == "box":
        return primitives.box(sizes, material)
    if shape.tag == "sphere":
        return primitives.ellipsoid(np.repeat(sizes, 3), material)
    make = primitives.cylinder if shape.tag == "cylinder" else primitives.capsule
    return make(float(sizes[0]), float(sizes[1]), material)


def _files(file: _File, links: tuple[Link, ...]) -> tuple[Path, ...]:
    meshes = [v.shape.path for k in links for v in k.visuals if isinstance(v.shape, MeshFile)]
    pictures = [picture for _, picture in file.looks.values() if picture is not None]
    named = dict.fromkeys([file.path, *meshes, *pictures])
    return tuple(dict.fromkeys(f for path in named for f in (path, *companions(path))))
