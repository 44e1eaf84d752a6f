"""The errors of many images in a few numbers: medians with their intervals, areas, shares.

Everything in metres, radians and shares of 1; `r2art.learn.report` writes them for people.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Category, JointKind
from r2art.learn import metrics
from r2art.learn.scores import CORRECT, Scores

FloatArray = NDArray[np.floating]

AUC_LIMIT = 0.1  # m: the paper's table entries hold only up to 136.6 mm, so 100 mm was meant
AUC_DIAMETER = 0.1


@dataclass(frozen=True, kw_only=True)
class Spread:
    """Where the values of one measure lie.

    Failures are in the median and the 90th percentile, as inf; the mean is of the others.

    Attributes:
        median: Of all values.
        low: Lower end of the bootstrap 95 % interval of the median.
        high: Its upper end.
        mean: Of the finite values; nan where there are none.
        p90: 90th percentile (a value that occurs, not interpolated).
    """

    median: float
    low: float
    high: float
    mean: float
    p90: float


@dataclass(frozen=True, kw_only=True)
class PartSummary:
    """One part, or all of them together; see `Scores` for the measures.

    ``add_share`` and ``aligned_share`` are in units of the object's diagonal.
    """

    name: str
    add: Spread
    add_s: Spread
    add_share: Spread
    aligned_share: Spread
    rotation: Spread
    translation: Spread
    overlap: Spread
    auc_100mm: float
    auc_diameter: float
    confidence_auroc: float


@dataclass(frozen=True, kw_only=True)
class JointSummary:
    """One joint; ``pivot`` is None for a prismatic one, which has no pivot."""

    name: str
    kind: JointKind
    state: Spread
    axis: Spread
    pivot: Spread | None


@dataclass(frozen=True, kw_only=True)
class Summary:
    """All that a results table tells.

    Attributes:
        images: How many were predicted.
        failures: How many of them gave no usable prediction.
        whole: All parts together.
        parts: Each part.
        joints: Each joint.
        kinds: All revolute joints together, and all prismatic ones, where there are any.
        depth: Relative error of the root's depth.
        box: Intersection over union of the 2D box.
        category_accuracy: Share of images whose category was recognised.
    """

    images: int
    failures: int
    whole: PartSummary
    parts: tuple[PartSummary, ...]
    joints: tuple[JointSummary, ...]
    kinds: tuple[JointSummary, ...]
    depth: Spread
    box: Spread
    category_accuracy: float


def spread(values: FloatArray) -> Spread:
    """Summarise (N, ...) values of N images."""
    low, high = metrics.bootstrap_median(values)
    finite = values[np.isfinite(values)]
    return Spread(
        median=float(np.median(values)),
        low=low,
        high=high,
        mean=float(finite.mean()) if finite.size else float("nan"),
        p90=float(np.quantile(values, 0.9, method="higher")),
    )


def summarise(scores: Scores, category: Category) -> Summary:
    """Summarise the scores (N, ...) of N images of a category."""
    num_parts = len(category.part_names)
    joints = category.joints
    of_kind: dict[JointKind, list[int]] = {}
    for j, joint in enumerate(joints):
        of_kind.setdefault(joint.kind, []).append(j)
    return Summary(
        images=len(scores.depth),
        failures=int(scores.failed.sum()),
        whole=_summarise_parts(scores, "all parts", list(range(num_parts))),
        parts=tuple(_summarise_parts(scores, n, [p]) for p, n in enumerate(category.part_names)),
        joints=tuple(_summarise_joints(scores, j.name, j.kind, [k]) for k, j in enumerate(joints)),
        kinds=tuple(
            _summarise_joints(scores, f"all {kind}", kind, js) for kind, js in of_kind.items()
        ),
        depth=spread(scores.depth),
        box=spread(scores.box),
        category_accuracy=float(scores.category.mean()),
    )


def _summarise_parts(scores: Scores, name: str, parts: list[int]) -> PartSummary:
    add, aligned = scores.add[:, parts], scores.aligned[:, parts]
    diameter, diagonal = scores.diameter[:, parts], scores.diagonal[:, None]
    return PartSummary(
        name=name,
        add=spread(add),
        add_s=spread(scores.add_s[:, parts]),
        add_share=spread(add / diagonal),
        aligned_share=spread(aligned / diagonal),
        rotation=spread(scores.rotation[:, parts]),
        translation=spread(scores.translation[:, parts]),
        overlap=spread(scores.overlap[:, parts]),
        auc_100mm=metrics.auc(add, AUC_LIMIT),
        auc_diameter=metrics.auc(add / diameter, AUC_DIAMETER),
        confidence_auroc=metrics.auroc(scores.confidence[:, parts], aligned <= CORRECT * diameter),
    )


def _summarise_joints(
    scores: Scores, name: str, kind: JointKind, joints: list[int]
) -> JointSummary:
    return JointSummary(
        name=name,
        kind=kind,
        state=spread(scores.state[:, joints]),
        axis=spread(scores.axis[:, joints]),
        pivot=spread(scores.pivot[:, joints]) if kind == "revolute" else None,
    )
