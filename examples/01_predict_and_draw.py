"""One photo in; numbers, a picture and a 3D scene out.

python examples/01_predict_and_draw.py [PHOTO...]
"""

import sys
from pathlib import Path

import numpy as np

import r2art
from r2art.run.export import FORMATS

HERE = Path(__file__).parent
OUT = Path("r2art_out")


def main(photos: list[str]) -> None:
    """Predict photos and tell what was found."""
    predictor = r2art.load()
    OUT.mkdir(exist_ok=True)
    for photo in photos or [HERE / "laptop.png", HERE / "drawer.png"]:
        prediction = predictor.predict(photo)
        name = Path(photo).stem
        print(f"{name}: {prediction.category}, camera {prediction.camera_source}")
        if prediction.rejected:
            print(f"  not worth using: {prediction.rejected}")
        for part in prediction.parts:
            x, y, z = part.cam_T_part[:3, 3]  # m: right, down, forward of the camera
            print(f"  {part.name:14} {x:+.3f} {y:+.3f} {z:+.3f} m, sure {part.confidence:.0%}")
        for joint in prediction.joints:
            hinge = joint.kind == "revolute"
            state = f"{np.degrees(joint.state):.0f}°" if hinge else f"{100 * joint.state:.1f} cm"
            print(f"  {joint.name:14} open by {state}")
        for warning in prediction.warnings:
            print(f"  note: {warning}")
        prediction.draw().save(OUT / f"{name}.overlay.png")
        (OUT / f"{name}.json").write_text(prediction.to_json(indent=2), encoding="utf-8")
        (OUT / f"{name}.glb").write_bytes(FORMATS["glb"].encode(prediction))


if __name__ == "__main__":
    main(sys.argv[1:])
