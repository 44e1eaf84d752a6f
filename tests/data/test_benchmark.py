"""A benchmark measures one thing at a time, and anybody gets the same one."""

import json
import shlex
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from r2art import cli
from r2art.core.camera import Camera
from r2art.core.errors import InputError, UsageError
from r2art.data import objects, prior
from r2art.data.benchmark.cad import SHIPPED, Cad, cad_objects, read_mapping
from r2art.data.benchmark.closing import as_one_of, closed_at, in_order, turned
from r2art.data.benchmark.make import make
from r2art.data.benchmark.manifest import verify
from r2art.data.benchmark.plan import CUT, HIDDEN, Benchmark, members
from r2art.data.benchmark.scaled import ARTIMAGE, OTHERS, Scaled, Size, diagonal, scaled
from r2art.data.categories import CATEGORIES, make_instance, staging
from r2art.data.checking.sample_faults import sample_faults
from r2art.data.models import cache
from r2art.data.objects import Procedural
from r2art.data.pose import posed_vertices, root_T_part
from r2art.data.prior import category_prior
from r2art.data.sample import Sample
from r2art.data.shape import Instance
from r2art.data.shards import Dataset
from r2art.data.source import Fault
from r2art.data.synth import synthesise

MODELS = Path(__file__).parents[3] / "shared/data/articulated"


@pytest.fixture
def small_priors(monkeypatch):
    monkeypatch.setattr(objects, "PRIOR_INSTANCES", 2)
    monkeypatch.setattr(prior, "_VIEWS", 2)


def posed(instance: Instance, state) -> np.ndarray:
    return posed_vertices(instance, root_T_part(instance.joints, np.asarray(state)))


def shares(instance: Instance, share: float) -> np.ndarray:
    limits = np.array([joint.limits for joint in instance.joints])
    return limits[:, 0] + share * (limits[:, 1] - limits[:, 0])


def levels(setting: str, category: str, index: int) -> dict[float, Sample]:
    """A sample of every level of a sweep."""
    whole = Benchmark(out=Path("unused"), settings=(setting,), categories=(category,), size=96)
    return {m.level / 100: synthesise(m.job, index) for m in members(whole)}


@pytest.mark.parametrize("category", ["laptop", "drawer"])
def test_a_scaled_object_moves_as_the_object_does_only_larger(category):
    instance = make_instance(category, 3)
    large = scaled(instance, 2.5)
    for share in (0.0, 0.4, 1.0):
        moved = posed(large, shares(large, share))
        np.testing.assert_allclose(moved, 2.5 * posed(instance, shares(instance, share)))


@pytest.mark.parametrize("category", ["laptop", "drawer"])
def test_the_prior_of_scaled_objects_is_the_scaled_prior(category, small_priors):
    instances, k = [make_instance(category, seed) for seed in range(3)], 3.0
    small = category_prior(instances, staging(category))
    large = category_prior([scaled(i, k) for i in instances], staging(category))
    for name, power in (("box_size", 1), ("box_center", 1), ("points", 1), ("areas", 2)):
        np.testing.assert_allclose(
            getattr(large, name), k**power * getattr(small, name), atol=1e-12
        )
    assert large.diagonal == pytest.approx(k * small.diagonal)
    assert large.frontal_area == pytest.approx(k**2 * small.frontal_area, rel=1e-6)
    for a, b in zip(large.joints, small.joints, strict=True):
        np.testing.assert_allclose(a.pivot, k * np.array(b.pivot), atol=1e-12)
        per_state = k if b.kind == "prismatic" else 1
        np.testing.assert_allclose(a.limits, per_state * np.array(b.limits))


@pytest.mark.parametrize("category", CATEGORIES)
def test_all_objects_at_the_scale_of_artimage_have_one_size(category):
    size = ARTIMAGE.get(category, OTHERS)
    for seed in range(2):
        instance = Scaled(Procedural(category), size).instance(seed)
        assert diagonal(instance, size.opened) == pytest.approx(size.diagonal)
    assert 1.6 < size.diagonal < 2.1


