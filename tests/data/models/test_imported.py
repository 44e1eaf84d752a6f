"""A category of models: which one is drawn when, and what all of them have in common."""

import json
import pickle
from pathlib import Path

import numpy as np
import pytest
from commands import run
from toy_models import CABINET

from r2art.core.category import Category
from r2art.core.errors import InputError, UsageError
from r2art.data import shards
from r2art.data.models.build import Reading
from r2art.data.models.imported import built, imported, of_split
from r2art.data.synth import Synth, synthesise


@pytest.fixture
def cabinets(write):
    """Ten cabinets of different heights."""

    def some(count=10, text=CABINET):
        return [
            write(text.replace("0.4 0.6 0.8", f"0.4 0.6 {0.8 + 0.01 * k}"), f"cabinet-{k}.urdf")
            for k in range(count)
        ]

    return some


def heights(objects, seeds=300):
    return {round(float(objects.instance(s).part_boxes()[1][0][1]), 6) for s in range(seeds)}


def shape(instance):
    return b"".join(s.vertices.tobytes() for part in instance.parts for s in part)


def test_one_model_serves_all_splits(cabinets):
    (path,) = cabinets(1)
    shapes = {
        shape(imported("urdf", [path], split=split).instance(7))
        for split in ("train", "val", "test")
    }
    assert len(shapes) == 1


def test_several_are_split_and_none_is_in_two(cabinets):
    paths = cabinets(25)
    drawn = {
        split: heights(imported("urdf", paths, split=split)) for split in ("train", "val", "test")
    }
    assert sum(map(len, drawn.values())) == len(set().union(*drawn.values())) == 25
    assert len(drawn["train"]) > len(drawn["val"]) + len(drawn["test"])


def test_a_model_stays_in_its_split_when_others_come(cabinets):
    paths = cabinets(20)
    some, more = (imported("urdf", p).sources for p in (paths[:12], paths))
    for split in ("train", "val", "test"):
        names = {source.path for source in of_split(more, split)}
        assert {source.path for source in of_split(some, split)} <= names


def test_the_order_of_the_models_does_not_matter(cabinets):
    paths = cabinets(8)
    assert imported("urdf", paths) == imported("urdf", paths[::-1])


def test_copies_count_once(cabinets, write):
    paths = [*cabinets(3), write(cabinets(1)[0].read_text(), "copy/elsewhere.urdf")]
    assert len(imported("urdf", paths).sources) == 3


def test_a_split_without_models_is_told(cabinets):
    # One of three splits of two models is empty, whatever their names.
    paths, told = cabinets(2), []
    for split in ("train", "val", "test"):
        try:
            imported("urdf", paths, split=split)
        except InputError as error:
            told.append(str(error))
    assert told
    assert all("of these 2 models is of no use (train " in text for text in told)


def test_no_model_at_all_is_told():
    with pytest.raises(UsageError, match="no model given"):
        imported("urdf", [])


def test_names_that_files_could_not_bear_are_made_plain(cabinets):
    (path,) = cabinets(1)
    assert imported("urdf", [path]).name == "toy_cabinet"
    assert imported("urdf", [path], name="my/cabinet.2").name == "my_cabinet_2"
    with pytest.raises(UsageError, match="cannot be named"):
        imported("urdf", [path], name="///")


def test_an_object_is_the_same_to_the_byte_from_memory_disk_or_anew(cabinets, own_cache):
    objects = imported("urdf", cabinets(6))
    first = [shape(objects.instance(seed)) for seed in range(5)]
    built.cache_clear()
    assert [shape(objects.instance(seed)) for seed in range(5)] == first
    built.cache_clear()
    for file in own_cache.rglob("*.npz"):
        file.unlink()
    assert [shape(objects.instance(seed)) for seed in range(5)] == first


def test_joints_lie_anywhere_within_limits_and_views_all_around(cabinets):
    objects = imported("urdf", cabinets(1))
    rng, joints = np.random.default_rng(0), objects.instance(0).joints
    states = np.array([objects.staging.sample_joint_state(rng, joints) for _ in range(400)])
    limits = np.array([joint.limits for joint in joints])
    share = (states - limits[:, 0]) / (limits[:, 1] - limits[:, 0])
    assert share.min() >= 0
    assert share.max() <= 1
    np.testing.assert_allclose(share.mean(axis=0), 0.5, atol=0.06)
    np.testing.assert_allclose(share.std(axis=0), 12**-0.5, atol=0.03)
    azimuth = [objects.staging.sample_view(rng).azimuth for _ in range(200)]
    assert np.ptp(azimuth) > 6


def test_mimicking_joints_follow_within_their_limits(cabinets):
    mimic = '<axis xyz="1 0 0"/><mimic joint="hinge" multiplier="0.2" offset="0.05"/>'
    objects = imported("urdf", cabinets(1, CABINET.replace('<axis xyz="1 0 0"/>', mimic)))
    rng, joints = np.random.default_rng(0), objects.instance(0).joints
    states = np.array([objects.staging.sample_joint_state(rng, joints) for _ in range(200)])
    wanted = np.clip(0.2 * states[:, 0] + 0.05, 0.1, 0.35)
    np.testing.assert_allclose(states[:, 1], wanted)


