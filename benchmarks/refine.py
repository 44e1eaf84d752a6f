"""Refinement against masks, from near, far and wide starts, with wrong shapes and wrong masks.

python benchmarks/refine.py                              prints Markdown
python benchmarks/refine.py --results docs/results.md    writes the page's section

One object of every procedural category, and an arm where a URDF is at hand; its masks are drawn
from its mesh, what is refined knows it by the coarse mesh of a prior. NumPy may use one thread:
others would wait for the small products here, and their waiting counts as CPU time.
"""

# ruff: noqa: E402, NumPy reads how many threads it may use when it is imported.

import os

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ[f"{library}_NUM_THREADS"] = "1"

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.category import Category
from r2art.data.categories import CATEGORIES
from r2art.data.models.imported import imported
from r2art.data.objects import Objects, Procedural, instance_seed
from r2art.data.pose import transformed
from r2art.data.prior import category_prior
from r2art.data.rendering.render import render_silhouettes
from r2art.data.shape import Instance
from r2art.learn.results import write_section
from r2art.run.refinement.body import Body, body_of
from r2art.run.refinement.coverage import coverage_errors
from r2art.run.refinement.pose import Pose, moved, pose_of, posed, rotation_of
from r2art.run.refinement.refine import refine, resolutions
from r2art.run.refinement.silhouettes import pyramid
from r2art.run.refinement.uncertainty import Uncertainty

FloatArray = NDArray[np.floating]

ROOT = Path(__file__).resolve().parent.parent
ARM = ROOT.parent / "shared/data/robot_arms/panda/urdf/panda_arm_hand.urdf"
SIZE = 224
FOCAL = 1.3 * SIZE
GOOD = 3.5
"""ADD in % of the diagonal below which a refinement is a success: 15 mm for a laptop."""


@dataclass(frozen=True, kw_only=True)
class Object:
    """An object to refine, and how to draw it."""

    name: str
    instance: Instance
    category: Category
    bodies: tuple[Body, ...]
    body: Body


@dataclass(frozen=True, kw_only=True)
class Case:
    """How far off the estimate starts, and what is wrong with shape and masks.

    Attributes:
        name: Of its column.
        turn: Angle (rad) of the root's error, about a random axis.
        joint: Error of every joint (rad; of a slide as the share of its range per 90°).
        depth: Relative error of the distance.
        pixels: Standard deviation of the error of place, in each direction.
        starts: Of the refinement.
        by_part: Whether masks are of the parts.
        wrong: Greatest error of the parts' scales along x, y and z.
        spoil: What is done to the masks; returns them and what of them is known.
        log_scale: Standard deviation that the refinement gives the parts' scales.
        outline: ... and the outline ...
        border: ... and how far masks reach beyond the object.
    """

    name: str
    turn: float = np.radians(20)
    joint: float = np.radians(20)
    depth: float = 0.1
    pixels: float = 6.0
    starts: int = 4
    by_part: bool = False
    wrong: float = 0.0
    spoil: Callable[[FloatArray, np.random.Generator], tuple[FloatArray, FloatArray]] | None = None
    log_scale: float = 0.0
    outline: float = 0.005
    border: float = 0.0

    def uncertainty(self, body: Body) -> Uncertainty:
        """What an estimate that knows how far off it may be would say."""
        span = (body.limits[:, 1] - body.limits[:, 0]).mean()
        return Uncertainty(
            rotation=self.turn / 3**0.5,
            place=max(0.01, self.pixels / FOCAL),
            log_depth=self.depth,
            joint=self.joint / span if not body.prismatic.all() else self.joint / (np.pi / 2),
            log_scale=self.log_scale,
            outline=self.outline,
            border=self.border,
        )


