"""Write what tracking says of a clip: an annotated film, JSON lines and a plot of the joints."""

import io
import json
from collections.abc import Callable
from pathlib import Path

from r2art.run.files import ANNOTATED, write_whole
from r2art.run.video.annotate import Annotator
from r2art.run.video.frame import Tracked
from r2art.run.video.plot import plot
from r2art.run.video.writer import Film, Lines

LINES, PLOT = ".tracked.jsonl", ".joints.png"


def json_line(seen: Tracked, source: str) -> str:
    """A frame as one line of JSON."""
    return json.dumps(seen.to_dict(source), ensure_ascii=False, allow_nan=False)


class Recorder:
    """Writes the results of one clip, each file whole or not at all.

    Args:
        folder: Where to.
        name: What the files are called before their endings.
        source: The clip, as the lines name it.
        film: Whether to write the annotated film, which needs PyAV.
    """

    def __init__(self, folder: Path, name: str, source: str, *, film: bool = True) -> None:
        self._source = source
        self._annotator = Annotator()
        self._plot = folder / (name + PLOT)
        self._lines = Lines(folder / (name + LINES))
        try:
            self._film = Film(folder / (name + ANNOTATED)) if film else None
        except BaseException:
            self._lines.finish()
            raise
        self._written: list[Path] = []

    @property
    def written(self) -> tuple[Path, ...]:
        """The files that have their names, once it is finished."""
        return tuple(self._written)

    def add(self, seen: Tracked) -> None:
        """One more frame."""
        self._annotator.add(seen)
        self._lines.add(json_line(seen, self._source))
        if self._film is not None:
            self._film.add(self._annotator.draw(seen), seen.time)

    def finish(self) -> None:
        """Give the files their names; what is done stays, whatever has happened.

        Raises:
            UsageError: The first that cannot be written; the others are written all the same.
        """
        parts = [self._lines] if self._film is None else [self._film, self._lines]
        endings: list[tuple[Path, Callable[[], bool]]] = [(p.path, p.finish) for p in parts]
        failures: list[Exception] = []
        for path, finish in (*endings, (self._plot, self._save_plot)):
            try:
                if finish():
                    self._written.append(path)
            except Exception as error:  # told when the rest is done
                failures.append(error)
        if failures:
            raise failures[0]

    def _save_plot(self) -> bool:
        """Whether there is anything to see in it."""
        if not self._annotator.history.joints:
            return False
        png = io.BytesIO()
        plot(self._annotator.history).save(png, "PNG")
        write_whole(self._plot, png.getvalue())
        return True
