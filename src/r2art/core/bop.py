"""Rows of results as BOP has them, the benchmark of 6D object pose estimation.

https://bop.felk.cvut.cz/challenges/: one CSV file with a row for each estimate. Every part is an
object of its own: part k has ``obj_id`` k + 1. Millimetres, and rotations row by row.
"""

from collections.abc import Iterator

from r2art.core.prediction import Prediction

MM = 1e3
RESULTS = ("scene_id", "im_id", "obj_id", "score", "R", "t", "time")
"""Headings of the columns."""


def result_rows(
    prediction: Prediction, scene: int, image: int, seconds: float
) -> Iterator[tuple[object, ...]]:
    """A row for each part; ``seconds`` for the whole photo, -1 where nobody measured."""
    for number, part in enumerate(prediction.parts, start=1):
        R, t = part.cam_T_part[:3, :3], MM * part.cam_T_part[:3, 3]
        yield (
            *(scene, image, number, f"{part.confidence:.6f}"),
            " ".join(f"{v:.9f}" for v in R.ravel()),
            " ".join(f"{v:.6f}" for v in t),
            f"{seconds:.6f}",
        )