def test_the_prior_is_the_mean_of_the_training_models(cabinets):
    objects = imported("urdf", cabinets(12), split="test", name="cabinet")
    prior = objects.prior()
    training = [
        0.8 + 0.01 * int(s.path.stem.split("-")[1]) for s in of_split(objects.sources, "train")
    ]
    assert prior.box_size[0, 1] == pytest.approx(np.exp(np.mean(np.log(training))))
    assert prior.name == "cabinet"
    assert [joint.limits for joint in prior.joints] == [(-0.2, 1.5), (0.1, 0.35)]
    assert 0.2 < prior.frontal_area / prior.diagonal**2 < 1.2


def test_joints_that_run_the_other_way_are_turned_round(cabinets, write):
    (first,) = cabinets(1)
    other = CABINET.replace('"0 0 2"', '"0 0 -1"').replace(
        'lower="-0.2" upper="1.5"', 'lower="-1.5" upper="0.2"'
    )
    other = other.replace('"hinge"', '"pivot"')
    paths = [first, *(write(other + " " * k, f"other-{k}.urdf") for k in range(12))]
    objects = imported("urdf", paths)
    for seed in range(20):
        hinge, _ = objects.instance(seed).joints
        reference = objects.instance(0).joints[0]
        np.testing.assert_allclose(hinge.axis, reference.axis, atol=1e-9)
        assert (hinge.name, hinge.limits) == (reference.name, reference.limits)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (('name="slide" type="prismatic"', 'name="slide" type="fixed"'), "other parts than"),
        (('"0 0 2"', '"0 2 0"'), "another axis than"),
    ],
)
def test_models_of_another_kind_are_told(cabinets, write, change, says):
    odd = [write(CABINET.replace(*change) + " " * k, f"odd-{k}.urdf") for k in range(12)]
    objects = imported("urdf", [*cabinets(6), *odd])
    with pytest.raises(InputError, match=says):
        [objects.instance(seed) for seed in range(40)]


def test_recolouring_changes_plain_colours_alone(cabinets):
    (path,) = cabinets(1)
    plain, bright = (imported("urdf", [path], recolor=r) for r in (False, True))
    assert shape(bright.instance(1)) == shape(plain.instance(1))
    colors = {bright.instance(s).parts[0][0].material.color for s in range(5)}
    assert len(colors) == 5
    assert bright.instance(3).parts[0][0].material == bright.instance(3).parts[0][0].material
    assert {plain.instance(s).parts[0][0].material.color for s in range(5)} == {(0.7, 0.7, 0.7)}


def test_a_manifest_tells_contents_and_settings_but_no_folders(cabinets, tmp_path):
    objects = imported("urdf", cabinets(2)[:1], reading=Reading(fix=("slide",), front="-y"))
    about = objects.about()
    text = json.dumps(about)
    assert str(tmp_path) not in text
    assert about["category"] == "toy_cabinet"
    assert about["models"][0]["name"] == "cabinet-0.urdf"
    assert about["reading"] == {"fix": ["slide"], "front": "-y", "scale": 1.0, "triangles": 12_000}
    (tmp_path / "cabinet-0.urdf").write_text(CABINET + " ")
    assert imported("urdf", [tmp_path / "cabinet-0.urdf"]).about()["models"] != about["models"]


def test_a_sample_of_a_model_is_the_same_in_another_process(cabinets):
    objects = imported("urdf", cabinets(1))
    job = Synth(
        objects=objects, n=3, seed=0, split="train", size=64, backgrounds=None, out=Path("unused")
    )
    again = pickle.loads(pickle.dumps(job))
    sample = synthesise(job, 1)
    assert shards.to_row(1, sample) == shards.to_row(1, synthesise(again, 1))
    assert set(np.unique(sample.mask)) & {1, 2, 3}
    joints = objects.instance(0).joints
    assert all(
        a.limits[0] <= q <= a.limits[1] for a, q in zip(joints, sample.joint_state, strict=True)
    )


def test_the_command_writes_a_prior(cabinets, tmp_path, capsys):
    out = tmp_path / "prior.npz"
    (path,) = cabinets(1)
    assert run("prior", "--urdf", path, "--fix", "slide", "--name", "cupboard", "--out", out) == 0
    prior = Category.load(out)
    assert prior.name == "cupboard"
    assert prior.part_names == ("base", "door")
    assert "cupboard, parts base, door; hinge (revolute)" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        ([], 2, "say what to show"),
        (["laptop", "--urdf", "a.urdf"], 2, "say what to show"),
        (["--urdf", "a.urdf", "--mjcf", "a.xml"], 2, "say what to show"),
        (["--urdf", "gone.urdf"], 3, "no such file or folder: gone.urdf"),
        (["--partnet", "gone"], 3, "mobility.urdf is not there"),
        (["--mjcf", "gone.xml"], 3, "no such file or folder: gone.xml"),
        (["toaster"], 2, "no category 'toaster'"),
    ],
)  # fmt: skip
def test_mistakes_are_one_line(arguments, code, says, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run("prior", *arguments) == code
    err = capsys.readouterr().err
    assert says in err
    assert err.count("\n") == 1


def test_models_that_cannot_be_objects_leave_no_dataset_behind(write, tmp_path, capsys):
    path = write(CABINET.replace("revolute", "fixed").replace("prismatic", "fixed"))
    assert run("synth", "--urdf", path, "-n", 1, "--out", tmp_path / "data") == 3
    assert "nothing that is seen turns" in capsys.readouterr().err
    assert not list((tmp_path / "data").glob("*"))
