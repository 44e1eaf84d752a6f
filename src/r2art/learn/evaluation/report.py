"""`r2art eval`: evaluate one or more datasets, print tables, and write what was asked for."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from r2art.core.errors import InputError, UsageError
from r2art.data.shards import write_atomically
from r2art.learn.evaluation import figures
from r2art.learn.evaluation.bop_results import bop_csv, bop_name
from r2art.learn.evaluation.evaluate import Predict, Report, count, evaluate
from r2art.learn.evaluation.paper import paper_csv, paper_tables
from r2art.learn.evaluation.records import describe, images_csv, summary_csv, to_json
from r2art.learn.evaluation.tables import Table
from r2art.learn.evaluation.tabulate import Result, by_cause, comparison, tables
from r2art.learn.evaluation.testsets import TestSet
from r2art.learn.evaluation.worst import worst
from r2art.learn.results import write_section


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """What to evaluate, and what to do with the outcome.

    Attributes:
        tests: The datasets.
        ask: For the name of a category, how to predict photos of it.
        model: The model file behind it; its checksum goes into the report.
        out: Folder for the report, or None.
        limit: Only the first so many photos of each dataset.
        refine: Steps of refinement, where they are not the default.
        results: Page whose sections on these datasets are to be written anew, or None.
        as_json: Whether to print JSON instead of tables.
    """

    tests: Sequence[TestSet]
    ask: Callable[[str], Predict]
    model: Path
    out: Path | None = None
    limit: int | None = None
    refine: int | None = None
    results: Path | None = None
    as_json: bool = False


def run_eval(job: Evaluation) -> list[Result]:
    """Evaluate, print, write; the files of a dataset are there as soon as it is done.

    Raises:
        UsageError: Two datasets have the same name.
        InputError: A folder cannot be written, or of a dataset no photo can be predicted.
    """
    names = [test.name for test in job.tests]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise UsageError(f"two datasets are called {twice}; rename the folder of one")
    if job.out is not None:
        _make_folder(job.out)
    results = []
    with _progress(sum(count(test, job.limit) for test in job.tests)) as advance:
        for test in job.tests:
            ask = job.ask(test.source.category.name)
            results.append(Result.of(evaluate(test, ask, job.limit, advance(test.name))))
            if job.out is not None:
                _write_dataset(job.out / test.name, results[-1])
    if job.results is not None:
        _write_sections(job.results, results, job)
    if job.out is not None:
        _write_whole(job.out, results, job)
        Console(stderr=True).print(f"wrote {job.out}/report.md, .json, .csv, .tex; figures below")
    # Last, for the reader of stdout may leave early, as `| head` does.
    print(to_json(results, job.model)) if job.as_json else _print(results)
    return results


@contextmanager
def _progress(total: int) -> Iterator[Callable[[str], Callable[[], None]]]:
    """A bar on stderr; what it gives takes the name of a dataset and gives what advances it."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    with Progress(*columns, TimeRemainingColumn(), console=Console(stderr=True)) as bar:
        task = bar.add_task("evaluating", total=total)

        def named(name: str) -> Callable[[], None]:
            bar.update(task, description=name)
            return lambda: bar.advance(task)

        yield named


def _print(results: Sequence[Result]) -> None:
    console = Console()
    if not console.is_terminal:
        console.width = 200  # a file or a pipe need not wrap
    shown = (comparison(results),) if len(results) > 1 else tables(results[0])
    for table in shown:
        console.print(table.rich())


def _write_dataset(folder: Path, result: Result) -> None:
    report = result.report
    _make_folder(folder)
    write_atomically(folder / "images.csv", images_csv(report).encode())
    write_atomically(folder / "errors.png", figures.errors(report))
    write_atomically(folder / "histograms.png", figures.histograms(report))
    write_atomically(folder / "calibration.png", figures.calibration(report, result.given))
    write_atomically(folder / "worst.png", worst(report))
    for name, mode in (("given", report.given), ("found", report.found)):
        path = folder / bop_name(report, f"r2art-{name}")
        write_atomically(path, bop_csv(report, mode).encode())


