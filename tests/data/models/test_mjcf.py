"""MuJoCo XML: what MuJoCo makes of a file is what we make of it."""

import mujoco
import numpy as np
import pytest
from PIL import Image

from r2art.core.errors import InputError
from r2art.data.models.build import Reading, build
from r2art.data.models.mjcf import read_mjcf
from r2art.data.models.parity import parity
from r2art.data.models.weld import welded

BOX = '<geom type="box" size="0.1 0.2 0.3"/>'


def mjcf(body, head="", world=""):
    return f"""
    <mujoco model="m">{head}
      <worldbody>{world}
        <body name="base">{BOX}{body}</body>
      </worldbody>
    </mujoco>"""


DOOR = """<body name="door" pos="0.1 -0.2 0" euler="0 0 30">
  <joint name="hinge" axis="0 0 1" range="-20 90" limited="true" pos="0.01 0 0"/>
  <geom type="box" size="0.01 0.2 0.3" pos="0 0.2 0"/></body>"""


def test_joint_limits_are_radians_and_poses_are_mujocos(write):
    path = write(mjcf(DOOR), "m.xml")
    result = parity(path, "mjcf")
    (joint,) = result.built.instance.joints
    np.testing.assert_allclose(joint.limits, np.radians([-20, 90]))
    assert result.deviation < 1e-12
    assert result.built.instance.part_names == ("base", "door")


def test_a_reference_position_keeps_the_files_numbering(write):
    path = write(mjcf(DOOR.replace('axis="0 0 1"', 'axis="0 0 1" ref="40"')), "m.xml")
    assert parity(path, "mjcf").deviation < 1e-12


def test_includes_defaults_and_degrees_or_radians(write):
    default = '<default><joint axis="0 1 0" range="0 0.5" limited="true"/></default>'
    door = DOOR.replace('axis="0 0 1" range="-20 90" limited="true" ', "")
    for name, text in (("defaults", default), ("door", door)):
        write(f"<mujocoinclude>{text}</mujocoinclude>", f"parts/{name}.xml")
    head = '<compiler angle="radian"/><include file="parts/defaults.xml"/>'
    path = write(mjcf('<include file="parts/door.xml"/>', head), "m.xml")
    model = read_mjcf(path)
    assert [file.name for file in model.files] == ["m.xml", "defaults.xml", "door.xml"]
    (joint,) = build(model).instance.joints
    assert joint.limits == (0, 0.5)
    np.testing.assert_allclose(joint.axis, [np.cos(30), 0, -np.sin(30)], atol=1e-9)


def test_several_joints_of_one_body_are_a_chain(write):
    joints = """<joint name="slide" type="slide" axis="1 0 0" range="0 0.3" limited="true"/>
                <joint name="hinge" axis="0 0 1" range="-90 90" limited="true"/>"""
    body = f'<body name="door" pos="0.1 0.3 0">{joints}{BOX}</body>'
    path = write(mjcf(body), "m.xml")
    model = read_mjcf(path)
    assert [(j.name, j.parent, j.child) for j in model.joints[1:]] == [
        ("slide", "base", "door after slide"),
        ("hinge", "door after slide", "door"),
    ]
    m = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(m)
    data.qpos[:] = 0.2, 0.7
    mujoco.mj_kinematics(m, data)
    moved = welded(model, ("slide=0.2", "hinge=0.7"))
    pose = next(link.base_T_link for link in moved.links if link.name == "door")
    np.testing.assert_allclose(pose[:3, 3], data.body("door").xpos, atol=1e-12)
    np.testing.assert_allclose(pose[:3, :3].ravel(), data.body("door").xmat, atol=1e-12)

    with pytest.raises(InputError, match=r"between the joints 'slide' and 'hinge'.*--fix slide"):
        build(model)
    for held, left in (("slide", "hinge"), ("hinge", "slide")):
        result = parity(path, "mjcf", reading=Reading(fix=(held,)))
        assert [joint.name for joint in result.built.instance.joints] == [left]
        assert result.deviation < 1e-12


@pytest.mark.parametrize(
    ("geom", "extent"),
    [
        ('type="box" size="0.1 0.2 0.3"', (0.2, 0.4, 0.6)),
        ('type="cylinder" size="0.1 0.2"', (0.2, 0.2, 0.4)),
        ('type="capsule" size="0.1 0.2"', (0.2, 0.2, 0.6)),
        ('type="sphere" size="0.1"', (0.2, 0.2, 0.2)),
        ('type="ellipsoid" size="0.1 0.2 0.3"', (0.2, 0.4, 0.6)),
        ('type="mesh" mesh="brick"', (0.1, 0.2, 0.3)),
        ('type="mesh" mesh="long"', (0.3, 0.2, 0.15)),
    ],
)
def test_shapes_have_mujocos_size_and_place(write, mesh_file, geom, extent):
    mesh_file("meshes/brick.stl")
    head = """<compiler meshdir="meshes"/><asset><mesh name="brick" file="brick.stl"/>
              <mesh name="long" file="brick.stl" scale="3 1 0.5"/></asset>"""
    joint = '<joint axis="0 0 1" range="0 9" limited="true"/>'
    body = f'<body name="arm">{joint}<geom {geom} pos="0.5 0 0"/></body>'
    built = build(read_mjcf(write(mjcf(body, head), "m.xml")))
    center, size = (values[1][[2, 0, 1]] for values in built.instance.part_boxes())
    np.testing.assert_allclose(size, extent, rtol=0.01)
    np.testing.assert_allclose(center, [0.5, 0, 0], atol=1e-6)


