"""The filter of one object in one clip: a value that each frame makes anew."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from r2art.core.prediction import Prediction
from r2art.run.video.measure import limits_of, measurement_of
from r2art.run.video.motion import CALM, UNKNOWN, Agility, predicted
from r2art.run.video.shape import Shape
from r2art.run.video.state import State
from r2art.run.video.update import begun, updated

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True, eq=False)
class Belief:
    """What is believed of an object at a time.

    Attributes:
        state: Where it is.
        agility: How lively it has been.
        shape: Its part boxes.
        limits: (J, 2) of its joints.
    """

    state: State
    agility: Agility
    shape: Shape
    limits: FloatArray

    @classmethod
    def begun(cls, prediction: Prediction) -> "Belief":
        """From one frame."""
        limits = limits_of(prediction)
        measurement = measurement_of(prediction)
        distance = float(np.linalg.norm(measurement.place))
        state = begun(measurement, limits, UNKNOWN.of(distance, limits[:, 1] - limits[:, 0]))
        return cls(
            state=state,
            agility=Agility(np.zeros(state.moving)),
            shape=Shape.of(prediction),
            limits=limits,
        )

    def later(self, seconds: float) -> "Belief":
        """Some time later, nothing seen yet."""
        spans = self.limits[:, 1] - self.limits[:, 0]
        calm = CALM.of(float(np.linalg.norm(self.state.place)), spans) ** 2
        state = predicted(self.state, seconds, calm * self.agility.factors)
        return replace(self, state=state)

    def seen(self, prediction: Prediction | None) -> tuple["Belief", bool]:
        """With what a frame says, and whether it has said where the object is."""
        if prediction is None:
            return replace(self, state=updated(self.state, None, self.limits).state), False
        update = updated(self.state, measurement_of(prediction), self.limits)
        belief = replace(
            self,
            state=update.state,
            agility=self.agility.after(update.whitened),
            shape=self.shape.after(prediction) if update.accepted else self.shape,
        )
        return belief, update.accepted
