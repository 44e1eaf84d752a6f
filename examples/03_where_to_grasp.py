"""Where a robot's hand must go to pull a drawer open: poses in your own code.

python examples/03_where_to_grasp.py [PHOTO]
"""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import r2art
from r2art.core.prediction import JointEstimate, Prediction
from r2art.run.export.mechanism import part_poses

HERE = Path(__file__).parent
# Where the camera is on your robot, from its calibration: here 1 m above the base, looking forward
# and 17° down. Camera axes are x right, y down, z forward; the base's are x forward, y left, z up.
S, C = np.sin(np.radians(17)), np.cos(np.radians(17))
BASE_T_CAM = np.array([[0, -S, C, 0], [-1, 0, 0, 0], [0, -C, -S, 1], [0, 0, 0, 1]], float)


def grip(prediction: Prediction, joint: JointEstimate, state: float) -> NDArray[np.floating]:
    """(4, 4) pose of a grip in the camera's frame where the joint stands at ``state``.

    Its origin is the middle of the front of the part that the joint moves. Part frames have x to
    the right, y up and z to the front, so z points back along the way the hand comes.
    """
    names = [part.name for part in prediction.parts]
    part = prediction.part(joint.child)
    part_T_grip = np.eye(4)
    part_T_grip[:3, 3] = part.box_center + part.box_size * (0, 0, 0.5)
    poses = part_poses(prediction, {joint.name: state})
    return poses[names.index(joint.child)] @ part_T_grip


def main(photo: str | Path) -> None:
    """Pull the drawer that is seen best to nine tenths of its way, in five steps."""
    prediction = r2art.load().predict(photo, category="drawer")
    best = max(prediction.parts[1:], key=lambda part: part.confidence)
    joint = next(j for j in prediction.joints if j.child == best.name)
    print(f"{joint.child} is open by {100 * joint.state:.1f} cm; grips in the robot's base (m):")
    for state in np.linspace(joint.state, 0.9 * joint.limits[1], 5):
        x, y, z = (BASE_T_CAM @ grip(prediction, joint, float(state)))[:3, 3]
        print(f"  open by {100 * state:5.1f} cm: {x:+.3f} {y:+.3f} {z:+.3f}")
    if prediction.scale.source == "prior":
        print(f"metres are a guess, off by about {prediction.scale.spread or 0:.0%}")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else HERE / "drawer.png")
