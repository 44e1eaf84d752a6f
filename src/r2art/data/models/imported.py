"""A category made of models: one robot arm, or many folders of cabinets."""

import hashlib
import zlib
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Category, Joint
from r2art.core.errors import InputError, UsageError
from r2art.data.hashes import file_hash
from r2art.data.models import cache
from r2art.data.models.build import Built, Follows, Reading, build
from r2art.data.models.model import Model, triple
from r2art.data.models.partnet import read_partnet
from r2art.data.models.urdf import read_urdf
from r2art.data.objects import PRIOR_INSTANCES, Split
from r2art.data.prior import category_prior
from r2art.data.shape import Instance, Material
from r2art.data.staging import Spread, Staging

FloatArray = NDArray[np.floating]
Format = Literal["urdf", "mjcf", "partnet"]

SHARES: tuple[tuple[Split, float], ...] = (("train", 0.7), ("val", 0.85), ("test", 1.0))
"""Upper end of each split's share of the models, in the order of a hash of their names."""
ALIKE = float(np.cos(np.radians(20)))
"""Joints of one category turn about the same axis, up to so much."""


def _read_mjcf(path: Path) -> Model:
    from r2art.data.models.mjcf import read_mjcf  # imports mujoco, which the others do without

    return read_mjcf(path)


READERS: dict[Format, Callable[[Path], Model]] = {
    "urdf": read_urdf,
    "mjcf": _read_mjcf,
    "partnet": read_partnet,
}


@dataclass(frozen=True)
class Source:
    """One model on disk.

    Attributes:
        path: Its file or folder.
        format: Of it.
        sha256: Of the contents of all its files.
    """

    path: Path
    format: Format
    sha256: str


@dataclass(frozen=True)
class ModelStaging(Staging):
    """Seen from all around, joints anywhere within limits; mimicking joints follow."""

    follows: tuple[Follows, ...] = ()

    def sample_joint_state(self, rng: np.random.Generator, joints: tuple[Joint, ...]) -> FloatArray:
        """(J,) joint states within limits."""
        state = super().sample_joint_state(rng, joints)
        for rule in self.follows * len(self.follows):  # a leader may follow another
            wanted = rule.multiplier * state[rule.leader] + rule.offset
            state[rule.follower] = np.clip(wanted, *joints[rule.follower].limits)
        return state


@dataclass(frozen=True, kw_only=True)
class Imported:
    """The objects of a category that models make up; see `imported`.

    Limits are those of the files: unlike a procedural object's they may be negative, and a
    robot's zero is no "closed".

    Attributes:
        name: Of the category.
        sources: All its models.
        split: Which of them are drawn.
        reading: How they are read.
        recolor: Whether each object gets colours of its own; textured ones never do.
    """

    name: str
    sources: tuple[Source, ...]
    split: Split = "train"
    reading: Reading = Reading()  # noqa: RUF009 (frozen)
    recolor: bool = False

    @property
    def staging(self) -> Staging:
        """From all around, joints uniform over their limits."""
        first = built(self._reference, self.reading)
        anywhere = {joint.name: Spread() for joint in first.instance.joints}
        return ModelStaging(azimuth=None, joints=anywhere, follows=first.follows)

    @property
    def _reference(self) -> Source:
        return of_split(self.sources, "train")[0]

    def instance(self, seed: int, photos: Sequence[Path] = ()) -> Instance:
        """The object of a seed: one of the split's models; ``photos`` are never used."""
        rng = np.random.default_rng(seed)
        own = of_split(self.sources, self.split)
        instance = self._alike(own[rng.integers(len(own))])
        return _recolored(instance, rng) if self.recolor else instance

    def prior(self) -> Category:
        """The mean of the training models."""
        sources = of_split(self.sources, "train")[:PRIOR_INSTANCES]
        return category_prior([self._alike(source) for source in sources], self.staging)

    def about(self) -> dict[str, Any]:
        """Names, contents and reading of all models."""
        models = [
            {"name": s.path.name, "format": s.format, "sha256": s.sha256} for s in self.sources
        ]
        reading = {k: v for k, v in vars(self.reading).items() if v is not None}
        reading["fix"] = list(self.reading.fix)
        return {
            "category": self.name,
            "models": models,
            "reading": reading,
            "recolor": self.recolor,
        }

    def _alike(self, source: Source) -> Instance:
        first = built(self._reference, self.reading).instance
        return _renamed(built(source, self.reading).instance, first, self.name, source)