def _write_whole(out: Path, results: Sequence[Result], job: Evaluation) -> None:
    papers = paper_tables(results)
    latex = "\n\n".join(t.latex() for t in (comparison(results), *papers))
    write_atomically(out / "report.md", _whole_page(results, papers, job).encode())
    write_atomically(out / "report.json", to_json(results, job.model).encode())
    write_atomically(out / "report.csv", summary_csv(results).encode())
    write_atomically(out / "report.tex", f"{latex}\n".encode())
    write_atomically(out / "paper.csv", paper_csv(results).encode())


def _whole_page(results: Sequence[Result], papers: Sequence[Table], job: Evaluation) -> str:
    parts = ["# Evaluation"]
    if len(results) > 1:
        parts.append(comparison(results).markdown())
    parts += [t.markdown() for t in papers]
    for result in results:
        parts += [section(result, job), *(t.markdown() for t in by_cause(result.report))]
    return "\n\n".join(parts) + "\n"


def _write_sections(page: Path, results: Sequence[Result], job: Evaluation) -> None:
    """One section per dataset, called by its category where that is clear; one for the paper's."""
    categories = [r.report.category.name for r in results]
    for result, category in zip(results, categories, strict=True):
        key = category if categories.count(category) == 1 else result.report.name
        write_section(page, f"eval-{key}", section(result, job))
    if papers := paper_tables(results):
        text = "\n\n".join(["## Beside the paper", *(t.markdown() for t in papers)])
        write_section(page, "eval-paper", text)


def section(result: Result, job: Evaluation) -> str:
    """The section of a page on one dataset."""
    report = result.report
    n, name = len(report.indices), report.category.name
    size, checksum = describe(job.model)
    some = f" --limit {job.limit}" if job.limit is not None else ""
    refine = "" if job.refine is None else f" --refine {job.refine}"
    page = " --results docs/results.md" if job.results is not None else ""
    broken = f", {len(report.broken)} more could not be read" if report.broken else ""
    title = name if report.name.startswith(name) else f"{name}, {report.name}"
    facts = (
        f"{n} photos of {name}{broken}, {made_by(report)},",
        f"predicted by `{job.model.name}` ({size:.1f} MB, SHA-256 `{checksum[:16]}`) with",
        f"`r2art eval {report.test.options}{some}{refine}{page}`.",
    )
    shown = (t.markdown() for t in tables(result))
    return "\n\n".join([f"## Accuracy: {title}", "\n".join(facts), *shown, READING])


READING = (
    "*Given*: the model is told the object's 2D box and category, as in the literature; "
    "*found*: it is told neither. The camera is known in both. ADD is the mean distance of "
    "the model points; *aligned*: after the whole predicted scene was scaled by the factor that "
    "fits each image best, which one photo cannot tell. *Centre*: displacement of the part's box "
    "centre. p90: 90th percentile. A part is *right* within 10 % of its diameter (aligned); AUROC: "
    "how well the confidence tells right parts from others. Failures count as infinitely wrong, "
    "except in means."
)

_SYNTH = {"format", "category", "n", "seed", "split", "size", "backgrounds"}
_ASIDE = {"shards", "shard_size"}


def made_by(report: Report) -> str:
    """How the dataset came to be, as far as it says."""
    about = report.test.about
    if "source" in about:
        return f"of the {about.get('split', 'all')} split of {about['source']}"
    if set(about) - _ASIDE != _SYNTH:
        return f"as {report.name}/manifest.json describes them"
    backgrounds = " --backgrounds DIR" if about["backgrounds"] else ""
    return (
        f"each of another object of the {about['split']} split, made by\n"
        f"`r2art synth {about['category']} -n {about['n']} --seed {about['seed']} --split "
        f"{about['split']} --size {about['size']}{backgrounds} --out {report.name}`"
    )


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot write to {out}: {error.strerror}") from None
