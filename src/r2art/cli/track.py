"""`r2art predict` on films, sequences of pictures and webcams: one object followed through each."""

import itertools
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from r2art.core.camera import Camera
from r2art.core.errors import InputError, R2ArtError, UsageError
from r2art.core.image import Photo, read_image
from r2art.core.legend import state_text
from r2art.run.files import untaken
from r2art.run.predictor import Predictor
from r2art.run.report import progress, say
from r2art.run.video.film import needed_av
from r2art.run.video.frame import Frame, Tracked
from r2art.run.video.record import Recorder, json_line
from r2art.run.video.source import Source, find_clip
from r2art.run.video.track import track
from r2art.run.video.vote import ENOUGH
from r2art.run.video.webcam import open_webcam

INTERRUPTED = 130

CameraOf = Callable[[Photo], Camera | None]


def check_meant_for_clips(depth: float | None, mask: Path | None) -> None:
    """Refuse what is true of one photo only.

    Raises:
        UsageError: A depth or a mask is given.
    """
    if depth is not None:
        raise UsageError("--depth is of one photo, and a clip has many; fix its scale with --size")
    if mask is not None:
        raise UsageError("--mask is of one photo, and a clip has many; leave it out")


def track_all(
    predictor: Predictor,
    clips: Sequence[str],
    webcam: str | None,
    *,
    fps: float,
    camera_of: CameraOf,
    folder: Path | None,
    json: bool,
    **options: Any,
) -> int:
    """Follow the object of every clip, and of the webcam in the end; the exit code.

    Args:
        predictor: Of all of them.
        clips: Films, folders and globs.
        webcam: Its number.
        fps: Of pictures.
        camera_of: The camera that the user has told for a photo of that size.
        folder: For results; None: none.
        json: Whether lines go to stdout.
        options: Of `track`.
    """
    if webcam is not None:
        needed_av()
    exit_code = 0
    taken: set[str] = set()
    once: dict[Path, str] = {}
    for clip in clips:
        once.setdefault(Path(clip).absolute(), clip)
    openings = [lambda c=c: find_clip(c, fps) for c in once.values()]
    openings += [] if webcam is None else [lambda: open_webcam(webcam)]
    for opening in openings:
        try:
            source = opening()
        except InputError as error:
            say("error", str(error))
            exit_code = max(exit_code, error.exit_code)
            continue
        name = untaken(source.name, taken)
        code = _track_one(predictor, source, name, camera_of, folder, json, options)
        exit_code = max(exit_code, code)
        if code == INTERRUPTED:
            break
    return exit_code


def _track_one(
    predictor: Predictor,
    source: Source,
    name: str,
    camera_of: CameraOf,
    folder: Path | None,
    json: bool,
    options: dict[str, Any],
) -> int:
    """One clip. Whatever ends it, what is done by then is kept, in files that are whole."""
    recorder = None if folder is None else _recorder(folder, name, source)
    summary = _Summary(source.label)
    exit_code = 0
    try:
        with progress(None if source.live else source.count) as advance:
            frames, camera = _camera_told(source.frames(), camera_of)
            ahead = 0 if source.live else ENOUGH
            for seen in track(frames, predictor, camera=camera, look_ahead=ahead, **options):
                if json:
                    print(json_line(seen, source.label), flush=True)
                if recorder is not None:
                    recorder.add(seen)
                summary.add(seen)
                advance()
    except KeyboardInterrupt:
        if not source.live:
            say("error", f"interrupted after {summary.count} frames of {source.label}")
            exit_code = INTERRUPTED
    except R2ArtError as error:
        say("error", str(error))
        exit_code = error.exit_code
    finally:
        exit_code = max(exit_code, _finish(recorder))
    if summary.faults and not exit_code:
        exit_code = InputError.exit_code
    if not json and summary.count:
        print(summary)
    summary.warn()
    if recorder is not None and (written := recorder.written):
        say("written", ", ".join([str(written[0]), *(p.name for p in written[1:])]))
    return exit_code


def _recorder(folder: Path, name: str, source: Source) -> Recorder:
    try:
        needed_av()
    except UsageError as error:
        say("warning", f"no annotated film: {error}")
        return Recorder(folder, name, source.label, film=False)
    return Recorder(folder, name, source.label)


def _finish(recorder: Recorder | None) -> int:
    """Finish it; the exit code."""
    try:
        if recorder is not None:
            recorder.finish()
    except R2ArtError as error:
        say("error", str(error))
        return error.exit_code
    return 0


def _camera_told(
    frames: Iterator[Frame], camera_of: CameraOf
) -> tuple[Iterator[Frame], Camera | None]:
    """All frames, and the camera for the first that is a picture."""
    before: list[Frame] = []
    for frame in frames:
        before.append(frame)
        if frame.image is not None:
            return itertools.chain(before, frames), camera_of(read_image(frame.image))
    return iter(before), None


class _Summary:
    """What a clip has shown, in a few words."""

    def __init__(self, label: str) -> None:
        self._label = label
        self._status: Counter[str] = Counter()
        self._first: Tracked | None = None
        self._last: Tracked | None = None
        self.faults: list[str] = []

    @property
    def count(self) -> int:
        """Of the frames."""
        return self._status.total()

    def add(self, seen: Tracked) -> None:
        """One more frame."""
        self._status[seen.status] += 1
        if seen.fault is not None:
            self.faults.append(seen.fault)
        if seen.prediction is not None:
            self._first = self._first or seen
            self._last = seen

    def __str__(self) -> str:
        kinds = ", ".join(f"{count} {status}" for status, count in self._status.items())
        first, last = self._first, self._last
        if first is None or last is None or first.prediction is None or last.prediction is None:
            return f"{self._label}: no object found in {self.count} frames"
        lines = [f"{self._label}: {last.prediction.category}, {self.count} frames ({kinds})"]
        for j, joint in enumerate(last.prediction.joints):
            began = state_text(first.prediction.joints[j])
            sure = last.deviations and state_text(joint, float(last.deviations.joints[j]))
            lines.append(f"  {joint.name}: {began} at first, {state_text(joint)} ± {sure} at last")
        return "\n".join(lines)

    def warn(self) -> None:
        """Tell what to know before trusting it."""
        for fault in self.faults:
            say("error", fault)
        for text in (
            self._first.prediction.warnings if self._first and self._first.prediction else ()
        ):
            say("warning", f"{self._label}: {text}")
        if self._status["lost"]:
            say("warning", f"{self._label}: no object in {self._status['lost']} frames")
