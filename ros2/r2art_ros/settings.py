"""The parameters of the node, each once: name, default, meaning."""

from dataclasses import dataclass, field, fields
from typing import Any

from r2art.core.errors import UsageError


def _parameter(default: Any, about: str) -> Any:
    return field(default=default, metadata={"about": about})


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What the node is told; see each field's ``about``. An empty text or 0 means: not given."""

    model: str = _parameter("", "model file that `r2art export` made; empty: the one inside r2art")
    category: str = _parameter("", "what the object is; empty: the model says")
    size: float = _parameter(0.0, "longest side of the root part in metres; 0: as usual objects")
    depth: float = _parameter(0.0, "distance of the root part's centre in metres, instead of size")
    refine: int = _parameter(6, "most steps of refinement; 0: none")
    min_score: float = _parameter(0.0, "least category score for which anything is published")
    rectified: bool = _parameter(False, "the images are rectified: use P of camera_info, not K")
    compressed: bool = _parameter(False, "subscribe to sensor_msgs/CompressedImage")
    track: bool = _parameter(False, "follow one object, smoothed over time, instead of afresh")
    prefix: str = _parameter("", "put before the names of frames and joints")
    publish_tf: bool = _parameter(True, "publish the parts' frames on /tf")
    slop: float = _parameter(0.01, "seconds that image and camera_info may lie apart")

    def __post_init__(self) -> None:
        for name in ("size", "depth", "slop", "min_score"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise UsageError(
                    f"{name} is {getattr(self, name)}, but must not be negative; 0: not given"
                )
        if self.size and self.depth:
            raise UsageError("size and depth both fix the scale; give one of them")
        if self.track and self.depth:
            raise UsageError("tracking knows no depth; give a size")


def parameters() -> list[tuple[str, Any, str]]:
    """Name, default and meaning of every parameter."""
    return [(f.name, f.default, f.metadata["about"]) for f in fields(Settings)]
