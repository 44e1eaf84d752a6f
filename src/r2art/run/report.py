"""What the terminal shows: results on stdout; errors, warnings and progress on stderr."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from r2art.core.legend import state_text
from r2art.core.prediction import JointEstimate, Prediction

STYLES = {"error": "bold red", "rejected": "red", "warning": "yellow", "written": "green"}


def say(kind: Literal["error", "rejected", "warning", "written"], text: str) -> None:
    """Print one line to stderr, above a progress bar if there is one."""
    line = Text.assemble((f"{kind}:", STYLES[kind]), " ", text)
    _stderr().print(line, soft_wrap=True)


@contextmanager
def progress(count: int | None) -> Iterator[Callable[[], None]]:
    """A bar for several images on a terminal, otherwise nothing; call what it gives to advance.

    None: nobody knows how many there are.
    """
    if (count is not None and count < 2) or not _stderr().is_terminal:
        yield lambda: None
        return
    from rich.progress import Progress

    with Progress(console=_stderr(), transient=True, redirect_stdout=False) as bar:
        task = bar.add_task("predicting", total=count)
        yield lambda: bar.advance(task)


def print_table(predictions: Sequence[Prediction]) -> None:
    """A small table for each photo: its parts, where they are, and how far each is open."""
    console = Console(highlight=False)
    for prediction in predictions:
        console.print(_table(prediction))


def _table(prediction: Prediction) -> Table:
    name = Path(prediction.image_path or "").name
    score = prediction.category_score
    sure = "" if score is None else f" {score:.0%}"
    title = Text.assemble((name, "bold"), f"  {prediction.category}{sure}")
    table = Table(title=title, title_justify="left", title_style="", box=SIMPLE_HEAD)
    for heading in ("part", "sure", "x (m)", "y (m)", "z (m)", "joint", "state", "sure"):
        table.add_column(heading, justify="left" if heading in ("part", "joint") else "right")
    for p, part in enumerate(prediction.parts):
        position = (f"{v:.2f}" for v in part.cam_T_part[:3, 3])
        joint = None if p == 0 else prediction.joints[p - 1]
        moved = ("", "", "") if joint is None else (joint.name, state_text(joint), _sure(joint))
        table.add_row(part.name, f"{part.confidence:.0%}", *position, *moved)
    return table


def _sure(joint: JointEstimate) -> str:
    return "" if joint.confidence is None else f"{joint.confidence:.0%}"


def print_warnings(predictions: Sequence[Prediction]) -> None:
    """What was rejected; each warning once, with the photo it is about or the number of photos."""
    for prediction in predictions:
        if prediction.rejected is not None:
            say("rejected", f"{prediction.image_path}: {prediction.rejected}")
    counts = Counter(text for p in predictions for text in p.warnings)
    for text, count in counts.items():
        if count > 1:
            say("warning", f"{text} ({count} photos)")
        elif len(predictions) == 1:
            say("warning", text)
        else:
            about = next(p.image_path for p in predictions if text in p.warnings)
            say("warning", f"{about}: {text}")


def _stderr() -> Console:
    return Console(stderr=True, highlight=False)
