"""URDF as people write it: what it may hold is read, what it must not is told in one line."""

import re

import numpy as np
import pytest
from PIL import Image
from toy_models import BOX, CABINET

from r2art.core.errors import InputError
from r2art.data.models.build import Reading, build
from r2art.data.models.urdf import read_urdf


def robot(visual, joint="", axis="0 0 1", kind="revolute", limit='<limit lower="0" upper="1"/>'):
    """A base and an arm with something to see."""
    return f"""
    <robot name="r">
      <material name="wood"><color rgba="0.6 0.4 0.2 1"/></material>
      <link name="base">{BOX.format("0.1 0.1 0.1")}</link>
      <link name="arm">{visual}</link>
      <joint name="j" type="{kind}">
        <parent link="base"/><child link="arm"/><axis xyz="{axis}"/>{limit}{joint}
      </joint>
    </robot>"""


ARM = BOX.format("0.2 0.1 0.1")


def arm(path):
    """Vertices and material of the arm at rest, in the model's own axes."""
    built = build(read_urdf(path), Reading())
    (surface,) = built.instance.parts[1]
    R, t = built.base_T_root[:3, :3], built.base_T_root[:3, 3]
    return surface.vertices @ R.T + t, surface


def volume(surface):
    a, b, c = np.moveaxis(surface.vertices[surface.faces], 1, 0)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def test_fixed_joints_make_one_part_of_their_links(write):
    built = build(read_urdf(write(CABINET)))
    assert built.instance.part_names == ("base", "door", "tray")
    assert [j.name for j in built.instance.joints] == ["hinge", "slide"]
    assert [j.parent for j in built.instance.joints] == [0, 0]
    assert {name: part for name, (part, _) in built.links.items()} == {
        "base": 0, "frame": 0, "door": 1, "knob": 1, "tray": 2
    }  # fmt: skip


def test_poses_are_those_of_the_tree_multiplied_by_hand(write):
    built = build(read_urdf(write(CABINET)))
    q = np.array([0.7, 0.2])
    c, s = np.cos(0.3), np.sin(0.3)
    base_T_frame = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0.1], [0, 0, 0, 1]])
    c, s = np.cos(0.7 - 0.3), np.sin(0.7 - 0.3)
    frame_T_door = np.array([[c, -s, 0, 0.2], [s, c, 0, -0.25], [0, 0, 1, 0], [0, 0, 0, 1]])
    frame_T_tray = np.eye(4)
    frame_T_tray[0, 3] = 0.2
    for link, pose in (("door", frame_T_door), ("tray", frame_T_tray)):
        got = np.linalg.inv(built.root_T_link("base", q)) @ built.root_T_link(link, q)
        np.testing.assert_allclose(got, base_T_frame @ pose, atol=1e-12)


def test_the_root_frame_is_right_up_front_from_the_centre_of_the_root_box(write):
    built = build(read_urdf(write(CABINET)))
    np.testing.assert_allclose(built.base_T_root[:3, :3], np.eye(3)[:, [1, 2, 0]], atol=1e-15)
    np.testing.assert_allclose(built.instance.part_boxes()[0][0], 0, atol=1e-12)
    np.testing.assert_allclose(built.instance.part_boxes()[1][0], [0.6, 0.8, 0.4], atol=1e-12)
    np.testing.assert_allclose(built.instance.joints[0].axis, [0, 1, 0], atol=1e-12)


def test_limits_are_those_of_the_file_even_without_zero(write):
    hinge, slide = build(read_urdf(write(CABINET))).instance.joints
    assert hinge.limits == (-0.2, 1.5)
    assert slide.limits == (0.1, 0.35)


def test_a_continuous_joint_turns_all_round(write):
    path = write(robot(ARM, kind="continuous", limit=""))
    assert build(read_urdf(path)).instance.joints[0].limits == (-np.pi, np.pi)


@pytest.mark.parametrize(
    ("shape", "extent"),
    [
        ('<box size="0.1 0.2 0.3"/>', (0.1, 0.2, 0.3)),
        ('<cylinder radius="0.05" length="0.4"/>', (0.1, 0.1, 0.4)),
        ('<sphere radius="0.06"/>', (0.12, 0.12, 0.12)),
        ('<capsule radius="0.05" length="0.2"/>', (0.1, 0.1, 0.3)),
        ('<mesh filename="m.stl"/>', (0.1, 0.2, 0.3)),
        ('<mesh filename="m.stl" scale="2 1 0.5"/>', (0.2, 0.2, 0.15)),
    ],
)
def test_shapes_have_their_size_and_face_outwards(write, mesh_file, shape, extent):
    mesh_file("m.stl")
    visual = f'<visual><origin xyz="0.5 0 0"/><geometry>{shape}</geometry></visual>'
    vertices, surface = arm(write(robot(visual)))
    np.testing.assert_allclose(np.ptp(vertices, axis=0), extent, rtol=0.01)
    np.testing.assert_allclose((vertices.max(0) + vertices.min(0)) / 2, [0.5, 0, 0], atol=1e-6)
    assert volume(surface) > 0.5 * np.prod(extent) * np.pi / 6


