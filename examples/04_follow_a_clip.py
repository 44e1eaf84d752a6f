"""Follow an object through a film: smooth poses, states and rates with their deviations.

python examples/04_follow_a_clip.py [FILM or FOLDER]     a film needs pip install 'r2art[video]'
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image

import r2art
from r2art.run.video import Frame, track
from r2art.run.video.source import find_clip

HERE = Path(__file__).parent
FPS, COUNT = 25, 16


def shaken() -> Iterator[Frame]:
    """A clip without a film: the example photo in an unsteady hand, with a noisy sensor."""
    photo = Image.open(HERE / "laptop.png").convert("RGB").resize((320, 240))
    rng = np.random.default_rng(0)
    for k in range(COUNT):
        x, y = 6 * np.sin(0.3 * k), 4 * np.cos(0.5 * k)
        moved = photo.transform(photo.size, Image.Transform.AFFINE, (1, 0, x, 0, 1, y))
        noisy = np.asarray(moved) + rng.normal(0, 5, (240, 320, 3))
        yield Frame(time=k / FPS, image=np.clip(noisy, 0, 255).astype(np.uint8))


def main(clip: str | None) -> None:
    """Print a line for every frame, of the first joint."""
    frames = shaken() if clip is None else find_clip(clip, FPS).frames()
    last = None
    for seen in track(frames, r2art.load()):
        if seen.prediction is None or seen.deviations is None or seen.rates is None:
            print(f"{seen.time:6.2f} s  {seen.status}")
            continue
        joint, last = seen.prediction.joints[0], seen
        alone = seen.measured.joints[0].state if seen.measured else float("nan")
        print(
            f"{seen.time:6.2f} s  {seen.status}  {joint.name} {joint.state:.3f} "
            f"± {seen.deviations.joints[0]:.3f}, {seen.rates[0]:+.3f}/s; this frame: {alone:.3f}"
        )
    if last is not None and last.prediction is not None:
        Path("r2art_out").mkdir(exist_ok=True)
        last.prediction.draw(last.photo).save("r2art_out/last_frame.png")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else None)
