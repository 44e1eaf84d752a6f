"""A robot arm's photos: link poses by SciPy's rotations read back as parts, joints and states."""

from pathlib import Path

import numpy as np
import pytest
from adapter_scenes import Truth, photograph, points_fall_on_masks, polygons, same
from reart_files import write_camera, write_frame
from scipy.spatial.transform import Rotation

from r2art.core.errors import InputError
from r2art.data.adapters import open_source
from r2art.data.adapters.robotarm import ROS, Arm, open_robotarm
from r2art.data.checking.sample_faults import sample_faults
from r2art.data.source import Fault

URDF = """<?xml version="1.0"?>
<robot name="arm">
  <link name="world"/>
  <joint name="stand" type="fixed"><parent link="world"/><child link="base"/>
    <origin xyz="0.3 -0.1 0.2" rpy="0 0 0.5"/></joint>
  <link name="base"><visual><origin xyz="0 0 0.05"/><geometry><box size="0.2 0.16 0.1"/></geometry>
    </visual></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="column"/>
    <origin xyz="0 0.02 0.1"/><axis xyz="0 0 1"/><limit lower="-2" upper="2"/></joint>
  <link name="column"><visual><origin xyz="0 0 0.15"/>
    <geometry><box size="0.06 0.08 0.3"/></geometry></visual></link>
  <joint name="lift" type="revolute"><parent link="column"/><child link="beam"/>
    <origin xyz="0.03 0 0.28" rpy="0 0.3 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1"/></joint>
  <link name="beam"><visual><origin xyz="0.15 0 0"/><geometry><box size="0.3 0.05 0.05"/></geometry>
    </visual></link>
  <joint name="glue" type="fixed"><parent link="beam"/><child link="plate"/>
    <origin xyz="0.1 0 0.05"/></joint>
  <link name="plate"><visual><geometry><box size="0.1 0.1 0.02"/></geometry></visual></link>
  <joint name="reach" type="prismatic"><parent link="beam"/><child link="tip"/>
    <origin xyz="0.3 0 0" rpy="0 0 -0.4"/><axis xyz="1 0 0"/><limit lower="0" upper="0.2"/></joint>
  <link name="tip"><visual><geometry><box size="0.04 0.07 0.03"/></geometry></visual></link>
</robot>
"""
STATE = np.array([0.6, -0.4, 0.08])


def step(xyz, rpy=(0.0, 0.0, 0.0)) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_euler("xyz", rpy).as_matrix(), xyz
    return T


def world_T_links(turn: float, lift: float, reach: float) -> np.ndarray:
    """Of base, column, beam and tip, written out by hand from the file above."""
    base = step((0.3, -0.1, 0.2), (0, 0, 0.5))
    column = base @ step((0, 0.02, 0.1)) @ step((0, 0, 0), (0, 0, turn))
    beam = column @ step((0.03, 0, 0.28), (0, 0.3, 0)) @ step((0, 0, 0), (0, lift, 0))
    tip = beam @ step((0.3, 0, 0), (0, 0, -0.4)) @ step((reach, 0, 0))
    return np.stack([base, column, beam, tip])


@pytest.fixture(scope="module")
def arm_file(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("arm") / "arm.urdf"
    path.write_text(URDF)
    return path


@pytest.fixture(scope="module")
def truth(arm_file) -> Truth:
    instance = Arm(arm_file, ROS).built.instance
    return photograph(instance, STATE, azimuth=0.7, backdrop=True)


def write(root: Path, truth: Truth, *, first: int = 1, at: tuple[str, ...] = ("train",)) -> None:
    """Up is the file's z and front its x: our x, y, z are its Y, Z, X."""
    root.mkdir(parents=True, exist_ok=True)
    (root / "arm.urdf").write_text(URDF)
    write_camera(root, truth)
    still = world_T_links(0, 0, 0)[0]
    corners = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.08, 0.08) for z in (0, 0.1)])
    corners = corners @ still[:3, :3].T + still[:3, 3]
    world_T_root = np.eye(4)
    world_T_root[:3, :3] = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]]).T
    world_T_root[:3, 3] = (corners.min(axis=0) + corners.max(axis=0)) / 2
    cam_T_world = truth.cam_T_part[0] @ np.linalg.inv(world_T_root)
    links = [
        {
            "link_category_id": first + part,
            "segmentation": polygons(truth.mask == part + 1),
            "transformation": (cam_T_world @ T).tolist(),
        }
        for part, T in enumerate(world_T_links(*STATE))
    ]
    for split in at:
        write_frame(
            root / f"real_{split}", "0/000000", truth, [{"bbox": truth.box, "links": links}]
        )


@pytest.mark.parametrize("first", [0, 1])
def test_an_arm_reads_back_as_photographed(tmp_path, truth, first):
    write(tmp_path, truth, first=first)
    source = open_source(tmp_path, split="train")
    same(source[0], truth)
    points_fall_on_masks(source[0], truth.instance)
    assert sample_faults(source[0], source.category) == []
    assert source.category.name == "robot_arm"
    assert source.category.part_names == ("base", "column", "beam", "tip")
    joints = source.category.joints
    assert [joint.parent for joint in joints] == [0, 1, 2]
    np.testing.assert_allclose([joint.limits for joint in joints], [(-2, 2), (-1, 1), (0, 0.2)])


def test_joints_may_be_held_still(tmp_path, truth):
    """The tip becomes a piece of the beam: three parts; and so must the annotation have three."""
    write(tmp_path, truth)
    (tmp_path / "r2art.json").write_text('{"fix": ["reach"]}')
    source = open_source(tmp_path)
    assert len(source) == 1
    with pytest.raises(Fault, match=r"link_category_id: is 4; links here are 1, 2, 3"):
        source[0]


def test_a_zero_elsewhere_than_the_files(tmp_path, truth):
    """Of a chain, moving the rest moves later axes with it; poses follow all the same."""
    write(tmp_path, truth)
    (tmp_path / "r2art.json").write_text('{"closed": [0.3, -0.2, 0.05]}')
    source = open_source(tmp_path)
    sample = source[0]
    np.testing.assert_allclose(sample.joint_state, STATE - (0.3, -0.2, 0.05), atol=1e-6)
    assert sample_faults(sample, source.category) == []
    turned = Rotation.from_rotvec(0.3 * sample.axis[0]).apply(truth.instance.joints[1].axis)
    np.testing.assert_allclose(sample.axis[1], turned, atol=1e-6)  # by the first joint


def test_splits_and_faults(tmp_path, truth):
    write(tmp_path, truth, at=("train", "test"))
    assert [len(open_source(tmp_path, split=s)) for s in ("train", "test", None)] == [1, 1, 2]
    (tmp_path / "other.urdf").write_text(URDF)
    with pytest.raises(InputError, match=r"several arms \(arm.urdf, other.urdf\)"):
        open_robotarm(tmp_path)
    (tmp_path / "other.urdf").unlink()
    (tmp_path / "arm.urdf").write_text(URDF.replace('child link="tip"', 'child link="top"'))
    with pytest.raises(Fault, match=r"arm\.urdf") as caught:
        open_robotarm(tmp_path)
    assert "top" in caught.value.problem