def test_a_mirrored_mesh_still_faces_outwards(write, mesh_file):
    mesh_file("m.stl")
    shape = '<mesh filename="m.stl" scale="1 -1 1"/>'
    _, surface = arm(write(robot(f"<visual><geometry>{shape}</geometry></visual>")))
    assert volume(surface) == pytest.approx(0.006)


@pytest.mark.parametrize(
    ("uri", "place"),
    [
        ("meshes/m.stl", "robot/urdf/meshes/m.stl"),
        ("../meshes/m.stl", "robot/meshes/m.stl"),
        ("package://robot/meshes/m.stl", "robot/meshes/m.stl"),
        ("package://other/meshes/m.stl", "other/meshes/m.stl"),
        ("package://renamed/meshes/m.stl", "robot/meshes/m.stl"),
        ("model://robot/m.stl", "robot/m.stl"),
    ],
)
def test_meshes_are_found(write, mesh_file, uri, place):
    mesh = mesh_file(place)
    visual = f'<visual><geometry><mesh filename="{uri}"/></geometry></visual>'
    model = read_urdf(write(robot(visual), "robot/urdf/r.urdf"))
    assert any(file.samefile(mesh) for file in model.files)
    np.testing.assert_allclose(build(model).instance.part_boxes()[1][1], [0.2, 0.3, 0.1])


def test_files_beside_what_a_link_leads_to_are_found(write, mesh_file, tmp_path):
    mesh_file("robot/m.stl")
    path = write(
        robot('<visual><geometry><mesh filename="m.stl"/></geometry></visual>'), "robot/r.urdf"
    )
    (link := tmp_path / "installed.urdf").symlink_to(path)
    assert len(build(read_urdf(link)).instance.parts) == 2


def test_packages_elsewhere_are_found_by_their_variable(write, mesh_file, monkeypatch, tmp_path):
    mesh_file("far/away/arm_description/m.stl")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "far" / "away"))
    shape = '<mesh filename="package://arm_description/m.stl"/>'
    read_urdf(write(robot(f"<visual><geometry>{shape}</geometry></visual>"), "here/r.urdf"))


def test_absolute_paths_and_file_addresses_are_taken_as_they_are(write, mesh_file):
    mesh = mesh_file("x/m.stl")
    for uri in (str(mesh), f"file://{mesh}"):
        visual = f'<visual><geometry><mesh filename="{uri}"/></geometry></visual>'
        assert mesh in read_urdf(write(robot(visual))).files


def test_colours_of_the_model_are_for_meshes_without(write, mesh_file):
    mesh_file("m.stl")
    for material in (
        '<material name="wood"/>',
        '<material><color rgba="0.6 0.4 0.2 1"/></material>',
    ):
        for shape in ('<mesh filename="m.stl"/>', '<box size="0.1 0.1 0.1"/>'):
            visual = f"<visual><geometry>{shape}</geometry>{material}</visual>"
            assert arm(write(robot(visual)))[1].material.color == (0.6, 0.4, 0.2)


OBJ = """mtllib m.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
usemtl paint
f 1/1 2/2 3/3 4/4
"""


def test_a_textured_obj_keeps_its_picture(write, tmp_path):
    write(OBJ, "m.obj")
    write("newmtl paint\nKd 0 0 0\nmap_Kd p.png\n", "m.mtl")
    pixels = np.zeros((4, 4, 3), np.uint8)
    pixels[0, 0] = (250, 0, 0)  # upper left
    Image.fromarray(pixels).save(tmp_path / "p.png")
    visual = '<visual><geometry><mesh filename="m.obj"/></geometry><material name="wood"/></visual>'
    model = read_urdf(write(robot(visual)))
    assert {file.name for file in model.files} == {"model.urdf", "m.obj", "m.mtl", "p.png"}
    vertices, surface = arm(write(robot(visual)))
    np.testing.assert_array_equal(surface.material.texture, pixels)
    assert surface.material.color == (1, 1, 1)
    corner = np.argmin(np.linalg.norm(vertices - [0, 1, 0], axis=1))
    np.testing.assert_allclose(surface.uv[corner], [0, 1])  # that is where the red pixel lies


