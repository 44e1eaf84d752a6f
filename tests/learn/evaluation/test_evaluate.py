"""A dataset of hand-made labels, evaluated by predictors whose errors are known."""

import contextlib
import csv
import io
import itertools
import json
from dataclasses import fields, replace

import numpy as np
import pytest
from hand_made import make_category, sample_of, write_dataset
from PIL import Image

from r2art.core.errors import InputError, UsageError
from r2art.data.bop import MM
from r2art.data.source import Fault
from r2art.learn.evaluation import scores as scores_module
from r2art.learn.evaluation.calibration import reject
from r2art.learn.evaluation.causes import causes, groups
from r2art.learn.evaluation.evaluate import evaluate
from r2art.learn.evaluation.report import Evaluation, run_eval
from r2art.learn.evaluation.scores import Scores, truth
from r2art.learn.evaluation.summary import summarise
from r2art.learn.evaluation.testsets import TestSet, open_testsets

N = 24


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    category = make_category()
    samples = [sample_of(category, i) for i in range(N)]
    return write_dataset(tmp_path_factory.mktemp("data") / "box-test", category, samples)


@pytest.fixture
def test(folder) -> TestSet:
    return open_testsets(folder)[0]


def labels(test):
    """The predictor that makes no error."""
    return lambda sample, given_box: truth(sample, test.source.category)


def scaled(test, factor):
    """The predictor that sees everything ``factor`` times as large and as far away."""
    return lambda sample, given_box: truth(sample, test.source.category).scaled(factor, "prior")


SHARES = (
    "overlap",
    "overlap_aligned",
    "scale",
    "box",
    "category",
    "confidence",
    "state_confidence",
)
FACTS = (
    *("seconds", "diameter", "diagonal", "azimuth", "elevation"),
    *("visible", "box_side", "inside", "true_state", "state_range"),
)


def test_truth_is_perfect_in_every_measure(test):
    report = evaluate(test, labels(test))
    for mode in (report.given, report.found):
        for field in fields(Scores):
            values = getattr(mode.scores, field.name)
            if field.name in SHARES:
                np.testing.assert_allclose(values, 1, atol=1e-9, err_msg=field.name)
            elif field.name not in FACTS:
                expected = np.zeros_like(values)
                if field.name in ("pivot", "pivot_aligned"):
                    expected[:, 1] = np.nan  # what slides has no pivot
                np.testing.assert_allclose(values, expected, atol=1e-9, err_msg=field.name)
    summary = summarise(report.given.scores, test.source.category)
    for poses in (summary.whole.plain, summary.whole.aligned):
        assert poses.auc_100mm.value == pytest.approx(1)
        assert poses.auc_diameter.value == pytest.approx(1)
        assert poses.overlap.mean.value == pytest.approx(1)
    assert summary.failures == 0
    assert summary.calibration.error.value == 0


@pytest.mark.parametrize("factor", [0.8, 1.1])
def test_a_scene_at_the_wrong_scale_is_wrong_in_lengths_and_right_once_aligned(test, factor):
    s = evaluate(test, scaled(test, factor)).given.scores
    np.testing.assert_allclose(s.depth, abs(factor - 1), rtol=1e-9)
    np.testing.assert_allclose(s.scale, 1 / factor)
    assert np.all(s.add > 0.05)
    assert np.all(s.overlap < 0.9)
    assert np.any(s.state[:, 1] > 1e-3)
    for name in ("add_aligned", "add_s_aligned", "translation_aligned", "state_aligned"):
        np.testing.assert_allclose(getattr(s, name), 0, atol=1e-9, err_msg=name)
    np.testing.assert_allclose(s.pivot_aligned[:, 0], 0, atol=1e-9)
    np.testing.assert_allclose(s.overlap_aligned, 1, atol=1e-9)


def test_aligning_never_moves_model_points_further_away_in_the_mean_square(test):
    """It minimises just that, so that no other common factor, 1 among them, does better."""
    for index in range(5):
        sample = test.source[index]
        said = truth(sample, test.source.category).scaled(1.3, "prior")
        found = scores_module.score(sample, test.source.category, said)
        again = scores_module.score(
            sample, test.source.category, said.scaled(float(found.scale), "prior")
        )
        assert again.scale == pytest.approx(1)
        np.testing.assert_allclose(again.add, found.add_aligned, atol=1e-12)


