"""Single things that lie in boxes: a shoe, tools, a ring, a watch, a pencil."""

import numpy as np

from r2art.data.categories.box.prints import VIVID
from r2art.data.procedural.curved import ellipsoid, revolved, tube
from r2art.data.procedural.randomness import Color, between, pick, tinted
from r2art.data.procedural.slabs import bent
from r2art.data.procedural.solids import box, cylinder, decal, plate, xyz
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
_STEEL = Material(color=(0.66, 0.66, 0.68), roughness=0.25, metallic=0.9)
_BLACK = Material(color=(0.06, 0.06, 0.065), roughness=0.55)
_WOOD = Material(color=(0.72, 0.55, 0.36), roughness=0.6)
_GOLD = Material(color=(0.85, 0.65, 0.3), roughness=0.15, metallic=1.0)
_SILVER = Material(color=(0.8, 0.8, 0.82), roughness=0.12, metallic=1.0)


def matt(color: Color, roughness: float = 0.75) -> Material:
    """A plain look."""
    return Material(color=color, roughness=roughness)


def sneaker(
    at: FloatArray,
    toe: int,
    length: float,
    width: float,
    height: float,
    upper: Material,
    sole: Material,
) -> list[Surface]:
    """A shoe whose sole's middle is ``at``; it points along ``toe`` times x."""
    half, thick = length / 2, 0.22 * height
    base = plate(
        at + xyz(-half, 0, -width / 2),
        at + xyz(half, thick, width / 2),
        1,
        sole,
        radius=0.45 * width,
        bevel=0.25 * thick,
    )
    tip = at + xyz(toe * 0.2 * length, 0.9 * thick, 0)
    heel = at + xyz(-toe * 0.22 * length, 0.9 * thick, 0)
    round_ = (0.0, np.pi / 2)  # the upper half, once its pole points up
    body = [
        _dome(tip, (0.29 * length, 0.42 * height, 0.46 * width), upper, round_),
        _dome(heel, (0.27 * length, 0.78 * height, 0.42 * width), upper, round_),
    ]
    throat = ellipsoid(
        heel + xyz(-toe * 0.02 * length, 0.7 * height, 0),
        (0.17 * length, 0.09 * height, 0.27 * width),
        _BLACK,
        rings=5,
        segments=12,
    )
    laces = [
        box(
            tip
            + xyz(-toe * (0.04 + 0.035 * k) * length - 0.003, (0.36 + 0.06 * k) * height, -0.016),
            tip
            + xyz(-toe * (0.04 + 0.035 * k) * length + 0.003, (0.44 + 0.06 * k) * height, 0.016),
            sole,
        )
        for k in range(3)
    ]
    return [*base, *body, throat, *laces]


def _dome(
    at: FloatArray, radii: tuple[float, float, float], look: Material, polar: tuple[float, float]
) -> Surface:
    """The upper half of an ellipsoid on ``at``."""
    x, y, z = radii
    shell = ellipsoid((0, 0, 0), (x, z, y), look, polar=polar, rings=6, segments=15)
    turn = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], dtype=np.float64)  # z up, y to the rear
    return Surface(
        vertices=at + shell.vertices @ turn,
        faces=shell.faces,
        normals=shell.normals @ turn,
        uv=shell.uv,
        material=look,
    )


def screwdriver(
    rng: np.random.Generator, at: FloatArray, length: float, room: float
) -> list[Surface]:
    """Along x on ``at``, at most ``room`` to either side."""
    r = min(0.015, room)
    look = Material(color=tinted(rng, pick(rng, VIVID)), roughness=0.3)
    side = pick(rng, (-1, 1))
    grip, y = 0.42 * length, at[1] + r
    profile = [(0.6 * r, 0), (r, 0.12 * grip), (0.85 * r, 0.5 * grip), (r, 0.8 * grip)]
    profile += [(0.5 * r, grip), (0.0, grip)]
    handle = revolved([(0.0, 0.0), *profile], (0, 0, 0), 0, look, segments=10)
    flip = np.array([side, 1.0, side])
    start = xyz(at[0] - side * length / 2, y, at[2])
    blade = cylinder(
        start + xyz(side * (grip + length) / 2, 0, 0), 0, 0.0032, length - grip, _STEEL, segments=8
    )
    return [
        Surface(
            vertices=start + handle.vertices * flip,
            faces=handle.faces,
            normals=handle.normals * flip,
            uv=handle.uv,
            material=look,
        ),
        *blade,
    ]