def test_an_untextured_obj_takes_the_colour_of_its_model(write):
    write(OBJ, "m.obj")
    write("newmtl paint\nKd 0.1 0.9 0.1\n", "m.mtl")
    shape = '<geometry><mesh filename="m.obj"/></geometry>'
    own = arm(write(robot(f"<visual>{shape}</visual>")))[1].material.color
    np.testing.assert_allclose(own, (0.1, 0.9, 0.1), atol=0.01)
    given = arm(write(robot(f'<visual>{shape}<material name="wood"/></visual>')))[1].material
    assert given.color == (0.6, 0.4, 0.2)


def test_a_picture_in_a_material_covers_a_box(write, tmp_path):
    Image.new("RGB", (700, 1400), (10, 200, 30)).save(tmp_path / "p.png")
    material = '<material name="print"><texture filename="p.png"/></material>'
    visual = f'<visual><geometry><box size="0.1 0.2 0.3"/></geometry>{material}</visual>'
    surface = arm(write(robot(visual)))[1]
    assert surface.material.texture.shape == (512, 256, 3)
    assert surface.uv.min() == 0
    assert surface.uv.max() == 1


def test_collision_shapes_are_seen_only_if_there_are_no_others(write):
    collision = ARM.replace("visual", "collision")
    only = CABINET.replace("visual>", "collision>")
    assert len(build(read_urdf(write(only))).instance.parts) == 3
    with pytest.raises(InputError, match="nothing that is seen turns"):
        build(read_urdf(write(robot(collision))))


def test_a_link_between_joints_that_has_collision_shapes_alone_is_seen_by_them(write):
    """Or nothing could be told of the joints: what stands between them is a part."""
    unseen = BOX.format("0.4 0.6 0.8")
    text = CABINET.replace(unseen, unseen.replace("visual", "collision"))
    text = text.replace('<parent link="frame"/>', '<parent link="base"/>')
    assert build(read_urdf(write(text))).instance.part_names == ("base", "door", "tray")


def test_mimicking_joints_follow(write):
    text = CABINET.replace(
        '<axis xyz="1 0 0"/>',
        '<axis xyz="1 0 0"/><mimic joint="hinge" multiplier="0.1" offset="0.15"/>',
    )
    (rule,) = build(read_urdf(write(text))).follows
    assert (rule.follower, rule.leader, rule.multiplier, rule.offset) == (1, 0, 0.1, 0.15)


def test_what_mimics_a_held_joint_is_held_where_it_then_is(write):
    extra = """
      <link name="lid"><visual><geometry><box size="0.4 0.6 0.02"/></geometry></visual></link>
      <joint name="top" type="revolute"><parent link="base"/><child link="lid"/>
        <axis xyz="0 1 0"/><limit lower="0" upper="1"/></joint></robot>"""
    text = CABINET.replace("</robot>", extra).replace(
        '<axis xyz="1 0 0"/>', '<axis xyz="1 0 0"/><mimic joint="hinge" multiplier="0.2"/>'
    )
    built = build(read_urdf(write(text)), Reading(fix=("hinge=0.5",)))
    assert [joint.name for joint in built.instance.joints] == ["top"]
    pose = np.linalg.inv(built.root_T_link("frame", np.zeros(1)))
    tray = pose @ built.root_T_link("tray", np.zeros(1))
    np.testing.assert_allclose(tray[:3, 3], [0.1, 0, 0], atol=1e-12)


def test_a_joint_without_range_is_rigid(write):
    text = CABINET.replace('lower="0.1" upper="0.35"', 'lower="0.2" upper="0.2"')
    built = build(read_urdf(write(text)))
    assert [joint.name for joint in built.instance.joints] == ["hinge"]
    frame_T_tray = np.linalg.inv(built.root_T_link("frame", np.zeros(1))) @ built.links["tray"][1]
    np.testing.assert_allclose(frame_T_tray[:3, 3], [0.2, 0, 0], atol=1e-12)


def test_a_folder_means_the_only_urdf_in_it(write, tmp_path):
    write(CABINET, "cabinet/urdf/a.urdf")
    assert read_urdf(tmp_path / "cabinet").name == "toy cabinet"
    write(CABINET, "cabinet/urdf/b.urdf")
    with pytest.raises(InputError, match=r"2 \.urdf files \(urdf/a\.urdf, urdf/b\.urdf\)"):
        read_urdf(tmp_path / "cabinet")


