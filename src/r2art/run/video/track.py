"""Follow one object through a clip.

>>> for seen in track(frames, r2art.load()):
...     seen.time, seen.prediction.joint("hinge").state, seen.deviations.joints
"""

import contextlib
import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from r2art.core.camera import Camera
from r2art.core.errors import InputError, UsageError
from r2art.core.image import Box, Photo, read_image
from r2art.core.prediction import CameraSource, Prediction
from r2art.run.boxes import check_box
from r2art.run.predictor import Predictor, check_lengths, choose_camera, guess_doubt
from r2art.run.refinement.body import Body, body_of
from r2art.run.refinement.mask_fit import STEPS, check_steps
from r2art.run.refinement.pose import Posed
from r2art.run.video.belief import Belief
from r2art.run.video.deviations import deviations_of
from r2art.run.video.frame import Frame, Tracked
from r2art.run.video.measure import usable
from r2art.run.video.shape import box_around, placed, shown
from r2art.run.video.vote import ENOUGH, Poll

GIVE_UP = 0.5
"""Seconds without a sight of the object after which it is lost, ..."""
LEAST_MISSED = 3
"""... and so many frames at least."""


def track(
    frames: Iterable[Frame],
    predictor: Predictor,
    *,
    camera: Camera | None = None,
    category: str | None = None,
    box: Sequence[float] | None = None,
    size: float | None = None,
    refine: int = STEPS,
    look_ahead: int = ENOUGH,
) -> Iterator[Tracked]:
    """Every frame with the object in it, smoothed by all frames before.

    Args:
        frames: In the order of their times; read only as results are taken.
        predictor: See `r2art.load`.
        camera: Of all frames; else the first photo's EXIF, else a guess.
        category: What the object is; else the first frames vote.
        box: Around it in the first frame that is a picture (px); else it is found.
        size: Longest side of its root part's box (m), see `Predictor.predict`.
        refine: Most steps of refinement in each frame.
        look_ahead: Frames to read before the first result, so that they can vote; 0 on live
            pictures, where the first results may then be of another category.

    Raises:
        UsageError, InputError: As `Predictor.predict`; a frame that cannot be read or used is
            none, and the object coasts.
    """
    tracker = Tracker(
        predictor, camera=camera, category=category, box=box, size=size, refine=refine
    )
    stream = iter(frames)
    first = list(itertools.islice(stream, look_ahead))
    for frame in first:
        tracker.poll(frame)
    yield from map(tracker.step, itertools.chain(first, stream))


