"""Models that a user has, as objects of the project's categories: which file is what.

A TOML file tells it (docs/benchmark.md, `models.toml` beside this module): per model its file,
its category, how the file is to be read, and which of its joints is which of the category's.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from r2art.core.category import Category
from r2art.core.errors import InputError
from r2art.data import categories
from r2art.data.benchmark.closing import as_one_of, closed_at, in_order, turned
from r2art.data.models.build import Reading
from r2art.data.models.imported import Format, Imported, imported
from r2art.data.objects import Procedural
from r2art.data.shape import Instance
from r2art.data.source import Fault
from r2art.data.staging import Staging

MAPPING = "models.toml"
SHIPPED = Path(__file__).with_name(MAPPING)
FORMATS: dict[str, Format] = {".urdf": "urdf", ".xml": "mjcf"}


@dataclass(frozen=True, kw_only=True)
class JointIs:
    """A model's joint that is one of a category's.

    Attributes:
        name: In the model.
        closed: State in which it is closed; None: its lower limit ...
        opened: ... and open as far as it goes; None: its upper limit.
    """

    name: str
    closed: float | None = None
    opened: float | None = None


@dataclass(frozen=True, kw_only=True)
class ModelIs:
    """A model that is an object of a category.

    Attributes:
        file: Below the folder of models; a folder there is of PartNet-Mobility.
        category: Of `r2art.data.categories`.
        joints: By the category's joint.
        fix: Joints to be held still, see `r2art.data.models.build.Reading` ...
        root: ... link of the root part ...
        up: ... direction of the file's frame that is up ...
        front: ... and that of its front ...
        scale: ... metres in its unit of length.
        turn: Degrees about right, up and front, in this order, that set straight what stands
            askew in its file.
        recolor: Whether untextured surfaces have other colours on every photo.
    """

    file: str
    category: str
    joints: Mapping[str, JointIs] = field(hash=False)
    fix: tuple[str, ...] = ()
    root: str | None = None
    up: str | None = None
    front: str | None = None
    scale: float = 1.0
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    recolor: bool = False


@dataclass(frozen=True)
class Found:
    """A model on disk that is an object of a category."""

    told: ModelIs
    model: Imported

    def instance(self, seed: int) -> Instance:
        """The object, in the colours of a seed."""
        instance = turned(self.model.instance(seed), self.told.turn)
        who, joints = self.told.file, self.told.joints
        like = _example(self.told.category)
        wanted = [joint.name for joint in like.joints]
        ours = {joint.name: joint for joint in instance.joints}
        if sorted(joints) != sorted(wanted):
            raise InputError(f"{who}: `joints` has {sorted(joints)}, needs {sorted(wanted)}")
        names = [joints[name].name for name in wanted]
        if sorted(names) != sorted(ours):
            raise InputError(
                f"{who}: joints {sorted(names)} are told, the model has {sorted(ours)}; "
                "hold others still with `fix`"
            )
        limits = np.array([_range(joints[name], ours[joints[name].name].limits) for name in wanted])
        ordered = closed_at(in_order(instance, names), limits[:, 0], limits[:, 1])
        return as_one_of(ordered, like, who)


@dataclass(frozen=True)
class Cad:
    """The models of a category: photographed as its procedural objects are, with their prior.

    Attributes:
        name: Of the category.
        found: Its models, drawn from alike.
    """

    name: str
    found: tuple[Found, ...]

    @property
    def staging(self) -> Staging:
        """The category's."""
        return Procedural(self.name).staging

    def instance(self, seed: int, photos: Sequence[Path] = ()) -> Instance:
        """One of the models; ``photos`` are never used."""
        own = np.random.default_rng([seed, 2]).integers(len(self.found))
        return self.found[own].instance(seed)

    def prior(self) -> Category:
        """The category's."""
        return Procedural(self.name).prior()

    def about(self) -> dict[str, Any]:
        """Names, contents and reading of the models."""
        return {
            "category": self.name,
            "models": [
                {
                    **f.model.about(),
                    "file": f.told.file,
                    "turn": list(f.told.turn),
                    "joints": _told(f.told.joints),
                }
                for f in self.found
            ],
        }


