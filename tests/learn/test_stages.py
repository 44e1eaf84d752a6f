"""The log of every sample's stage, its picture, and the picture of silhouettes."""

import io
from dataclasses import replace

import numpy as np
import pytest
import torch
from PIL import Image

from r2art.learn.augment import crops
from r2art.learn.chance import Chance
from r2art.learn.objective import true_shape
from r2art.learn.silhouette_sheet import ESTIMATED, TILE, TRUE, silhouette_sheet
from r2art.learn.stages import (
    LOG,
    PICTURE,
    StageLog,
    forget_stages_after,
    history,
    plot_stages,
    read_stages,
)
from r2art.method.depth import translation_targets, viewing_ray
from r2art.method.estimate import share_from_state
from r2art.method.outputs import RawEstimate
from r2art.method.rotation import egocentric_to_allocentric
from r2art.method.shape import Prior, deformation_of


def note(log: StageLog, step: int, name: str, *pairs: tuple[int, int]) -> None:
    samples, stages = (torch.tensor(v) for v in zip(*pairs, strict=True))
    log.add(step, name, samples, stages)


@pytest.fixture
def folder(tmp_path):
    log = StageLog(tmp_path)
    note(log, 1, "laptop", (7, 1), (3, 2))
    note(log, 2, "drawer", (0, 1), (5, 1))
    log.write()
    note(log, 5, "laptop", (3, 3), (3, 3), (9, 2))
    log.write()
    log.write()
    return tmp_path


def test_what_was_noted_is_read_back(folder):
    read = read_stages(folder)
    assert list(read) == ["drawer", "laptop"]
    assert read["drawer"].tolist() == [[2, 0, 1], [2, 5, 1]]
    assert read["laptop"].tolist() == [[1, 7, 1], [1, 3, 2], [5, 3, 3], [5, 3, 3], [5, 9, 2]]


def test_a_resumed_run_forgets_what_it_will_write_again(folder):
    forget_stages_after(folder, 2)
    assert read_stages(folder)["laptop"].tolist() == [[1, 7, 1], [1, 3, 2]]
    forget_stages_after(folder, 0)
    assert read_stages(folder) == {}
    assert (folder / LOG).read_text() == ""
    plot_stages(folder)
    assert not (folder / PICTURE).exists()


def test_the_history_keeps_a_stage_until_the_sample_is_seen_again(folder):
    rows = read_stages(folder)["laptop"]
    table = history(rows, np.array([3, 7, 9]), columns=5)
    assert table.tolist() == [[2, 2, 2, 2, 3], [1, 1, 1, 1, 1], [0, 0, 0, 0, 2]]
    assert history(rows, np.array([7]), columns=2).tolist() == [[1, 1]]


def test_the_picture_shows_a_line_per_sample(folder):
    plot_stages(folder)
    with Image.open(folder / PICTURE) as picture:
        colours = {rgb for _, rgb in picture.convert("RGB").getcolors(1 << 20)}
    for colour in ((0xD9,) * 3, (0xD5, 0x5E, 0), (0xF0, 0xC4, 0x19), (0, 0x9E, 0x73)):
        assert colour in colours


@pytest.fixture
def truth(photos):
    """A drawer's crops and what a perfect network would say of them."""
    some = photos["drawer"]
    prior = Prior.from_category(some.category)
    true = crops(some, torch.arange(4), 64, Chance(0, torch.device("cpu")), None, augment=False)
    root = true.cam_T_part[:, 0]
    facing = egocentric_to_allocentric(root[:, :3, :3], viewing_ray(true.box, true.K))
    phi, log_lambda = translation_targets(root[:, :3, 3], true.box, true.K, prior.frontal_area)
    deformation = deformation_of(prior, true.box_center, true.box_size)
    raw = RawEstimate(
        up=facing[..., 1],
        right=facing[..., 0],
        phi=phi,
        log_lambda=log_lambda,
        joint_share=share_from_state(true.joint_state, prior.kinematics.limits),
        log_scale=deformation.log_scale,
        center_shift=deformation.center_shift,
        confidence_logit=torch.zeros(true.box_size.shape[:2]),
    )
    assert true_shape(prior, true).points.isfinite().all()
    return prior, true, raw


def test_the_outlines_coincide_where_the_estimate_is_right(truth):
    prior, true, raw = truth

    def lines(raw: RawEstimate):
        with Image.open(io.BytesIO(silhouette_sheet(prior, raw, true))) as sheet:
            assert sheet.width == 4 * TILE
            pixels = np.asarray(sheet)
        return ((pixels == colour).all(-1).sum() for colour in (TRUE, ESTIMATED))

    green, pink = lines(raw)
    assert pink > 4 * TILE / 2  # drawn over the green ones
    assert green < 0.2 * pink
    green, pink = lines(replace(raw, phi=raw.phi + 0.2))
    assert green > 0.5 * pink > 0