class Tracker:
    """Follows one object, a frame at a time; see `track` for its arguments."""

    def __init__(
        self,
        predictor: Predictor,
        *,
        camera: Camera | None = None,
        category: str | None = None,
        box: Sequence[float] | None = None,
        size: float | None = None,
        refine: int = STEPS,
    ) -> None:
        check_lengths(size, None)
        check_steps(refine)
        if category is not None:
            predictor.category(category)
        self._predictor = predictor
        self._camera = camera
        self._source: CameraSource = "given"
        self._category = self._given_category = category
        self._box, self._size = box, size
        self._box_time: float | None = None  # of the first frame that is a picture
        self._refine = refine
        self._poll = Poll()
        self._bodies: dict[str, Body] = {}
        self._belief: Belief | None = None
        self._last: Prediction | None = None
        self._time = self._seen_at = -np.inf
        self._missed = self._index = 0

    @property
    def polling(self) -> bool:
        """Whether category or camera are still to be settled."""
        open_camera = self._camera is None or self._source == "guessed"
        return (self._given_category is None or open_camera) and not self._poll.closed

    def poll(self, frame: Frame) -> None:
        """Let a frame vote on what is not known yet, without following anything.

        One whose size is not that of the frames before has no vote; `step` refuses it.
        """
        photo = _readable(frame)
        if photo is not None and self.polling and self._fits(photo):
            self._vote(photo, self._box_in(frame))

    def step(self, frame: Frame) -> Tracked:
        """The next frame, with what it shows.

        Raises:
            UsageError: Its time lies before the last frame's, or an argument cannot be meant.
            InputError: Its size is not that of the frames before.
        """
        if not (np.isfinite(frame.time) and frame.time >= self._time):
            raise UsageError(
                f"frame {self._index} is of {frame.time:g} s, the one before of {self._time:g} s; "
                "give frames in the order of their times"
            )
        seconds = frame.time - self._time if self._index else 0.0
        self._time = frame.time
        photo = _readable(frame)
        box = None if photo is None else self._box_in(frame)
        if photo is not None:
            self._check_size(photo)
            if self.polling:
                self._vote(photo, box)
        measured = self._follow(photo, seconds)
        if self._belief is None and photo is not None:
            measured = self._find(photo, box)
        tracked = self._told(frame, photo, measured)
        self._index += 1
        return tracked

    def _box_in(self, frame: Frame) -> Sequence[float] | None:
        """The given box, if this is the first frame that is a picture, polled or followed."""
        if self._box_time is None:
            self._box_time = frame.time
        return self._box if frame.time == self._box_time else None

    def _vote(self, photo: Photo, box: Sequence[float] | None) -> None:
        """Category and camera as the frames so far have it.

        Whatever was followed as another object, or through another camera, is forgotten.
        """
        if self._camera is None:
            camera, self._source = choose_camera(photo, None)
            self._camera = None if self._source == "guessed" else camera
        guessing = self._source == "guessed"
        given = None if guessing else self._camera
        with contextlib.suppress(InputError):
            vote = self._predictor.predict(photo, given, self._given_category, box, refine=0)
            self._poll = self._poll.after(vote)
        before = (self._category, self._camera)
        if self._poll.category is not None:
            self._category = self._poll.category
            self._camera = self._poll.camera
        if (self._category, self._camera) != before:
            self._belief = None

    def _fits(self, photo: Photo) -> bool:
        """Whether it can be of the camera, as far as that is known."""
        camera = self._camera
        return camera is None or (photo.width, photo.height) == (camera.width, camera.height)

    def _check_size(self, photo: Photo) -> None:
        camera = self._camera
        if camera is not None and not self._fits(photo):
            raise InputError(
                f"frame {self._index} has {photo.width}×{photo.height} px, the camera "
                f"{camera.width}×{camera.height}; all frames of a clip must be of one size"
            )

    def _follow(self, photo: Photo | None, seconds: float) -> Prediction | None:
        """Look where the object should be by now; what the frame says of it there."""
        if self._belief is None:
            return None
        belief, seen = self._belief.later(seconds), None
        if photo is not None:
            box = self._place(belief)[1]
            seen = None if box is None else self._look(photo, box)
            seen = self._look(photo, None) if seen is None else seen
        self._belief, trusted = belief.seen(seen)
        self._missed = 0 if trusted else self._missed + 1
        self._seen_at = self._time if trusted else self._seen_at
        if self._missed >= LEAST_MISSED and self._time - self._seen_at >= GIVE_UP:
            self._belief = None
        return seen

    def _find(self, photo: Photo, box: Sequence[float] | None) -> Prediction | None:
        """Look for the object in the box, or anywhere, and begin anew with it."""
        seen = self._look(photo, None if box is None else check_box(box, photo))
        if seen is not None:
            self._belief, self._missed, self._seen_at = Belief.begun(seen), 0, self._time
        return seen

    def _look(self, photo: Photo, box: Box | None) -> Prediction | None:
        """What the network sees there, or anywhere; None: nothing that can be used."""
        if self._category is None or self._camera is None:
            return None
        try:
            seen = self._predictor.predict(
                photo, self._camera, self._category, box, refine=self._refine
            )
        except (InputError, UsageError):  # the box has left the picture; no finite answer
            return None
        return replace(seen, camera_source=self._source, photo=None) if usable(seen) else None

    def _place(self, belief: Belief) -> tuple[Body, Box | None, Posed]:
        """The object as believed: at rest, its 2D box, and where it is."""
        assert self._category is not None
        assert self._camera is not None
        body = belief.shape.body(self._mean(self._category), float(np.exp(belief.state.log_size)))
        at = placed(body, belief.state)
        return body, box_around(at, self._camera), at

    def _mean(self, category: str) -> Body:
        if category not in self._bodies:
            self._bodies[category] = body_of(self._predictor.category(category).prior()).outlined()
        return self._bodies[category]

    def _told(self, frame: Frame, photo: Photo | None, measured: Prediction | None) -> Tracked:
        self._last = measured or self._last
        belief, base = self._belief, self._last
        told = Tracked(
            index=self._index,
            time=frame.time,
            status="lost",
            measured=measured,
            photo=photo,
            fault=frame.fault,
        )
        if belief is None or base is None:
            return told
        body, box, at = self._place(belief)
        notes = (guess_doubt(base.camera),) if base.camera_source == "guessed" else ()
        notes += () if frame.fault is None else (frame.fault,)
        notes += (f"not seen for {self._missed} frames",) if self._missed else ()
        prediction = shown(base, body, at, belief.state, base.box if box is None else box)
        deviations = deviations_of(belief.state, belief.limits, base.scale.spread)
        rates = belief.state.rates[6:]
        prediction = replace(
            prediction, image_path=_path(photo), warnings=(*prediction.warnings, *notes)
        )
        if self._size is not None:
            factor = self._size / float(np.max(body.size[0]))
            sliding = np.where([j.kind == "prismatic" for j in base.joints], factor, 1.0)
            prediction = prediction.scaled(factor, "size")
            deviations = deviations.scaled(factor, sliding)
            rates = rates * sliding
        return replace(
            told,
            status="coasting" if self._missed else "tracked",
            prediction=prediction,
            deviations=deviations,
            rates=rates,
        )


def _readable(frame: Frame) -> Photo | None:
    """The frame's picture, if it has one."""
    return None if frame.image is None else read_image(frame.image)


def _path(photo: Photo | None) -> str | None:
    return None if photo is None or photo.path is None else str(photo.path)
