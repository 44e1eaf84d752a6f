"""A PartNet-Mobility folder as the data set has it: made here, with the same conventions."""

import json

import numpy as np
import pytest
import trimesh

from r2art.core.errors import InputError
from r2art.data.models.build import build
from r2art.data.models.partnet import read_partnet

UP = "1.570796326794897 0 -1.570796326794897"  # meshes are y up, front to +z; base is z up


def link(name, mesh="", at=(0, 0, 0)):
    if not mesh:
        return f'<link name="{name}"/>'
    origin = " ".join(str(-v) for v in at)
    return f"""<link name="{name}"><visual name="x-1"><origin xyz="{origin}"/><geometry>
        <mesh filename="textured_objs/{mesh}"/></geometry></visual></link>"""


def joint(name, kind, parent, child, at=(0, 0, 0), axis=(1, 0, 0), limit="", rpy="0 0 0"):
    xyz, direction = (" ".join(map(str, values)) for values in (at, axis))
    return f"""<joint name="{name}" type="{kind}"><origin xyz="{xyz}" rpy="{rpy}"/>
        <axis xyz="{direction}"/><child link="{child}"/><parent link="{parent}"/>
        {limit}</joint>"""


def entry(id, name, joint, parent=3, **limit):
    data = {"axis": {"origin": [0, 0, 0], "direction": [1, 0, 0]}, "limit": limit}
    return {
        "id": id,
        "parent": parent,
        "joint": joint,
        "name": name,
        "parts": [],
        "jointData": data,
    }


HINGE, LID = (-0.3, 0, 0.2), (0, 0.45, 0)


@pytest.fixture
def chest(tmp_path):
    """A chest with a door, two drawers (numbered from below), a bottle-like lid and a loose bit."""
    meshes = {
        "body.obj": ((0.6, 0.8, 0.4), (0, 0, 0)),
        "door.obj": ((0.6, 0.2, 0.02), (0, -0.2, 0.21)),
        "low.obj": ((0.5, 0.1, 0.3), (0, 0.05, 0.06)),
        "high.obj": ((0.5, 0.1, 0.3), (0, 0.25, 0.06)),
        "lid.obj": ((0.1, 0.1, 0.1), LID),
        "bit.obj": ((0.02, 0.02, 0.02), (0.2, 0.39, 0)),
    }
    (tmp_path / "textured_objs").mkdir()
    for name, (extents, center) in meshes.items():
        mesh = trimesh.creation.box(extents=extents)
        mesh.apply_translation(center)
        mesh.export(tmp_path / "textured_objs" / name)
    slide = '<limit lower="0" upper="0.25"/>'
    parts = [
        link("base"),
        link("link_0", "low.obj"),
        link("link_1", "high.obj"),
        link("link_2", "door.obj", HINGE),
        link("link_3", "body.obj"),
        link("link_4", "lid.obj", LID),
        link("link_4_helper"),
        link("link_5", "bit.obj"),
        joint("joint_0", "prismatic", "link_3", "link_0", axis=(0, 0, 1), limit=slide),
        joint("joint_1", "prismatic", "link_3", "link_1", axis=(0, 0, 1), limit=slide),
        joint("joint_2", "continuous", "link_3", "link_2", HINGE, (0, -1, 0)),
        joint("joint_3", "fixed", "base", "link_3", rpy=UP),
        joint("joint_4", "continuous", "link_4_helper", "link_4", axis=(0, 1, 0)),
        joint("joint_6", "prismatic", "link_3", "link_4_helper", LID, (0, 1, 0), slide),
        joint("joint_5", "continuous", "link_3", "link_5", axis=(0, 1, 0)),
    ]
    (tmp_path / "mobility.urdf").write_text(f'<robot name="partnet_0ab">{"".join(parts)}</robot>')
    notes = [
        entry(0, "drawer", "slider", a=0, b=0.25, noLimit=False),
        entry(1, "drawer", "slider", a=0, b=0.25, noLimit=False),
        entry(2, "door", "hinge", a=-10, b=90, noLimit=False),
        entry(3, "cabinet_frame", "fixed", parent=-1),
        entry(4, "lid", "slider", a=0, b=0.25, noLimit=False, rotates=True, noRotationLimit=True),
        entry(5, "bit", "junk"),
    ]
    (tmp_path / "mobility_v2.json").write_text(json.dumps(notes))
    (tmp_path / "meta.json").write_text(json.dumps({"model_cat": "StorageFurniture"}))
    return tmp_path


