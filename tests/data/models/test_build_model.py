"""From a model to an object: which link is the root, which way is up, how large, how fine."""

from dataclasses import replace

import numpy as np
import pytest
from toy_models import BOX, CABINET

from r2art.core.errors import InputError, UsageError
from r2art.data.models.build import Reading, build, turn
from r2art.data.models.urdf import read_urdf
from r2art.data.pose import posed_vertices, root_T_part


@pytest.fixture
def cabinet(write):
    return read_urdf(write(CABINET))


def triangles(built):
    return sum(len(s.faces) for part in built.instance.parts for s in part)


def in_base(built, state, root_link="base"):
    """All vertices, in the frame of a link of the root part."""
    vertices = posed_vertices(built.instance, root_T_part(built.instance.joints, state))
    root_T_link = built.root_T_link(root_link, state)
    return (vertices - root_T_link[:3, 3]) @ root_T_link[:3, :3]


def sorted_rows(points):
    points = np.round(points, 9) + 0.0
    return points[np.lexsort(points.T)]


@pytest.mark.parametrize("front", ["x", "-x", "+y", "-y"])
def test_a_robots_own_front_is_r2arts_z_and_its_right_x(front):
    R = turn("+z", front)
    sign, axis = (-1 if front[0] == "-" else 1), "xyz".index(front[-1])
    np.testing.assert_array_equal(R @ (sign * np.eye(3)[axis]), [0, 0, 1])
    np.testing.assert_array_equal(R @ [0, 0, 1], [0, 1, 0])
    assert np.linalg.det(R) == 1


@pytest.mark.parametrize(("up", "front"), [("z", "-z"), ("w", "x"), ("", "x"), ("z", "forward")])
def test_directions_that_cannot_be_meant_are_refused(up, front):
    with pytest.raises(UsageError, match=r"--up|--front"):
        turn(up, front)


def test_the_choice_of_axes_moves_nothing(cabinet):
    state = np.array([0.8, 0.3])
    usual = build(cabinet)
    for up, front in (("y", "x"), ("-x", "z"), ("z", "-y")):
        other = build(cabinet, Reading(up=up, front=front))
        np.testing.assert_allclose(
            sorted_rows(in_base(other, state)), sorted_rows(in_base(usual, state)), atol=1e-9
        )


def test_another_root_moves_nothing_and_keeps_the_states(cabinet):
    state = np.array([0.8, 0.3])
    usual, other = build(cabinet), build(cabinet, Reading(root="knob"))
    assert other.instance.part_names == ("door", "base", "tray")
    assert [joint.name for joint in other.instance.joints] == ["hinge", "slide"]
    assert [joint.parent for joint in other.instance.joints] == [0, 1]
    assert [j.limits for j in other.instance.joints] == [j.limits for j in usual.instance.joints]
    np.testing.assert_allclose(other.instance.part_boxes()[0][0], 0, atol=1e-12)
    np.testing.assert_allclose(
        sorted_rows(in_base(other, state, "base")), sorted_rows(in_base(usual, state)), atol=1e-9
    )


def test_a_held_joint_stays_where_it_is_held(cabinet):
    free = build(cabinet)
    held = build(cabinet, Reading(fix=("hinge=0.8",)))
    assert [joint.name for joint in held.instance.joints] == ["slide"]
    assert held.instance.part_names == ("base", "tray")
    np.testing.assert_allclose(
        sorted_rows(in_base(held, np.array([0.3]))),
        sorted_rows(in_base(free, np.array([0.8, 0.3]))),
        atol=1e-9,
    )


