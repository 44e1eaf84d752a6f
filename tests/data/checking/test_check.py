"""A sound dataset passes; whatever is done to one is found, and named by file and field."""

import io
import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from PIL import Image

from r2art.core.errors import InputError
from r2art.data import objects, prior, shards, synth
from r2art.data.checking.check import check
from r2art.data.hashes import SUMS
from r2art.data.objects import Procedural
from r2art.data.shards import MANIFEST, PRIOR, Dataset
from r2art.data.source import Fault
from r2art.data.synth import Synth

SIZE, N = 64, 4
FIRST, SECOND = (f"shard-0000{k}.parquet" for k in (0, 1))
FLOATS = tuple(shards.SHAPES)


@pytest.fixture(scope="module", params=["laptop", "drawer"])
def sound(request, tmp_path_factory):
    """A folder with two shards of two samples; not to be changed."""
    folder = tmp_path_factory.mktemp(request.param)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(synth, "SHARD_SIZE", 2)
        patch.setattr(objects, "PRIOR_INSTANCES", 8)
        patch.setattr(prior, "_VIEWS", 8)
        job = Synth(
            objects=Procedural(request.param),
            n=N,
            seed=3,
            split="val",
            size=SIZE,
            backgrounds=None,
            out=folder,
            workers=1,
        )
        synth.synth(job)
    return folder


@pytest.fixture
def folder(sound, tmp_path):
    """A copy to spoil, without hashes, so that every fault must be found by what it breaks."""
    shutil.copytree(sound, copy := tmp_path / "data")
    (copy / SUMS).unlink()
    return copy


def faults(folder: Path) -> list[Fault]:
    try:
        return list(check(Dataset.open(folder, whole=False)))
    except Fault as fault:
        return [fault]


def assert_named(folder: Path, file: str, *fields: str) -> None:
    """Some fault names the file and one of the fields, all of them name some file."""
    found = faults(folder)
    named = [(f.file.removeprefix(f"{folder}/"), f.field) for f in found]
    assert any((file, field) in named for field in fields), [str(f) for f in found] or "passed"
    assert all(f.problem and "Traceback" not in f.problem for f in found)


# What is done to the row of a sample -----------------------------------------------------------

Change = Callable[[dict], None]


def spoil(folder: Path, change: Change, number: int = 0, row: int = 1) -> str:
    """Change one row of a shard; where it stands."""
    path = shards.shard_path(folder, number)
    rows = pq.read_table(path).to_pylist()
    change(rows[row])
    shards.write_shard(path, rows)
    return f"{path.name} row {row}"


def put(name: str, place: int, value: float) -> Change:
    """One number of a column becomes another."""
    return lambda row: row[name].__setitem__(place, value)


def turn(name: str, by: Callable[[np.ndarray], np.ndarray]) -> Change:
    """A column's numbers, shaped as in `Sample`, become others."""

    def change(row: dict) -> None:
        shape = shards.SHAPES.get(name, (-1,))
        row[name] = np.asarray(by(np.reshape(row[name], shape))).ravel().tolist()

    return change


def picture(name: str, by: Callable[[np.ndarray], np.ndarray]) -> Change:
    """A column's picture becomes another."""

    def change(row: dict) -> None:
        out = io.BytesIO()
        Image.fromarray(by(np.asarray(Image.open(io.BytesIO(row[name]))))).save(out, "PNG")
        row[name] = out.getvalue()

    return change


@pytest.mark.parametrize("name", ["camera", *FLOATS])
@pytest.mark.parametrize(
    "spoilt",
    [
        lambda v: [np.nan, *v[1:]],
        lambda v: [*v[:-1], np.inf],
        lambda v: v[:-1],
        lambda v: [*v, 0.0],
        lambda v: [],
        lambda v: None,
        lambda v: [None, *v[1:]],
    ],
    ids=["nan", "inf", "short", "long", "empty", "null", "hole"],
)
def test_numbers_that_are_none_or_too_few(folder, name, spoilt):
    file = spoil(folder, lambda row: row.__setitem__(name, spoilt(row[name])))
    assert_named(folder, file, name)


