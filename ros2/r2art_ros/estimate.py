"""One image with its camera_info in, messages out: what the node does, without ROS."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from r2art.core.camera import Camera
from r2art.core.image import Photo
from r2art.core.prediction import Prediction
from r2art.run.predictor import Predictor, load
from r2art_ros import results
from r2art_ros.cameras import camera_of, doubt_about_distortion
from r2art_ros.images import photo_of_compressed, photo_of_image
from r2art_ros.pairing import seconds
from r2art_ros.settings import Settings


@dataclass(frozen=True)
class Estimate:
    """What is to be published about one image; all have its stamp and its frame.

    Attributes:
        detections: ``vision_msgs/Detection3DArray``, empty where nothing is seen.
        joint_states: ``sensor_msgs/JointState``, or None where nothing is seen.
        frames: ``tf2_msgs/TFMessage``, or None where nothing is seen.
        warnings: What to know before trusting it.
    """

    detections: Any
    joint_states: Any
    frames: Any
    warnings: tuple[str, ...]


class Estimator:
    """The model, and what the node was told."""

    def __init__(self, settings: Settings, types: results.Types) -> None:
        self._settings = settings
        self._types = types
        self._predictor = load(settings.model or None)
        if settings.category:
            self._predictor.category(settings.category)  # an unknown one is told at once
        self._look: Callable[[Photo, Camera, float], Prediction | None] = self._afresh
        if settings.track:
            self._look = Following(self._predictor, settings)

    def estimate(self, image: Any, info: Any) -> Estimate:
        """What one image shows.

        Raises:
            InputError: Image or camera_info cannot be used.
            UsageError: The settings cannot be meant for it.
        """
        told = self._settings
        photo = photo_of_compressed(image) if told.compressed else photo_of_image(image)
        camera = camera_of(info, photo.width, photo.height, rectified=told.rectified)
        doubt = doubt_about_distortion(info, rectified=told.rectified)
        warnings = () if doubt is None else (doubt,)
        prediction = self._look(photo, camera, seconds(image.header.stamp))
        if prediction is not None:
            warnings += prediction.warnings
            doubt = self._no_object(prediction)
            if doubt is not None:
                prediction, warnings = None, (doubt,)
        about = (self._types, prediction, image.header, told.prefix)
        if prediction is None:
            return Estimate(results.detections(*about), None, None, warnings)
        return Estimate(
            results.detections(*about),
            results.joint_states(self._types, prediction, image.header, told.prefix),
            results.frames(self._types, prediction, image.header, told.prefix),
            warnings,
        )

    def _no_object(self, prediction: Prediction) -> str | None:
        """Why no object is published, or None."""
        if prediction.rejected is not None:
            return f"no object is published: {prediction.rejected}"
        score, least = prediction.category_score, self._settings.min_score
        if score is None or score >= least:
            return None
        return f"no object is published: {prediction.category} scores {score:.2f}, below {least:g}"

    def _afresh(self, photo: Photo, camera: Camera, time: float) -> Prediction:
        told = self._settings
        return self._predictor.predict(
            photo,
            camera,
            told.category or None,
            size=told.size or None,
            depth=told.depth or None,
            refine=told.refine,
        )


class Following:
    """The object of the images before, by `r2art.run.video.track`.

    It begins anew where time runs backwards, as a bag that is played in a loop makes it, and
    where the camera changes.
    """

    def __init__(self, predictor: Predictor, settings: Settings) -> None:
        self._predictor = predictor
        self._settings = settings
        self._tracker: Any = None
        self._camera: Camera | None = None
        self._time = 0.0

    def __call__(self, photo: Photo, camera: Camera, time: float) -> Prediction | None:
        """What is seen now, or None where the object is lost."""
        from r2art.run.video.frame import Frame
        from r2art.run.video.track import Tracker

        if self._tracker is None or camera != self._camera or time < self._time:
            self._tracker = Tracker(
                self._predictor,
                camera=camera,
                category=self._settings.category or None,
                size=self._settings.size or None,
                refine=self._settings.refine,
            )
        self._camera, self._time = camera, time
        return self._tracker.step(Frame(time=time, image=photo)).prediction
