"""What errors may depend on: viewpoint, occlusion, size in the image, how far joints are open."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Category
from r2art.learn.evaluation import statistics
from r2art.learn.evaluation.scores import Scores
from r2art.learn.evaluation.summary import AUC_LIMIT

FloatArray = NDArray[np.floating]

GROUPS = 5


@dataclass(frozen=True, kw_only=True)
class Cause:
    """One fact about every photo.

    Attributes:
        name: For a heading, with the unit ``values`` are in.
        values: (N,) in the unit for people.
        joints: (N, J) the same as it concerns each joint.
        joint_names: J headings for it.
    """

    name: str
    values: FloatArray
    joints: FloatArray
    joint_names: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Group:
    """The photos for which a cause lies between two values, and how wrong they are.

    Attributes:
        low: Least value of the cause, in the unit of its name.
        high: Its greatest value.
        images: How many photos these are.
        failures: How many of them gave no usable prediction.
        rotation: Median over all parts (rad).
        add_share: Median ADD of all parts in units of the diagonal.
        add_share_aligned: The same with the scale aligned.
        state: Median error of the revolute (rad), else of the prismatic joints (m); nan without.
        auc_100mm: Area under the recall curve of ADD to 100 mm.
        overlap: Mean intersection over union of the part boxes.
    """

    low: float
    high: float
    images: int
    failures: int
    rotation: float
    add_share: float
    add_share_aligned: float
    state: float
    auc_100mm: float
    overlap: float


def causes(scores: Scores, category: Category) -> list[Cause]:
    """All causes in which the photos of (N, ...) scores differ."""
    return [c for c in _causes(scores, category) if len(np.unique(grouped(c.values, GROUPS))) > 1]


def grouped(values: FloatArray, count: int) -> NDArray[np.intp]:
    """(N,) to which of up to ``count`` groups of about equal size each value belongs, by size.

    Equal values are never parted, so that there may be fewer groups, and empty ones.
    """
    edges = np.quantile(values, np.linspace(0, 1, count + 1)[1:-1])
    return np.searchsorted(edges, values, side="left")


def _causes(scores: Scores, category: Category) -> Iterator[Cause]:
    joints = category.joints
    azimuth, elevation = np.degrees(scores.azimuth), np.degrees(scores.elevation)
    yield _of_photo("azimuth, °", azimuth, len(joints))
    yield _of_photo("elevation, °", elevation, len(joints))
    yield Cause(
        name="visible share of the parts, %",
        values=100 * scores.visible.mean(axis=1),
        joints=100 * scores.visible[:, 1:],
        joint_names=tuple(f"visible share of {n}, %" for n in category.part_names[1:]),
    )
    yield _of_photo("object within the photo, %", 100 * scores.inside, len(joints))
    yield _of_photo("longer side of the 2D box, px", scores.box_side, len(joints))
    if joints:
        low, high = np.array([j.limits for j in joints]).T
        unit = np.array([180 / np.pi if j.kind == "revolute" else 100 for j in joints])
        signs = ["°" if j.kind == "revolute" else "cm" for j in joints]
        yield Cause(
            name="how far open, % of the range",
            values=100 * ((scores.true_state - low) / (high - low)).mean(axis=1),
            joints=unit * scores.true_state,
            joint_names=tuple(f"{j.name}, {sign}" for j, sign in zip(joints, signs, strict=True)),
        )


def _of_photo(name: str, values: FloatArray, joints: int) -> Cause:
    columns = np.repeat(values[:, None], joints, axis=1)
    return Cause(name=name, values=values, joints=columns, joint_names=(name,) * joints)


def groups(scores: Scores, category: Category, cause: Cause) -> tuple[Group, ...]:
    """Photos in up to `GROUPS` groups of about equal size, by rising values of a cause."""
    number = grouped(cause.values, GROUPS)
    turning = [j.kind == "revolute" for j in category.joints]
    states = [turns == any(turning) for turns in turning]
    return tuple(
        Group(
            low=float(cause.values[here].min()),
            high=float(cause.values[here].max()),
            images=int(here.sum()),
            failures=int(scores.failed[here].sum()),
            rotation=float(np.median(scores.rotation[here])),
            add_share=float(np.median(scores.add[here] / scores.diagonal[here, None])),
            add_share_aligned=float(
                np.median(scores.add_aligned[here] / scores.diagonal[here, None])
            ),
            state=float(np.median(scores.state[here][:, states])) if states else float("nan"),
            auc_100mm=statistics.auc(scores.add[here], AUC_LIMIT),
            overlap=float(scores.overlap[here].mean()),
        )
        for here in (number == k for k in np.unique(number))
    )