PICTURES = {
    "empty": lambda data: b"",
    "null": lambda data: None,
    "cut": lambda data: data[: len(data) // 2],
    "noise": lambda data: bytes(range(256)),
    "head only": lambda data: data[:60],
}


@pytest.mark.parametrize("name", ["image", "mask", "depth"])
@pytest.mark.parametrize("spoilt", PICTURES.values(), ids=PICTURES)
def test_pictures_that_cannot_be_decoded(folder, name, spoilt):
    file = spoil(folder, lambda row: row.__setitem__(name, spoilt(row[name])))
    assert_named(folder, file, name)


def about_z(angle: float) -> np.ndarray:
    T = np.eye(4)
    T[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return T


def scaled(place, factor):
    def by(array):
        array[place] *= factor
        return array

    return by


def moved(place, *step):
    def by(array):
        array[place] += step
        return array

    return by


MEANING: dict[str, tuple[Change, tuple[str, ...]]] = {
    "focal length negative": (turn("camera", scaled(0, -1)), ("camera",)),
    "focal length zero": (put("camera", 1, 0.0), ("camera",)),
    "focal lengths unlike": (turn("camera", scaled(0, 3)), ("camera",)),
    "focal lengths tiny": (turn("camera", scaled(slice(2), 1e-3)), ("camera",)),
    "principal point far away": (put("camera", 2, 9000.0), ("camera",)),
    "principal point moved": (turn("camera", moved(slice(2, 4), 12, 9)), ("mask", "box", "depth")),
    "focal lengths doubled": (turn("camera", scaled(slice(2), 2)), ("mask", "box", "depth")),
    "box turned round": (turn("box", lambda b: b[[2, 3, 0, 1]]), ("box",)),
    "box as x y w h": (turn("box", lambda b: [*b[:2], *(b[2:] - b[:2]) / 3]), ("box",)),
    "box elsewhere": (turn("box", lambda b: b + 2 * SIZE), ("box",)),
    "box too small": (turn("box", moved(slice(4), 8, 8, -8, -8)), ("box",)),
    "box too large": (turn("box", moved(slice(4), -30, -30, 30, 30)), ("box",)),
    "rotation scaled": (turn("cam_T_part", scaled(np.s_[1, :3, :3], 1.01)), ("cam_T_part",)),
    "rotation mirrored": (turn("cam_T_part", scaled(np.s_[:, :3, 0], -1)), ("cam_T_part",)),
    "rotation zero": (turn("cam_T_part", scaled(np.s_[0, :3, :3], 0)), ("cam_T_part",)),
    "last row wrong": (put("cam_T_part", 15, 2.0), ("cam_T_part",)),
    "last row holds the position": (put("cam_T_part", 12, 0.1), ("cam_T_part",)),
    "poses transposed": (turn("cam_T_part", lambda T: T.swapaxes(1, 2)), ("cam_T_part",)),
    "poses inverted": (
        turn("cam_T_part", np.linalg.inv),
        ("cam_T_part", "box", "mask", "depth"),
    ),
    "part moved": (turn("cam_T_part", moved(np.s_[1, :3, 3], 0.02, 0, 0)), ("cam_T_part",)),
    "part turned": (
        turn("cam_T_part", lambda T: [T[0], T[1] @ about_z(0.1), *T[2:]]),
        ("cam_T_part",),
    ),
    "behind the camera": (turn("cam_T_part", scaled(np.s_[:, :3, 3], -1)), ("cam_T_part",)),
    "object moved": (
        turn("cam_T_part", moved(np.s_[:, :3, 3], 0.08, 0, 0)),
        ("box", "mask", "depth"),
    ),
    "millimetres": (turn("cam_T_part", scaled(np.s_[:, :3, 3], 1e3)), ("cam_T_part",)),
    "overflow": (put("cam_T_part", 3, 1e308), ("cam_T_part", "box")),
    "state beyond limits": (put("joint_state", 0, 7.0), ("joint_state",)),
    "state in degrees": (put("joint_state", 0, 101.0), ("joint_state",)),
    "state negative": (put("joint_state", 0, -1.0), ("joint_state",)),
    "state of another pose": (turn("joint_state", lambda q: 0.9 * q + 0.03), ("cam_T_part",)),
    "root box off the origin": (put("box_center", 0, 0.05), ("box_center",)),
    "box centre far away": (put("box_center", 4, 90.0), ("box_center",)),
    "box centre moved": (turn("box_center", moved(1, 0.1, 0.1, 0.1)), ("mask", "box", "depth")),
    "box size zero": (put("box_size", 1, 0.0), ("box_size",)),
    "box size negative": (turn("box_size", scaled(0, -1)), ("box_size",)),
    "box size in mm": (turn("box_size", lambda s: 1e3 * s), ("box_size",)),
    "box size halved": (turn("box_size", lambda s: s / 2), ("mask", "box", "depth")),
    "axis not unit": (turn("axis", scaled(0, 1.05)), ("axis",)),
    "axis zero": (turn("axis", scaled(0, 0)), ("axis",)),
    "axis flipped": (turn("axis", lambda a: -a), ("axis",)),
    "pivot far away": (put("pivot", 0, 50.0), ("pivot",)),
    "visible above 1": (put("visible", 0, 1.2), ("visible",)),
    "visible negative": (put("visible", 1, -0.1), ("visible",)),
    "visible zero": (turn("visible", lambda v: 0 * v), ("visible",)),
    "index of another": (lambda row: row.__setitem__("index", 0), ("index",)),
    "index missing": (lambda row: row.__setitem__("index", None), ("index",)),
    "image flat": (picture("image", lambda p: 0 * p), ("image",)),
    "image of another size": (picture("image", lambda p: p[:-2]), ("mask",)),
    "mask of another size": (picture("mask", lambda m: m[:, 2:]), ("mask",)),
    "depth of another size": (picture("depth", lambda d: d[::2, ::2]), ("depth",)),
    "mask in colour": (picture("mask", lambda m: np.stack([m] * 3, -1)), ("mask",)),
    "mask in 16 bits": (picture("mask", lambda m: m.astype(np.uint16)), ("mask",)),
    "depth in 8 bits": (picture("depth", lambda d: d.astype(np.uint8)), ("depth",)),
    "part beyond the last": (picture("mask", lambda m: np.where(m == 1, 9, m)), ("mask",)),
    "mask turned": (picture("mask", lambda m: m[::-1, ::-1]), ("mask", "box")),
    "mask shifted": (picture("mask", lambda m: np.roll(m, 14, axis=1)), ("mask", "box")),
    "parts swapped": (
        picture("mask", lambda m: np.where(m == 1, 2, np.where(m == 2, 1, m)).astype(np.uint8)),
        ("mask", "depth", "visible"),
    ),
    "depth in mm": (picture("depth", lambda d: d // 5), ("depth",)),
    "depth too far": (picture("depth", lambda d: (1.3 * d).astype(np.uint16)), ("depth",)),
    "depth of the backdrop": (picture("depth", lambda d: 0 * d + 60000), ("depth",)),
}


@pytest.mark.parametrize("name", MEANING)
def test_values_that_cannot_be_true(folder, name):
    change, fields = MEANING[name]
    assert_named(folder, spoil(folder, change), *fields)


def test_a_hinge_elsewhere_is_blamed_for_the_pose_it_does_not_explain(folder):
    category = Dataset.open(folder).category
    name = "pivot" if category.joints[0].kind == "revolute" else "axis"
    aside = np.cross(np.ones(3), category.joints[0].axis)
    change = turn(
        name,
        lambda a: (
            (b := a + 0.1 * aside)
            / (1 if name == "pivot" else np.linalg.norm(b, axis=1, keepdims=True))
        ),
    )
    for number in (0, 1):
        for row in (0, 1):
            file = spoil(folder, change, number, row)
            if max(Dataset.open(folder)[2 * number + row].joint_state) > 0.02:
                assert_named(folder, file, "cam_T_part")
                assert all(name in f.problem for f in faults(folder) if f.file.endswith(file))


# What is done to files -------------------------------------------------------------------------


def test_a_column_that_is_missing_is_named(folder):
    path = shards.shard_path(folder, 1)
    table = pq.read_table(path)
    for name in ("index", "image", "mask", "depth", "camera", *FLOATS):
        pq.write_table(table.drop_columns([name]), path)
        assert_named(folder, f"{SECOND} row 0", name)
        assert_named(folder, f"{SECOND} row 1", name)


def test_a_column_of_another_type_is_named(folder):
    path = shards.shard_path(folder, 0)
    table = pq.read_table(path)
    for k, name in enumerate(table.schema.names):
        spoilt = table.set_column(k, name, pa.array(["a", "b"]))
        pq.write_table(spoilt, path)
        assert_named(folder, f"{FIRST} row 0", name)


def table_of(path: Path, rows: slice) -> None:
    pq.write_table(pq.read_table(path)[rows], path)


SHARDS = {
    "missing": Path.unlink,
    "empty": lambda p: p.write_bytes(b""),
    "text": lambda p: p.write_text("PAR1"),
    "cut in half": lambda p: p.write_bytes(p.read_bytes()[: p.stat().st_size // 2]),
    "last byte gone": lambda p: p.write_bytes(p.read_bytes()[:-1]),
    "first half gone": lambda p: p.write_bytes(p.read_bytes()[p.stat().st_size // 2 :]),
    "zeros": lambda p: p.write_bytes(bytes(p.stat().st_size)),
    "a folder": lambda p: (p.unlink(), p.mkdir()),
    "a row less": lambda p: table_of(p, slice(0, 1)),
    "no row": lambda p: table_of(p, slice(0, 0)),
    "a row more": lambda p: pq.write_table(pa.concat_tables([pq.read_table(p)] * 2), p),
}


@pytest.mark.parametrize("spoilt", SHARDS.values(), ids=SHARDS)
def test_shards_that_are_missing_torn_or_of_another_length(folder, spoilt):
    spoilt(folder / FIRST)
    assert_named(folder, FIRST, "")
    assert len([f for f in faults(folder) if f.file.endswith(FIRST)]) == 1  # not once per sample


def test_shards_in_each_others_place(folder):
    (folder / FIRST).rename(folder / "x")
    (folder / SECOND).rename(folder / FIRST)
    (folder / "x").rename(folder / SECOND)
    assert_named(folder, f"{FIRST} row 0", "index")


def test_a_shard_too_many(folder):
    shutil.copy(folder / FIRST, folder / "shard-00002.parquet")
    assert_named(folder, "shard-00002.parquet", "")


MANIFESTS = {
    "format of later": ({"format": "r2art/dataset/9"}, "format"),
    "no n": ({"n": None}, "n"),
    "n in words": ({"n": "four"}, "n"),
    "n zero": ({"n": 0}, "n"),
    "n half": ({"n": 3.5}, "n"),
    "n more": ({"n": 7}, "shards"),
    "shards none": ({"shards": -1}, "shards"),
    "shards more": ({"shards": 3}, "shards"),
    "shard_size": ({"shard_size": 0}, "shard_size"),
    "shard_size true": ({"shard_size": 1}, "shards"),
    "category": ({"category": "teapot"}, "category"),
    "no category": ({"category": None}, "category"),
    "seed": ({"seed": "7"}, "seed"),
    "split": ({"split": "tset"}, "split"),
    "size": ({"size": -1}, "size"),
    "backgrounds": ({"backgrounds": "photos"}, "backgrounds"),
}


@pytest.mark.parametrize("name", MANIFESTS)
def test_manifests_that_cannot_be_true(folder, name):
    change, field = MANIFESTS[name]
    manifest = json.loads((folder / MANIFEST).read_text()) | change
    (folder / MANIFEST).write_text(json.dumps(manifest))
    assert_named(folder, MANIFEST, field)


@pytest.mark.parametrize("text", ["", "{", "[1]", '"r2art"', "null", "\xff\xfe", "{'n': 1}"])
def test_manifests_that_are_none(folder, text):
    (folder / MANIFEST).write_bytes(text.encode("latin-1"))
    assert_named(folder, MANIFEST, "", "format")


def test_fewer_samples_than_the_shards_hold(folder):
    manifest = json.loads((folder / MANIFEST).read_text())
    (folder / MANIFEST).write_text(json.dumps(manifest | {"n": N - 1}))
    assert_named(folder, SECOND, "")


def test_photos_of_another_size_than_the_manifest_says(folder):
    manifest = json.loads((folder / MANIFEST).read_text())
    (folder / MANIFEST).write_text(json.dumps(manifest | {"size": 2 * SIZE}))
    assert_named(folder, f"{FIRST} row 0", "image")


ARRAYS = ("box_center", "box_size", "points", "normals", "areas")


def with_prior(folder: Path, **changed: object) -> None:
    """Write the prior with other arrays; None drops one."""
    with np.load(folder / PRIOR) as f:
        arrays = {name: f[name] for name in f.files} | changed
    np.savez(folder / PRIOR, **{k: v for k, v in arrays.items() if v is not None})  # pyright: ignore


@pytest.mark.parametrize("name", [*ARRAYS, "meta"])
def test_an_array_of_the_prior_is_missing(folder, name):
    with_prior(folder, **{name: None})
    assert_named(folder, PRIOR, name)


@pytest.mark.parametrize("name", ARRAYS)
@pytest.mark.parametrize("spoilt", ["nan", "short", "text", "flat", "none"])
def test_an_array_of_the_prior_holds_no_such_numbers(folder, name, spoilt):
    with np.load(folder / PRIOR) as f:
        array = f[name]
    with_prior(
        folder,
        **{
            name: {
                "nan": np.where(array == array.flat[0], np.nan, array),
                "short": array[:-1],
                "text": array.astype(str),
                "flat": array.ravel()[:, None, None, None],
                "none": array[:0],
            }[spoilt]
        },
    )
    assert_named(folder, PRIOR, name)


def scale(name, factor):
    return lambda c: {name: factor * getattr(c, name)}


PRIORS = {
    "box_size": scale("box_size", -1),
    "areas": scale("areas", 0),
    "points": scale("points", 5),
    "normals": scale("normals", 0.5),
    "box_center": lambda c: {"box_center": c.box_center + 0.1},
    "frontal_area": lambda c: {"frontal_area": -1.0},
    "kind": lambda c: {"joints": (replace(c.joints[0], kind="ball"), *c.joints[1:])},
    "axis": lambda c: {"joints": (replace(c.joints[0], axis=(1, 1, 0)), *c.joints[1:])},
    "pivot": lambda c: {"joints": (replace(c.joints[0], pivot=(0, 99, 0)), *c.joints[1:])},
    "limits": lambda c: {"joints": (replace(c.joints[0], limits=(1, 0)), *c.joints[1:])},
    "meta": lambda c: {"part_names": c.part_names[:1] * len(c.part_names)},
}


@pytest.mark.parametrize("field", PRIORS)
def test_priors_that_cannot_be_true(folder, field):
    category = Dataset.open(folder).category
    replace(category, mirror=None, **PRIORS[field](category)).save(folder / PRIOR)
    assert_named(folder, PRIOR, field)


@pytest.mark.parametrize(
    "spoilt",
    [
        Path.unlink,
        lambda p: p.write_bytes(b""),
        lambda p: p.write_bytes(p.read_bytes()[:-30]),
        lambda p: p.write_bytes(p.read_bytes()[30:]),
        lambda p: p.write_text("no prior"),
        lambda p: (np.save(p.with_suffix(".npy"), np.zeros(3)), p.with_suffix(".npy").rename(p)),
        lambda p: np.savez(p, meta=json.dumps({"name": "x"})),
    ],
    ids=["missing", "empty", "cut", "beheaded", "text", "npy", "half"],
)
def test_priors_that_are_none(folder, spoilt):
    spoilt(folder / PRIOR)
    found = faults(folder)
    assert [f.file for f in found] == [str(folder / PRIOR)]


# Hashes ----------------------------------------------------------------------------------------


def test_a_sound_dataset_passes(sound):
    assert faults(sound) == []
    (sound / SUMS).rename(sound / "x")
    assert faults(sound) == []
    (sound / "x").rename(sound / SUMS)


def test_any_flipped_bit_is_found_by_the_hashes_and_never_raises(sound, tmp_path):
    rng = np.random.default_rng(0)
    shutil.copytree(sound, folder := tmp_path / "data")
    for name in 20 * [FIRST, SECOND, PRIOR, MANIFEST]:
        whole = (folder / name).read_bytes()
        spoilt = bytearray(whole)
        spoilt[rng.integers(len(whole))] ^= 1 << int(rng.integers(8))
        (folder / name).write_bytes(spoilt)
        try:
            found = faults(folder)
        except InputError as error:  # the manifest itself cannot be found any more
            found = [Fault(str(folder / name), "", str(error))]
        assert any(Path(f.file.split(" row")[0]).name == name for f in found), name
        (folder / name).write_bytes(whole)


@pytest.mark.parametrize(
    ("spoilt", "file", "field"),
    [
        (lambda text: text.replace("category.npz", "categories.npz"), "categories.npz", ""),
        (lambda text: "0" * 64 + text[64:], PRIOR, ""),
        (lambda text: text + "what is this\n", SUMS, "line 5"),
        (lambda text: "".join(text.splitlines(keepends=True)[:-1]), SUMS, SECOND),
    ],
)
def test_hashes_that_are_not_of_these_files(sound, tmp_path, spoilt, file, field):
    shutil.copytree(sound, folder := tmp_path / "data")
    (folder / SUMS).write_text(spoilt((folder / SUMS).read_text()))
    assert_named(folder, file, field)
