"""A camera's faults leave what a picture shows, and JPEG's are those of a codec."""

import io

import numpy as np
import pytest
import torch
from PIL import Image

from r2art.learn import faults
from r2art.learn.chance import Chance

S = 96


def chance() -> Chance:
    return Chance(0, torch.device("cpu"))


def test_faults_keep_what_the_picture_shows():
    """A bright half stays the brighter one, whatever the camera does."""
    image = torch.full((64, 3, 32, 32), -0.5)
    image[..., 16:] = 0.5
    faulty = faults.camera_faults(image, chance())
    left, right = faulty[..., :14].mean(dim=(1, 2, 3)), faulty[..., 18:].mean(dim=(1, 2, 3))
    assert torch.all(right > left)
    assert faulty.std(dim=0).mean() > 0.1  # every camera has faults of its own


def test_blur_keeps_the_mean_and_only_ever_smooths():
    x = torch.rand(32, 3, 24, 24)
    smooth = faults.blurred(x, chance())
    torch.testing.assert_close(smooth.mean(dim=(1, 2, 3)), x.mean(dim=(1, 2, 3)), atol=0.02, rtol=0)
    ratio = smooth.std(dim=(1, 2, 3)) / x.std(dim=(1, 2, 3))
    assert torch.all(ratio < 1.001)
    assert torch.count_nonzero(ratio > 0.999) > 5  # some stay sharp
    assert torch.count_nonzero(ratio < 0.7) > 5


def texture(*, coloured: bool) -> np.ndarray:
    """A picture of details of every size, in bytes."""
    rng, picture = np.random.default_rng(0), np.zeros((S, S, 3))
    for cells in (3, 6, 12, 24, 48):
        bytes_ = rng.integers(0, 256, (cells, cells, 3), np.uint8)
        picture += np.asarray(Image.fromarray(bytes_).resize((S, S), Image.Resampling.BICUBIC))
    if not coloured:
        picture = picture.mean(axis=2, keepdims=True).repeat(3, axis=2)
    low, high = picture.min(), picture.max()
    return (255 * (picture - low) / (high - low)).round().astype(np.uint8)


def by_codec(picture: np.ndarray, quality: int) -> np.ndarray:
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "JPEG", quality=quality)
    return np.asarray(Image.open(file), float)


def by_us(picture: np.ndarray, *quality: float) -> np.ndarray:
    x = torch.from_numpy(picture).permute(2, 0, 1).float() / 255
    found = faults.recompressed(x.expand(len(quality), 3, S, S), torch.tensor(quality))
    return 255 * found.permute(0, 2, 3, 1).numpy()


@pytest.mark.parametrize("coloured", [False, True])
def test_compression_loses_what_a_codec_loses(coloured):
    picture, qualities = texture(coloured=coloured), (30, 50, 80)
    losses = []
    for quality, found in zip(qualities, by_us(picture, *qualities), strict=True):
        expected = by_codec(picture, quality)
        losses.append(np.abs(expected - picture).mean())
        assert np.abs(found - expected).mean() < 0.25 * losses[-1], quality
        assert np.abs(found - picture).mean() == pytest.approx(losses[-1], rel=0.05)
    assert losses[0] > losses[1] > losses[2] > 2


def test_compression_of_the_best_quality_loses_next_to_nothing():
    picture = texture(coloured=False)
    (found,) = by_us(picture, 100)
    assert np.abs(found - picture).max() < 2.5  # of 255
    assert np.abs(found - picture).mean() < 0.5
    (white,) = by_us(np.full_like(picture, 255), 25)
    assert white == pytest.approx(255, abs=1)