def eroded(masks: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Two pixels less all around."""
    return 1 - dilated(1 - masks, rng)[0], np.ones_like(masks)


def dilated(masks: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Two pixels more all around."""
    shifts = [(dy, dx) for dy in (-2, 0, 2) for dx in (-2, 0, 2)]
    return np.max([np.roll(masks, s, axis=(-2, -1)) for s in shifts], axis=0), np.ones_like(masks)


def occluded(masks: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """A bar of a quarter of the object's width hides it from top to bottom, and is known to."""
    columns = masks.max(axis=(0, 1)).nonzero()[0]
    width = max(1, (columns[-1] - columns[0]) // 4)
    start = rng.integers(columns[0], columns[-1] - width + 1)
    known = np.ones_like(masks)
    known[..., start : start + width] = 0
    return masks * known, known


CASES = (
    Case(name="near"),
    Case(name="near, part masks", by_part=True),
    Case(name="far", pixels=100.0, depth=0.3),
    Case(name="wide", turn=np.radians(40), joint=np.radians(40), depth=0.2, starts=16),
    Case(name="shape ±5 %", wrong=0.05, log_scale=0.03, outline=0.01),
    Case(name="shape ±10 %", wrong=0.1, log_scale=0.06, outline=0.02),
    Case(name="eroded 2 px", spoil=eroded, border=0.02),
    Case(name="dilated 2 px", spoil=dilated, border=0.02),
    Case(name="occluded", spoil=occluded),
)


@dataclass
class Scores:
    """Of the trials of one case."""

    told: list[bool] = field(default_factory=list)
    before: list[float] = field(default_factory=list)
    after: list[float] = field(default_factory=list)
    milliseconds: list[float] = field(default_factory=list)

    @property
    def success(self) -> float:
        return 100 * float(np.mean(np.array(self.after) < GOOD))

    @property
    def success_where_told(self) -> float:
        """Without the failures that fit the masks as well as the truth does."""
        good = np.array(self.after) < GOOD
        return 100 * float(np.mean(good[good | np.array(self.told)])) if good.any() else 0.0

    @property
    def better(self) -> float:
        return 100 * float(np.mean(np.array(self.after) < np.array(self.before)))

    @property
    def worst(self) -> float:
        return float(np.max(np.array(self.after) / np.array(self.before)))

    @property
    def cell(self) -> str:
        return f"{self.success:.0f} / {np.median(self.after):.1f}"


def objects(only: str | None) -> Iterator[Object]:
    sources: list[Objects] = [Procedural(name) for name in CATEGORIES]
    if ARM.exists():
        sources.append(imported("urdf", [ARM], name="arm"))
    for source in sources:
        if only is not None and source.name not in only.split(","):
            continue
        instance = source.instance(instance_seed(source.name, "test", 0, 0))
        category = category_prior([instance], source.staging)
        yield Object(
            name=source.name,
            instance=instance,
            category=category,
            bodies=resolutions(category),
            body=body_of(category),
        )


def draw(thing: Object, body: Body, pose: Pose) -> FloatArray:
    """(P, H, W) whole masks of the parts of an object stretched like ``body``."""
    at = posed(body, pose)
    scale = body.size / thing.body.size
    groups = []
    for p, part in enumerate(thing.instance.parts):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = at.rotation[0, p], at.translation[0, p]
        stretched = [
            replace(s, vertices=body.center[p] + scale[p] * (s.vertices - thing.body.center[p]))
            for s in part
        ]
        groups.append([transformed(s, T) for s in stretched])
    bits = render_silhouettes(groups, Camera(FOCAL, FOCAL, SIZE / 2, SIZE / 2, SIZE, SIZE))
    return np.stack([(bits >> p) & 1 for p in range(len(groups))]).astype(float)


def scene(thing: Object, body: Body, rng: np.random.Generator) -> Pose:
    """A view from the front and above, joints within the middle of their ranges."""
    elevation, azimuth = rng.uniform(0.25, 0.8), rng.uniform(-0.9, 0.9)
    R = np.diag([1.0, -1, -1]) @ rotation_of(np.array([elevation, 0, 0]))
    R = R @ rotation_of(np.array([0, azimuth, 0]))
    z = thing.category.diagonal * rng.uniform(1.9, 2.9)
    low, high = body.limits.T
    return Pose(
        rotation=R[None],
        anchor=np.array([[*rng.uniform(-0.08, 0.08, 2) * z, z]]),
        joint_state=(low + (high - low) * rng.uniform(0.15, 0.85, len(low)))[None],
        log_scale=np.zeros((1, *body.center.shape)),
        border=np.zeros(1),
    )


def estimate(body: Body, true: Pose, case: Case, rng: np.random.Generator) -> Pose:
    """The truth, as far off as the case says."""
    axis = rng.normal(size=3)
    sign = rng.choice([-1, 1], len(body.parent) + 1)
    span = body.limits[:, 1] - body.limits[:, 0]
    joint = np.where(body.prismatic, case.joint / (np.pi / 2) * span, case.joint)
    place = rng.normal(size=2) * case.pixels / FOCAL
    step = [
        *(axis / np.linalg.norm(axis) * case.turn),
        *place,
        np.log(1 + case.depth * sign[0]),
        *(joint * sign[1:]),
        0.0,
    ]
    return moved(body, true, np.array([step]))


def run(thing: Object, case: Case, trials: int) -> Scores:
    scores = Scores()
    K = np.array([[FOCAL, 0, SIZE / 2], [0, FOCAL, SIZE / 2], [0, 0, 1]])
    for trial in range(trials):
        rng = np.random.default_rng([trial, len(case.name)])
        error = 1 + case.wrong * rng.uniform(-1, 1, thing.body.size.shape)
        center = error[:1] * thing.body.center
        real = thing.body.stretched(center, error * thing.body.size)
        true = scene(thing, real, rng)
        masks = draw(thing, real, true)
        masks = masks if case.by_part else masks.max(axis=0, keepdims=True)
        known = None
        if case.spoil is not None:
            masks, known = case.spoil(masks, rng)
        start = estimate(thing.body, true, case, rng)
        cam_T_root = matrix(thing.body, start)
        began = time.process_time()
        found = refine(
            thing.bodies,
            cam_T_root,
            start.joint_state[0],
            masks,
            K,
            known=known,
            uncertainty=case.uncertainty(thing.body),
            starts=case.starts,
        )
        scores.milliseconds.append((time.process_time() - began) * 1e3)
        end = pose_of(thing.body, found.cam_T_root, found.joint_state)
        end = replace(end, log_scale=found.log_scale[None])
        if not case.wrong:
            misfits = [misfit(thing, pose, masks, known, K) for pose in (end, true)]
            scores.told.append(misfits[0] > misfits[1])
        wanted = posed(real, true).points
        for where, kept in ((start, scores.before), (end, scores.after)):
            distance = np.linalg.norm(posed(thing.body, where).points - wanted, axis=2)
            kept.append(100 * float(distance.mean()) / thing.category.diagonal)
    return scores


def misfit(
    thing: Object, pose: Pose, masks: FloatArray, known: FloatArray | None, K: FloatArray
) -> float:
    """Sum of squares by which silhouettes of 56² differ from the masks'."""
    known = np.ones_like(masks) if known is None else known
    y, x = np.nonzero((masks * known).max(axis=0) > 0.5)
    pixels = np.array([x.min(), y.min(), x.max() + 1, y.max() + 1])
    box = (pixels - np.tile(K[:2, 2], 2)) / FOCAL
    (level,) = pyramid(masks, known, K, box, (56,), soft=False)
    return float((coverage_errors(thing.bodies[0], pose, level, scale=False).error ** 2).sum())


def matrix(body: Body, pose: Pose) -> FloatArray:
    T = np.eye(4)
    T[:3, :3] = pose.rotation[0]
    T[:3, 3] = pose.anchor[0] - pose.rotation[0] @ body.anchor
    return T


def speed() -> float:
    """CPU ms of something that does not change: how fast the machine is now."""
    a = np.random.default_rng(0).normal(size=(256, 256))
    began = time.process_time()
    for _ in range(10):
        a = a @ a / np.linalg.norm(a)
    return (time.process_time() - began) * 1e3


def targets(scores: dict[str, dict[str, Scores]]) -> list[str]:
    """The targets, and how many objects meet them."""

    def line(what: str, case: str, meets: Callable[[Scores], bool]) -> str:
        missed = [name for name, row in scores.items() if not meets(row[case])]
        met = len(scores) - len(missed)
        return f"| {what} | {met} of {len(scores)} | {', '.join(missed) or '—'} |"

    def wrong(s: Scores) -> bool:
        return s.better >= 90 and s.worst <= 1.5

    return [
        "| target | met by | missed by |",
        "| --- | ---: | --- |",
        line("near: success ≥ 98 %", "near", lambda s: s.success >= 98),
        line("near: the same where the mask tells", "near", lambda s: s.success_where_told >= 98),
        line("near, part masks: success ≥ 98 %", "near, part masks", lambda s: s.success >= 98),
        line("near: median ADD ≤ 1 %", "near", lambda s: bool(np.median(s.after) <= 1)),
        line("near: ≤ 20 ms", "near", lambda s: bool(np.median(s.milliseconds) <= 20)),
        line("far: success ≥ 95 %", "far", lambda s: s.success >= 95),
        line("wide: success ≥ 90 %", "wide", lambda s: s.success >= 90),
        line("wide: the same where the mask tells", "wide", lambda s: s.success_where_told >= 90),
        line("wide: ≤ 100 ms", "wide", lambda s: bool(np.median(s.milliseconds) <= 100)),
        line("shape ±5 %: better in ≥ 90 %, worst ≤ 1.5×", "shape ±5 %", wrong),
    ]


def report(trials: int, only: str | None, flags: str) -> str:
    """The section of docs/results.md."""
    scores: dict[str, dict[str, Scores]] = {}
    speeds = []
    for thing in objects(only):
        speeds.append(speed())
        scores[thing.name] = {case.name: run(thing, case, trials) for case in CASES}
        print(
            thing.name, *(s.cell for s in scores[thing.name].values()), sep=" | ", file=sys.stderr
        )
    names = [case.name for case in CASES]
    rows = [
        f"| {name} | {' | '.join(row[c].cell for c in names)} | "
        f"{np.median(row['near'].milliseconds):.0f} | {np.median(row['wide'].milliseconds):.0f} |"
        for name, row in scores.items()
    ]
    reference = float(np.median(speeds))
    facts = (
        f"{trials} trials of each: success (ADD below {GOOD} % of the diagonal) in % / median ADD "
        "in %. One object per category, masks of 224² drawn from its mesh; it is refined by the "
        "prior's mesh of few triangles, against the mask of the whole. Starts: near "
        "and the columns without a start of their own 20°, joints 20° (slides 22 % of their "
        "range), 10 % of the distance, 6 px; far 100 px and 30 %; wide 40°, 40°, 20 %; from 4 "
        "poses, wide from 16, and from more where none fits. A mask does not tell where an end "
        "that is wrong fits it no worse than the truth. Times are CPU ms of one core and one "
        "thread (median), beside "
        f"{reference:.1f} ms for ten products of 256² matrices measured in between. "
        f"Written by `python benchmarks/refine.py{flags}`."
    )
    return "\n".join(
        [
            "## Refinement against a mask",
            "",
            facts,
            "",
            f"| object | {' | '.join(names)} | near ms | wide ms |",
            f"| --- |{' ---: |' * (len(names) + 2)}",
            *rows,
            "",
            *targets(scores),
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description="Benchmark refinement against masks.")
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--only", help="objects, comma-separated")
    parser.add_argument("--results", type=Path, help="write the section on refinement of this page")
    args = parser.parse_args()
    flags = f" --trials {args.trials}" + (" --results docs/results.md" if args.results else "")
    section = report(args.trials, args.only, flags)
    print(section)
    if args.results:
        write_section(args.results, "refine", section)


if __name__ == "__main__":
    main()
