"""MJCF (MuJoCo XML) to a `Model`, through the mujoco library: includes, defaults, scales and all.

What MuJoCo's own viewer shows at first is what is seen: geoms of the groups 0 to 2.
"""

# pyright: reportAttributeAccessIssue=false
# mujoco's names come from a compiled module that type checkers cannot see into.

from pathlib import Path
from xml.etree import ElementTree as ET

import mujoco
import numpy as np
from numpy.typing import NDArray

from r2art.core.errors import InputError
from r2art.data.models import primitives
from r2art.data.models.elements import parse
from r2art.data.models.model import (
    MOVABLE,
    Link,
    Mimic,
    Model,
    ModelJoint,
    Patch,
    Visual,
    rigid,
    triple,
)
from r2art.data.models.mujoco_looks import Looks
from r2art.data.models.paths import model_file

FloatArray = NDArray[np.floating]

GROUPS = 3  # the first geom groups are seen
_GEOM, _JOINT = mujoco.mjtGeom, mujoco.mjtJoint
_NOT_SEEN = tuple(map(int, (_GEOM.mjGEOM_PLANE, _GEOM.mjGEOM_HFIELD, _GEOM.mjGEOM_SDF)))
_KINDS = {
    int(_JOINT.mjJNT_HINGE): "revolute",
    int(_JOINT.mjJNT_SLIDE): "prismatic",
    int(_JOINT.mjJNT_FREE): "free",
    int(_JOINT.mjJNT_BALL): "a ball joint",
}


def read_mjcf(path: Path) -> Model:
    """A model from a MuJoCo XML file, or from the only one in a folder.

    A free joint holds nothing: what hangs on it is an object of its own. Several joints of one
    body become a chain with links between that are not seen.

    Raises:
        InputError: MuJoCo refuses it, in whose own words.
    """
    path = model_file(path, ".xml")
    parse(path, "mujoco")
    try:
        m = mujoco.MjModel.from_xml_path(str(path))
        files = _files(path)
    except (ValueError, ET.ParseError) as error:
        words = " ".join(str(error).split()).removeprefix("Error: ")
        raise InputError(f"MuJoCo cannot read {path}: {words}") from None
    data = mujoco.MjData(m)
    for j in range(m.njnt):
        if _kind(m, j) in MOVABLE:
            data.qpos[m.jnt_qposadr[j]] = 0.0
    mujoco.mj_kinematics(m, data)
    visuals = _visuals(m)
    links = [Link(name="world", base_T_link=np.eye(4), visuals=visuals[0])]
    joints = []
    for body in range(1, m.nbody):
        pose = rigid(data.xmat[body].reshape(3, 3), data.xpos[body])
        chain = _chain(m, data, body)
        joints += chain
        links += [Link(name=joint.child, base_T_link=pose) for joint in chain[:-1]]
        links.append(Link(name=body_name(m, body), base_T_link=pose, visuals=visuals[body]))
    return Model(
        name=_text(m.names, 0) or path.stem,
        links=tuple(links),
        joints=tuple(joints),
        files=files,
    )


def body_name(m: mujoco.MjModel, body: int) -> str:
    """A body's name; one of its own if the file gives none."""
    return m.body(body).name or f"body{body}"


def joint_name(m: mujoco.MjModel, joint: int) -> str:
    """A joint's name; one of its own if the file gives none."""
    return m.joint(joint).name or f"joint{joint}"


def _kind(m: mujoco.MjModel, joint: int) -> str:
    return _KINDS[int(m.jnt_type[joint])]


def _chain(m: mujoco.MjModel, data: mujoco.MjData, body: int) -> list[ModelJoint]:
    """What joins a body to its parent: a fixed joint, or its joints one after the other."""
    parent, name = body_name(m, m.body_parentid[body]), body_name(m, body)
    ids = range(m.body_jntadr[body], m.body_jntadr[body] + m.body_jntnum[body])
    if not ids:
        return [ModelJoint(name=f"{name} (fixed)", kind="fixed", parent=parent, child=name)]
    ends = [*(f"{name} after {joint_name(m, j)}" for j in ids[:-1]), name]
    return [
        ModelJoint(
            name=joint_name(m, j),
            kind=_kind(m, j),
            parent=start,
            child=end,
            axis=triple(data.xaxis[j]),
            pivot=triple(data.xanchor[j]),
            limits=tuple(m.jnt_range[j].tolist()) if m.jnt_limited[j] else None,
            mimic=_mimic(m, j),
        )
        for j, start, end in zip(ids, [parent, *ends], ends, strict=False)
    ]


