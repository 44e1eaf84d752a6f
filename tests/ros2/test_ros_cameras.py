"""A camera_info becomes the camera that sees every point where ROS says it is seen."""

import numpy as np
import pytest
from r2art_ros.cameras import camera_of, doubt_about_distortion
from ros_messages import camera_info

from r2art.core.errors import InputError

K = np.array([[610.0, 0, 321.5], [0, 605.0, 243.25], [0, 0, 1]])
POINTS = np.random.default_rng(0).uniform((-0.4, -0.3, 0.8), (0.4, 0.3, 2.0), (50, 3))


def ros_pixels(K):
    """Where points are seen, in pixels whose centres are whole numbers."""
    seen = POINTS @ K[:3, :3].T
    return seen[:, :2] / seen[:, 2:]


def test_the_centre_of_the_first_pixel_is_where_each_side_puts_it(types, raw, header):
    info = types.there_and_back(camera_info(raw, header, K, 640, 480))
    camera = camera_of(info, 640, 480)
    np.testing.assert_allclose(camera.project(POINTS) - 0.5, ros_pixels(K), atol=1e-9)


def test_region_and_binning_are_applied(raw, header):
    roi = (100, 40, 320, 240)
    info = camera_info(raw, header, K, 640, 480, roi=roi, binning=(2, 4))
    camera = camera_of(info, 160, 60)
    # A binned pixel covers 2 × 4 of the sensor's; edges, not centres, fall together.
    expected = (ros_pixels(K) + 0.5 - roi[:2]) / (2, 4)
    np.testing.assert_allclose(camera.project(POINTS), expected, atol=1e-9)


def test_a_rectified_image_is_seen_by_p(raw, header):
    P = np.array([[500.0, 0, 300, -30], [0, 500, 200, 0], [0, 0, 1, 0]])
    info = camera_info(raw, header, K, 640, 480, d=(0.1, -0.2, 0, 0, 0), P=P)
    camera = camera_of(info, 640, 480, rectified=True)
    np.testing.assert_allclose(camera.project(POINTS) - 0.5, ros_pixels(P), atol=1e-9)


def test_a_camera_that_is_not_calibrated_is_refused(raw, header):
    info = camera_info(raw, header, np.zeros((3, 3)), 640, 480)
    for rectified in (False, True):
        with pytest.raises(InputError, match=r"not calibrated.*camera_calibration"):
            camera_of(info, 640, 480, rectified=rectified)
    with pytest.raises(InputError, match="not calibrated"):
        camera_of(camera_info(raw, header, np.nan * K, 640, 480), 640, 480)


def test_a_camera_of_another_size_is_refused(raw, header):
    info = camera_info(raw, header, K, 640, 480)
    with pytest.raises(InputError, match=r"320×240.*640×480"):
        camera_of(info, 320, 240)


def test_distortion_is_told_where_it_bends_the_image(raw, header):
    bent = camera_info(raw, header, K, 640, 480, d=(0.1, -0.2, 0, 0, 0))
    told = doubt_about_distortion(bent, rectified=False)
    assert told is not None
    assert "plumb_bob" in told
    assert "rectified:=true" in told
    assert doubt_about_distortion(bent, rectified=True) is None
    straight = camera_info(raw, header, K, 640, 480, d=(0, 0, 0, 0, 0))
    assert doubt_about_distortion(straight, rectified=False) is None
