"""What `r2art eval` takes for data, through the command itself."""

import json
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest
from hand_made import make_category, make_laptop, sample_of, write_dataset

from r2art.cli import main
from r2art.core.errors import InputError
from r2art.data import shards
from r2art.data.benchmark import manifest
from r2art.learn.evaluation.testsets import open_testsets


@pytest.fixture(scope="module")
def laptops(tmp_path_factory):
    category = make_laptop()
    samples = [sample_of(category, seed) for seed in range(3)]
    return write_dataset(tmp_path_factory.mktemp("data") / "laptop-test", category, samples)


@pytest.fixture(scope="module")
def benchmark(tmp_path_factory):
    """Two settings, with a category that the shipped model knows and one that it does not."""
    home = tmp_path_factory.mktemp("benchmark")
    folders = []
    for setting in ("physical", "sweeps/occlusion"):
        for category in (make_category(), make_laptop()):
            samples = [sample_of(category, seed) for seed in range(2)]
            folders.append(write_dataset(home / setting / category.name, category, samples))
    datasets = [{"folder": folder.relative_to(home).as_posix()} for folder in folders]
    content = {"format": manifest.FORMAT, "datasets": datasets}
    (home / manifest.NAME).write_text(json.dumps(content))
    return home


def test_a_benchmark_is_all_the_datasets_below_it(benchmark):
    names = [test.name for test in open_testsets(benchmark)]
    assert names == [
        *("physical-box", "physical-laptop"),
        *("sweeps-occlusion-box", "sweeps-occlusion-laptop"),
    ]
    only = open_testsets(benchmark, "laptop")
    assert [test.name for test in only] == names[1::2]
    with pytest.raises(InputError, match=r"shows no sofa; it has box, laptop"):
        open_testsets(benchmark, "sofa")


def test_a_benchmark_that_lacks_a_dataset_is_refused(tmp_path):
    content = {"format": manifest.FORMAT, "datasets": [{"folder": "physical/laptop"}]}
    (tmp_path / manifest.NAME).write_text(json.dumps(content))
    with pytest.raises(InputError, match="physical/laptop"):
        open_testsets(tmp_path)


def test_the_command_evaluates_what_the_model_knows_and_says_what_it_leaves_out(benchmark, capsys):
    assert main(["eval", "--data", str(benchmark), "--json"]) == 0
    out, err = capsys.readouterr()
    content = json.loads(out)
    assert [d["name"] for d in content["datasets"]] == [
        "physical-laptop",
        "sweeps-occlusion-laptop",
    ]
    for dataset in content["datasets"]:
        assert dataset["given"]["images"] == 2
        assert np.isfinite(dataset["given"]["whole"]["plain"]["add"]["mean"]["value"])
        assert dataset["given"]["seconds"]["median"]["value"] > 0
    assert "physical-box is left out: the joints of this model's box are revolute" in err


def test_a_broken_row_is_told_with_exit_code_3_and_the_others_are_evaluated(tmp_path, capsys):
    category = make_laptop()
    samples = [sample_of(category, seed) for seed in range(3)]
    folder = write_dataset(tmp_path / "laptops", category, samples)
    path = shards.shard_path(folder, 0)
    rows = pq.read_table(path).to_pylist()
    rows[1]["image"] = b"no image"
    shards.write_shard(path, rows)
    assert main(["eval", "--data", str(folder), "--json"]) == 3
    out, err = capsys.readouterr()
    dataset = json.loads(out)["datasets"][0]
    assert dataset["given"]["images"] == 2
    assert len(dataset["unreadable"]) == 1
    assert "row 1: image" in err


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (("--limit", "0"), 2, "limit"),
        (("--category", "sofa"), 3, "sofa"),
        (("--split", "train"), 3, "train"),
        (("--data", "nowhere"), 3, "no folder nowhere"),
        (("--data", "{laptops}"), 2, "two datasets are called laptop-test"),
        (("--out", "{laptops}/manifest.json"), 3, "cannot write"),
    ],
)
def test_what_cannot_be_meant_is_one_line(laptops, capsys, arguments, code, says):
    given = [a.format(laptops=laptops) for a in arguments]
    assert main(["eval", "--data", str(laptops), *given]) == code
    err = capsys.readouterr().err
    assert says in err
    assert "Traceback" not in err
    assert len([line for line in err.splitlines() if line.startswith("error")]) == 1


def test_a_category_with_other_joints_than_the_models_is_refused(tmp_path, capsys):
    category = replace(make_category(), name="laptop")  # three parts instead of two
    samples = [sample_of(category, seed) for seed in range(2)]
    folder = write_dataset(tmp_path / "odd", category, samples)
    assert main(["eval", "--data", str(folder)]) == 2
    assert "joints" in capsys.readouterr().err


def test_no_data_is_one_line(capsys):
    assert main(["eval"]) == 2
    assert "--data" in capsys.readouterr().err