def cad_objects(folder: Path) -> dict[str, Cad]:
    """By category, the models in a folder, as its `MAPPING` tells, else the shipped one.

    Of the shipped one, models that are not there are left out.

    Raises:
        InputError: There is no model, one cannot be read, or it is no object of its category.
    """
    own = folder / MAPPING
    told = read_mapping(own if own.exists() else SHIPPED)
    if not own.exists():
        told = [model for model in told if (folder / model.file).exists()]
    if not told:
        raise InputError(
            f"{folder} holds neither a {MAPPING} nor any model that r2art knows "
            "(see docs/benchmark.md)"
        )
    found: dict[str, list[Found]] = {}
    for model in told:
        found.setdefault(model.category, []).append(_found(folder, model))
    return {name: Cad(name, tuple(models)) for name, models in sorted(found.items())}


def read_mapping(path: Path) -> list[ModelIs]:
    """The models that a `MAPPING` file tells of.

    Raises:
        Fault: It cannot be read, or says something that is not meant there.
    """
    try:
        content = tomllib.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise Fault(str(path), "", f"cannot be read ({error})") from None
    models = content.get("model")
    if set(content) != {"model"} or not isinstance(models, list):
        raise Fault(str(path), "", "must hold one [[model]] per model, and nothing else")
    return [_model(model, path, k) for k, model in enumerate(models, start=1)]


def _model(given: dict[str, Any], path: Path, number: int) -> ModelIs:
    field_name = f"model {number}"
    try:
        _check_texts(given)
        joints = {name: _joint(**joint) for name, joint in given["joints"].items()}
        rest = {k: v for k, v in given.items() if k not in ("joints", "fix", "turn")}
        x, y, z = map(float, given.get("turn", (0.0, 0.0, 0.0)))
        model = ModelIs(**rest, joints=joints, fix=tuple(given.get("fix", ())), turn=(x, y, z))
    except KeyError:
        raise Fault(str(path), field_name, "lacks `joints`") from None
    except (TypeError, AttributeError, ValueError) as error:
        reason = str(error).rpartition("() ")[2]
        raise Fault(str(path), field_name, f"{reason} (see docs/benchmark.md)") from None
    if model.category not in categories.CATEGORIES:
        known = ", ".join(categories.CATEGORIES)
        raise Fault(str(path), field_name, f"category {model.category!r} is none of {known}")
    return model


def _check_texts(given: dict[str, Any]) -> None:
    for name in ("file", "category", "root", "up", "front"):
        if not isinstance(given.get(name, ""), str):
            raise ValueError(f"{name} must be a text")


def _joint(name: str, closed: float | None = None, opened: float | None = None) -> JointIs:
    return JointIs(
        name=str(name),
        closed=None if closed is None else float(closed),
        opened=None if opened is None else float(opened),
    )


def _found(folder: Path, told: ModelIs) -> Found:
    path = folder / told.file
    reading = Reading(fix=told.fix, root=told.root, up=told.up, front=told.front, scale=told.scale)
    format = "partnet" if path.is_dir() else FORMATS.get(path.suffix.lower())
    if format is None:
        raise InputError(f"{path}: only .urdf, .xml (MuJoCo) and folders of PartNet-Mobility")
    model = imported(
        format, [path], name=told.category, split="test", reading=reading, recolor=told.recolor
    )
    found = Found(told, model)
    found.instance(0)  # tells now what does not fit
    return found


@lru_cache(maxsize=32)
def _example(category: str) -> Instance:
    return Procedural(category).instance(0)


def _range(told: JointIs, limits: tuple[float, float]) -> tuple[float, float]:
    lower, upper = limits
    return (
        lower if told.closed is None else told.closed,
        upper if told.opened is None else told.opened,
    )


def _told(joints: Mapping[str, JointIs]) -> dict[str, dict[str, Any]]:
    return {name: {k: v for k, v in vars(j).items() if v is not None} for name, j in joints.items()}
