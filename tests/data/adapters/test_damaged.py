"""Damaged files of other datasets: each is named, none passes, nothing else is ever raised."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import artimage_files
import numpy as np
import pytest
import reart_files
from adapter_scenes import laptop, photograph
from damage import (
    at,
    changed,
    name_of,
    wrong_arrays,
    wrong_text,
    wrong_transformations,
    wrong_values,
)

from r2art.data.adapters import open_source
from r2art.data.checking.check import check
from r2art.data.source import Fault

Spoilt = tuple[tuple[str | int, ...], Any]
MANY = 300


@pytest.fixture(scope="module")
def truths() -> list:
    return [photograph(laptop(seed), np.array([1.6 - 0.5 * seed])) for seed in range(2)]


def art_model(seed: int) -> artimage_files.Model:
    return artimage_files.Model(
        urdf_id=9748 + seed, raw_R_ours=np.eye(3), shift=np.array([0.1, 0.2, 0.3]), rest=(20.0,)
    )


def reart_model(seed: int) -> reart_files.Model:
    return reart_files.Model(urdf_id=seed, theirs_R_ours=np.eye(3), shift=np.full(3, 0.1))


def write_artimage(root: Path, truths: list) -> Path:
    models = [(art_model(seed), truth) for seed, truth in enumerate(truths)]
    return artimage_files.write(root, "laptop", models)


def write_reart(root: Path, truths: list) -> Path:
    models = [reart_model(seed) for seed in range(len(truths))]
    entries = [reart_files.entry(m, t) for m, t in zip(models, truths, strict=True)]
    reart_files.write_metas(root, entries)
    reart_files.write_camera(root, truths[0])
    home = root / "box_train"
    for seed, (model, truth) in enumerate(zip(models, truths, strict=True)):
        instances = [reart_files.instance(model, truth, 1)]
        reart_files.write_frame(home, f"s/{seed:06d}", truth, instances)
    return home


def of_artimage(tree: Any) -> Iterator[Spoilt]:
    """What can be wrong with an annotation of ArtImage."""
    first, second = (("instances", 0, "links", k) for k in (0, 1))  # the lid, the base
    for link in (first, second):
        yield from wrong_transformations(tree, (*link, "transformation"))
    ids = ("link_category_id",)
    yield first, changed(changed(tree, first + ids, 0), second + ids, 1)
    yield first, changed(tree, first + ids, 0)
    yield second, changed(tree, second + ids, 1)
    yield first, changed(tree, first + ids, 7)
    yield first, changed(tree, first + ids, -1)
    for state in (0.9, -40.0, 500.0, 1e9):  # of 1.6 rad
        yield (*first, "state"), changed(tree, (*first, "state"), state)
    yield (*second, "state"), changed(tree, (*second, "state"), 12.0)
    yield from wrong_frames(tree)
    yield ("instances", 0, "urdf_id"), changed(tree, ("instances", 0, "urdf_id"), 123456)
    yield ("instances", 0, "urdf_id"), changed(tree, ("instances", 0, "urdf_id"), 9749)
    for path in ("color/none.jpg", "/etc/passwd", "../../../x.jpg", "color", "a\0b", "train.txt"):
        yield ("color_path",), changed(tree, ("color_path",), path)
    for path in ("depth/none.png", "color/000000.jpg", "category_mask/000000.png", "deep"):
        yield ("depth_path",), changed(tree, ("depth_path",), path)
    yield from wrong_arrays(tree, skip=("segmentation",))
    yield from wrong_text(tree)
    yield from wrong_values(tree, skip=("segmentation",))


def of_reart(tree: Any) -> Iterator[Spoilt]:
    """What can be wrong with an annotation of ReArt."""
    first, second = (("instances", 0, "links", k) for k in (0, 1))  # the lid, the base
    for link in (first, second):
        yield from wrong_transformations(tree, (*link, "transformation"))
        path = (*link, "segmentation")
        for polygons in (
            [[1, 2, 3]],
            [[0, 0, 9, 0, 9, 9]],
            [[1e9] * 6],
            "x",
            {"counts": 3},
            [[[1]]],
        ):
            yield path, changed(tree, path, polygons)
    ids = ("link_category_id",)
    yield first, changed(changed(tree, first + ids, 1), second + ids, 2)
    yield first, changed(tree, first + ids, 1)
    yield second, changed(tree, second + ids, 2)
    yield first, changed(tree, first + ids, 9)
    yield from wrong_frames(tree)
    for number in (0, 7, -3):
        yield (
            ("instances", 0, "category_id"),
            changed(tree, ("instances", 0, "category_id"), number),
        )
    yield ("instances", 0, "urdf_id"), changed(tree, ("instances", 0, "urdf_id"), 77)
    yield ("instances", 0, "urdf_id"), changed(tree, ("instances", 0, "urdf_id"), 1)
    for key in ("color_path", "depth_path"):
        for path in ("s/none.png", "/etc/passwd", "../../x.jpg", "a\0b", "s"):
            yield (key,), changed(tree, (key,), path)
    yield from wrong_arrays(tree, skip=("segmentation", "id"))
    yield from wrong_text(tree)
    for path, spoilt in wrong_values(tree, skip=("segmentation", "id")):
        # Without paths the usual places are meant, and frames may show nothing.
        if not isinstance(spoilt, dict) or (
            {"color_path", "depth_path"} <= set(spoilt) and spoilt.get("instances") != []
        ):
            yield path, spoilt


def wrong_frames(tree: Any) -> Iterator[Spoilt]:
    """Sizes and 2D boxes that cannot be."""
    for key in ("width", "height"):
        for size in (0, -96, 640, 97, 128.5):
            yield (key,), changed(tree, (key,), size)
    x1, y1, x2, y2 = tree["instances"][0]["bbox"]
    boxes = ([x2, y1, x1, y2], [x1, y2, x2, y1], [0, 0, 0, 0], [x1, y1, x2 - x1, y2 - y1])
    for box in (*boxes, [x2, y2, x2 + 40, y2 + 40], [-500, -500, 900, 900]):
        yield ("instances", 0, "bbox"), changed(tree, ("instances", 0, "bbox"), box)


def write_spoilt(path: Path, content: Any) -> None:
    path.write_bytes(content if isinstance(content, bytes) else json.dumps(content).encode())


def is_about(fault: Fault, path: tuple[str | int, ...], annotation: Path) -> bool:
    """Whether a fault names an annotation, and where it can be told the field."""
    if str(annotation) not in fault.file:
        return False
    spoilt, near = name_of(path), name_of(path[:-1])
    # Where a value may be right by itself, what does not fit it is named.
    fitting = ("cam_T_part", "mask", "depth", "box", "joint_state", "visible", "instances[0].bbox")
    return fault.field in fitting or fault.field.startswith(near) or spoilt.startswith(fault.field)


@pytest.mark.parametrize("dataset", ["artimage", "reart"])
def test_each_of_many_damaged_annotations_is_named_with_its_field(tmp_path, truths, dataset):
    if dataset == "artimage":
        home = write_artimage(tmp_path, truths)
        folder, kinds = home / "train" / "annotations", of_artimage
    else:
        home = write_reart(tmp_path, truths)
        folder, kinds = home / "annotations" / "s", of_reart
    sound = json.loads((folder / "000000.json").read_text())
    assert list(check(open_source(tmp_path, split="train"))) == []
    damaged = list(kinds(sound))
    assert len(damaged) >= MANY
    for number, (_, content) in enumerate(damaged):
        write_spoilt(folder / f"{number + 1000:06d}.json", content)
    if dataset == "artimage":
        names = sorted(path.name for path in folder.iterdir())
        (home / "train.txt").write_text("\n".join(names))
    faults = list(check(open_source(tmp_path, split="train")))
    assert not [f for f in faults if "00000.json" in f.file or "00001.json" in f.file]
    for number, (path, content) in enumerate(damaged):
        annotation = folder / f"{number + 1000:06d}.json"
        named = [fault for fault in faults if is_about(fault, path, annotation)]
        told = [str(fault) for fault in faults if annotation.name in str(fault)]
        assert named, (number, name_of(path), told, content if path == () else at(content, path))


def told(root: Path) -> list[Fault]:
    """All faults, those of opening included."""
    try:
        return list(check(open_source(root, split="train")))
    except Fault as fault:
        return [fault]


def spoilt_files(root: Path, home: Path, dataset: str) -> dict[Path, list[Any]]:
    """By file, other than annotations: contents that it must not have."""
    camera = json.loads((root / "camera_intrinsic.json").read_text())
    files: dict[Path, list[Any]] = {
        root / "camera_intrinsic.json": [
            *(spoilt for _, spoilt in wrong_values(camera)),
            *(spoilt for _, spoilt in wrong_arrays(camera)),
            *(spoilt for _, spoilt in wrong_text(camera)),
            changed(camera, ("intrinsic_matrix", 0), 0),
            changed(camera, ("intrinsic_matrix", 4), -100),
            changed(camera, ("intrinsic_matrix", 3), 0.5),
            {**camera, "intrinsic_matrix": np.reshape(camera["intrinsic_matrix"], (3, 3)).tolist()},
        ],
        root / "r2art.json": [
            {"up": "y"},
            {"up": "+y", "front": "-y"},
            {"fronts": "+z"},
            {"unit": 0},
            {"unit": "1"},
            {"closed": [0, 0, 0]},
            {"order": [0, 0]},
            {"left_handed": 1},
            [],
            3,
            b"{",
        ],
    }
    if dataset == "artimage":
        rest = json.loads((home / "urdf" / "rest_state.json").read_text())
        files[home / "urdf" / "rest_state.json"] = [
            # Objects without an entry rest at 0.
            *(s for _, s in wrong_values(rest) if not isinstance(s, dict) or len(s) == len(rest)),
            *(content for _, content in wrong_text(rest)),
        ]
        files |= spoilt_model(home / "urdf" / "9748")
    else:
        metas = json.loads((root / "urdf_metas.json").read_text())
        first = ("urdf_metas", 1)
        files[root / "urdf_metas.json"] = [
            *(
                s
                for p, s in wrong_values(metas, skip=("object_name",))
                if p[:2] in (first, first[:1])
            ),
            *(spoilt for path, spoilt in wrong_arrays(metas) if path[:2] == first),
            *(content for _, content in wrong_text(metas)),
            changed(metas, (*first, "joint_rpy"), [[0.0, 0.0, 0.0]]),
            changed(metas, (*first, "joint_types"), ["fixed"]),
            changed(metas, (*first, "joint_children"), [1]),
            changed(metas, (*first, "joint_parents"), [2]),
            changed(metas, (*first, "id"), 1),
        ]
    return files


def spoilt_model(home: Path) -> dict[Path, list[Any]]:
    """What can be wrong with an object of ArtImage."""
    urdf, points = home / "mobility_for_unity_align.urdf", home / "part_point_sample" / "1.xyz"
    text, rows = urdf.read_text(), points.read_text().splitlines()
    swaps = {
        'type="revolute"': ('type="ball"', 'type="fixed"', ""),
        'name="joint_1"': ('name="joint"', 'name="joint_2"', ""),
        "axis xyz": ("axis abc", "axles xyz"),
        'child link="1"/>': ('child link="1"/', ""),
        "</robot>": ("", "</robot", "</robot><robot>"),
    }
    return {
        urdf: [
            *(text.replace(old, new).encode() for old, news in swaps.items() for new in news),
            text.replace("</robot>", text[text.index('<joint name="joint_1') :]).encode(),
            *(text[: int(share * len(text))].encode() for share in (0, 0.2, 0.5, 0.9)),
            text.replace('axis xyz="', 'axis xyz="nan ').encode(),
            text.replace('axis xyz="', 'axis xyz="1 ').encode(),
            b"\xff\xfe",
        ],
        points: [
            b"",
            b"\x00\xff",
            "\n".join(rows[:3]).encode(),
            "\n".join([*rows[:9], "1 2"]).encode(),
            "\n".join([*rows[:9], "1 2 nan"]).encode(),
            "\n".join([*rows[:9], "1 2 x"]).encode(),
        ],
    }


@pytest.mark.parametrize("dataset", ["artimage", "reart"])
def test_every_other_file_is_named_too_when_damaged_or_gone(tmp_path, truths, dataset):
    home = (write_artimage if dataset == "artimage" else write_reart)(tmp_path, truths)
    for path, contents in spoilt_files(tmp_path, home, dataset).items():
        sound = path.read_bytes() if path.exists() else None
        for content in contents:
            write_spoilt(path, content)
            faults = told(tmp_path)
            about = [fault for fault in faults if path.name in str(fault)]
            geometry = [f for f in faults if f.field in ("cam_T_part", "mask", "depth")]
            assert about or geometry, (path, content, faults)
        path.unlink()
        if sound is not None:
            assert any(path.name in str(fault) for fault in told(tmp_path)), path
            path.write_bytes(sound)
    assert told(tmp_path) == []
