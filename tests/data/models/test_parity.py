"""Every model at hand, link by link, where MuJoCo says it is."""

from pathlib import Path

import pytest

from r2art.data.models.parity import parity

DATA = Path(__file__).resolve().parents[3].parent / "shared" / "data"
MODELS = {
    "robot_arms/kuka_iiwa7/model.urdf": 7,
    "robot_arms/panda/urdf/franka.urdf": 9,
    "robot_arms/panda/urdf/panda_arm_hand.urdf": 9,
    "robot_arms/xarm7/xarm7_textured.urdf": 7,
    "robot_arms/xarm7/xarm7_with_gripper_reduced_dof.urdf": 9,
    "articulated/sektion_cabinet/urdf/sektion_cabinet.urdf": 4,
    "articulated/sektion_cabinet/urdf/sektion_cabinet_2.urdf": 4,
    "articulated/aloha_drawer/scene.xml": 3,
    "articulated/aloha_laptop/scene.xml": 1,
    "articulated/furniture_sim/boxcabinet.xml": 1,
    "articulated/furniture_sim/dishwasher.xml": 2,
    "articulated/furniture_sim/hingecabinet.xml": 2,
    "articulated/furniture_sim/microwave.xml": 1,
    "articulated/furniture_sim/oven.xml": 10,
    "articulated/furniture_sim/slidecabinet.xml": 1,
    "articulated/furniture_sim/studyTable.xml": 2,
}


@pytest.mark.parametrize(("name", "joints"), MODELS.items(), ids=MODELS)
def test_every_link_of_every_model_is_where_mujoco_has_it(name, joints):
    path = DATA / name
    if not path.exists():
        pytest.skip(f"{name} is not beside the project")
    # Shapes do not matter here, and a URDF's meshes take seconds to read and simplify.
    is_urdf = path.suffix == ".urdf"
    result = parity(path, "urdf" if is_urdf else "mjcf", shapes=not is_urdf)
    assert len(result.built.instance.joints) == joints
    assert result.links == len(result.built.links) > joints
    assert result.deviation < 1e-6
    assert result.limits < 1e-9
