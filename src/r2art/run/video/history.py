"""The joints of a clip over time."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from r2art.core.prediction import JointEstimate
from r2art.run.video.frame import Status, Tracked

FloatArray = NDArray[np.floating]


@dataclass
class History:
    """What a plot needs of the frames so far; `add` them in order.

    Attributes:
        joints: As the last frame that shows the object has them.
        times: s.
        status: Of every frame.
        states: (J,) of every frame (rad, m); empty where the object is lost.
        deviations: Likewise.
        measured: Likewise, of every frame alone; empty where it says nothing.
    """

    joints: tuple[JointEstimate, ...] = ()
    times: list[float] = field(default_factory=list)
    status: list[Status] = field(default_factory=list)
    states: list[list[float]] = field(default_factory=list)
    deviations: list[list[float]] = field(default_factory=list)
    measured: list[list[float]] = field(default_factory=list)

    def add(self, seen: Tracked) -> None:
        """One more frame."""
        prediction = seen.prediction
        if prediction is not None:
            self.joints = prediction.joints
        alone = seen.measured if prediction is not None else None
        self.times.append(seen.time)
        self.status.append(seen.status)
        self.states.append([] if prediction is None else [j.state for j in prediction.joints])
        self.deviations.append([] if seen.deviations is None else seen.deviations.joints.tolist())
        self.measured.append([] if alone is None else [j.state for j in alone.joints])

    def last(self, seconds: float) -> "History":
        """Only the newest part of it."""
        if not self.times:
            return self
        first = int(np.searchsorted(self.times, self.times[-1] - seconds))
        lists = {k: v[first:] for k, v in vars(self).items() if k != "joints"}
        return History(joints=self.joints, **lists)

    def curve(self, name: str, joint: int) -> FloatArray:
        """(N,) one joint of ``states``, ``deviations`` or ``measured``; NaN where there is none."""
        rows = getattr(self, name)
        return np.array([row[joint] if joint < len(row) else np.nan for row in rows], float)