def hammer(rng: np.random.Generator, at: FloatArray, length: float, room: float) -> list[Surface]:
    """Along x, its head on one side."""
    r = min(0.013, 0.8 * room)
    side = pick(rng, (-1, 1))
    look = _WOOD if rng.random() < 0.6 else Material(color=pick(rng, VIVID), roughness=0.4)
    y = at[1] + max(r, 0.012)
    shaft = cylinder((at[0], y, at[2]), 0, r, 0.95 * length, look, segments=10, bevel=0.003)
    x, half = at[0] + side * 0.42 * length, min(1.6 * room, 0.05)
    head = plate(
        (x - 0.014, y - 0.012, at[2] - half),
        (x + 0.014, y + 0.014, at[2] + half),
        2,
        _STEEL,
        radius=0.006,
        bevel=0.003,
    )
    return [*shaft, *head]


def wrench(rng: np.random.Generator, at: FloatArray, length: float, room: float) -> list[Surface]:
    """Along x, a ring at either end."""
    r, thick = min(0.016, room), 0.006
    y = at[1] + thick / 2
    bar = plate(
        at + xyz(-0.45 * length, 0, -0.45 * r),
        at + xyz(0.45 * length, 0.8 * thick, 0.45 * r),
        1,
        _STEEL,
        bevel=0.001,
    )
    pieces = [*bar]
    for x in (-0.46 * length, 0.46 * length):
        center = xyz(at[0] + x, y, at[2])
        pieces += cylinder(center, 1, r, thick, _STEEL, segments=12, bevel=0.001)
        hole = center + xyz(0, thick / 2, 0)
        pieces += cylinder(hole, 1, 0.55 * r, 8e-4, _BLACK, segments=6)
    return pieces


def tape_measure(rng: np.random.Generator, at: FloatArray) -> list[Surface]:
    """Lying flat, its lower corner ``at``."""
    look = Material(
        color=pick(rng, ((0.95, 0.75, 0.1), (0.9, 0.3, 0.1), (0.2, 0.2, 0.2))), roughness=0.4
    )
    body = plate(at, at + xyz(0.065, 0.034, 0.06), 1, look, radius=0.018, bevel=0.004)
    disc = cylinder(at + xyz(0.0325, 0.034, 0.03), 1, 0.021, 0.002, _BLACK, segments=16)
    return [*body, *disc]


def ring(rng: np.random.Generator, at: FloatArray, *, flat: bool) -> list[Surface]:
    """A finger ring with a stone, lying or standing."""
    look = _GOLD if rng.random() < 0.6 else _SILVER
    r = between(rng, 0.008, 0.0095)
    angle = np.linspace(0, 2 * np.pi, 17)
    circle = np.stack([r * np.cos(angle), r * np.sin(angle)], axis=-1)
    zero = np.zeros(17)
    if flat:
        path = np.stack([circle[:, 0], zero, circle[:, 1]], axis=-1)
        up, stone = (0, 1, 0), at + xyz(0, 0.001, r)
    else:
        path = np.stack([circle[:, 0], circle[:, 1], zero], axis=-1)
        up, stone = (0, 0, 1), at + xyz(0, r, 0)
    gem = Material(color=tinted(rng, pick(rng, (*VIVID, (0.9, 0.9, 0.95)))), roughness=0.08)
    return [
        tube(at + path, 0.0012, look, up=up, segments=6),
        ellipsoid(stone, (0.003, 0.003, 0.003), gem, rings=4, segments=7),
    ]


