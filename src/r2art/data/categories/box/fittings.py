"""What is fitted to boxes: hinges, corner pieces, straps, nails, edging, feet."""

import numpy as np

from r2art.data.categories.box.shells import GAP, Pieces, Shell
from r2art.data.procedural.curved import ellipsoid
from r2art.data.procedural.randomness import between, chance
from r2art.data.procedural.slabs import bent
from r2art.data.procedural.solids import box, cylinder, decal, xyz
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray


def hinges(rng: np.random.Generator, shell: Shell, look: Material, spine: Material) -> Pieces:
    """Two butt hinges, or one along the whole rear edge; ``spine`` closes the gap between."""
    radius = 0.0038 * shell.scale
    y, z = pivot(shell)
    center, straight = xyz(0, y, z), shell.width - 2 * shell.radius
    if chance(rng, 0.3) or shell.width < 0.12:
        return Pieces(base=[*cylinder(center, 0, 0.8 * radius, 0.97 * straight, look)])
    pieces = Pieces(base=[*cylinder(center, 0, 0.55 * radius, 0.99 * straight, spine, segments=8)])
    long, tall = between(rng, 0.02, 0.05) * shell.scale, 0.016 * shell.scale
    at = between(rng, 0.28, 0.38) * shell.width
    for x in (-at, at):
        low = xyz(x - long / 2, shell.height - min(tall, 0.8 * shell.height), -shell.z - 0.0012)
        high = xyz(x + long / 2, shell.height - 0.001, -shell.z + 1e-4)
        reach = min(tall, 0.8 * shell.lid)
        upper = box(
            xyz(low[0], shell.height + 0.001, low[2]),
            xyz(high[0], shell.height + reach, high[2]),
            look,
        )
        barrel = cylinder(center + xyz(x, 0, 0), 0, radius, long, look, segments=10)
        pieces += Pieces([box(low, high, look), *barrel], [upper])
    return pieces


def pivot(shell: Shell) -> tuple[float, float]:
    """y and z of the line about which `hinges` turn."""
    return shell.height + GAP / 2, -shell.z - 0.0012 * shell.scale


def corners(shell: Shell, look: Material, size: float, *, lid: bool = True) -> Pieces:
    """Metal caps over the four lower corners and, on a flat lid, the four upper ones."""
    thick = 0.0011
    base = _caps(shell, 0.0, 1, look, min(size, 0.45 * shell.height), thick)
    top = _caps(shell, shell.top, -1, look, min(size, 0.9 * shell.lid), thick) if lid else []
    return Pieces(base, top)


def _caps(
    shell: Shell, y: float, up: int, look: Material, size: float, thick: float
) -> list[Surface]:
    pieces = []
    for sx in (-1, 1):
        for sz in (-1, 1):
            corner = xyz(sx * shell.x, y, sz * shell.z)
            inward = xyz(-sx, up, -sz)
            for axis in range(3):
                reach = size * inward
                reach[axis] = 0.0
                ends = np.stack([corner - thick * inward, corner + reach])
                ends[1, axis] = corner[axis]
                pieces.append(box(ends.min(axis=0), ends.max(axis=0), look))
    return pieces


def bands(
    shell: Shell, look: Material, places: list[float], width: float, profile: FloatArray | None
) -> Pieces:
    """Straps around the box at the given x, over the lid's ``profile`` or its flat top."""
    thick = 0.0016
    if profile is None:
        z, low = shell.z, shell.height + GAP
        profile = np.array([(z, low), (z, shell.top), (-z, shell.top), (-z, low)])
    path = profile[::-1]  # clockwise: the strap lies on the outside
    under = np.array([(-shell.z, 0), (shell.z, 0)])
    low = np.concatenate([[(-shell.z, shell.height)], under, [(shell.z, shell.height)]])
    base, lid = [], []
    for x in places:
        span = (x - width / 2, x + width / 2)
        base += bent(low[::-1], thick, 0, span, look)
        lid += bent(path, thick, 0, span, look)
    return Pieces(base, lid)


def studs(points: FloatArray, radius: float, look: Material, outward: int) -> list[Surface]:
    """Nail heads at (N, 3) points of a face towards +z (``outward`` 2) or +y (1)."""
    flat = np.full(3, radius)
    flat[outward] *= 0.6
    return [ellipsoid(p, flat, look, rings=4, segments=6) for p in points]


def edging(shell: Shell, look: Material, width: float, *, lid: bool = True) -> Pieces:
    """Strips of another material along all edges of base and (flat) lid."""
    base = _borders(*shell.base_box, look, width, ("front", "back", "left", "right"))
    if not lid:
        return Pieces(base)
    low = shell.lid_box
    top = _borders(*low, look, min(width, 0.45 * shell.lid), ("front", "back", "left", "right"))
    return Pieces(base, [*top, *_borders(*low, look, width, ("top",))])


def _borders(
    lower: FloatArray, upper: FloatArray, look: Material, width: float, sides: tuple[str, ...]
) -> list[Surface]:
    size = upper - lower
    extents = {"front": (0, 1), "back": (0, 1), "left": (2, 1), "right": (2, 1), "top": (0, 2)}
    pieces = []
    for side in sides:
        w, h = (float(size[k]) for k in extents[side])
        a, b = 0.5 * width / w, 0.5 * width / h
        for at, extent in (
            ((0.5, b), (w, width)),
            ((0.5, 1 - b), (w, width)),
            ((a, 0.5), (width, h)),
            ((1 - a, 0.5), (width, h)),
        ):
            pieces.append(decal(lower, upper, side, look, at=at, size=extent, lift=7e-4))
    return pieces


def feet(shell: Shell, look: Material, *, height: float, radius: float) -> Pieces:
    """Four round feet under the base."""
    inset = radius + 0.02 * shell.width + shell.draft
    x, z = shell.x - inset, shell.z - inset
    return Pieces(
        [
            piece
            for px in (-x, x)
            for pz in (-z, z)
            for piece in cylinder((px, -height / 2, pz), 1, radius, height, look, segments=10)
        ]
    )
