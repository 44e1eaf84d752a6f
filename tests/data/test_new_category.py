"""The page on adding a category keeps its word: its first microwave is a category."""

import re
from pathlib import Path

import numpy as np
import pytest

from r2art.data.categories import microwave
from r2art.data.pose import root_T_part
from r2art.data.prior import category_prior

PAGE = Path(__file__).resolve().parents[2] / "docs" / "new_category.md"


@pytest.fixture(scope="module")
def first_microwave() -> dict:
    code, _ = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    names: dict = {}
    exec(code, names)
    return names


def test_the_page_s_file_makes_microwaves_whose_doors_open_to_the_user(first_microwave):
    instances = [first_microwave["generate"](np.random.default_rng(seed)) for seed in range(20)]
    for instance in instances:
        assert instance.part_names == ("body", "door")
        np.testing.assert_allclose(instance.part_boxes()[0][0], 0, atol=1e-12)
        T = root_T_part(instance.joints, np.array([np.pi / 2]))[1]
        door = np.concatenate([s.vertices for s in instance.parts[1]])
        end = door[np.argmax(door[:, 0])]
        assert (T[:3, :3] @ end + T[:3, 3])[2] > end[2] + 0.25
    prior = category_prior(instances, first_microwave["STAGING"])
    assert prior.joints[0].axis == (0.0, -1.0, 0.0)


def test_the_page_quotes_the_staging_of_the_real_file(first_microwave):
    _, quoted = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    names = dict(first_microwave)
    exec(quoted, names)
    assert names["STAGING"] == microwave.STAGING