def test_failures_count_as_failures(test):
    calls = iter(range(2 * N))

    def predict(sample, given_box):
        if next(calls) % 8 < 2:  # every fourth photo, in both modes
            raise InputError("the model gives no finite answer for this photo")
        return truth(sample, test.source.category)

    report = evaluate(test, predict)
    summary = summarise(report.given.scores, test.source.category)
    assert summary.failures == N / 4
    for poses in (summary.whole.plain, summary.whole.aligned):
        assert poses.auc_100mm.value == pytest.approx(0.75)
        assert poses.overlap.mean.value == pytest.approx(0.75)
        assert poses.add.p90 == np.inf
        assert poses.add.mean.value == pytest.approx(0, abs=1e-12)
    assert report.worst[0].badness == np.inf
    # A failure has confidence 0 and is wrong, so those are the first to be rejected.
    rejection = reject(report.given.scores, 0.25)
    assert (rejection.right, rejection.right_kept, rejection.wrong_removed) == (0.75, 1, 1)
    found = [g for c in causes(report.given.scores, report.category) for g in _groups(report, c)]
    assert len(found) >= 4
    assert {sum(g.failures for g in _groups(report, c)) for c in _causes(report)} == {N / 4}


def _causes(report):
    return causes(report.given.scores, report.category)


def _groups(report, cause):
    return groups(report.given.scores, report.category, cause)


def test_groups_share_out_all_photos_and_do_not_overlap(test):
    report = evaluate(test, scaled(test, 1.1))
    names = [cause.name for cause in _causes(report)]
    assert any("azimuth" in n for n in names)
    assert any("visible" in n for n in names)
    assert any("open" in n for n in names)
    for cause in _causes(report):
        found = _groups(report, cause)
        assert sum(g.images for g in found) == N
        assert all(a.high < b.low for a, b in itertools.pairwise(found))


def test_another_category_is_a_failure_but_its_box_still_counts(test):
    def predict(sample, given_box):
        right = truth(sample, test.source.category)
        return right if given_box else replace(right, category="sofa", box=(10, 8, 50, 24))

    report = evaluate(test, predict)
    found = summarise(report.found.scores, test.source.category)
    assert found.category_accuracy == 0
    assert found.failures == N
    assert found.box.median.value == pytest.approx(0.5)
    assert set(report.found.messages) == {"taken for a sofa"}
    assert set(report.given.messages) == {""}


def test_nothing_predicted_is_an_error(test):
    with pytest.raises(InputError, match="no photo could be predicted"):
        evaluate(test, lambda sample, given_box: None)


@pytest.mark.parametrize("limit", [0, -3])
def test_a_limit_below_one_is_refused(test, limit):
    with pytest.raises(UsageError, match="limit"):
        evaluate(test, labels(test), limit)


class Broken:
    """A source whose every third sample cannot be read."""

    def __init__(self, source):
        self.category, self.source = source.category, source

    def __len__(self):
        return len(self.source)

    def __getitem__(self, index):
        if index % 3 == 0:
            raise Fault("photos.json", f"photo {index}", "is missing")
        return self.source[index]

    def file(self, index):
        return self.source.file(index)


def test_samples_that_cannot_be_read_are_told_and_the_others_evaluated(test):
    broken = TestSet("broken", Broken(test.source), {}, "")
    report = evaluate(broken, labels(test), limit=7)
    assert report.indices == (1, 2, 4, 5)
    assert [b.split(":")[1].strip() for b in report.broken] == ["photo 0", "photo 3", "photo 6"]
    with pytest.raises(InputError, match="no photo of broken can be read"):
        evaluate(broken, labels(test), limit=1)


WRITTEN = 6


@pytest.fixture(scope="module")
def written(folder, tmp_path_factory):
    """Runs in which some photos fail: the folder of one, their page and what they printed."""
    test, home = open_testsets(folder)[0], tmp_path_factory.mktemp("report")
    model, out, results = home / "m.onnx", home / "out", home / "results.md"
    model.write_bytes(b"any file has a checksum")
    results.write_text("# Results\n\n<!-- begin speed -->\nkept\n<!-- end speed -->\n")

    def predict(sample, given_box):
        wrong = scaled(test, 1.05)(sample, given_box)
        return wrong if sample.joint_state[0] < 1.5 else None

    job = Evaluation(
        tests=[test],
        ask=lambda name: predict,
        model=model,
        limit=WRITTEN,
        results=results,
    )
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        run_eval(replace(job, tests=[test, replace(test, name="again")], limit=2))
        run_eval(replace(job, out=out))
    return out, results.read_text(), printed.getvalue()