def _mimic(m: mujoco.MjModel, joint: int) -> Mimic | None:
    """A linear equality constraint between two joints, as the rule it is."""
    for e in range(m.neq):
        kind = mujoco.mjtEq(int(m.eq_type[e]))
        coupling = kind == mujoco.mjtEq.mjEQ_JOINT and m.eq_obj1id[e] == joint
        if not coupling or m.eq_obj2id[e] < 0 or m.eq_data[e, 2:5].any():
            continue
        leader, (offset, multiplier) = int(m.eq_obj2id[e]), m.eq_data[e, :2].tolist()
        own, other = (float(m.qpos0[m.jnt_qposadr[j]]) for j in (joint, leader))
        offset += own - multiplier * other
        return Mimic(leader=joint_name(m, leader), multiplier=multiplier, offset=offset)
    return None


def _visuals(m: mujoco.MjModel) -> list[tuple[Visual, ...]]:
    """What is seen of each body; all groups where the first ones hold nothing."""
    looks = Looks(m)
    shown = [g for g in range(m.ngeom) if m.geom_group[g] < GROUPS and looks.alpha(g) > 0]
    solid = [g for g in shown or range(m.ngeom) if int(m.geom_type[g]) not in _NOT_SEEN]
    seen: list[tuple[Visual, ...]] = [() for _ in range(m.nbody)]
    for g in solid:
        R = np.zeros(9)
        mujoco.mju_quat2Mat(R, m.geom_quat[g])
        visual = Visual(
            link_T_visual=rigid(R.reshape(3, 3), m.geom_pos[g]), shape=(_patch(m, g, looks),)
        )
        seen[m.geom_bodyid[g]] += (visual,)
    return seen


def _patch(m: mujoco.MjModel, geom: int, looks: Looks) -> Patch:
    material = looks.material(geom)
    kind, size = _GEOM(int(m.geom_type[geom])), m.geom_size[geom]
    if kind == _GEOM.mjGEOM_MESH:
        corners, uv = _mesh(m, int(m.geom_dataid[geom]))
        patch = primitives.patch(corners, material, uv)
    elif kind == _GEOM.mjGEOM_BOX:
        patch, uv = primitives.box(2 * size, material), None
    elif kind == _GEOM.mjGEOM_CYLINDER:
        patch, uv = primitives.cylinder(size[0], 2 * size[1], material), None
    elif kind == _GEOM.mjGEOM_CAPSULE:
        patch, uv = primitives.capsule(size[0], 2 * size[1], material), None
    else:
        radii = size if kind == _GEOM.mjGEOM_ELLIPSOID else np.repeat(size[0], 3)
        patch, uv = primitives.ellipsoid(radii, material), None
    if material.texture is None:
        return patch
    return primitives.patch(patch.corners, material, looks.mapped(geom, patch.corners, uv))


def _mesh(m: mujoco.MjModel, mesh: int) -> tuple[FloatArray, FloatArray | None]:
    """Corners (F, 3, 3) of a mesh and their texture coordinates (F, 3, 2), if it has any."""
    start, count = m.mesh_faceadr[mesh], m.mesh_facenum[mesh]
    faces = slice(start, start + count)
    vertices = m.mesh_vert[m.mesh_vertadr[mesh] :].astype(np.float64)
    corners = vertices[m.mesh_face[faces]]
    if m.mesh_texcoordadr[mesh] < 0:
        return corners, None
    uv = m.mesh_texcoord[m.mesh_texcoordadr[mesh] :][m.mesh_facetexcoord[faces]]
    return corners, uv.astype(np.float64)


def _text(names: bytes, start: int) -> str:
    return names[start : names.index(b"\0", start)].decode()


def _files(path: Path) -> tuple[Path, ...]:
    """The XML files, meshes and textures that a model names, as far as they are found."""
    spec = mujoco.MjSpec.from_file(str(path))
    folder = path.parent
    named = [(spec.meshdir, mesh.file) for mesh in spec.meshes]
    named += [(spec.texturedir, f) for t in spec.textures for f in (t.file, *t.cubefiles)]
    found = [folder / (place or "") / name for place, name in named if name]
    return tuple(dict.fromkeys([*_includes(path, folder), *(f for f in found if f.is_file())]))


def _includes(path: Path, folder: Path) -> list[Path]:
    """A file and those that it includes; all are named from the model's folder."""
    names = [e.get("file", "") for e in ET.parse(path).getroot().iter("include")]
    return [path, *(file for name in names for file in _includes(folder / name, folder))]
