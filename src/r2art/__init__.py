"""r2art: one photo of an articulated object in, the pose of every part and joint state out.

>>> import r2art
>>> prediction = r2art.load().predict("laptop.jpg")
>>> prediction.joint("hinge").state  # radians
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from r2art.core.camera import Camera
    from r2art.core.prediction import Prediction
    from r2art.run.predictor import load

    __version__: str

__all__ = ["Camera", "Prediction", "__version__", "load"]

_HOMES = {
    "Camera": "r2art.core.camera",
    "Prediction": "r2art.core.prediction",
    "load": "r2art.run.predictor",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: ``import r2art`` itself costs nothing."""
    import importlib.metadata

    if name == "__version__":
        return importlib.metadata.version("r2art")
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'r2art' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
