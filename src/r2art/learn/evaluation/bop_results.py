"""Predictions in the format of results of BOP, the benchmark of 6D object pose estimation.

https://bop.felk.cvut.cz/challenges/: one CSV file ``METHOD_DATASET-test.csv`` with a row per
part. Scenes, images and objects are numbered as `r2art data bop` numbers them. Their toolkit
compares with models of the category's mean object; ours are stretched to each instance.
"""

import re
from collections.abc import Iterator

from r2art.core.bop import RESULTS, result_rows
from r2art.data.bop import PER_SCENE
from r2art.learn.evaluation.evaluate import Mode, Report
from r2art.learn.evaluation.tables import csv_text


def bop_name(report: Report, method: str) -> str:
    """The file's name; the dataset's own must be letters and digits there."""
    dataset = re.sub(r"[^a-z0-9]", "", report.category.name.lower()) or "object"
    return f"{method}_{dataset}-test.csv"


def bop_csv(report: Report, mode: Mode) -> str:
    """The rows of all photos that were predicted, and taken for the right category."""
    return csv_text([RESULTS, *_rows(report, mode)])


def _rows(report: Report, mode: Mode) -> Iterator[tuple[object, ...]]:
    each = zip(report.indices, mode.predictions, mode.scores.seconds, strict=True)
    for index, prediction, seconds in each:
        if prediction is not None and prediction.category == report.category.name:
            yield from result_rows(
                prediction, index // PER_SCENE, index % PER_SCENE, float(seconds)
            )