def test_a_held_joint_that_cannot_be_at_zero_is_held_next_to_it(cabinet):
    held = build(cabinet, Reading(fix=("sli*",)))
    frame_T_tray = np.linalg.inv(held.links["frame"][1]) @ held.links["tray"][1]
    np.testing.assert_allclose(frame_T_tray[:3, 3], [0.1, 0, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("fix", "error", "says"),
    [
        ("elbow", InputError, "no joint 'elbow' to fix; it has hinge, slide"),
        ("screw", InputError, "no joint 'screw'"),
        ("hinge=far", UsageError, "must be a number"),
        ("*", InputError, "nothing that is seen turns or slides"),
    ],
)
def test_joints_that_cannot_be_held_are_told(cabinet, fix, error, says):
    with pytest.raises(error, match=says):
        build(cabinet, Reading(fix=(fix,)))


def test_an_unknown_root_is_told(cabinet):
    with pytest.raises(InputError, match="no link 'roof' to be the root; it has base, frame"):
        build(cabinet, Reading(root="roof"))


def test_scale_scales_lengths_and_no_angles(cabinet):
    one, other = build(cabinet), build(cabinet, Reading(scale=2.0))
    for a, b in zip(one.instance.part_boxes(), other.instance.part_boxes(), strict=True):
        np.testing.assert_allclose(2 * a, b, atol=1e-12)
    for a, b in zip(one.instance.joints, other.instance.joints, strict=True):
        np.testing.assert_allclose(2 * np.asarray(a.pivot), b.pivot, atol=1e-12)
        unit = 2 if a.kind == "prismatic" else 1
        np.testing.assert_allclose(unit * np.asarray(a.limits), b.limits)
    state = np.array([0.8, 0.3])
    np.testing.assert_allclose(
        2 * one.root_T_link("tray", state)[:3, 3],
        other.root_T_link("tray", state * (1, 2))[:3, 3],
        atol=1e-12,
    )


@pytest.mark.parametrize("scale", [1e-4, 1e3])
def test_sizes_that_no_photo_shows_are_refused(cabinet, scale):
    with pytest.raises(InputError, match=r"m across.*--scale"):
        build(cabinet, Reading(scale=scale))


@pytest.mark.parametrize("change", [{"scale": 0.0}, {"scale": np.nan}, {"triangles": 10}])
def test_readings_that_cannot_be_meant_are_refused(change):
    with pytest.raises(UsageError):
        Reading(**change)


def test_more_parts_than_labels_hold_are_told(write):
    link = f'<link name="{{}}">{BOX.format("0.1 0.1 0.1")}</link>'
    joint = """<joint name="j{0}" type="revolute"><parent link="{0}"/><child link="{1}"/>
        <limit lower="0" upper="1"/></joint>"""
    links = "".join(link.format(k) for k in range(17))
    joints = "".join(joint.format(k, k + 1) for k in range(16))
    model = read_urdf(write(f'<robot name="snake">{links}{joints}</robot>'))
    with pytest.raises(InputError, match=r"has 17 parts that move.*--fix j15"):
        build(model)
    assert len(build(model, Reading(fix=("j15",))).instance.parts) == 16


def test_an_object_keeps_within_its_triangles(write):
    ball = '<visual><geometry><sphere radius="0.3"/></geometry></visual>'
    model = read_urdf(write(CABINET.replace(BOX.format("0.3 0.5 0.05"), 4 * ball)))
    assert triangles(build(model)) == 12 * 2 + 1280 * 2  # the four balls are one
    few = build(model, Reading(triangles=900))
    assert 800 < triangles(few) <= 900
    assert sum(len(s.faces) for s in few.instance.parts[0]) == 12
    np.testing.assert_allclose(few.instance.part_boxes()[1][2], 0.6, rtol=0.03)


def test_links_that_are_never_seen_are_left_out(write):
    extra = """<link name="tool"/><joint name="spin" type="continuous">
      <parent link="tray"/><child link="tool"/></joint></robot>"""
    built = build(read_urdf(write(CABINET.replace("</robot>", extra))))
    assert built.instance.part_names == ("base", "door", "tray")
    assert "tool" not in built.links


def test_where_nothing_is_seen_of_the_root_its_only_child_is_it(write):
    extra = """<link name="floor"/><joint name="drive" type="prismatic"><parent link="floor"/>
      <child link="base"/><limit lower="-9" upper="9"/></joint></robot>"""
    built = build(read_urdf(write(CABINET.replace("</robot>", extra))))
    assert built.instance.part_names == ("base", "door", "tray")
    assert [joint.name for joint in built.instance.joints] == ["hinge", "slide"]


def test_nothing_seen_between_two_joints_is_told(write):
    text = CABINET.replace('name="lift" type="fixed"', 'name="lift" type="continuous"')
    with pytest.raises(InputError, match=r"between the joints 'lift' and 'hinge'.*--fix lift"):
        build(read_urdf(write(text)))


def test_a_root_that_is_not_seen_and_carries_several_is_told(write):
    text = CABINET.replace(BOX.format("0.4 0.6 0.8"), "")
    model = read_urdf(write(text))
    with pytest.raises(InputError, match=r"nothing is seen of the root.*--fix hinge"):
        build(model)
    assert build(model, Reading(fix=("hinge",))).instance.part_names == ("door", "tray")


def test_parts_by_place_go_from_top_to_bottom_and_left_to_right(cabinet):
    labels = {"door": "panel", "tray": "panel"}
    links = tuple(replace(k, label=labels.get(k.name, k.name)) for k in cabinet.links)
    joints = tuple(replace(j, kind="prismatic") if j.name == "hinge" else j for j in cabinet.joints)
    built = build(replace(cabinet, links=links, joints=joints, by_place=True))
    assert built.instance.part_names == ("base", "panel_1", "panel_2")
    centers = built.instance.part_boxes()[0]
    assert tuple(-centers[1:, 1].round(2)) <= tuple(-centers[1:, 1].round(2)[::-1])
    assert [joint.name for joint in built.instance.joints] == ["panel_1", "panel_2"]
