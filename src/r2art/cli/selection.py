"""Which objects a command is about: the options that `r2art synth` and `r2art prior` share."""

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from r2art.cli.option import option
from r2art.core.errors import UsageError

if TYPE_CHECKING:
    from r2art.core.category import Category
    from r2art.data.models.imported import Format
    from r2art.data.objects import Objects, Split


def _procedural() -> str:
    """Names of the categories that come with r2art, found without importing any."""
    spec = find_spec("r2art.data.categories")
    folders = spec.submodule_search_locations if spec else None
    return ", ".join(sorted(module.name for module in iter_modules(folders or [])))


_MODELS = arg(metavar="PATH...", help_behavior_hint="")


@dataclass(frozen=True)
class Selection:
    """A procedural category, or models of your own.

    Attributes:
        category: One that comes with r2art; nothing if models are given.
        urdf: URDF files, or folders with one each, instead of a category: one object, or
            several of one kind.
        mjcf: The same, as MuJoCo XML files.
        partnet: The same, as folders of PartNet-Mobility.
        name: What the models' category is called.
        fix: Joints of the models to hold still, so that what they join is one part: --fix finger1
            finger2, or --fix 'finger*', or --fix finger1=0.04 to hold it there (rad, m).
        root: Link of the models that is the root part, or belongs to it.
        up: Axis of the models that points up: x, y, z, or with an equals sign --up=-x, -y, -z.
        front: Axis to which their front looks; the same.
        scale: Metres in the models' unit of length; 0.001 if they are in millimetres.
        recolor: Give the models' untextured surfaces other colours on every photo.
    """

    category: Annotated[
        Positional[str | None],
        arg(
            metavar="[CATEGORY]",
            help=f"One that comes with r2art: {_procedural()}. Or leave it out and give models of "
            "your own with --urdf, --mjcf or --partnet (docs/importing.md).",
            help_behavior_hint="",
        ),
    ] = None
    urdf: Annotated[tuple[Path, ...], _MODELS] = ()
    mjcf: Annotated[tuple[Path, ...], _MODELS] = ()
    partnet: Annotated[tuple[Path, ...], _MODELS] = ()
    name: Annotated[str | None, option("NAME", "the first model's")] = None
    fix: Annotated[tuple[str, ...], arg(metavar="JOINT...", help_behavior_hint="")] = ()
    root: Annotated[str | None, option("LINK", "as the file has it")] = None
    up: Annotated[str | None, option("AXIS", "z")] = None
    front: Annotated[str | None, option("AXIS", "x; PartNet-Mobility: -x")] = None
    scale: float = 1.0
    recolor: bool = False

    def objects(self, split: "Split" = "train") -> "Objects":
        """What is meant.

        Raises:
            UsageError: Nothing, or two things.
        """
        from r2art.data.objects import Procedural

        given: dict[Format, tuple[Path, ...]]
        given = {"urdf": self.urdf, "mjcf": self.mjcf, "partnet": self.partnet}
        meant: list[Format] = [format for format, paths in given.items() if paths]
        if (self.category is not None) + len(meant) != 1:
            raise UsageError(
                "say what to show: a category such as laptop, or else --urdf, --mjcf or --partnet"
            )
        if self.category is not None:
            return Procedural(self.category)

        from r2art.data.models.build import Reading
        from r2art.data.models.imported import imported

        reading = Reading(
            fix=self.fix, root=self.root, up=self.up, front=self.front, scale=self.scale
        )
        return imported(
            meant[0],
            given[meant[0]],
            name=self.name,
            split=split,
            reading=reading,
            recolor=self.recolor,
        )


def say_filled(out: Path, category: str) -> None:
    """Say what a run of `r2art synth` has left: a whole dataset, or its share of one."""
    from r2art.data.filling import WHOLE, missing
    from r2art.data.shards import read_manifest
    from r2art.run.report import say

    manifest = read_manifest(out)
    if left := len(missing(out, manifest, WHOLE)):
        say("written", f"{out}: its share; {left} of {manifest['shards']} shards are still missing")
    else:
        say("written", f"{out} ({manifest['n']} photos of {category}); look: r2art data show {out}")


def write_prior(category: "Category", path: Path) -> None:
    """Write a prior, whole or not at all, and say what it holds."""
    from io import BytesIO

    from r2art.run.files import write_whole
    from r2art.run.report import say

    content = BytesIO()
    category.save(content)
    write_whole(path, content.getvalue())
    joints = ", ".join(f"{j.name} ({j.kind})" for j in category.joints)
    say("written", f"{path}: {category.name}, parts {', '.join(category.part_names)}; {joints}")
