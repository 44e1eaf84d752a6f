"""Which datasets a benchmark has: one per setting, level and category, all from fixed seeds."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from r2art.core.errors import UsageError
from r2art.data import categories
from r2art.data.benchmark.cad import Cad, cad_objects
from r2art.data.benchmark.framed import Framed
from r2art.data.benchmark.occlusion import Occlusion
from r2art.data.benchmark.scaled import ARTIMAGE, OTHERS, Scaled
from r2art.data.hashes import folder_hash
from r2art.data.objects import Objects, Procedural, Split
from r2art.data.staging import Framing
from r2art.data.synth import Arrangement, Synth

Setting = Literal["physical", "artimage-scale", "occlusion", "truncation", "cad"]
SETTINGS: tuple[Setting, ...] = get_args(Setting)

SEED = 0
ARTIMAGE_SIDE = 640
HIDDEN = tuple(k / 10 for k in range(7))
"""Levels of the occlusion sweep: shares of an object's pixels that are hidden."""
CUT = tuple(k / 10 for k in range(6))
"""Levels of the truncation sweep: shares of an object's box outside the photo."""


@dataclass(frozen=True, kw_only=True)
class Benchmark:
    """What to make; all but ``out`` and ``workers`` decides its bytes.

    Attributes:
        out: Its folder.
        settings: Which.
        categories: Which; () are all.
        n: Photos per category, in the settings that have no levels.
        sweep_n: Photos per category and level, and per category of ``cad``.
        size: Side of the photos (px), but for ``artimage-scale``, whose photos have 640.
        split: Whose objects; ``train`` makes data like the benchmark's to learn from.
        backgrounds: Folder to draw surroundings from.
        models: Folder of models, for ``cad``.
        workers: Processes; 0: one per core.
    """

    out: Path
    settings: tuple[Setting, ...] = SETTINGS[:-1]
    categories: tuple[str, ...] = ()
    n: int = 1000
    sweep_n: int = 200
    size: int = 320
    split: Split = "test"
    backgrounds: Path | None = None
    models: Path | None = None
    workers: int = 0

    def __post_init__(self) -> None:
        odd = [setting for setting in self.settings if setting not in SETTINGS]
        if odd or not self.settings:
            raise UsageError(f"settings are {', '.join(SETTINGS)}; got {odd or 'none'}")
        if self.sweep_n < 1:
            raise UsageError(f"need sweep_n >= 1, got {self.sweep_n}")
        for name in self.categories:
            Procedural(name)  # raises if there is none
        if ("cad" in self.settings) != (self.models is not None):
            raise UsageError("the setting cad and --models FOLDER need each other")

    @property
    def names(self) -> tuple[str, ...]:
        """Of all categories that are meant."""
        return tuple(sorted(set(self.categories))) or categories.CATEGORIES

    def about(self) -> dict[str, Any]:
        """What its manifest says of it; JSON."""
        return {
            "settings": sorted(set(self.settings), key=SETTINGS.index),
            "categories": list(self.names),
            "n": self.n,
            "sweep_n": self.sweep_n,
            "size": self.size,
            "seed": SEED,
            "split": self.split,
            "backgrounds": f"sha256:{folder_hash(self.backgrounds)}" if self.backgrounds else False,
        }


@dataclass(frozen=True, kw_only=True)
class Member:
    """One of a benchmark's datasets.

    Attributes:
        setting: Of it.
        level: Hidden or cut share in percent; None: the setting has no levels.
        job: How it is made.
    """

    setting: Setting
    level: int | None
    job: Synth

    def about(self, out: Path) -> dict[str, Any]:
        """What the benchmark's manifest says of it; JSON."""
        return {
            "folder": self.job.out.relative_to(out).as_posix(),
            "setting": self.setting,
            "level": self.level,
            "category": self.job.objects.name,
            "n": self.job.n,
        }


def members(benchmark: Benchmark) -> list[Member]:
    """All datasets, those of a category one after the other.

    Raises:
        InputError: A model for ``cad`` cannot be read, or no category meant has any.
    """
    models = cad_objects(benchmark.models) if benchmark.models else {}
    if benchmark.models and not set(models) & set(benchmark.names):
        raise UsageError(
            f"the models in {benchmark.models} are of {', '.join(models)}, "
            f"none of {', '.join(benchmark.names)}"
        )
    return [
        member
        for name in benchmark.names
        for setting in SETTINGS
        if setting in benchmark.settings
        for member in _members(benchmark, name, setting, models)
    ]


def _members(
    benchmark: Benchmark, name: str, setting: Setting, models: Mapping[str, Cad]
) -> Iterator[Member]:
    objects = Procedural(name)
    if setting == "physical":
        yield _member(benchmark, setting, objects)
    elif setting == "artimage-scale":
        yield _member(benchmark, setting, Scaled(objects, ARTIMAGE.get(name, OTHERS)))
    elif setting == "occlusion":
        whole = Framed(objects, Framing(whole=True))
        for share in HIDDEN:
            yield _member(benchmark, setting, whole, Occlusion(share), share)
    elif setting == "truncation":
        for share in CUT:
            cut = Framed(objects, Framing(beyond=share))
            yield _member(benchmark, setting, cut, Occlusion(0.0), share)
    elif name in models:
        yield _member(benchmark, setting, models[name])


def _member(
    benchmark: Benchmark,
    setting: Setting,
    objects: Objects,
    arrange: Arrangement | None = None,
    share: float | None = None,
) -> Member:
    level = None if share is None else round(100 * share)
    steps: Sequence[str] = (setting, objects.name) if level is None else (
        setting, f"{level:02d}", objects.name
    )  # fmt: skip
    many = setting in ("physical", "artimage-scale")
    job = Synth(
        objects=objects,
        n=benchmark.n if many else benchmark.sweep_n,
        seed=SEED,
        split=benchmark.split,
        size=ARTIMAGE_SIDE if setting == "artimage-scale" else benchmark.size,
        backgrounds=benchmark.backgrounds,
        out=benchmark.out.joinpath(*steps),
        workers=benchmark.workers,
        arrange=arrange,
    )
    return Member(setting=setting, level=level, job=job)
