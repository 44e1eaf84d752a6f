"""A real server on a free port, around the model that ships with r2art."""

import numpy as np
import pytest
from PIL import Image
from serving import encoded, running

import r2art
from r2art.serve.limits import Limits


@pytest.fixture(scope="session")
def predictor():
    return r2art.load()


@pytest.fixture(scope="session")
def served(predictor):
    """A server of small limits: 0.2 MB, 0.1 megapixels."""
    with running(predictor, Limits(megabytes=0.2, megapixels=0.1, seconds=20)) as served:
        yield served


@pytest.fixture(scope="session")
def image():
    """A photo of 160 × 120 px, of nothing in particular."""
    rng = np.random.default_rng(0)
    coarse = Image.fromarray(rng.integers(0, 256, (12, 16, 3), np.uint8))
    return coarse.resize((160, 120), Image.Resampling.BICUBIC)


@pytest.fixture(scope="session")
def photo(image):
    return encoded(image)
