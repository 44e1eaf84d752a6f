"""What is the same in all of a clip, settled by its first frames: category and camera."""

from collections import Counter
from dataclasses import dataclass, field, replace

from r2art.core.camera import Camera
from r2art.core.prediction import Prediction
from r2art.run.video.measure import usable

ENOUGH = 5
"""Votes after which the poll is closed."""


@dataclass(frozen=True)
class Poll:
    """Votes of frames that show an object.

    Attributes:
        ballots: Their predictions, each made without knowing the category.
    """

    ballots: tuple[Prediction, ...] = field(default=(), repr=False)

    def after(self, prediction: Prediction) -> "Poll":
        """With the vote of one more frame, if it shows an object and the poll is open."""
        if self.closed or not usable(prediction):
            return self
        return Poll((*self.ballots, replace(prediction, photo=None)))

    @property
    def closed(self) -> bool:
        """Whether there have been enough."""
        return len(self.ballots) >= ENOUGH

    @property
    def category(self) -> str | None:
        """The category with most votes by their scores; the first of equals."""
        scores: Counter[str] = Counter()
        for vote in self.ballots:
            scores[vote.category] += vote.category_score or 1.0  # pyright: ignore[reportArgumentType]
        return max(scores, key=scores.__getitem__) if scores else None

    @property
    def camera(self) -> Camera | None:
        """The camera that most votes for that category name; the first of equals."""
        cameras = Counter(v.camera for v in self.ballots if v.category == self.category)
        return max(cameras, key=cameras.__getitem__) if cameras else None
