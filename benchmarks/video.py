"""How much smoother tracking is than frame by frame, and how late: on rendered clips, truth known.

python benchmarks/video.py                          prints Markdown
python benchmarks/video.py --results docs/video.md  writes the page's section on figures
python benchmarks/video.py --pictures docs/images   draws frames and the joint's curve of one clip
python benchmarks/video.py --save clip.mp4          renders the first clip as a film
python benchmarks/video.py --noise                  measures the noise that the filter assumes
"""

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from clips import FPS, Clip, make_clip
from numpy.typing import NDArray
from PIL import Image

from r2art.core.prediction import Prediction
from r2art.data.objects import Split
from r2art.learn.results import write_section
from r2art.run.predictor import Predictor, load
from r2art.run.refinement.pose import vector_of
from r2art.run.video import Frame, Tracked, track
from r2art.run.video.annotate import Annotator
from r2art.run.video.measure import size_of
from r2art.run.video.plot import plot
from r2art.run.video.writer import Film

FloatArray = NDArray[np.floating]

SHIFTS = np.arange(-5, 8.01, 0.1)
"""Delays (frames) that are tried."""
ENDS = 8
"""Frames at either end that serve the search for a delay only."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """A clip, predicted frame by frame and tracked."""

    name: str
    clip: Clip
    alone: list[Prediction]
    seen: list[Tracked]
    seconds: float

    @property
    def truth(self) -> FloatArray:
        """(N, J)."""
        return np.array([t.joint_state for t in self.clip.truth])

    @property
    def tracked(self) -> list[Prediction]:
        """Of every frame; a lost object would end the benchmark."""
        predictions = [s.prediction for s in self.seen]
        if any(p is None for p in predictions):
            raise RuntimeError(f"{self.name}: the object was lost")
        return [p for p in predictions if p is not None]


def states(predictions: Sequence[Prediction]) -> FloatArray:
    """(N, J) joint states."""
    return np.array([[j.state for j in p.joints] for p in predictions])


def jitter(error: FloatArray) -> FloatArray:
    """(J,) standard deviation of the second difference of an error (N, J)."""
    return np.diff(error, 2, axis=0).std(axis=0)


def lag(late: FloatArray, early: FloatArray) -> float:
    """By how many frames (N, J) ``late`` follows ``early``: where their correlation is greatest."""
    at = np.arange(len(late), dtype=float)
    score = []
    for shift in SHIFTS:
        delayed = np.stack([np.interp(at - shift, at, x) for x in early.T], axis=-1)
        pairs = zip(late[ENDS:-ENDS].T, delayed[ENDS:-ENDS].T, strict=True)
        score.append(np.mean([np.corrcoef(a, b)[0, 1] for a, b in pairs]))
    return round(float(SHIFTS[int(np.argmax(score))]), 1) + 0.0


def run(predictor: Predictor, category: str, split: Split, seed: int, count: int) -> Run:
    """Render a clip and follow its object."""
    clip = make_clip(category, split, seed, count)
    pictures = list(clip.frames())
    frames = [Frame(time=t.time, image=x) for t, x in zip(clip.truth, pictures, strict=True)]
    began = time.perf_counter()
    seen = list(track(frames, predictor, camera=clip.camera, category=category))
    seconds = (time.perf_counter() - began) / count
    alone = [predictor.predict(x, clip.camera, category) for x in pictures]
    print(category, seed, f"{1e3 * seconds:.0f} ms per frame", file=sys.stderr, flush=True)
    return Run(name=f"{category} {seed}", clip=clip, alone=alone, seen=seen, seconds=seconds)


def row(result: Run) -> tuple[str, FloatArray, float, float]:
    """A line of the table; the ratio of each joint, the lag, and the one beside frame by frame."""
    truth, alone, tracked = result.truth, states(result.alone), states(result.tracked)
    slides = result.alone[0].joints[0].kind == "prismatic"
    unit, name = (0.01, " cm") if slides else (np.pi / 180, "°")
    before, after = jitter(alone - truth), jitter(tracked - truth)
    ratio = before / after
    lags = [lag(x, y) for x, y in ((tracked, truth), (alone, truth), (tracked, alone))]
    rms = [float(np.sqrt(np.mean((x - truth) ** 2))) / unit for x in (alone, tracked)]
    sure = np.array([s.deviations.joints for s in result.seen if s.deviations is not None])
    covered = np.mean(np.abs(tracked - truth) < 2 * sure)
    cells = [
        result.name,
        f"{np.sqrt(np.mean(before**2)) / unit:.2f}{name}",
        f"{np.sqrt(np.mean(after**2)) / unit:.2f}{name}",
        ", ".join(f"{r:.1f}" for r in ratio),
        *(f"{v:.1f}" for v in lags),
        *(f"{v:.1f}{name}" for v in rms),
        f"{covered:.0%}",
    ]
    return f"| {' | '.join(cells)} |", ratio, lags[0], lags[2]


def report(results: Sequence[Run], flags: str) -> str:
    """The section of docs/video.md."""
    rows = [row(r) for r in results]
    ratios = np.concatenate([r[1] for r in rows])
    late, added = np.array([r[2] for r in rows]), np.array([r[3] for r in rows])
    count = len(results[0].seen)
    facts = (
        f"{len(results)} clips of {count} frames of 320 × 240 px at {FPS:.0f} per second, objects "
        "of the test split. Jitter: standard deviation of the second difference of the joint's "
        "error. Lag: the delay (frames) at which one curve correlates best with another; it is "
        "negative where the network itself is ahead of the truth. Error: root mean square. "
        "Covered: share of frames whose error is below two reported standard deviations. "
        f"Written by `python benchmarks/video.py{flags}`."
    )
    return "\n".join(
        [
            "## Figures",
            "",
            facts,
            "",
            "| clip | jitter, frame by frame | tracked | ratio (each joint) | lag, tracked behind "
            "truth | frame by frame behind truth | tracked behind frame by frame | error, frame by "
            "frame | tracked | covered |",
            "| --- |" + " ---: |" * 9,
            *(r[0] for r in rows),
            "",
            f"Jitter ratio: median {np.median(ratios):.1f}, least {ratios.min():.1f}; at least 3 "
            f"for {np.count_nonzero(ratios >= 3)} of {len(ratios)} joints. Lag behind the truth: "
            f"median {np.median(late):.1f}, greatest {late.max():.1f} frames; at most 2 in "
            f"{np.count_nonzero(late <= 2)} of {len(late)} clips. Added by tracking: median "
            f"{np.median(added):.1f}, greatest {added.max():.1f}.",
        ]
    )


def errors(result: Run) -> dict[str, FloatArray]:
    """(N, ...) errors of the frames alone, as tracking sees them, in the units of `Noise`."""
    pairs = [(p, result.clip.truth[s.index]) for s in result.seen if (p := s.measured)]
    predictions, truth = [p for p, _ in pairs], [t for _, t in pairs]
    spans = np.array([j.limits[1] - j.limits[0] for j in predictions[0].joints])
    root = np.array([p.parts[0].cam_T_part for p in predictions])
    size = np.array([size_of(p) for p in predictions])[:, None]
    true_root = np.array([t.cam_T_part[0] for t in truth])
    true_size = np.array([t.diagonal for t in truth])[:, None]
    place, true_place = root[:, :3, 3] / size, true_root[:, :3, 3] / true_size
    return {
        "rotation": vector_of(root[:, :3, :3] @ true_root[:, :3, :3].swapaxes(1, 2)),
        "across": place[:, :2] / place[:, 2:] - true_place[:, :2] / true_place[:, 2:],
        "along": np.log(place[:, 2:] / true_place[:, 2:]),
        "joint": (states(predictions) - np.array([t.joint_state for t in truth])) / spans,
        "size": np.log(size / true_size),
    }


def noise(results: Sequence[Run]) -> str:
    """What `r2art.run.video.measure` assumes, as these clips have it."""
    lines = []
    for result in results:
        cells = [
            f"{np.mean(jitter(e)) / np.sqrt(6):.4f} / {np.sqrt(np.mean(e**2)):.3f}"
            for e in errors(result).values()
        ]
        lines.append(f"| {result.name} | {' | '.join(cells)} |")
    names = errors(results[0])
    head, rule = f"| clip | {' | '.join(names)} |", "| --- |" + " ---: |" * len(names)
    return "\n".join(["White noise / all error, as `Noise` counts them.", "", head, rule, *lines])


def draw(result: Run, folder: Path) -> None:
    """Three annotated frames side by side, and the curve of the whole clip."""
    annotator = Annotator()
    pictures = []
    for seen in result.seen:
        annotator.add(seen)
        if seen.index in (len(result.seen) // 4, len(result.seen) // 2, len(result.seen) - 1):
            pictures.append(annotator.draw(seen).reduce(2))
    sheet = Image.new("RGB", (sum(p.width for p in pictures) + 16, pictures[0].height), "white")
    for k, picture in enumerate(pictures):
        sheet.paste(picture, (k * (picture.width + 8), 0))
    sheet.save(folder / "video-frames.jpg", quality=85)
    plot(annotator.history).save(folder / "video-joints.png")


def save(clip: Clip, path: Path) -> None:
    """The clip as a film."""
    film = Film(path)
    for truth, picture in zip(clip.truth, clip.frames(), strict=True):
        film.add(Image.fromarray(picture), truth.time)
    film.finish()


def main() -> None:
    parser = argparse.ArgumentParser(description="Benchmark tracking on rendered clips.")
    parser.add_argument("--laptops", type=int, default=4)
    parser.add_argument("--drawers", type=int, default=2)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--noise", action="store_true", help="on objects of the validation split")
    parser.add_argument("--results", type=Path, help="write the section on figures of this page")
    parser.add_argument("--pictures", type=Path, help="draw the first clip into this folder")
    parser.add_argument("--save", type=Path, help="render the first clip as this film, and end")
    args = parser.parse_args()
    wanted = [("laptop", k) for k in range(args.laptops)]
    wanted += [("drawer", k) for k in range(args.drawers)]
    split: Split = "val" if args.noise else "test"
    if args.save:
        save(make_clip(*(wanted[0][0], split, wanted[0][1], args.frames)), args.save)
        return
    predictor = load()
    results = [run(predictor, name, split, seed, args.frames) for name, seed in wanted]
    flags = " --results docs/video.md" if args.results else ""
    section = noise(results) if args.noise else report(results, flags)
    print(section)
    if args.results:
        write_section(args.results, "video", section)
    if args.pictures:
        draw(results[0], args.pictures)


if __name__ == "__main__":
    main()
