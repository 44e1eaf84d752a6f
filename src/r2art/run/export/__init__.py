"""Predictions in the formats of other programs.

>>> from r2art.run.export import FORMATS
>>> FORMATS["urdf"].encode(prediction)  # bytes of a .urdf file
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from r2art.core.prediction import Prediction
from r2art.run.export.glb import to_glb
from r2art.run.export.mjcf import to_mjcf
from r2art.run.export.tables import to_bop, to_csv
from r2art.run.export.urdf import to_urdf

__all__ = ["FORMATS", "Format"]


@dataclass(frozen=True, kw_only=True)
class Format:
    """One way to write a prediction down.

    Attributes:
        about: What it is, in a few words.
        suffix: How its files end, with the dot.
        media_type: For the Content-Type of HTTP.
        encode: The bytes of a file of one prediction.
        encode_all: Of formats that are tables: the bytes of one file of many predictions.
    """

    about: str
    suffix: str
    media_type: str
    encode: Callable[[Prediction], bytes]
    encode_all: Callable[[Sequence[Prediction]], bytes] | None = None


def to_json(prediction: Prediction) -> bytes:
    """The bytes of a ``.json`` file, indented; see docs/prediction.md."""
    return (prediction.to_json(indent=2) + "\n").encode()


FORMATS: dict[str, Format] = {
    "json": Format(
        about="the prediction itself",
        suffix=".json",
        media_type="application/json",
        encode=to_json,
    ),
    "glb": Format(
        about="3D scene for any glTF viewer",
        suffix=".glb",
        media_type="model/gltf-binary",
        encode=to_glb,
    ),
    "mjcf": Format(
        about="model for MuJoCo, the photo as its keyframe",
        suffix=".mjcf.xml",
        media_type="application/xml",
        encode=to_mjcf,
    ),
    "urdf": Format(
        about="robot description for ROS and simulators",
        suffix=".urdf",
        media_type="application/xml",
        encode=to_urdf,
    ),
    "csv": Format(
        about="table, a row for each part and its joint",
        suffix=".csv",
        media_type="text/csv",
        encode=lambda prediction: to_csv([prediction]),
        encode_all=to_csv,
    ),
    "bop": Format(
        about="results for the BOP toolkit",
        suffix=".bop.csv",
        media_type="text/csv",
        encode=lambda prediction: to_bop([prediction]),
        encode_all=to_bop,
    ),
}
