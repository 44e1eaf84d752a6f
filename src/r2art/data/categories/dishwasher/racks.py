"""Wire racks, and the dishes in them."""

import numpy as np

from r2art.data.procedural.carved import carved
from r2art.data.procedural.curved import revolved
from r2art.data.procedural.dishes import dish
from r2art.data.procedural.randomness import Color, between, chance, pick, tinted
from r2art.data.procedural.solids import box, cylinder, xyz
from r2art.data.procedural.wires import wires
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
_CHINA: tuple[Color, ...] = (
    (0.93, 0.93, 0.92),
    (0.93, 0.93, 0.92),
    (0.9, 0.87, 0.8),
    (0.35, 0.45, 0.6),
    (0.75, 0.5, 0.35),
    (0.3, 0.32, 0.33),
    (0.65, 0.75, 0.65),
    (0.8, 0.3, 0.25),
)
_STEEL = Material(color=(0.7, 0.7, 0.71), roughness=0.2, metallic=0.9)
_GLASS = Material(color=(0.7, 0.76, 0.78), roughness=0.06)


def rack(
    rng: np.random.Generator, lower: FloatArray, upper: FloatArray, look: Material, *, tines: float
) -> list[Surface]:
    """A basket of wire that fills a box, with rows of ``tines`` (m) to stand plates between."""
    step = between(rng, 0.048, 0.06)
    (x0, y0, z0), (x1, y1, z1) = lower.tolist(), upper.tolist()
    xs, zs = (np.linspace(a, b, max(3, round((b - a) / step))) for a, b in ((x0, x1), (z0, z1)))
    front = y1 - between(rng, 0.0, 0.35) * (y1 - y0)  # its front may be lower
    ends: list[tuple[tuple[float, float, float], tuple[float, float, float]]] = []
    for x in xs:
        ends += [
            ((x, y0, z0), (x, y0, z1)),
            ((x, y0, z0), (x, y1, z0)),
            ((x, y0, z1), (x, front, z1)),
        ]
    for z in zs:
        ends += [((x0, y0, z), (x1, y0, z)), ((x0, y0, z), (x0, y1, z)), ((x1, y0, z), (x1, y1, z))]
    for y in (y1, (y0 + y1) / 2):
        f = min(y, front)
        ends += [((x0, y, z0), (x1, y, z0)), ((x0, f, z1), (x1, f, z1))]
        ends += [((x, y, z0), (x, f, z1)) for x in (x0, x1)]
    for x in xs[1:-1:2]:
        ends += [((x, y0, z), (x, y0 + tines, z)) for z in np.arange(z0 + 0.03, z1 - 0.02, 0.04)]
    return [wires(ends, between(rng, 0.0022, 0.003), look)]


def wheels(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Four wheels below and outside a rack that fills the box."""
    look = Material(
        color=tinted(rng, pick(rng, ((0.5, 0.5, 0.52), (0.8, 0.8, 0.8)))), roughness=0.5
    )
    at = [(x, z) for x in (lower[0], upper[0]) for z in (lower[2] + 0.06, upper[2] - 0.06)]
    return [
        s for x, z in at for s in cylinder((x, lower[1], z), 0, 0.019, 0.012, look, segments=10)
    ]


def basket(rng: np.random.Generator, corner: FloatArray) -> list[Surface]:
    """A cutlery basket whose lower front left corner is given, with its cutlery."""
    look = Material(
        color=tinted(rng, pick(rng, ((0.5, 0.51, 0.53), (0.85, 0.85, 0.85), (0.2, 0.2, 0.22)))),
        roughness=0.6,
    )
    size = xyz(between(rng, 0.12, 0.2), between(rng, 0.1, 0.13), -between(rng, 0.08, 0.13))
    lower, upper = np.minimum(corner, corner + size), np.maximum(corner, corner + size)
    inner = lower + 0.004, upper - (0.004, 0.0, 0.004)
    pieces = [*carved((lower, upper), inner, 1, look, radius=0.01)]
    count = int(rng.integers(0, 16))
    if count:
        foot = lower + 0.015 + rng.random((count, 3)) * (upper - lower - 0.03) * (1, 0, 1)
        lean = foot + rng.uniform(-0.012, 0.012, (count, 3)) * (1, 0, 1)
        lean[:, 1] = upper[1] + rng.uniform(0.03, 0.09, count)
        pieces.append(wires(np.stack([foot, lean], axis=1), 0.004, _STEEL))
    return pieces


def plates(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Plates standing in a row in the box, all of them facing to the front or to a side."""
    axis = pick(rng, (0, 2))
    radius = min(
        between(rng, 0.085, 0.135), 0.48 * (upper - lower)[1], 0.48 * (upper - lower)[2 - axis]
    )
    look = _china(rng)
    shape = dish("plate", radius, between(rng, 0.015, 0.024))
    other, share = 2 - axis, between(rng, 0.3, 1.0)
    pieces: list[Surface] = []
    at = lower + radius
    at[other] = between(rng, lower[other] + radius, upper[other] - radius)
    for place in np.arange(lower[axis] + 0.02, upper[axis] - 0.03, between(rng, 0.03, 0.05))[:14]:
        if chance(rng, share):
            at[axis] = place
            if chance(rng, 0.1):
                look = _china(rng)
            pieces.append(revolved(shape, at, axis, look, segments=14))
    return pieces


def cups(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Cups, glasses and bowls that stand upside down on the floor of the box."""
    looks = [_china(rng), _china(rng), _GLASS]
    step, share = between(rng, 0.085, 0.11), between(rng, 0.15, 0.8)
    pieces: list[Surface] = []
    for x in np.arange(lower[0] + 0.055, upper[0] - 0.04, step):
        for z in np.arange(lower[2] + 0.055, upper[2] - 0.04, step):
            if chance(rng, share) and len(pieces) < 12:
                kind = pick(rng, ("cup", "cup", "glass", "glass", "bowl"))
                tall = {"cup": 0.09, "glass": 0.12, "bowl": 0.055}[kind] * between(rng, 0.85, 1.1)
                radius = {"cup": 0.04, "glass": 0.034, "bowl": 0.06}[kind] * between(rng, 0.9, 1.05)
                shape = dish(kind, radius, min(tall, upper[1] - lower[1]), upturned=True)
                look = _GLASS if kind == "glass" else pick(rng, looks)
                pieces.append(revolved(shape, (x, lower[1], z), 1, look, segments=10))
    return pieces


def pots(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """One or two pots upside down."""
    size, pieces = upper - lower, []
    for x in (0.27, 0.74)[: int(rng.integers(1, 3))]:
        radius = min(between(rng, 0.08, 0.12), 0.22 * size[0])
        tall = min(between(rng, 0.08, 0.15), 0.9 * size[1])
        at = lower + size * (x, 0, between(rng, 0.4, 0.6))
        look = pick(rng, (_STEEL, Material(color=(0.08, 0.08, 0.08), roughness=0.4)))
        pieces.append(revolved(dish("pot", radius, tall, upturned=True), at, 1, look, segments=22))
        grip = at + xyz(radius, 0.75 * tall, 0)
        pieces.append(box(grip - xyz(0, 0.006, 0.02), grip + xyz(0.03, 0.006, 0.02), look))
    return pieces


def _china(rng: np.random.Generator) -> Material:
    return Material(color=tinted(rng, pick(rng, _CHINA), 0.02), roughness=between(rng, 0.08, 0.25))
