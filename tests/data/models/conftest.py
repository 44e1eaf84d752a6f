"""Small models, and a cache of their own for every test."""

import pytest
import trimesh

from r2art.data.models import cache, imported


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory, monkeypatch):
    """A cache that nobody else writes to."""
    folder = tmp_path_factory.mktemp("cache")
    monkeypatch.setattr(cache, "folder", lambda: folder)
    imported.built.cache_clear()
    return folder


@pytest.fixture
def write(tmp_path):
    """Write a text file, return its path."""

    def to_file(text, name="model.urdf"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    return to_file


@pytest.fixture
def mesh_file(tmp_path):
    """Write a box of the given extents as a mesh, return its path."""

    def to_file(name, extents=(0.1, 0.2, 0.3)):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        trimesh.creation.box(extents=extents).export(path)
        return path

    return to_file