def bead_string(rng: np.random.Generator, at: FloatArray, radius: float) -> list[Surface]:
    """Pearls or beads in a loose loop."""
    look = Material(
        color=pick(rng, ((0.95, 0.92, 0.88), (0.85, 0.8, 0.75), *VIVID)), roughness=0.15
    )
    r = between(rng, 0.0025, 0.004)
    angle = np.arange(0, 2 * np.pi, 2.1 * r / max(radius, 4 * r))
    wobble = 1 + 0.25 * np.sin(2 * angle + between(rng, 0, 6))
    reach = max(radius, 4 * r) * wobble * 0.8
    return [
        ellipsoid(at + xyz(d * np.cos(a), r, d * np.sin(a)), (r, r, r), look, rings=4, segments=7)
        for a, d in zip(angle, reach, strict=True)
    ]


def watch(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Around the cushion ``lower``..``upper``, its face up."""
    center, tall, deep = (lower + upper) / 2, upper[1], upper[2] - lower[2]
    strap = Material(
        color=tinted(
            rng, pick(rng, ((0.1, 0.1, 0.1), (0.35, 0.2, 0.1), (0.6, 0.6, 0.62), (0.2, 0.25, 0.4)))
        ),
        roughness=0.4,
    )
    half = min(0.011, 0.3 * (upper[0] - lower[0]))
    z0, z1, r = center[2] + deep / 2, center[2] - deep / 2, 0.3 * deep
    path = [(-z0, tall - r), (-z0 + 0.7 * r, tall - 0.2 * r), (-z0 + r, tall)]
    path += [(-z1 - r, tall), (-z1 - 0.7 * r, tall - 0.2 * r), (-z1, tall - r)]
    around = bent(path, 0.0025, 0, (center[0] - half, center[0] + half), strap)
    case = pick(rng, (_GOLD, _SILVER, _SILVER, _BLACK))
    radius = min(1.75 * half, 0.021)
    top = xyz(center[0], tall + 0.004, center[2])
    dial: Color = pick(rng, ((0.95, 0.95, 0.93), (0.05, 0.05, 0.06), (0.1, 0.15, 0.35)))
    face = Material(color=dial, roughness=0.08)
    hands = Material(color=(0.9, 0.9, 0.9) if sum(dial) < 1 else (0.1, 0.1, 0.1), roughness=0.4)
    flat = top + xyz(0, 0.0052, 0)
    return [
        *around,
        *cylinder(top, 1, radius, 0.008, case, segments=18, bevel=0.001),
        *cylinder(top + xyz(0, 0.0042, 0), 1, 0.85 * radius, 0.001, face, segments=18),
        decal(flat, flat, "top", hands, size=(0.0016, 1.3 * radius)),
        decal(
            flat + xyz(0.25 * radius, 0, 0),
            flat + xyz(0.25 * radius, 0, 0),
            "top",
            hands,
            size=(0.6 * radius, 0.0016),
        ),
    ]


def pencil(rng: np.random.Generator, at: FloatArray, length: float, r: float) -> list[Surface]:
    """Along x, its tip to the right."""
    look = Material(color=tinted(rng, pick(rng, (*VIVID, (0.9, 0.7, 0.15)))), roughness=0.35)
    tip = 4 * r
    body = cylinder(at - xyz(tip / 2, 0, 0), 0, r, length - tip, look, segments=6)
    start = at + xyz(length / 2 - tip, 0, 0)
    cone = revolved([(r, 0), (0.3 * r, 0.7 * tip)], start, 0, _WOOD, segments=6)
    lead = revolved([(0.3 * r, 0.7 * tip), (0.0, tip)], start, 0, look, segments=6)
    return [*body, cone, lead]
