"""What finds objects is taught by itself, and put into a model file that stays as it is else."""

import numpy as np
import onnx
import onnxruntime
import pytest
from onnx import numpy_helper

from r2art.core.errors import ModelError, UsageError
from r2art.learn import exported
from r2art.learn.export import export
from r2art.learn.train import Training, train
from r2art.method.outputs import FINDING


@pytest.fixture(scope="module")
def finding_run(datasets, model_file, small, tmp_path_factory):
    """A run that has gone on from a model file and learned nothing but to find objects."""
    out = tmp_path_factory.mktemp("finding")
    recipe = small(steps=4, taught="finding", groups=2, crops=2, others=1, cascade_from=None)
    train(Training(recipe=recipe, data=tuple(datasets.values()), init=model_file, out=out))
    return out


@pytest.fixture(scope="module")
def better(finding_run, model_file, tmp_path_factory):
    path = tmp_path_factory.mktemp("better") / "better.onnx"
    export(finding_run, path, finding_for=model_file)
    return path


def arrays(path) -> dict[str, np.ndarray]:
    return {t.name: numpy_helper.to_array(t) for t in onnx.load(path).graph.initializer}


def test_nothing_else_of_the_file_changes(better, model_file):
    own = tuple(exported.PREFIX + name for name in FINDING)
    before, after = arrays(model_file), arrays(better)
    assert before.keys() == after.keys()
    changed = {k for k, v in after.items() if not np.array_equal(v, before[k])}
    assert changed
    assert all(name.startswith(own) for name in changed)
    told = exported.facts(better)
    assert told["finding"]["recipe"]["taught"] == "finding"
    assert told["recipe"] == exported.facts(model_file)["recipe"]


def test_poses_are_the_same_to_the_bit(better, model_file):
    feed = {
        "image": np.random.default_rng(0).integers(0, 256, (1, 64, 64, 3), np.uint8),
        "K": np.float32([[[70, 0, 30], [0, 72, 33], [0, 0, 1]]]),
        "box": np.float32([[4, 6, 50, 60]]),
    }
    names, found = ["laptop.cam_T_part", "object_mask", "category_scores"], []
    for path in (model_file, better):
        session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
        found.append(session.run(names, feed))
    np.testing.assert_array_equal(found[0][0], found[1][0])
    np.testing.assert_array_equal(found[0][1], found[1][1])
    assert not np.array_equal(found[0][2], found[1][2])


def test_a_file_of_other_categories_is_refused(finding_run, run, model_file, tmp_path):
    export(run, tmp_path / "laptop.onnx", ["laptop"])
    with pytest.raises(ModelError, match="other categories"):
        export(finding_run, tmp_path / "out.onnx", finding_for=tmp_path / "laptop.onnx")
    with pytest.raises(UsageError, match="one of"):
        export(finding_run, tmp_path / "out.onnx", blend=model_file, finding_for=model_file)
    with pytest.raises(UsageError, match="goes together with a run"):
        export(model_file, tmp_path / "out.onnx", finding_for=model_file)
    assert not (tmp_path / "out.onnx").exists()