def test_the_lens_is_that_of_artimage():
    views = Scaled(Procedural("laptop"), Size(diagonal=1.0)).staging
    view = views.sample_view(np.random.default_rng(0))
    assert Camera.from_fov(view.fov, 640, 640).fx == pytest.approx(914)


def test_scaled_objects_are_sound_samples_of_their_prior(small_priors):
    benchmark = Benchmark(
        out=Path("unused"), settings=("artimage-scale",), categories=("laptop", "drawer")
    )
    for member in members(benchmark):
        assert member.job.size == 640
        sample = synthesise(replace(member.job, size=128), 0)
        assert sample_faults(sample, member.job.objects.prior()) == []


def on_object(sample: Sample) -> np.ndarray:
    return (sample.mask > 0) & (sample.mask <= len(sample.cam_T_part))


@pytest.mark.parametrize(("category", "index"), [("laptop", 0), ("laptop", 1), ("scissors", 2)])
def test_what_is_hidden_is_what_was_asked_of_the_same_photo(category, index):
    photos = levels("occlusion", category, index)
    assert list(photos) == list(HIDDEN)
    first = photos[0.0]
    still_seen = on_object(first)
    for share, sample in photos.items():
        assert sample.amodal is not None
        whole = np.count_nonzero(sample.amodal)
        assert 1 - np.count_nonzero(on_object(sample)) / whole == pytest.approx(share, abs=0.04)
        np.testing.assert_array_equal(sample.cam_T_part, first.cam_T_part)
        np.testing.assert_array_equal(sample.joint_state, first.joint_state)
        assert sample.camera == first.camera
        assert not (on_object(sample) & ~still_seen).any()  # what was hidden stays hidden
        still_seen = on_object(sample)
    assert first.box.min() >= 0
    assert first.box.max() <= 96


@pytest.mark.parametrize(("category", "index"), [("laptop", 0), ("laptop", 10), ("drawer", 2)])
def test_what_is_cut_off_is_what_was_asked_of_the_same_object(category, index):
    photos = levels("truncation", category, index)
    assert list(photos) == list(CUT)
    edges = set()
    for share, sample in photos.items():
        outside = np.concatenate([-sample.box[:2], sample.box[2:] - 96])
        extent = np.tile(sample.box[2:] - sample.box[:2], 2)
        over = outside / extent
        edge = int(over.argmax())
        edges.add(edge)
        assert over[edge] == pytest.approx(share, abs=0.015)
        assert np.delete(over, edge).max() <= 0.015
        np.testing.assert_array_equal(sample.joint_state, photos[0.0].joint_state)
        np.testing.assert_array_equal(sample.box_size, photos[0.0].box_size)
        assert sample.camera == photos[0.0].camera
    assert len(edges) == 1


def chain(instance: Instance) -> Instance:
    """A cabinet's drawers hung on one another, the second turning: worse than any model."""
    joints = tuple(replace(joint, parent=j) for j, joint in enumerate(instance.joints))
    turning = replace(joints[1], kind="revolute", axis=(0.0, 0.6, 0.8), limits=(-1.0, 2.0))
    return replace(instance, joints=(joints[0], turning, *joints[2:]))


def test_an_object_closed_elsewhere_moves_as_before():
    instance = chain(make_instance("drawer", 0))
    closed, opened = np.array([0.1, 1.5, 0.2]), np.array([-0.1, 0.5, 0.4])
    moved = closed_at(instance, closed, opened)
    span = np.abs(opened - closed)
    np.testing.assert_allclose([joint.limits for joint in moved.joints], [(0, s) for s in span])
    for share in (0.0, 0.3, 1.0):
        np.testing.assert_allclose(
            posed(moved, share * span),
            posed(instance, closed + share * (opened - closed)),
            atol=1e-12,
        )


