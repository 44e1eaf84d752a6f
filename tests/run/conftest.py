"""The model that ships with r2art, and a photo to show it."""

import numpy as np
import pytest
from PIL import Image, ImageFilter

import r2art


@pytest.fixture(scope="session")
def predictor():
    return r2art.load()


@pytest.fixture(scope="session")
def pixels():
    """A 320 × 240 photo of nothing in particular, without symmetry."""
    noise = np.random.default_rng(0).integers(0, 256, (240, 320, 3), np.uint8)
    smooth = np.array(Image.fromarray(noise).filter(ImageFilter.GaussianBlur(3)))
    smooth[60:180, 80:200] = (40, 44, 52)
    smooth[180:200, 70:220] = (150, 152, 155)
    return smooth
