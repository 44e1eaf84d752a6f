"""What a camera does to radiance: mild, repeatable, and often nothing."""

import numpy as np
import pytest

from r2art.data.rendering.camera_effects import CLEAN, developed
from r2art.data.rendering.render import GAMMA

SIZE = 64
SEEDS = range(60)


@pytest.fixture(scope="module")
def view() -> tuple[np.ndarray, np.ndarray]:
    """Radiance with a soft pattern and one hard edge, and depth: near left, far right."""
    y, x = np.meshgrid(np.linspace(0, 1, SIZE), np.linspace(0, 1, SIZE), indexing="ij")
    tone = 0.25 + 0.1 * np.sin(5 * x) * np.cos(7 * y) + 0.2 * (x > 0.5)
    depth = np.where(x > 0.5, 4.0, 1.0)
    return np.repeat(tone[..., None], 3, axis=-1), depth


def photo(view, seed, focus=1.0):
    radiance, depth = view
    return developed(np.random.default_rng(seed), radiance, depth, focus)


def clean(view):
    return (255 * np.clip(view[0], 0, 1) ** (1 / GAMMA) + 0.5).astype(np.uint8)


def test_about_half_of_the_photos_are_clean(view):
    exact = [np.abs(photo(view, s).astype(int) - clean(view)).max() <= 1 for s in SEEDS]
    assert np.mean(exact) == pytest.approx(CLEAN, abs=0.2)


def test_effects_are_mild_and_repeatable(view):
    changes = []
    for seed in SEEDS:
        picture = photo(view, seed)
        assert picture.shape == (SIZE, SIZE, 3)
        assert picture.dtype == np.uint8
        assert picture.tobytes() == photo(view, seed).tobytes()
        changes.append(np.abs(picture.astype(float) - clean(view)).mean())
    assert max(changes) < 0.15 * 255
    assert np.mean(np.array(changes) > 1) > 0.2


def test_a_grey_wall_stays_a_wall_of_its_mean_brightness():
    wall = np.full((SIZE, SIZE, 3), 0.3), np.zeros((SIZE, SIZE))
    for seed in SEEDS:
        middle = photo(wall, seed)[16:-16, 16:-16].mean(axis=(0, 1)) / 255
        np.testing.assert_allclose(middle, 0.3 ** (1 / GAMMA), rtol=0.15)


def test_what_is_in_focus_is_sharper_than_what_is_not(view):
    rng = np.random.default_rng(0)
    texture = np.repeat(0.3 + 0.1 * rng.standard_normal((SIZE, SIZE, 1)), 3, axis=-1).clip(0, 1)
    pairs = []
    for seed in SEEDS:
        left, right = (photo((texture, view[1]), seed, focus) for focus in (1.0, 4.0))
        if left.tobytes() != right.tobytes():  # a photo with depth of field
            near, far = (np.s_[:, :24], np.s_[:, -24:])
            pairs.append((left[near].std() / left[far].std(), right[near].std() / right[far].std()))
    assert len(pairs) >= 2
    assert all(first > second for first, second in pairs)
