"""A table of text, for a terminal, a Markdown page, a LaTeX document and a spreadsheet."""

import csv
import io
from collections.abc import Iterable
from dataclasses import dataclass

from rich import box
from rich.table import Table as RichTable
from rich.text import Text

_TEX = str.maketrans(
    {
        **{c: f"\\{c}" for c in "&%$#_{}"},
        **{"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"},
        **{"°": r"\textdegree{}", "×": r"$\times$", "∞": r"$\infty$", "⌀": r"$\varnothing$"},
        **{"²": r"\textsuperscript{2}", "–": "--", "≤": r"$\leq$"},
    }
)


@dataclass(frozen=True)
class Table:
    """Rows of text under a title.

    Attributes:
        title: What it shows.
        columns: Headings; the first column is left-aligned, the others as ``words`` says.
        rows: Each with as many cells as there are columns.
        words: How many of the first columns hold words rather than numbers.
        breaks: Numbers of the rows before which a new group begins.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int = 1
    breaks: tuple[int, ...] = ()

    def rich(self) -> RichTable:
        """The table for a terminal."""
        table = RichTable(title=self.title, title_justify="left", box=box.SIMPLE_HEAD)
        for k, column in enumerate(self.columns):
            table.add_column(column, justify="left" if k < self.words else "right")
        for k, row in enumerate(self.rows):
            # As Text, for in strings [0.1, 0.2] would be a style.
            table.add_row(*map(Text, row), end_section=k + 1 in self.breaks)
        return table

    def markdown(self) -> str:
        """The table for a Markdown page."""
        rule = ["---"] * self.words + ["---:"] * (len(self.columns) - self.words)
        lines = [f"| {' | '.join(row)} |" for row in (self.columns, rule, *self.rows)]
        return "\n".join([f"**{self.title}**", "", *lines])

    def latex(self) -> str:
        """The table for LaTeX, with the packages booktabs and textcomp."""
        letters = "l" * self.words + "r" * (len(self.columns) - self.words)
        lines = [
            *(r"\begin{table*}", r"\centering", r"\small"),
            rf"\caption{{{_tex(self.title)}}}",
            rf"\begin{{tabular}}{{{letters}}}",
            *(r"\toprule", _tex_row(self.columns), r"\midrule"),
        ]
        for k, row in enumerate(self.rows):
            lines += [r"\midrule"] * (k in self.breaks)
            lines.append(_tex_row(row))
        return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", r"\end{table*}"])


def _tex(text: str) -> str:
    return text.translate(_TEX)


def _tex_row(cells: Iterable[str]) -> str:
    return " & ".join(map(_tex, cells)) + r" \\"


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """Rows of a spreadsheet, the headings first."""
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue()