def test_a_turned_object_is_turned_in_every_state():
    instance = make_instance("laptop", 0)
    askew = turned(instance, (20.0, 0.0, 0.0))
    for share in (0.0, 0.5):
        before = posed(instance, shares(instance, share))
        after = posed(askew, shares(askew, share))
        c, s = np.cos(np.radians(20)), np.sin(np.radians(20))
        R = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
        np.testing.assert_allclose(np.ptp(after - before @ R.T, axis=0), 0, atol=1e-12)
    np.testing.assert_allclose(askew.part_boxes()[0][0], 0, atol=1e-12)


def test_joints_in_another_order_carry_their_parts_along():
    instance = make_instance("drawer", 0)
    names = [joint.name for joint in instance.joints]
    mixed = in_order(instance, names[::-1])
    assert [joint.name for joint in mixed.joints] == names[::-1]
    assert mixed.part_names == (instance.part_names[0], *instance.part_names[:0:-1])
    assert in_order(mixed, names) == instance


def test_an_object_of_another_kind_is_told():
    laptop, drawer = make_instance("laptop", 0), make_instance("drawer_single", 0)
    with pytest.raises(InputError, match="some file has the joints"):
        as_one_of(drawer, laptop, "some file")
    hinge = replace(laptop.joints[0], axis=(1.0, 0.0, 0.0))
    with pytest.raises(InputError, match="180° away from that of a 'hinge'"):
        as_one_of(replace(laptop, joints=(hinge,)), laptop, "some file")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[[model]", "cannot be read"),
        ("title = 1", "one \\[\\[model\\]\\] per model"),
        ('[[model]]\nfile = "a.xml"\ncategory = "laptop"', "model 1: lacks `joints`"),
        ('[[model]]\nfile = "a.xml"\njoints = {}', "model 1: missing 1 required .*'category'"),
        ('[[model]]\nfile = "a"\ncategory = "toaster"\njoints = {}', "'toaster' is none of"),
        ('[[model]]\nfile = "a"\ncolour = 1\ncategory = "box"\njoints = {}', "'colour'"),
        ('[[model]]\nfile = "a"\ncategory = "box"\njoints.hinge = 1', "model 1: "),
        ('[[model]]\nfile = 1\ncategory = "box"\njoints = {}', "file must be a text"),
        ('[[model]]\nfile = "a"\ncategory = "box"\njoints.a = {name = "a", closed = "b"}', "'b'"),
        ('[[model]]\nfile = "a"\ncategory = "box"\njoints.a = {closed = 1}', "'name'"),
    ],
)
def test_a_mapping_that_cannot_be_meant_is_told(tmp_path, text, says):
    (tmp_path / "models.toml").write_text(text)
    with pytest.raises(Fault, match=says):
        read_mapping(tmp_path / "models.toml")


def test_a_folder_without_models_is_told(tmp_path):
    with pytest.raises(InputError, match=r"neither a models\.toml nor any model"):
        cad_objects(tmp_path)


@pytest.mark.skipif(not MODELS.is_dir(), reason="the public models are not here")
def test_public_models_are_sound_objects_of_their_categories(small_priors, tmp_path, monkeypatch):
    monkeypatch.setattr(cache, "folder", lambda: tmp_path)
    benchmark = Benchmark(out=Path("unused"), settings=("cad",), models=MODELS, size=64)
    jobs = [member.job for member in members(benchmark)]
    seen = 0
    for job in jobs:
        assert isinstance(job.objects, Cad)
        assert sample_faults(synthesise(job, 0), job.objects.prior()) == []
        seen += len(job.objects.found)
    assert seen == len(read_mapping(SHIPPED))


SMALL = Benchmark(
    out=Path("unused"),
    settings=("physical", "truncation"),
    categories=("laptop",),
    n=2,
    sweep_n=1,
    size=48,
    workers=1,
)


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("bench")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(objects, "PRIOR_INSTANCES", 2)
        patch.setattr(prior, "_VIEWS", 2)
        make(replace(SMALL, out=out), "the command")
    return out


