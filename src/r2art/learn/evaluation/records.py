"""An evaluation for programs: JSON and spreadsheets, in metres, radians, seconds, shares of 1."""

import hashlib
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from r2art.learn.evaluation.causes import causes, groups
from r2art.learn.evaluation.evaluate import Report
from r2art.learn.evaluation.scores import OF_JOINTS, Scores
from r2art.learn.evaluation.statistics import Interval
from r2art.learn.evaluation.summary import Spread, Summary
from r2art.learn.evaluation.tables import csv_text
from r2art.learn.evaluation.tabulate import Result

FORMAT = "r2art/report/2"


def describe(model: Path) -> tuple[float, str]:
    """Size (MB) and SHA-256 of a model file."""
    content = model.read_bytes()
    return len(content) / 1e6, hashlib.sha256(content).hexdigest()


def to_json(results: Sequence[Result], model: Path) -> str:
    """Everything the tables tell, in SI units; what is infinite or unknown is null."""
    size, checksum = describe(model)
    content = {
        "format": FORMAT,
        "units": {"length": "m", "angle": "rad", "time": "s"},
        "model": {"name": model.name, "megabytes": round(size, 3), "sha256": checksum},
        "datasets": [
            {
                "name": r.report.name,
                "category": r.report.category.name,
                "dataset": r.report.test.about,
                "unreadable": r.report.broken,
                "given": asdict(r.given),
                "found": asdict(r.found),
                "by_cause": _causes(r.report),
            }
            for r in results
        ],
    }
    return json.dumps(_finite(content), indent=1, allow_nan=False, ensure_ascii=False)


def _causes(report: Report) -> dict[str, Any]:
    scores, category = report.given.scores, report.category
    return {
        c.name: [asdict(g) for g in groups(scores, category, c)] for c in causes(scores, category)
    }


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def summary_csv(results: Sequence[Result]) -> str:
    """One row per dataset, mode, part or joint, and measure; the units are SI."""
    names = ("dataset", "category", "mode", "of", "measure")
    rows: list[tuple[object, ...]] = [
        (*names, "median", "median_low", "median_high", "mean", "mean_low", "mean_high", "p90")
    ]
    for result in results:
        for mode, summary in (("given", result.given), ("found", result.found)):
            who = (result.report.name, result.report.category.name, mode)
            rows += [(*who, *row) for row in _measures(summary)]
    return csv_text(rows)


def _measures(summary: Summary) -> Iterator[tuple[object, ...]]:
    yield "photo", "images", *_plain(summary.images)
    yield "photo", "failures", *_plain(summary.failures)
    yield "photo", "category", *_plain(summary.category_accuracy)
    yield "photo", "relabelled", *_plain(summary.relabelled)
    for name in ("depth", "box", "seconds"):
        yield ("photo", name, *_figures(getattr(summary, name)))
    yield ("all parts", "calibration_error", *_figures(summary.calibration.error))
    yield ("all parts", "confidence_auroc", *_figures(summary.calibration.auroc))
    for part in (*summary.parts, summary.whole):
        yield (part.name, "rotation", *_figures(part.rotation))
        for suffix, poses in (("", part.plain), ("_aligned", part.aligned)):
            for f in fields(poses):
                yield (part.name, f.name + suffix, *_figures(getattr(poses, f.name)))
    for joint in (*summary.joints, *summary.kinds):
        for name in ("state", "state_aligned", "axis", "pivot", "pivot_aligned"):
            if (found := getattr(joint, name)) is not None:
                yield (joint.name, name, *_figures(found))


def _plain(value: float) -> tuple[str, ...]:
    return ("", "", "", f"{value:.6g}", "", "", "")


def _figures(found: Spread | Interval) -> tuple[str, ...]:
    """Median, mean and 90th percentile with their intervals; an area or share is a mean."""
    if isinstance(found, Interval):
        return ("", "", "", *(f"{v:.6g}" for v in (found.value, found.low, found.high)), "")
    values = (i for i in (found.median, found.mean))
    each = [f"{v:.6g}" for i in values for v in (i.value, i.low, i.high)]
    return (*each, f"{found.p90:.6g}")


def images_csv(report: Report) -> str:
    """One row per photo and mode (given, found), in metres and radians."""
    rows: list[list[object]] = [["index", "mode", "message", *_columns(report)]]
    n = len(report.indices)
    for name, mode in (("given", report.given), ("found", report.found)):
        values = [np.reshape(getattr(mode.scores, f.name), (n, -1)) for f in fields(Scores)]
        each = zip(report.indices, mode.messages, np.concatenate(values, axis=1), strict=True)
        rows += [[index, name, message, *(f"{v:.6g}" for v in row)] for index, message, row in each]
    return csv_text(rows)


def _columns(report: Report) -> list[str]:
    parts, joints = report.category.part_names, [j.name for j in report.category.joints]
    columns = []
    for f in fields(Scores):
        single = getattr(report.given.scores, f.name).ndim == 1
        names = joints if f.name in OF_JOINTS else parts
        columns += [f.name] if single else [f"{f.name}.{n}" for n in names]
    return columns
