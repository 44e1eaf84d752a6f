"""Built objects on disk: the same bytes back, whatever happens to the files or beside us."""

import multiprocessing
import os
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from toy_models import CABINET

from r2art.data.models import cache, imported
from r2art.data.models.build import Built, Reading, build
from r2art.data.models.imported import Source
from r2art.data.models.urdf import read_urdf

PRINT = '<material name="p"><texture filename="p.png"/></material>'


FOLDER = cache.folder  # of the real thing; tests have their own


@pytest.fixture
def path(write, tmp_path):
    pixels = np.random.default_rng(0).integers(0, 255, (8, 8, 3), np.uint8)
    Image.fromarray(pixels).save(tmp_path / "p.png")
    mimic = '<axis xyz="1 0 0"/><mimic joint="hinge" multiplier="0.1" offset="0.15"/>'
    text = CABINET.replace("</visual>", f"{PRINT}</visual>").replace('<axis xyz="1 0 0"/>', mimic)
    return write(text)


def contents(built: Built) -> list:
    surfaces = [s for part in built.instance.parts for s in part]
    arrays = [a for s in surfaces for a in (s.vertices, s.faces, s.normals, s.uv)]
    looks = [(m.color, m.roughness, m.metallic, m.emission) for m in (s.material for s in surfaces)]
    pictures = [s.material.texture.tobytes() for s in surfaces if s.material.texture is not None]
    frames = [(name, part, T.tobytes()) for name, (part, T) in built.links.items()]
    return [
        [(a.dtype, a.shape, a.tobytes()) for a in arrays],
        looks,
        pictures,
        frames,
        built.base_T_root.tobytes(),
        (built.follows, built.instance.joints, built.instance.part_names, built.instance.category),
    ]


def kept(path: Path, key: str = "key") -> Built:
    return cache.kept(key, lambda: build(read_urdf(path)))


def refuse() -> Built:
    raise AssertionError("it was made again")


def test_what_was_kept_comes_back_to_the_byte(path, own_cache):
    first = contents(kept(path))
    assert contents(cache.kept("key", refuse)) == first
    assert first[2]  # pictures were among it
    assert [p.name for p in (own_cache / "models").iterdir()] == ["key.npz"]


@pytest.mark.parametrize("damage", ["empty", "cut", "flipped", "other"])
def test_a_damaged_file_is_made_again(path, own_cache, damage):
    first = contents(kept(path))
    (file,) = own_cache.rglob("*.npz")
    whole = bytearray(file.read_bytes())
    if damage == "flipped":
        whole[len(whole) // 2] ^= 0xFF
    cut = {"empty": 0, "cut": len(whole) // 3}.get(damage, len(whole))
    file.write_bytes(b"{}" if damage == "other" else whole[:cut])
    assert contents(kept(path)) == first
    assert contents(cache.kept("key", refuse)) == first


def test_without_a_place_to_keep_it_an_object_is_built_all_the_same(path, tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    monkeypatch.setattr(cache, "folder", lambda: blocked)
    assert contents(kept(path)) == contents(build(read_urdf(path)))


def test_a_full_disk_leaves_nothing_behind(path, own_cache, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    assert contents(kept(path)) == contents(build(read_urdf(path)))
    assert not list((own_cache / "models").iterdir())


def _write_often(path: Path, folder: Path) -> int:
    """Write and read one file many times over; how often it was not there, whole."""
    built = build(read_urdf(path))
    content, missed = cache._encoded(built), 0
    for _ in range(60):
        cache._write(folder / "key.npz", content)
        missed += contents(cache._decoded((folder / "key.npz").read_bytes())) != contents(built)
    return missed


def test_many_writers_never_leave_a_torn_file(path, own_cache):
    with multiprocessing.get_context("spawn").Pool(3) as pool:
        assert pool.starmap(_write_often, [(path, own_cache)] * 3) == [0, 0, 0]
    assert [p.name for p in own_cache.iterdir()] == ["key.npz"]


def test_every_setting_and_every_file_has_an_object_of_its_own(path, own_cache):
    for sha, reading in (
        ("a", Reading()),
        ("b", Reading()),
        ("a", Reading(up="y")),
        ("a", Reading(fix=("slide",))),
        ("a", Reading(triangles=500)),
    ):
        imported.built(Source(path, "urdf", sha), reading)
    assert len(list(own_cache.rglob("*.npz"))) == 5


def test_the_folder_is_the_users_cache(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert tmp_path / "r2art" == FOLDER()
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert Path.home() / ".cache" / "r2art" == FOLDER()
