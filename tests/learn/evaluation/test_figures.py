"""Every figure can be drawn of every evaluation, however odd."""

import io
from dataclasses import replace

import numpy as np
import pytest
from hand_made import disturbed, make_category, sample_of, write_dataset
from PIL import Image

from r2art.learn.evaluation import figures
from r2art.learn.evaluation.evaluate import evaluate
from r2art.learn.evaluation.scores import truth
from r2art.learn.evaluation.tabulate import Result, by_cause, tables
from r2art.learn.evaluation.testsets import open_testsets
from r2art.learn.evaluation.worst import worst


def one_part():
    """A category without joints."""
    c, names = make_category(), ("box_center", "box_size", "points", "normals", "areas")
    first = {name: getattr(c, name)[:1] for name in names}
    return replace(c, name="brick", part_names=("body",), joints=(), **first)


def without_joints(sample):
    joints = {name: getattr(sample, name)[:0] for name in ("joint_state", "axis", "pivot")}
    parts = ("cam_T_part", "box_center", "box_size", "visible")
    return replace(sample, **joints, **{name: getattr(sample, name)[:1] for name in parts})


def result_of(folder, category, samples, predict):
    test = open_testsets(write_dataset(folder, category, samples))[0]
    return Result.of(evaluate(test, predict))


def some_failures(folder):
    """One photo failed, one was taken for something else."""
    category = make_category()
    samples = [sample_of(category, seed) for seed in range(5)]
    states = [s.joint_state[0] for s in samples]

    def predict(sample, given_box):
        said = disturbed(truth(sample, category), np.random.default_rng(0))
        if sample.joint_state[0] == states[1]:
            return None
        return replace(said, category="sofa") if sample.joint_state[0] == states[2] else said

    return result_of(folder, category, samples, predict)


def a_single_brick(folder):
    samples = [without_joints(sample_of(make_category(), 0))]
    return result_of(folder, one_part(), samples, lambda sample, _: truth(sample, one_part()))


def nothing_but_failures(folder):
    """Of those with box and category given, which are drawn."""
    category = make_category()
    samples = [sample_of(category, seed) for seed in range(3)]

    def predict(sample, given_box):
        return None if given_box else truth(sample, category)

    return result_of(folder, category, samples, predict)


@pytest.mark.parametrize("make", [some_failures, a_single_brick, nothing_but_failures])
def test_figures_and_tables(tmp_path, make):
    result = make(tmp_path / "photos")
    drawn = [figures.errors(result.report), figures.histograms(result.report)]
    drawn += [figures.calibration(result.report, result.given), worst(result.report)]
    for content in drawn:
        with Image.open(io.BytesIO(content)) as picture:
            assert np.ptp(np.asarray(picture.convert("L"))) > 100
    for table in (*tables(result), *by_cause(result.report)):
        assert table.rows
        assert {len(row) for row in table.rows} == {len(table.columns)}
        assert "nan" not in table.markdown()