def contents(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


@pytest.fixture
def copy(made, tmp_path) -> Path:
    return shutil.copytree(made, tmp_path / "copy")


def test_every_dataset_of_it_opens_and_the_manifest_tells_them(made):
    manifest = json.loads((made / "benchmark.json").read_text())
    assert len(manifest["datasets"]) == 1 + len(CUT)
    for told in manifest["datasets"]:
        dataset = Dataset.open(made / told["folder"])
        assert len(dataset) == told["n"]
        assert dataset.category.name == told["category"]
        assert sample_faults(dataset[0], dataset.category) == []
    assert set(manifest["files"]) == set(contents(made)) - {"benchmark.json"}
    assert verify(made).faults == ()


def test_a_run_that_was_cut_short_ends_with_the_same_bytes(made, copy, small_priors):
    manifest = json.loads((copy / "benchmark.json").read_text())
    whole, files = manifest.pop("sha256"), manifest.pop("files")
    (copy / "benchmark.json").write_text(json.dumps(manifest))
    shutil.rmtree(copy / "truncation/30")
    for name in ("SHA256SUMS", "shard-00000.parquet"):
        (copy / "physical/laptop" / name).unlink()
    with pytest.raises(InputError, match="not finished; run its command again: the command"):
        verify(copy)
    assert files
    assert make(replace(SMALL, out=copy), "the command") == whole
    assert contents(copy) == contents(made)


def test_the_command_that_the_manifest_names_makes_the_same_bytes(made, tmp_path, small_priors):
    def run(command: str, out: Path) -> dict[str, Any]:
        words = [str(out) if word == "DIR" else word for word in shlex.split(command)]
        assert cli.main([*words[1:], "--workers", "1"]) == 0
        return json.loads((out / "benchmark.json").read_text())

    options = "-n 2 --sweep-n 1 --settings physical truncation --categories laptop --size 48"
    first = run(f"r2art benchmark make --out DIR {options}", tmp_path / "first")
    second = run(first["command"], tmp_path / "second")
    assert first == second
    assert first["files"] == json.loads((made / "benchmark.json").read_text())["files"]


def test_another_benchmark_is_refused(copy, small_priors):
    before = contents(copy)
    with pytest.raises(InputError, match=r"another benchmark \(differs in n, datasets\)"):
        make(replace(SMALL, out=copy, n=3), "the command")
    assert contents(copy) == before


def test_every_file_that_differs_or_is_missing_is_named(copy, capsys):
    changed = copy / "truncation/20/laptop/shard-00000.parquet"
    content = bytearray(changed.read_bytes())
    content[len(content) // 2] ^= 1
    changed.write_bytes(content)
    gone, extra = copy / "physical/laptop/category.npz", copy / "physical/laptop/notes.txt"
    gone.unlink()
    extra.write_text("mine")
    assert cli.main(["benchmark", "verify", str(copy)]) == 1
    told = capsys.readouterr().out.splitlines()
    assert told[:3] == [
        f"{gone}: is missing",
        f"{changed}: differs from the manifest",
        f"{extra}: is no file of the benchmark",
    ]
    assert "3 faults" in told[3]
    assert cli.main(["benchmark", "verify", str(copy), "--json"]) == 1
    faults = json.loads(capsys.readouterr().out)["faults"]
    assert [fault["file"] for fault in faults] == [str(gone), str(changed), str(extra)]


def test_hashes_that_were_tampered_with_are_told(copy):
    manifest = json.loads((copy / "benchmark.json").read_text())
    manifest["files"].popitem()
    (copy / "benchmark.json").write_text(json.dumps(manifest))
    assert "is not that of its files" in [f.problem for f in verify(copy).faults]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"settings": ("cad",)}, "need each other"),
        ({"models": Path("models")}, "need each other"),
        ({"settings": ("sunshine",)}, "got \\['sunshine'\\]"),
        ({"categories": ("toaster",)}, "no category 'toaster'"),
        ({"sweep_n": 0}, "sweep_n >= 1"),
    ],
)
def test_what_cannot_be_meant_is_told(change, says):
    with pytest.raises(UsageError, match=says):
        replace(SMALL, **change)
