"""Predictions as tables: a tidy CSV for spreadsheets and data frames, and results for BOP."""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from pathlib import PurePath

from r2art.core import bop
from r2art.core.prediction import Prediction
from r2art.run.export.mechanism import rigid
from r2art.run.export.rotations import quaternion

SCENE_FOLDERS = ("rgb", "gray")
"""Names of the folders of photos in a scene of a BOP dataset."""

COLUMNS = (
    *("image", "category", "category_score", "rejected", "part", "confidence"),
    *("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"),
    *("box_center_x_m", "box_center_y_m", "box_center_z_m"),
    *("box_size_x_m", "box_size_y_m", "box_size_z_m"),
    *("parent", "joint", "kind", "unit", "state", "lower", "upper"),
    *("axis_x", "axis_y", "axis_z", "pivot_x_m", "pivot_y_m", "pivot_z_m", "state_confidence"),
)
UNITS = {"revolute": "rad", "prismatic": "m"}


def to_csv(predictions: Sequence[Prediction]) -> bytes:
    """The bytes of a CSV file: a row for each part, with the joint that moves it.

    Poses are in the camera frame, quaternions w x y z with w not negative; the root has no joint
    and empty cells there.
    """
    return _csv([COLUMNS, *(row for p in predictions for row in _rows(p))])


def _rows(prediction: Prediction) -> Iterator[tuple[object, ...]]:
    # None becomes an empty cell.
    image, score = prediction.image_path, prediction.category_score
    about = (image, prediction.category, score, prediction.rejected)
    joints = {joint.child: joint for joint in prediction.joints}
    for part in prediction.parts:
        pose = rigid(part.cam_T_part)
        placed = (*pose[:3, 3], *quaternion(pose[:3, :3]), *part.box_center, *part.box_size)
        moved: tuple[object, ...] = ("",) * 14
        if (joint := joints.get(part.name)) is not None:
            names = (joint.parent, joint.name, joint.kind, UNITS[joint.kind])
            numbers = (joint.state, *joint.limits, *joint.axis, *joint.pivot)
            moved = (*names, *map(float, numbers), joint.confidence)
        yield (*about, part.name, part.confidence, *map(float, placed), *moved)


def to_bop(predictions: Sequence[Prediction]) -> bytes:
    """The bytes of a BOP results file, a row for each part.

    Photos within a BOP dataset (``…/000003/rgb/000012.png``) keep the numbers of scene and image.
    If one of them lies elsewhere, all are numbered from 0 on in the order given, in scene 0.
    """
    numbers = [_numbers_of(p.image_path) for p in predictions]
    known = [n for n in numbers if n is not None]
    if len(known) < len(numbers):
        known = [(0, i) for i in range(len(predictions))]
    pairs = zip(predictions, known, strict=True)
    rows = (row for p, (scene, image) in pairs for row in bop.result_rows(p, scene, image, -1))
    return _csv([bop.RESULTS, *rows])


def _numbers_of(path: str | None) -> tuple[int, int] | None:
    """Numbers of scene and image, of a photo in a BOP dataset."""
    *_, scene, folder, name = ("", "", "", *PurePath(path or "").parts)
    image = PurePath(name).stem
    if folder in SCENE_FOLDERS and scene.isdecimal() and image.isdecimal():
        return int(scene), int(image)
    return None


def _csv(rows: Iterable[Sequence[object]]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue().encode()