def test_collision_groups_floors_and_the_invisible_are_not_seen(write):
    body = DOOR.replace("</body>", """
        <geom type="box" size="0.5 0.5 0.5" group="3"/>
        <geom type="box" size="0.5 0.5 0.5" rgba="1 0 0 0"/></body>""")  # fmt: skip
    floor = '<geom type="plane" size="0 0 1"/>'
    built = build(read_mjcf(write(mjcf(body, world=floor), "m.xml")))
    np.testing.assert_allclose(built.instance.part_boxes()[1][0], [0.4, 0.6, 0.2], atol=1e-9)
    assert built.instance.part_boxes()[1][1].max() < 0.7


def test_a_model_of_collision_geoms_alone_is_seen_by_them(write):
    text = mjcf(DOOR).replace("<geom", '<geom group="3"')
    assert build(read_mjcf(write(text, "m.xml"))).instance.part_names == ("base", "door")


def test_colours_come_from_geom_material_or_default(write, tmp_path):
    Image.new("RGB", (8, 8), (200, 100, 50)).save(tmp_path / "p.png")
    head = """<asset><texture name="t" type="2d" file="p.png"/>
      <material name="red" rgba="1 0 0 1"/><material name="print" texture="t" texrepeat="3 2"/>
      </asset><default><default class="blue"><geom rgba="0 0 1 1"/></default></default>"""
    geoms = [
        '<geom type="box" size="0.1 0.1 0.1" material="red"/>',
        '<geom type="box" size="0.1 0.1 0.2" material="red" rgba="0 1 0 1"/>',
        '<geom type="box" size="0.1 0.1 0.3" class="blue"/>',
        '<geom type="box" size="0.1 0.1 0.4" material="print"/>',
    ]
    body = DOOR.replace("</body>", "".join(geoms) + "</body>")
    _, door = build(read_mjcf(write(mjcf(body, head), "m.xml"))).instance.parts
    assert [s.material.color for s in door[1:4]] == [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    np.testing.assert_array_equal(door[4].material.texture[0, 0], (200, 100, 50))
    np.testing.assert_allclose(np.ptp(door[4].uv, axis=0), [3, 2])


def test_what_hangs_on_a_free_joint_is_an_object_of_its_own(write):
    free = mjcf(f"<freejoint/>{DOOR}", world='<geom type="box" size="1 1 0.01"/>')
    built = build(read_mjcf(write(free, "m.xml")))
    assert built.instance.part_names == ("base", "door")
    assert "world" not in built.links


def test_two_objects_in_one_file_need_a_choice(write):
    lid = DOOR.replace("door", "lid").replace("hinge", "lift")
    other = f'<body name="other"><freejoint/>{BOX}{lid}</body>'
    path = write(mjcf(f"<freejoint/>{DOOR}", world=other), "m.xml")
    with pytest.raises(InputError, match=r"several objects \(other, base\).*--root other"):
        build(read_mjcf(path))
    for root, parts in (("other", ("other", "lid")), ("base", ("base", "door"))):
        assert build(read_mjcf(path), Reading(root=root)).instance.part_names == parts


def test_coupled_joints_follow(write):
    lid = DOOR.replace("door", "lid").replace("hinge", "lift").replace("0.1 -0.2 0", "-0.1 -0.2 0")
    rule = '<equality><joint joint1="lift" joint2="hinge" polycoef="0.1 -2 0 0 0"/></equality>'
    path = write(mjcf(DOOR + lid).replace("</mujoco>", rule + "</mujoco>"), "m.xml")
    (follows,) = build(read_mjcf(path)).follows
    assert (follows.follower, follows.leader) == (1, 0)
    assert (follows.multiplier, follows.offset) == (-2, 0.1)


def test_unnamed_bodies_and_joints_get_names(write):
    body = f'<body><joint axis="0 1 0" range="0 9" limited="true"/>{BOX}</body>'
    result = parity(write(mjcf(body), "m.xml"), "mjcf")
    assert result.built.instance.part_names == ("base", "body2")
    assert [joint.name for joint in result.built.instance.joints] == ["joint0"]


def test_an_unlimited_hinge_turns_all_round(write):
    body = f'<body><joint axis="0 1 0"/>{BOX}</body>'
    (joint,) = build(read_mjcf(write(mjcf(body), "m.xml"))).instance.joints
    assert joint.limits == (-np.pi, np.pi)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("<mujoco>", "is not XML"),
        ("<robot/>", "is a <robot>, not a <mujoco>"),
        (mjcf('<geom type="mesh" mesh="gone"/>'), "gone"),
        (mjcf("", '<asset><mesh name="gone" file="gone.stl"/></asset>'), r"gone\.stl"),
        (mjcf('<body><joint axis="0 0 0"/><geom size="1"/></body>'), "MuJoCo cannot read"),
        (mjcf(""), "nothing that is seen turns or slides"),
        (mjcf(f'<body><joint name="b" type="ball"/>{BOX}</body>'), "'b' is a ball joint.*--fix b"),
        (mjcf(f'<body><joint name="s" type="slide"/>{BOX}</body>'), "'s' slides without limits"),
    ],
)
def test_a_fault_is_one_clear_line(write, text, says):
    path = write(text, "m.xml")
    with pytest.raises(InputError, match=says) as caught:
        build(read_mjcf(path))
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_missing_file_or_folder_is_named(tmp_path):
    with pytest.raises(InputError, match=r"gone\.xml"):
        read_mjcf(tmp_path / "gone.xml")
    with pytest.raises(InputError, match=r"holds no \.xml"):
        read_mjcf(tmp_path)
