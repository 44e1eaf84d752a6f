"""Two processes train as one with the double batch does."""

import json
import os
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file

from r2art.learn import checkpoint
from r2art.learn import train as train_module
from r2art.learn.journal import read_log
from r2art.learn.recipes import Recipe
from r2art.learn.train import Training, train

SCRIPT = """
import json, sys
from pathlib import Path
import torch
from r2art.learn import train as t
from r2art.learn.recipes import recipe_of
torch.set_num_threads(1)
t.LOG_EVERY = 1
recipe, out, *data = sys.argv[1:]
recipe, data = recipe_of(json.loads(recipe)), tuple(map(Path, data))
t.train(t.Training(recipe=recipe, data=data, out=Path(out)))
"""
STEPS = 50
RECIPE = Recipe(
    backbone="mobilenetv2_050",
    backbone_options={"pad_type": "same"},
    input_size=64,
    width=32,
    steps=STEPS,
    crops=4,
    photos=2,
    warm_up=10,
    cascade_from=20,
    cascade_pixels=32,
    learning_rate=1e-6,
    trunk_learning_rate=1e-6,
)
"""At usual rates, Adam amplifies the rounding of the first steps, as for any change of order."""


def launch(recipe: Recipe, data: list[Path], folder: Path, processes: int) -> Path:
    """Run a training as `accelerate launch` does."""
    script = folder / "train.py"
    script.write_text(SCRIPT)
    # --multi_gpu starts several processes on this machine, on CPUs where there are no GPUs.
    flags = ["--multi_gpu", "--num_processes", str(processes), "--num_machines", "1"]
    flags += ["--mixed_precision", "no", "--dynamo_backend", "no", "--main_process_port", "0"]
    arguments = [json.dumps(asdict(recipe)), str(folder / "run"), *map(str, data)]
    command = [sys.executable, "-m", "accelerate.commands.launch", *flags, str(script), *arguments]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "CUDA_VISIBLE_DEVICES": ""}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return folder / "run"


@pytest.mark.slow
def test_two_processes_learn_what_one_with_the_double_batch_does(datasets, tmp_path, monkeypatch):
    data = list(datasets.values())
    two = launch(RECIPE, data, tmp_path, processes=2)

    monkeypatch.setattr(train_module, "LOG_EVERY", 1)
    alone = tmp_path / "alone"
    train(Training(recipe=replace(RECIPE, shares=2), data=tuple(data), out=alone))
    together, single = read_log(two), read_log(alone)
    assert [e["step"] for e in together] == [e["step"] for e in single] == list(range(1, STEPS + 1))
    for a, b in zip(together, single, strict=True):
        assert a.keys() == b.keys()
        assert a["total"] == pytest.approx(b["total"], rel=1e-4), a["step"]
    ended, expected = (load_file(f / checkpoint.STATE) for f in (two, alone))
    for key, value in expected.items():
        if key.endswith("running_var") and key.startswith("model."):
            torch.testing.assert_close(ended[key], value, rtol=2e-2, atol=1e-3, msg=key)
    half = tmp_path / "half"
    train(Training(recipe=replace(RECIPE, steps=3), data=tuple(data), out=half))
    for a, b in zip(read_log(half), single, strict=False):
        assert abs(a["total"] - b["total"]) > 1e-2  # half of the batch is plainly another
