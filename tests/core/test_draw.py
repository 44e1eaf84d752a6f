"""Drawings show what is in front of the camera, where the camera sees it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from r2art.core.camera import Camera
from r2art.core.draw import EDGES, LARGEST, SMALLEST, draw, facing, joint_arrow
from r2art.core.errors import InputError
from r2art.core.image import Photo
from r2art.core.palette import PART_COLORS
from r2art.core.pen import clip_near


def grey_photo(camera, level=128):
    return Photo(np.full((camera.height, camera.width, 3), level, np.uint8))


def looks_like(pixels, color, tolerance=40):
    return (np.abs(pixels.astype(int) - color).max(axis=-1) < tolerance).any()


def test_a_box_has_twelve_edges_that_meet_in_threes():
    assert len(EDGES) == 12
    ends = [corner for edge in EDGES for corner in edge]
    assert {ends.count(corner) for corner in ends} == {3}


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(0.5, 5))
def test_a_box_seen_from_outside_shows_one_to_three_faces(x, y, z):
    from r2art.core.prediction import PartEstimate

    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    box = PartEstimate(
        name="box",
        cam_T_part=pose,
        box_center=np.zeros(3),
        box_size=np.full(3, 0.5),
        confidence=1.0,
    )
    seen = facing(box)
    assert 1 <= len(seen) <= 3
    assert (2, 0) in seen  # the face towards the camera
    assert len({axis for axis, _ in seen}) == len(seen)  # never a face and its opposite


def test_a_joints_arrow_spans_a_hinge_and_leaves_a_slide(laptop):
    (hinge,), lid = laptop.joints, laptop.part("lid")
    along = (lid.corners() - hinge.pivot) @ hinge.axis
    for kind in ("revolute", "prismatic"):
        ends = np.array(joint_arrow(replace(hinge, kind=kind), lid)) - hinge.pivot
        tail, tip = ends @ hinge.axis
        np.testing.assert_allclose(ends, np.outer([tail, tip], hinge.axis), atol=1e-12)
        assert tip > along.max()
        assert tail < along.min() if kind == "revolute" else tail == 0


polygons = arrays(float, (4, 3), elements=st.floats(-10, 10, width=16))


@given(polygons)
def test_clipping_keeps_what_lies_in_front_and_nothing_else(polygon):
    clipped = clip_near(polygon, 0.5)
    assert (clipped[:, 2] >= 0.5 - 1e-9).all()
    in_front = polygon[polygon[:, 2] >= 0.5]
    assert len(clipped) >= len(in_front)
    for point in in_front:
        assert (clipped == point).all(axis=1).any()


@pytest.mark.parametrize("level", [0, 255])
def test_every_corner_is_drawn_in_its_parts_colour(laptop, level):
    photo = grey_photo(laptop.camera, level)
    drawing = np.asarray(draw(laptop, photo))
    scale = SMALLEST / 640
    # Corners of edges away from the camera are dim; the front of the base is never hidden.
    for corner in laptop.part("base").corners()[:, 1, 1]:
        u, v = (scale * laptop.camera.project(corner)).astype(int)
        assert looks_like(drawing[v - 3 : v + 4, u - 3 : u + 4], PART_COLORS[0])
    assert (photo.pixels == level).all()


@pytest.mark.parametrize(
    ("width", "height"), [(40, 30), (640, 480), (480, 640), (2400, 1800), (900, 9), (9, 900)]
)
def test_drawings_have_a_comfortable_size_for_any_photo(laptop, width, height):
    camera = Camera(500, 500, width / 2, height / 2, width, height)
    drawing = draw(replace(laptop, camera=camera), grey_photo(camera))
    longer = np.clip(max(width, height), SMALLEST, LARGEST)
    assert drawing.mode == "RGB"
    assert drawing.width == max(round(width * longer / max(width, height)), longer // 2)
    assert drawing.height > round(height * longer / max(width, height))


@pytest.mark.parametrize("depth", [0.2, 0.05, 0.0, -0.3])
def test_an_object_around_or_behind_the_camera_does_no_harm(laptop, depth):
    shift = np.zeros((4, 4))
    shift[2, 3] = depth - 0.6
    parts = tuple(replace(p, cam_T_part=p.cam_T_part + shift) for p in laptop.parts)
    joints = tuple(replace(j, pivot=j.pivot + shift[:3, 3]) for j in laptop.joints)
    draw(replace(laptop, parts=parts, joints=joints), grey_photo(laptop.camera))


def test_a_photo_of_another_size_is_refused(laptop):
    with pytest.raises(InputError, match="480"):
        draw(laptop, Photo(np.zeros((480, 641, 3), np.uint8)))


def test_a_prediction_finds_its_photo_again(laptop, tmp_path, monkeypatch):
    from PIL import Image

    photo = grey_photo(laptop.camera, 200)
    monkeypatch.chdir(tmp_path)
    Image.fromarray(photo.pixels).save("laptop.png")
    from_file = replace(laptop, image_path="laptop.png").draw()
    from_memory = replace(laptop, image_path=None, photo=photo).draw()
    assert from_file.tobytes() == from_memory.tobytes() == laptop.draw(photo.pixels).tobytes()
    with pytest.raises(InputError, match="draw"):
        replace(laptop, image_path=None).draw()
