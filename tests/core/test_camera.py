"""What a camera sees, told in angles."""

import numpy as np
import pytest

from r2art.core.camera import Camera


@pytest.mark.parametrize(("fx", "fy"), [(500, 500), (300, 700)])
def test_field_of_view_and_aspect_reach_the_edges_of_the_image(fx, fy):
    camera = Camera(fx, fy, 320, 120, 640, 240)
    up = np.tan(camera.fov_y / 2)
    corner = np.array([camera.aspect * up, up, 1.0])
    np.testing.assert_allclose(camera.project(corner), [640, 240])


def test_square_pixels_have_the_images_aspect():
    camera = Camera.from_fov(1.0, 400, 300)
    assert camera.aspect == pytest.approx(400 / 300)
    tall = Camera.from_fov(1.0, 300, 400)
    assert tall.fov_y == pytest.approx(1.0)  # across the longer side
