"""An export is laid out as BOP says, and its numbers are those of the samples."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from r2art.core.category import Category
from r2art.core.errors import UsageError
from r2art.data.bop import DEPTH_SCALE, export_bop
from r2art.data.categories import make_instance, staging
from r2art.data.objects import Procedural, instance_seed
from r2art.data.prior import category_prior
from r2art.data.sample import Sample
from r2art.data.scenes.scene import make_sample
from r2art.data.scenes.surroundings import Surroundings

N, SIZE = 3, 96
PARTS = ("cabinet", "drawer_top", "drawer_middle", "drawer_bottom")


class Photos(list[Sample]):
    """Samples, as a source."""

    category: Category

    def file(self, index: int) -> str:
        return f"photo {index}"


@pytest.fixture(scope="module")
def photos() -> Photos:
    """The last of them without whole silhouettes, as real photos are."""
    objects, photos = Procedural("drawer"), Photos()
    for index in range(N):
        seed = instance_seed("drawer", "test", 0, index)
        rng = np.random.default_rng(seed)
        sample = make_sample(rng, objects.instance(seed), objects.staging, Surroundings(), SIZE)
        photos.append(replace(sample, amodal=_whole(sample) if index < N - 1 else None))
    photos.category = category_prior(
        [make_instance("drawer", seed) for seed in range(2)], staging("drawer")
    )
    return photos


def _whole(sample: Sample) -> np.ndarray:
    """What is seen, and a row of pixels more."""
    whole = np.zeros(sample.mask.shape, np.uint16)
    for part in range(len(PARTS)):
        seen = sample.mask == part + 1
        whole |= (seen | np.roll(seen, 1, axis=0)).astype(np.uint16) << part
    return whole


@pytest.fixture(scope="module")
def folder(photos, tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("bop") / "drawer"
    assert export_bop(photos, out, "test") == N
    return out


def read(path: Path):
    return json.loads(path.read_text())


def test_every_file_that_the_format_asks_for_is_there(folder):
    scene = folder / "test" / "000000"
    images = [f"{i:06d}.png" for i in range(N)]
    masks = [f"{i:06d}_{p:06d}.png" for i in range(N) for p in range(len(PARTS))]
    assert sorted(p.name for p in (scene / "rgb").iterdir()) == images
    assert sorted(p.name for p in (scene / "depth").iterdir()) == images
    assert sorted(p.name for p in (scene / "mask_visib").iterdir()) == masks
    assert sorted(p.name for p in (scene / "mask").iterdir()) == masks[: -len(PARTS)]
    for name in ("scene_camera", "scene_gt", "scene_gt_info", "scene_articulation"):
        assert list(read(scene / f"{name}.json")) == [str(i) for i in range(N)]
    models = sorted(p.name for p in (folder / "models").iterdir())
    assert models == ["models_info.json", *(f"obj_{p + 1:06d}.ply" for p in range(len(PARTS)))]
    assert (folder / "camera.json").is_file()


def test_poses_cameras_and_depth_are_those_of_the_samples(folder, photos):
    scene = folder / "test" / "000000"
    cameras, truths = read(scene / "scene_camera.json"), read(scene / "scene_gt.json")
    for i, sample in enumerate(photos):
        K = np.reshape(cameras[str(i)]["cam_K"], (3, 3))
        np.testing.assert_allclose(K[:2, 2] + 0.5, sample.camera.K[:2, 2], atol=1e-5)
        np.testing.assert_allclose(np.diag(K), np.diag(sample.camera.K), atol=1e-5)
        assert [entry["obj_id"] for entry in truths[str(i)]] == [1, 2, 3, 4]
        for entry, T in zip(truths[str(i)], sample.cam_T_part, strict=True):
            R, t = np.reshape(entry["cam_R_m2c"], (3, 3)), np.array(entry["cam_t_m2c"])
            np.testing.assert_allclose(R, T[:3, :3], atol=1e-8)
            np.testing.assert_allclose(t / 1000, T[:3, 3], atol=1e-8)
        assert cameras[str(i)]["depth_scale"] == DEPTH_SCALE
        steps = np.asarray(Image.open(scene / "depth" / f"{i:06d}.png")).astype(float)
        near = sample.depth < 13
        metres = steps * DEPTH_SCALE / 1000
        np.testing.assert_allclose(metres[near], sample.depth[near], atol=1.01e-4)


def test_masks_boxes_and_counts_agree(folder, photos):
    scene = folder / "test" / "000000"
    info = read(scene / "scene_gt_info.json")
    for i, sample in enumerate(photos):
        for part, facts in enumerate(info[str(i)]):
            name = f"{i:06d}_{part:06d}.png"
            seen = np.asarray(Image.open(scene / "mask_visib" / name))
            assert set(np.unique(seen)) <= {0, 255}
            np.testing.assert_array_equal(seen > 0, sample.mask == part + 1)
            assert facts["px_count_visib"] == (seen > 0).sum() <= facts["px_count_all"]
            assert facts["visib_fract"] == sample.visible[part]
            if sample.amodal is not None:
                whole = np.asarray(Image.open(scene / "mask" / name)) > 0
                assert facts["px_count_all"] == whole.sum()
                assert not (whole < (seen > 0)).any()
            if (seen > 0).any():
                x, y, w, h = facts["bbox_visib"]
                v, u = np.nonzero(seen)
                assert (x, y, x + w, y + h) == (u.min(), v.min(), u.max(), v.max())
            else:
                assert facts["bbox_visib"] == [-1, -1, -1, -1]


def test_models_are_the_mean_object_in_millimetres(folder, photos):
    info = read(folder / "models" / "models_info.json")
    for part, name in enumerate(PARTS):
        facts = info[str(part + 1)]
        assert facts["name"] == name
        lines = (folder / "models" / f"obj_{part + 1:06d}.ply").read_text().splitlines()
        start = lines.index("end_header") + 1
        points = np.array([line.split() for line in lines[start:]], float)[:, :3]
        assert lines[:2] == ["ply", "format ascii 1.0"]
        assert f"element vertex {len(points)}" in lines
        np.testing.assert_allclose(points / 1000, photos.category.points[part], atol=1e-5)
        extent = [facts[f"size_{axis}"] for axis in "xyz"]
        np.testing.assert_allclose(extent, np.ptp(points, axis=0), atol=0.01)
        assert max(extent) <= facts["diameter"] <= np.linalg.norm(extent)


def test_targets_are_the_parts_of_which_enough_is_seen(folder, photos):
    targets = read(folder / "test_targets_bop19.json")
    found = {(t["im_id"], t["obj_id"]) for t in targets}
    expected = {
        (i, part + 1)
        for i, sample in enumerate(photos)
        for part in np.flatnonzero(sample.visible >= 0.1).tolist()
    }
    assert found == expected
    assert found
    assert all(t["scene_id"] == 0 and t["inst_count"] == 1 for t in targets)


def test_a_folder_that_holds_something_is_refused(folder, photos):
    with pytest.raises(UsageError, match="is not empty"):
        export_bop(photos, folder)
