"""Results beside those that the paper prints, in the layout of its Tables 1, 3 and 4.

The paper's figures are data (`paper_tables.json`), and every row says whose it is. Only rows on
one and the same dataset may be compared; on other objects the share of the diagonal is the
fairest figure, for millimetres mean little where one dataset's laptops are six times as large
as another's.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from r2art.learn.evaluation.summary import PoseSummary
from r2art.learn.evaluation.tables import Table, csv_text
from r2art.learn.evaluation.tabulate import MM, PERCENT, Result

PRINTED = Path(__file__).with_name("paper_tables.json")
MEASURED, IN_PAPER = "measured", "paper"


@dataclass(frozen=True, kw_only=True)
class Row:
    """One method on one category, part by part, the root first.

    Attributes:
        category: Its name.
        method: Whose result this is.
        source: `IN_PAPER` if the figures are the paper's, `MEASURED` if this program's.
        data: The dataset, and how many photos failed if any did.
        input: ``"RGB"`` or ``"RGB-D"``.
        parts: Names, or numbers from 1.
        add: Mean ADD (mm), failures left out.
        auc: Area under the recall curve to 100 mm (percent), failures counting 0.
        iou: Mean 3D IoU (percent), failures counting 0; nan where the paper has none.
        share: Mean ADD in percent of the object's diagonal; nan where that is unknown.
    """

    category: str
    method: str
    source: str
    data: str
    input: str
    parts: tuple[str, ...]
    add: tuple[float, ...]
    auc: tuple[float, ...]
    iou: tuple[float, ...]
    share: tuple[float, ...]


@lru_cache(maxsize=1)
def printed() -> list[dict[str, Any]]:
    """The paper's tables as `PRINTED` has them."""
    return json.loads(PRINTED.read_text(encoding="utf-8"))["tables"]


def rows_of(table: dict[str, Any], results: Sequence[Result]) -> list[list[Row]]:
    """A table's rows by category: the paper's, then ours on that category, if there are any.

    A result belongs to a category of the same name with as many parts; and to one that its own is
    ``like``, whose parts are counted without the root, if it has so many. Categories without a
    result are left out.
    """
    out = []
    for entry in table["categories"]:
        ours = [r for r in results if _belongs(r, entry)]
        if ours:
            paper = [_printed_row(table["dataset"], entry, row) for row in entry["rows"]]
            measured = (row for r in ours for row in _measured_rows(r, entry["parts"]))
            out.append([*paper, *measured])
    return out


def _belongs(result: Result, entry: dict[str, Any]) -> bool:
    name, parts = result.report.category.name, len(result.given.parts)
    if name in entry.get("like", ()):
        return parts == entry["parts"] + 1
    return (name, parts) == (entry["category"], entry["parts"])


def _printed_row(dataset: str, entry: dict[str, Any], row: dict[str, Any]) -> Row:
    unknown = (float("nan"),) * entry["parts"]
    share = unknown
    if "mean_box" in entry:
        diagonal = MM * float(np.linalg.norm(entry["mean_box"]))
        share = tuple(PERCENT * add / diagonal for add in row["add"])
    return Row(
        category=entry["category"],
        method=row["method"],
        source=IN_PAPER,
        data=dataset,
        input=row["input"],
        parts=tuple(str(p + 1) for p in range(entry["parts"])),
        add=tuple(row["add"]),
        auc=tuple(row["auc"]),
        iou=tuple(row.get("iou", unknown)),
        share=share,
    )


def _measured_rows(result: Result, parts: int) -> Iterator[Row]:
    """Ours on the last ``parts`` parts."""
    given, failures = result.given, result.given.failures
    failed = f", {failures} of {given.images} failed" if failures else ""
    for method, aligned in (("r2art", False), ("r2art, scale aligned", True)):
        yield _measured_row(
            result,
            [p.name for p in given.parts[-parts:]],
            [p.aligned if aligned else p.plain for p in given.parts[-parts:]],
            method,
            f"{result.report.name}{failed}",
        )


def _measured_row(
    result: Result, names: list[str], poses: list[PoseSummary], method: str, data: str
) -> Row:
    return Row(
        category=result.report.category.name,
        method=method,
        source=MEASURED,
        data=data,
        input="RGB",
        parts=tuple(names),
        add=tuple(MM * p.add.mean.value for p in poses),
        auc=tuple(PERCENT * p.auc_100mm.value for p in poses),
        iou=tuple(PERCENT * p.overlap.mean.value for p in poses),
        share=tuple(PERCENT * p.add_share.mean.value for p in poses),
    )


def paper_tables(results: Sequence[Result]) -> tuple[Table, ...]:
    """Those of the paper's tables to which there is a result."""
    found = ((table, rows_of(table, results)) for table in printed())
    return tuple(_layout(table, blocks) for table, blocks in found if blocks)


MEASURES = (("ADD mm", "add"), ("AUC %", "auc"), ("3D IoU %", "iou"), ("ADD %", "share"))


def _layout(table: dict[str, Any], blocks: list[list[Row]]) -> Table:
    title = (
        f"Layout of the paper's Table {table['number']} ({table['dataset']}), per part, the root "
        "first. Rows marked “paper” are printed there; those marked “measured” are of this run, "
        "on the data named. ADD % is of the object's diagonal"
    )
    if table.get("parts_as_columns"):
        return _by_part(title, [row for block in blocks for row in block])
    return _by_category(title, blocks)


def _by_category(title: str, blocks: list[list[Row]]) -> Table:
    """Tables 1 and 3: a row per category and method."""
    columns = ("category", "method", "figures", "data", "input", *(name for name, _ in MEASURES))
    rows = tuple(
        (
            row.category if k == 0 else "",
            *_who(row),
            *(_listed(getattr(row, field)) for _, field in MEASURES),
        )
        for block in blocks
        for k, row in enumerate(block)
    )
    breaks = np.cumsum([len(block) for block in blocks])[:-1]
    return Table(title, columns, rows, words=5, breaks=tuple(breaks.tolist()))


def _by_part(title: str, known: list[Row]) -> Table:
    """Table 4: a column per part, and a block of rows per measure."""
    rows: list[tuple[str, ...]] = []
    breaks = []
    for name, field in MEASURES:
        breaks.append(len(rows))
        found = [row for row in known if not np.isnan(getattr(row, field)).all()]
        rows += [
            (name if k == 0 else "", *_who(row), *(f"{v:.1f}" for v in getattr(row, field)))
            for k, row in enumerate(found)
        ]
    columns = ("measure", "method", "figures", "data", "input", *known[0].parts)
    return Table(title, columns, tuple(rows), words=5, breaks=tuple(breaks[1:]))


def _who(row: Row) -> tuple[str, str, str, str]:
    return row.method, row.source, row.data, row.input


def _listed(values: tuple[float, ...]) -> str:
    return "–" if np.isnan(values).all() else ", ".join(f"{v:.1f}" for v in values)


def paper_csv(results: Sequence[Result]) -> str:
    """The same with one row per part."""
    names = ("table", "category", "method", "figures", "data", "input", "part")
    rows: list[tuple[object, ...]] = [
        (*names, "add_mm", "auc_percent", "iou_percent", "add_percent_of_diagonal")
    ]
    for table in printed():
        for row in (row for block in rows_of(table, results) for row in block):
            who = (table["number"], row.category, *_who(row))
            each = zip(row.parts, row.add, row.auc, row.iou, row.share, strict=True)
            rows += [(*who, part, *(f"{v:.6g}" for v in values)) for part, *values in each]
    return csv_text(rows)