def test_the_command_writes_tables_files_and_pictures(written, folder):
    out, page, shown = written
    assert "again" in shown
    for name in ("box", "box-test", "again"):  # by category where that is clear
        assert page.count(f"<!-- begin eval-{name} -->") == 1
    assert "kept" in page
    assert f"{WRITTEN} photos" in page
    assert "slide" in page
    assert str(folder.parent) not in page
    assert "r2art synth box -n 24 --seed 0 --split test --size 64 --out box-test" in page
    assert sorted(str(p.relative_to(out)) for p in out.rglob("*.*")) == sorted(
        [
            *("report.md", "report.json", "report.csv", "report.tex", "paper.csv"),
            *(
                f"box-test/{file}"
                for file in (
                    *("images.csv", "r2art-given_box-test.csv", "r2art-found_box-test.csv"),
                    *("errors.png", "histograms.png", "calibration.png", "worst.png"),
                )
            ),
        ]
    )
    for picture in out.rglob("*.png"):
        with Image.open(picture) as image:
            image.load()


def test_json_and_spreadsheets_agree(written):
    out, _, _ = written
    content = json.loads((out / "report.json").read_text())
    assert [d["name"] for d in content["datasets"]] == ["box-test"]
    given = content["datasets"][0]["given"]
    assert given["images"] == WRITTEN
    assert 0 < given["failures"] < WRITTEN
    assert [p["name"] for p in given["parts"]] == ["body", "lid", "tray"]
    rows = list(csv.DictReader((out / "box-test" / "images.csv").read_text().splitlines()))
    assert len(rows) == 2 * WRITTEN
    depths = [float(row["depth"]) for row in rows if row["mode"] == "given"]
    assert sum(np.isinf(depths)) == given["failures"]
    assert np.ptp([d for d in depths if np.isfinite(d)]) < 1e-5
    summary = list(csv.DictReader((out / "report.csv").read_text().splitlines()))
    found = [
        row
        for row in summary
        if (row["dataset"], row["mode"], row["of"], row["measure"])
        == ("box-test", "given", "lid", "auc_100mm_aligned")
    ]
    assert len(found) == 1
    auc = given["parts"][1]["aligned"]["auc_100mm"]["value"]
    assert float(found[0]["mean"]) == pytest.approx(auc, rel=1e-4)
    assert auc == pytest.approx(1 - given["failures"] / WRITTEN)


def test_bop_results_hold_the_poses_of_what_was_predicted(written, test):
    out, _, _ = written
    rows = list(
        csv.DictReader((out / "box-test" / "r2art-given_box-test.csv").read_text().splitlines())
    )
    assert list(rows[0]) == ["scene_id", "im_id", "obj_id", "score", "R", "t", "time"]
    failures = sum(test.source[i].joint_state[0] >= 1.5 for i in range(WRITTEN))
    assert len(rows) == 3 * (WRITTEN - failures)
    for row in rows:
        pose = test.source[int(row["im_id"])].cam_T_part[int(row["obj_id"]) - 1]
        np.testing.assert_allclose(
            np.array(row["R"].split(), float), pose[:3, :3].ravel(), atol=1e-8
        )
        t = np.array(row["t"].split(), float)
        np.testing.assert_allclose(t, 1.05 * MM * pose[:3, 3], atol=1e-5)


def test_json_on_stdout_is_the_report(test, tmp_path, capsys):
    model = tmp_path / "m.onnx"
    model.write_bytes(b"model")
    job = Evaluation(
        tests=[test], ask=lambda name: labels(test), model=model, limit=2, as_json=True
    )
    run_eval(job)
    content = json.loads(capsys.readouterr().out)
    assert content["datasets"][0]["given"]["whole"]["plain"]["add"]["median"]["value"] < 1e-9


def test_two_datasets_of_one_name_are_refused(test, tmp_path):
    job = Evaluation(tests=[test, test], ask=lambda name: labels(test), model=tmp_path)
    with pytest.raises(UsageError, match="two datasets are called box-test"):
        run_eval(job)
