"""The camera that is guessed when nobody tells it."""

from dataclasses import replace

import numpy as np
import pytest

from r2art.core.camera import Camera
from r2art.core.image import crop_square
from r2art.run.guess import GUESSED_FOVS, best_camera, cameras, fit

WIDTH, HEIGHT = 320, 240
BOX = (60.0, 40.0, 260.0, 200.0)


def a_part(z):
    """A box of 0.4 × 0.3 × 0.3 m, seen head on from ``z`` metres."""
    T = np.eye(4)
    T[2, 3] = z
    return {
        "cam_T_part": T[None],
        "box_center": np.zeros((1, 3)),
        "box_size": np.array([[0.4, 0.3, 0.3]]),
    }


def box_of(part, camera):
    half = part["box_size"][0] / 2
    near = part["cam_T_part"][0, 2, 3] - half[2]
    (u,), (v,) = camera.fx * half[:1] / near, camera.fy * half[1:2] / near
    return camera.cx - u, camera.cy - v, camera.cx + u, camera.cy + v


def test_a_pose_fits_the_box_it_projects_to():
    camera = Camera(300, 300, 160, 120, WIDTH, HEIGHT)
    part = a_part(1.0)
    x1, y1, x2, y2 = box_of(part, camera)
    assert fit(part, camera, (x1, y1, x2, y2)) == pytest.approx(1)
    assert fit(part, camera, (x1, y1, x1 + (x2 - x1) / 2, y2)) == pytest.approx(0.5)
    assert fit(part, camera, (x2 + 1, y1, x2 + 9, y2)) == 0
    assert fit(a_part(0.1), camera, (x1, y1, x2, y2)) == 0, "a corner lies behind the camera"


@pytest.mark.parametrize("true", range(len(GUESSED_FOVS)))
def test_the_camera_is_the_one_through_which_the_pose_fits(true):
    """An estimator that is right through the true camera only, and too near through the others."""
    everyone = list(cameras(WIDTH, HEIGHT))
    pixels = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    view = crop_square(pixels, everyone[0], BOX, 160, 1.25)
    right = crop_square(pixels, everyone[true], BOX, 160, 1.25).camera
    part = a_part(1.2)
    box = box_of(part, right)

    def poses(seen):
        same = [np.isclose(camera.fx, right.fx) for camera in seen]
        others = [a_part(1.0 * camera.fx / right.fx) for camera in seen]
        return [part if s else other for s, other in zip(same, others, strict=True)]

    camera, outputs = best_camera(view, WIDTH, HEIGHT, box, poses)
    assert camera == everyone[true]
    assert outputs is part


def test_in_doubt_it_is_the_first(predictor, pixels):
    view = crop_square(pixels, next(cameras(WIDTH, HEIGHT)), BOX, 160, 1.25)
    nowhere = {**a_part(1.0), "cam_T_part": np.eye(4)[None]}
    camera, _ = best_camera(
        view, WIDTH, HEIGHT, (0, 0, 160, 160), lambda seen: [nowhere] * len(seen)
    )
    assert camera == next(cameras(WIDTH, HEIGHT))


def test_the_first_camera_is_the_crops_own(pixels):
    first = next(cameras(WIDTH, HEIGHT))
    view = crop_square(pixels, first, BOX, 160, 1.25)
    seen = []

    def poses(cameras):
        seen.extend(cameras)
        return [a_part(1.0)] * len(cameras)

    best_camera(replace(view, camera=first), WIDTH, HEIGHT, (0, 0, 160, 160), poses)
    np.testing.assert_allclose(seen[0].K, view.camera.K)
