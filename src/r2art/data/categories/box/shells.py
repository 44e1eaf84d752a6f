"""The bodies of boxes: a hollow base and a lid on it, before anything is fitted to them.

Metres; y = 0 is the underside of the base, x = 0 and z = 0 its middle, +z its front.
"""

from dataclasses import dataclass, field

import numpy as np

from r2art.data.procedural.curved import prism
from r2art.data.procedural.hollow import tub
from r2art.data.procedural.slabs import arc, bent
from r2art.data.procedural.solids import plate, xyz
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
Corners = tuple[FloatArray, FloatArray]
GAP = 5e-4  # m between base and lid


@dataclass(frozen=True)
class Pieces:
    """What belongs to the base and what to the lid."""

    base: list[Surface] = field(default_factory=list)
    lid: list[Surface] = field(default_factory=list)

    def __add__(self, other: "Pieces") -> "Pieces":
        return Pieces([*self.base, *other.base], [*self.lid, *other.lid])


@dataclass(frozen=True)
class Box:
    """A box that is built: its pieces, where its lid turns (m) and how far (rad)."""

    pieces: Pieces
    hinge: tuple[float, float]  # y, z
    opens: float


@dataclass(frozen=True, kw_only=True)
class Shell:
    """Outer measures (m) of a box.

    Attributes:
        width: Along x.
        depth: Along z.
        height: Of the base.
        lid: Of the lid above the base.
        wall: Thickness of the walls.
        radius: Of the upright edges.
        edge: Of the edges around the underside and the top.
        draft: By how much the base narrows downward, on each side.
    """

    width: float
    depth: float
    height: float
    lid: float
    wall: float
    radius: float = 0.0
    edge: float = 0.0
    draft: float = 0.0

    @property
    def x(self) -> float:
        """Half the width."""
        return self.width / 2

    @property
    def z(self) -> float:
        """Half the depth."""
        return self.depth / 2

    @property
    def top(self) -> float:
        """Height of the closed box."""
        return self.height + self.lid

    @property
    def scale(self) -> float:
        """By how much fittings are larger than those of a box 30 cm wide."""
        return float(np.clip((self.width / 0.3) ** 0.7, 0.35, 1.3))

    @property
    def base_box(self) -> Corners:
        """Lower and upper corner of the base."""
        return xyz(-self.x, 0, -self.z), xyz(self.x, self.height, self.z)

    @property
    def lid_box(self) -> Corners:
        """Lower and upper corner of the lid."""
        return xyz(-self.x, self.height + GAP, -self.z), xyz(self.x, self.top, self.z)

    @property
    def inside(self) -> Corners:
        """Lower and upper corner of the room within the base."""
        inset = self.wall + self.draft + 0.3 * max(self.radius - self.wall, 0.0)
        x, z = self.x - inset, self.z - inset
        return xyz(-x, self.wall, -z), xyz(x, self.height - 0.002, z)

    @property
    def ceiling(self) -> Corners:
        """The flat part of the lid; its underside is what one sees in the open lid."""
        inset = self.wall + 0.3 * max(self.radius - self.wall, 0.0)
        x, z = self.x - inset, self.z - inset
        return xyz(-x, self.top - self.wall, -z), xyz(x, self.top, z)


@dataclass(frozen=True, kw_only=True)
class Looks:
    """Materials of a box; ``tile`` (m) is where their textures repeat."""

    outside: Material
    inside: Material
    rim: Material
    metal: Material
    lid: Material
    tile: float | None = 0.4


def base(shell: Shell, looks: Looks) -> list[Surface]:
    """The hollow base."""
    return list(
        tub(
            *shell.base_box,
            shell.wall,
            looks.outside,
            inside=looks.inside,
            rim=looks.rim,
            radius=shell.radius,
            edge=shell.edge,
            draft=shell.draft,
            tile=looks.tile,
        )
    )


def cap_lid(shell: Shell, looks: Looks) -> list[Surface]:
    """A hollow lid as wide as the base, with walls all around."""
    return list(
        tub(
            *shell.lid_box,
            shell.wall,
            looks.lid,
            opens="bottom",
            inside=looks.inside,
            rim=looks.rim,
            radius=shell.radius,
            edge=shell.edge,
            tile=looks.tile,
        )
    )


def board_lid(shell: Shell, looks: Looks, over: float, edge: float) -> list[Surface]:
    """A board that overhangs front and sides by ``over``; its underside is lined."""
    lower, upper = shell.lid_box
    aside = xyz(over, 0, over)
    pieces = plate(
        lower - xyz(over, 0, 0),
        upper + aside,
        1,
        looks.lid,
        radius=shell.radius + over,
        bevel=(0.3 * edge, edge),
        bottom=looks.rim,
        tile=looks.tile,
    )
    inner = (shell.inside[0] * (1, 0, 1), shell.inside[1] * (1, 0, 1))
    depth = min(0.35 * shell.height, 0.004)
    tray = plate(
        inner[0] + xyz(0.002, shell.height - depth, 0.002),
        inner[1] + xyz(-0.002, shell.height + GAP, -0.002),
        1,
        looks.inside,
        tile=looks.tile,
    )
    return [*pieces, *tray]


def vault_lid(shell: Shell, looks: Looks, profile: FloatArray) -> list[Surface]:
    """A hollow lid whose (K, 2) ``profile`` of -z and y runs from the rear over to the front."""
    inner = shell.x - shell.wall
    roof = bent(
        profile, shell.wall, 0, (-inner, inner), looks.lid, inner=looks.inside, tile=looks.tile
    )
    ends = [
        piece
        for span in ((-shell.x, -inner), (inner, shell.x))
        for piece in prism(profile, 0, span, looks.lid, tile=looks.tile)
    ]
    return [*roof, *ends]


def arched(shell: Shell, skirt: float) -> FloatArray:
    """The profile of a barrel vault above upright sides ``skirt`` metres high."""
    z, low, spring = shell.z, shell.height + GAP, shell.height + skirt
    crown = arc((z, spring), (-z, spring), min(shell.lid - skirt, 0.98 * z), 14)
    return np.concatenate([[(z, low)], crown, [(-z, low)]])


def roofed(shell: Shell, skirt: float, flat: float) -> FloatArray:
    """The profile of a hipped roof: upright sides, slopes, and a flat share in the middle."""
    z, low, spring = shell.z, shell.height + GAP, shell.height + skirt
    half = flat * z
    return np.array(
        [(z, low), (z, spring), (half, shell.top), (-half, shell.top), (-z, spring), (-z, low)]
    )