def test_parts_are_named_by_what_they_are_from_top_to_bottom(chest):
    instance = build(read_partnet(chest)).instance
    assert instance.category == "storagefurniture"
    assert instance.part_names == ("cabinet_frame", "door", "drawer_1", "drawer_2", "lid")
    assert [j.name for j in instance.joints] == ["door", "drawer_1", "drawer_2", "lid"]
    center, _ = instance.part_boxes()
    assert center[2, 1] > center[3, 1]  # drawer_1 is the upper one


def test_the_root_frame_is_the_meshes_own_for_they_are_y_up_and_face_z(chest):
    built = build(read_partnet(chest))
    center, size = built.instance.part_boxes()
    np.testing.assert_allclose(size[0], [0.6, 0.8, 0.4], atol=1e-9)
    np.testing.assert_allclose(center[1], [0, -0.2, 0.21], atol=1e-9)
    np.testing.assert_allclose(center[2], [0, 0.25, 0.06], atol=1e-9)
    np.testing.assert_allclose(center[4], LID, atol=1e-9)
    axes = {joint.name: joint.axis for joint in built.instance.joints}
    np.testing.assert_allclose(axes["drawer_1"], [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(axes["door"], [0, -1, 0], atol=1e-9)
    np.testing.assert_allclose(built.instance.joints[0].pivot, HINGE, atol=1e-9)


def test_limits_that_the_urdf_lacks_come_from_the_json_in_degrees(chest):
    door, *others = build(read_partnet(chest)).instance.joints
    np.testing.assert_allclose(door.limits, np.radians([-10, 90]))
    assert [joint.limits for joint in others] == [(0, 0.25)] * 3


def test_a_hinge_without_limit_turns_all_round(chest):
    notes = json.loads((chest / "mobility_v2.json").read_text())
    notes[2]["jointData"]["limit"]["noLimit"] = True
    (chest / "mobility_v2.json").write_text(json.dumps(notes))
    assert build(read_partnet(chest)).instance.joints[0].limits == (-np.pi, np.pi)


def test_of_a_lid_that_is_lifted_and_spun_the_json_says_which_counts(chest):
    lid = build(read_partnet(chest)).instance.joints[-1]
    assert lid.kind == "prismatic"
    notes = json.loads((chest / "mobility_v2.json").read_text())
    notes[4]["joint"] = "hinge"
    (chest / "mobility_v2.json").write_text(json.dumps(notes))
    built = build(read_partnet(chest)).instance
    assert [j.kind for j in built.joints] == ["revolute", "prismatic", "prismatic", "revolute"]


def test_junk_belongs_to_what_it_hangs_on(chest):
    built = build(read_partnet(chest))
    assert built.links["link_5"][0] == 0


@pytest.mark.parametrize("name", ["mobility.urdf", "mobility_v2.json"])
def test_both_files_are_needed(chest, name):
    (chest / name).unlink()
    with pytest.raises(InputError, match=name):
        read_partnet(chest)


@pytest.mark.parametrize("text", ["{", "{}", "[1]", "[{}]", "null"])
def test_a_damaged_json_is_told_in_one_line(chest, text):
    (chest / "mobility_v2.json").write_text(text)
    with pytest.raises(InputError, match=r"mobility_v2\.json is not a list"):
        read_partnet(chest)
