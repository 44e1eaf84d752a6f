"""The paper's figures, and ours beside them."""

import csv
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hand_made import make_arm, make_laptop, sample_of, write_dataset

from r2art.learn.evaluation.evaluate import evaluate
from r2art.learn.evaluation.paper import IN_PAPER, MEASURED, paper_csv, paper_tables, printed
from r2art.learn.evaluation.scores import truth
from r2art.learn.evaluation.tabulate import Result
from r2art.learn.evaluation.testsets import open_testsets

ROWS = [
    (table["number"], entry, row)
    for table in printed()
    for entry in table["categories"]
    for row in entry["rows"]
]


def test_every_table_is_there_whole():
    methods = {1: 25, 3: 10, 4: 2}
    assert {n: sum(t == n for t, _, _ in ROWS) for n in methods} == methods
    for number, entry, row in ROWS:
        for name in ("add", "auc") if number == 4 else ("add", "auc", "iou"):
            assert len(row[name]) == entry["parts"]


@pytest.mark.parametrize(("number", "entry", "row"), ROWS)
def test_no_error_is_smaller_than_its_area_allows(number, entry, row):
    """1 − AUC ≤ ADD / τ holds for every entry up to τ = 136.5 mm: a slip would show."""
    for add, auc in zip(row["add"], row["auc"], strict=True):
        assert 1 - auc / 100 <= add / 136.5


def test_means_that_the_paper_states_elsewhere():
    ours = {(n, e["category"]): r for n, e, r in ROWS if r["method"] == "R2-Art"}
    assert np.mean(ours[4, "robot_arm"]["add"]) == pytest.approx(47.1, abs=0.05)
    assert np.mean(ours[4, "robot_arm"]["auc"]) == pytest.approx(69.1, abs=0.05)
    assert np.mean(ours[1, "drawer"]["add"]) == pytest.approx(98.9, abs=0.05)
    assert np.mean(ours[1, "drawer"]["auc"]) == pytest.approx(71.95, abs=0.005)


def seen_too_large(folder) -> Result:
    """A dataset, evaluated by a predictor that sees all 1.1 times too large and far."""
    test = open_testsets(folder)[0]

    def predict(sample, given_box):
        return truth(sample, test.source.category).scaled(1.1, "prior")

    return Result.of(evaluate(test, predict))


@pytest.fixture(scope="module")
def result(tmp_path_factory) -> Result:
    category = make_laptop()
    samples = [sample_of(category, seed) for seed in range(8)]
    home = tmp_path_factory.mktemp("data")
    return seen_too_large(write_dataset(home / "laptop_&_co", category, samples))


def test_ours_stands_beside_the_papers_and_each_row_says_whose_it_is(result):
    tables = paper_tables([result])
    assert len(tables) == 1  # laptops are in Table 1 alone
    rows = tables[0].rows
    assert [row[2] for row in rows] == [IN_PAPER] * 5 + [MEASURED] * 2
    assert [row[3] for row in rows] == ["ArtImage"] * 5 + ["laptop_&_co"] * 2
    assert rows[4][5:8] == ("37.5, 49.2", "75.3, 70.3", "74.6, 49.2")
    plain, aligned = rows[5:]
    assert all(float(v) > 20 for v in plain[5].split(", "))
    assert aligned[5:8] == ("0.0, 0.0", "100.0, 100.0", "100.0, 100.0")
    share = float(rows[4][8].split(", ")[0])
    assert share == pytest.approx(100 * 37.5 / (1000 * math.hypot(1.32, 0.89, 1.17)), abs=0.05)


def test_categories_with_other_parts_do_not_belong_to_a_table(result):
    three = replace(result.given, parts=result.given.parts + result.given.parts[:1])
    assert paper_tables([replace(result, given=three)]) == ()


def test_an_arms_parts_are_columns_as_in_the_papers_table_4(tmp_path):
    category = make_arm()
    samples = [sample_of(category, seed) for seed in range(3)]
    arm = seen_too_large(write_dataset(tmp_path / "arms", category, samples))
    table = paper_tables([arm])[0]
    assert table.columns[5:] == tuple("1234567")
    assert [row[0] for row in table.rows if row[0]] == ["ADD mm", "AUC %", "3D IoU %", "ADD %"]
    add = table.rows[: table.breaks[0]]
    assert [row[2] for row in add] == [IN_PAPER] * 2 + [MEASURED] * 2
    assert add[1][5:] == ("37.6", "39.2", "45.3", "45.6", "48.9", "52.6", "60.8")
    assert add[3][5:] == ("0.0",) * 7
    iou = table.rows[table.breaks[1] : table.breaks[2]]
    assert [row[2] for row in iou] == [MEASURED] * 2  # the paper has none
    assert table.latex().count(r"\midrule") == 4


def test_an_arm_with_a_base_is_counted_without_it(tmp_path):
    category = replace(make_arm(parts=8), name="panda")
    samples = [sample_of(category, seed) for seed in range(3)]
    arm = seen_too_large(write_dataset(tmp_path / "pandas", category, samples))
    assert len(arm.given.parts) == 8
    add = next(t for t in paper_tables([arm]) if "Table 4" in t.title).rows[:4]
    assert [row[2] for row in add] == [IN_PAPER] * 2 + [MEASURED] * 2
    mean = [f"{1000 * part.plain.add.mean.value:.1f}" for part in arm.given.parts[1:]]
    assert list(add[2][5:]) == mean
    rows = list(csv.DictReader(paper_csv([arm]).splitlines()))
    assert [r["part"] for r in rows if r["method"] == "r2art"] == [f"link_{p}" for p in range(1, 8)]


def test_the_spreadsheet_has_a_row_per_part(result):
    rows = list(csv.DictReader(paper_csv([result]).splitlines()))
    assert len(rows) == 7 * 2
    assert [r["part"] for r in rows[-2:]] == ["base", "lid"]
    assert {r["figures"] for r in rows} == {IN_PAPER, MEASURED}


def test_latex_is_balanced_and_escaped(result):
    text = paper_tables([result])[0].latex()
    assert text.count(r"\begin{") == text.count(r"\end{") == 2
    assert text.count(r"\toprule") == text.count(r"\bottomrule") == 1
    bare = re.sub(r"\\[&%$#_{}]", "", text)
    assert bare.count("{") == bare.count("}")
    assert "%" not in bare
    assert "_" not in bare
    body = [line for line in bare.splitlines() if line.endswith(r"\\")]
    assert {line.count("&") for line in body} == {8}
    assert len(body) == 8