def imported(
    format: Format,
    paths: Sequence[Path],
    *,
    name: str | None = None,
    split: Split = "train",
    reading: Reading = Reading(),  # noqa: B008 (frozen)
    recolor: bool = False,
) -> Imported:
    """A category of some models; models of the same content count once.

    One model serves all splits. Several are split by a hash of their names: 70 % train, 15 %
    val, 15 % test, no model in two splits.

    Args:
        format: Of all of them.
        paths: Files or folders.
        name: Of the category; default: the first model's.
        split: Whose models are drawn.
        reading: How they are read.
        recolor: See `Imported`.

    Raises:
        InputError: A model cannot be read, or the split gets none.
        UsageError: There are no models, or the name cannot be meant.
    """
    if not paths:
        raise UsageError(f"no model given; name at least one file or folder after --{format}")
    found: dict[str, Source] = {}
    for path in paths:
        source = Source(path, format, _content_hash(READERS[format](path)))
        found.setdefault(source.sha256, source)
    sources = tuple(sorted(found.values(), key=lambda s: (s.path.name, s.sha256)))
    own = name or READERS[format](sources[0].path).name
    clean = "".join(c if c.isalnum() or c in "_-" else "_" for c in own).strip("_")
    if not clean:
        raise UsageError(f"a category cannot be named {own!r}; give another --name")
    if not of_split(sources, split) or not of_split(sources, "train"):
        counts = ", ".join(f"{s} {len(of_split(sources, s))}" for s, _ in SHARES)
        raise InputError(
            f"the split {split!r} of these {len(sources)} models is of no use ({counts}); "
            "every object falls to one split by its name: give more models, or one alone"
        )
    return Imported(name=clean, sources=sources, split=split, reading=reading, recolor=recolor)


def of_split(sources: Sequence[Source], split: Split) -> tuple[Source, ...]:
    """The models of a split; a single one belongs to all."""
    if len(sources) == 1:
        return tuple(sources)
    return tuple(source for source in sources if _split(source) == split)


def _split(source: Source) -> Split:
    share = zlib.crc32(source.path.name.encode()) / 2**32
    return next(split for split, end in SHARES if share < end)


def _content_hash(model: Model) -> str:
    digest = hashlib.sha256()
    for path in model.files:
        digest.update(file_hash(path).encode())
    return digest.hexdigest()


@lru_cache(maxsize=128)
def built(source: Source, reading: Reading) -> Built:
    """The object of a model, built once and then kept on disk, and a while in memory."""
    parts = (cache.VERSION, source.format, source.sha256, *map(repr, astuple(reading)))
    key = hashlib.sha256("\n".join(parts).encode()).hexdigest()
    return cache.kept(key, lambda: build(READERS[source.format](source.path), reading))


def _renamed(instance: Instance, like: Instance, name: str, source: Source) -> Instance:
    """An instance as one of a category: names of the first, joints that run the same way.

    Raises:
        InputError: It has other parts or joints.
    """
    ours, theirs = _structure(instance), _structure(like)
    if ours != theirs:
        raise InputError(
            f"{source.path} has other parts than the category's first model "
            f"({_told(instance)}; {_told(like)}); leave it out, or hold joints still with --fix"
        )
    joints = tuple(
        _aligned(joint, first, source)
        for joint, first in zip(instance.joints, like.joints, strict=True)
    )
    return replace(instance, category=name, part_names=like.part_names, joints=joints)


def _structure(instance: Instance) -> list[tuple[str, int]]:
    return [(joint.kind, joint.parent) for joint in instance.joints]


def _told(instance: Instance) -> str:
    return ", ".join(
        f"{j.name} {j.kind} on {instance.part_names[j.parent]}" for j in instance.joints
    )


def _aligned(joint: Joint, like: Joint, source: Source) -> Joint:
    """The joint under the other's name; its states change sign if it runs the other way."""
    cosine = float(np.dot(joint.axis, like.axis))
    if abs(cosine) < ALIKE:
        raise InputError(
            f"{source.path}: joint {joint.name!r} has another axis than {like.name!r} of the "
            "category's first model; leave it out, or turn it with --up and --front apart"
        )
    if cosine > 0:
        return replace(joint, name=like.name)
    lower, upper = joint.limits
    back = triple(-np.asarray(joint.axis))
    return replace(joint, name=like.name, axis=back, limits=(-upper, -lower))


def _recolored(instance: Instance, rng: np.random.Generator) -> Instance:
    """The same shapes, every untextured material a little (sometimes quite) another."""
    new: dict[int, Material] = {}
    bold = rng.random() < 0.3
    for surface in (s for part in instance.parts for s in part):
        old = surface.material
        if old.texture is None and id(old) not in new:
            spread = 0.3 if bold else 0.07
            shift = rng.normal(0, spread / 2) + rng.normal(0, spread, 3)
            color = np.clip(np.asarray(old.color) + shift, 0, 1)
            roughness = float(np.clip(old.roughness + rng.normal(0, 0.15), 0.1, 1))
            new[id(old)] = replace(old, color=triple(color), roughness=roughness)
    parts = tuple(
        tuple(replace(s, material=new.get(id(s.material), s.material)) for s in part)
        for part in instance.parts
    )
    return replace(instance, parts=parts)