MESH = '<visual><geometry><mesh filename="{}"/></geometry></visual>'
XACRO = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arm/></robot>'


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("<robot><link name='a'>", r"is not XML \(.*line 1"),
        ("\0\1\2", "is not XML"),
        ("<mujoco/>", "is a <mujoco>, not a <robot>"),
        ("<robot/>", "no links"),
        (XACRO, "expand it"),
        (robot(MESH.format("gone.stl")), "link 'arm' needs gone.stl, which is not there"),
        (robot(MESH.format("package://p/gone.stl")), "link 'arm' needs package://p/gone.stl"),
        (robot(MESH.format("http://h/m.stl")), "only files"),
        (robot("<visual/>"), "link 'arm'.* has no geometry"),
        (robot(BOX.format("1 2")), "size='1 2' must be 3 finite numbers"),
        (robot(BOX.format("1 2 nan")), "3 finite numbers"),
        (robot(BOX.format("0.1 0.1 -0.2")), "negative"),
        (robot("<visual><geometry><cone/></geometry></visual>"), "unknown shape"),
        (robot("<visual><geometry><sphere/></geometry></visual>"), "'radius' is missing"),
        (robot(ARM, axis="0 0 0"), "joint 'j': the axis is zero"),
        (robot(ARM, axis="0 0 inf"), "joint 'j': xyz='0 0 inf'"),
        (robot(ARM, joint='<origin xyz="0 0"/>'), "joint 'j', origin"),
        (robot(ARM, limit=""), "joint 'j' has no <limit>"),
        (robot(ARM, limit='<limit lower="1" upper="0"/>'), "above upper"),
        (robot(ARM, limit='<limit lower="low" upper="0"/>'), "a finite number"),
        (robot(ARM, kind="hinge"), "unknown type 'hinge'"),
        (robot(ARM, joint='<mimic joint="k"/>'), "mimics 'k'"),
        (robot(ARM).replace('"base"/>', '"bass"/>'), "no link 'bass'"),
        (robot(ARM).replace('name="arm"', 'name="base"'), "several links named 'base'"),
        (robot(ARM).replace("<joint", '<joint name="k" type="fixed"><parent link="base"/>'
         '<child link="arm"/></joint><joint'), "a link has one parent"),
        (robot(ARM).replace("</robot>", '<link name="stray"/></robot>'), "both have no parent"),
        (robot(ARM).replace('"base"/>', '"arm"/>').replace('child link="arm"', 'child link="base"')
         .replace("</robot>", '<joint name="k" type="fixed"><parent link="base"/>'
         '<child link="arm"/></joint></robot>'), "cycle"),
        (robot(ARM).replace("</robot>", '<link name="x"/><link name="y"/><joint name="a" '
         'type="fixed"><parent link="x"/><child link="y"/></joint><joint name="b" type="fixed">'
         '<parent link="y"/><child link="x"/></joint></robot>'), "cycle"),
    ],
)  # fmt: skip
def test_a_fault_is_one_clear_line(write, text, says):
    path = write(text)
    with pytest.raises(InputError, match=says) as caught:
        read_urdf(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (robot(ARM, kind="floating", limit=""), "joint 'j' is floating.*--fix j"),
        (robot(ARM, kind="planar", limit=""), "joint 'j' is planar"),
        (robot(ARM, kind="fixed"), "nothing that is seen turns or slides"),
        (robot(BOX.format("300 200 300")), r"is 300 m across.*--scale 0\.001"),
        (robot(MESH.format("m.glb")), r"m\.glb \(link 'arm'.* is not a mesh"),
        (robot(MESH.format("m.stl")), r"m\.stl \(link 'arm'.* holds no triangles"),
    ],
)
def test_what_cannot_become_an_object_is_one_clear_line(write, text, says):
    write("no mesh", "m.glb")
    write("solid but empty", "m.stl")
    path = write(text)
    with pytest.raises(InputError, match=says) as caught:
        build(read_urdf(path))
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_named(tmp_path):
    for path in (tmp_path / "gone.urdf", tmp_path):
        with pytest.raises(InputError, match=re.escape(str(path))):
            read_urdf(path)


def test_a_mesh_in_millimetres_is_recognised(write, mesh_file):
    mesh_file("m.stl", (100, 200, 300))
    path = write(robot(MESH.format("m.stl")))
    with pytest.raises(InputError, match=r"300 m across; .*scale=\"0\.001"):
        build(read_urdf(path))
