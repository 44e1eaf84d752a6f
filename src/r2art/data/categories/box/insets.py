"""What boxes keep in order: compartments, rows, foam. Fillers as in `contents`."""

from itertools import pairwise

import numpy as np

from r2art.data.categories.box.goods import (
    bead_string,
    hammer,
    matt,
    pencil,
    ring,
    screwdriver,
    tape_measure,
    watch,
    wrench,
)
from r2art.data.categories.box.prints import VIVID
from r2art.data.procedural.curved import ellipsoid
from r2art.data.procedural.materials import felt
from r2art.data.procedural.randomness import Color, between, chance, pick, tinted
from r2art.data.procedural.solids import box, cylinder, decal, plate, skin, xyz
from r2art.data.procedural.textures import label
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
_FELTS: tuple[Color, ...] = (
    (0.1, 0.1, 0.1),
    (0.85, 0.8, 0.7),
    (0.5, 0.5, 0.5),
    (0.35, 0.06, 0.1),
    (0.08, 0.1, 0.25),
)


def divided(
    lower: FloatArray, upper: FloatArray, columns: int, rows: int, look: Material, thick: float
) -> tuple[list[Surface], list[tuple[FloatArray, FloatArray]]]:
    """Walls between ``columns`` x ``rows`` compartments, and the compartments."""
    xs = np.linspace(lower[0], upper[0], columns + 1)
    zs = np.linspace(lower[2], upper[2], rows + 1)
    walls = [
        box((x - thick / 2, lower[1], lower[2]), (x + thick / 2, upper[1], upper[2]), look)
        for x in xs[1:-1]
    ]
    walls += [
        box((lower[0], lower[1], z - thick / 2), (upper[0], upper[1], z + thick / 2), look)
        for z in zs[1:-1]
    ]
    inset = xyz(thick / 2 + 5e-4, 0, thick / 2 + 5e-4)
    rooms = [
        (xyz(a, lower[1], c) + inset, xyz(b, upper[1], d) - inset)
        for a, b in pairwise(xs.tolist())
        for c, d in pairwise(zs.tolist())
    ]
    return walls, rooms


def jewels(
    rng: np.random.Generator,
    lower: FloatArray,
    upper: FloatArray,
    lining: Material | None = None,
) -> list[Surface]:
    """Rings in rolls of felt, chains, pearls, brooches in compartments."""
    size = upper - lower
    look = lining or felt(rng, pick(rng, _FELTS))
    top = lower[1] + min(0.55 * size[1], 0.03)
    columns, rows = np.clip(np.round(size[[0, 2]] / (0.07, 0.06)), 1, (5, 3)).astype(int).tolist()
    walls, rooms = divided(lower, upper * (1, 0, 1) + xyz(0, top, 0), columns, rows, look, 0.004)
    pieces = list(walls)
    for low, high in rooms:
        kind = pick(rng, ("rolls", "beads", "rings", "gems", "empty"))
        middle = (low + high) / 2 * (1, 0, 1) + xyz(0, low[1], 0)
        r = min(0.36 * min(high[0] - low[0], high[2] - low[2]), 0.03)
        if kind == "rolls":
            pieces += _ring_rolls(rng, low, high, look)
        elif kind == "beads":
            pieces += bead_string(rng, middle, r)
        elif kind == "rings":
            for _ in range(int(rng.integers(1, 4))):
                at = middle + xyz(between(rng, -r, r), 0.002, between(rng, -r, r)) * 0.6
                pieces += ring(rng, at, flat=True)
        elif kind == "gems":
            for _ in range(int(rng.integers(1, 6))):
                at = middle + xyz(between(rng, -r, r), 0.004, between(rng, -r, r)) * 0.8
                gem = Material(color=tinted(rng, pick(rng, VIVID)), roughness=0.1)
                pieces.append(ellipsoid(at, (0.006, 0.004, 0.006), gem, rings=4, segments=8))
    return pieces


def _ring_rolls(
    rng: np.random.Generator, low: FloatArray, high: FloatArray, look: Material
) -> list[Surface]:
    count = max(2, int((high[2] - low[2]) / 0.013))
    step = (high[2] - low[2]) / count
    pieces: list[Surface] = []
    wide, x = high[0] - low[0], (low[0] + high[0]) / 2
    for k in range(count):
        at = xyz(x, low[1] + 0.5 * step, low[2] + (k + 0.5) * step)
        pieces += cylinder(at, 0, 0.48 * step, 0.96 * wide, look, segments=10)
        if chance(rng, 0.4):
            place = at + xyz(between(rng, -0.35, 0.35) * wide, 0.4 * step, 0.5 * step)
            pieces += ring(rng, place, flat=False)
    return pieces


def cigars(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """A layer of them, banded, front to back or side by side."""
    size = upper - lower
    r = min(between(rng, 0.0075, 0.0095), 0.45 * size[1])
    count = int(size[0] / (2.05 * r))
    leaf = matt(tinted(rng, (0.36, 0.22, 0.13)), 0.8)
    paper = Material(color=tinted(rng, pick(rng, VIVID)), roughness=0.4)
    taken = int(rng.integers(0, max(1, count // 3)))
    y = lower[1] + max(0.0, size[1] - 2 * r - between(rng, 0.002, 0.02)) * 0.9 + r
    under = box(lower, xyz(upper[0], y - r, upper[2]), leaf)
    pieces = [under]
    for k in range(count - taken):
        at = xyz(lower[0] + (k + 0.5) * size[0] / count, y, (lower[2] + upper[2]) / 2)
        pieces += cylinder(at, 2, r, 0.96 * size[2], leaf, segments=9, bevel=0.002)
        band = at + xyz(0, 0, 0.22 * size[2])
        pieces += cylinder(band, 2, 1.05 * r, 0.016, paper, segments=9)
    return pieces


def watches(
    rng: np.random.Generator,
    lower: FloatArray,
    upper: FloatArray,
    lining: Material | None = None,
) -> list[Surface]:
    """Cushions in compartments, most with a watch around them."""
    size = upper - lower
    look = lining or felt(rng, pick(rng, _FELTS))
    columns, rows = max(1, round(size[0] / 0.065)), max(1, round(size[2] / 0.1))
    walls, rooms = divided(lower, upper - xyz(0, 0.3 * size[1], 0), columns, rows, look, 0.005)
    pieces = list(walls)
    for low, high in rooms:
        tall = min(0.05, 0.9 * (upper[1] - low[1]))
        pillow = (low + xyz(0.003, 0, 0.008), xyz(high[0] - 0.003, low[1] + tall, high[2] - 0.008))
        pieces += plate(*pillow, 0, look, radius=0.4 * tall, bevel=0.006)
        if chance(rng, 0.75):
            pieces += watch(rng, *pillow)
    return pieces


def money(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """A tray of coins over bank notes and keys."""
    size = upper - lower
    look = matt(pick(rng, ((0.1, 0.1, 0.1), (0.75, 0.75, 0.75), (0.35, 0.12, 0.12))), 0.5)
    y = lower[1] + between(rng, 0.35, 0.6) * size[1]
    floor = box(xyz(lower[0], y - 0.002, lower[2]), xyz(upper[0], y, upper[2]), look)
    columns = int(np.clip(size[0] / 0.045, 3, 6))
    top = min(upper[1], y + 0.035)
    walls, rooms = divided(
        xyz(lower[0], y, lower[2]), xyz(upper[0], top, upper[2]), columns, 2, look, 0.002
    )
    pieces = [floor, *walls]
    coins = [
        Material(color=c, roughness=0.35, metallic=0.9)
        for c in ((0.75, 0.6, 0.3), (0.7, 0.7, 0.72), (0.65, 0.4, 0.25))
    ]
    for low, high in rooms:
        room = (high - low)[[0, 2]]
        for _ in range(int(rng.integers(0, 5))):
            r = min(between(rng, 0.009, 0.013), 0.4 * min(room))
            x, z = low[[0, 2]] + r + rng.random(2) * np.maximum(room - 2 * r, 0)
            tall = between(rng, 0.002, 0.018)
            pieces += cylinder((x, y + tall / 2, z), 1, r, tall, pick(rng, coins), segments=12)
    if chance(rng, 0.4):
        note = Material(color=(1, 1, 1), texture=label(rng), roughness=0.8)
        low, high = rooms[int(rng.integers(len(rooms)))]
        pieces.append(decal(low, xyz(high[0], y + 0.004, high[2]), "top", note))
    return pieces


def pencils(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Side by side along the box, of all colours, and an eraser."""
    size = upper - lower
    r = min(0.0038, 0.4 * size[1])
    lanes = int(size[2] / (2.3 * r))
    pieces = []
    layers = 1 if size[1] < 0.02 else 2
    for layer in range(layers):
        for k in range(lanes):
            if chance(rng, 0.15 + 0.3 * layer):
                continue
            length = min(between(rng, 0.11, 0.178), 0.97 * size[0])
            x = lower[0] + length / 2 + rng.random() * (size[0] - length)
            at = xyz(x, lower[1] + r * (1 + 1.9 * layer), lower[2] + (k + 0.5) * size[2] / lanes)
            pieces += pencil(rng, at, length, r)
    if chance(rng, 0.6) and size[2] > 0.04:
        at = xyz(upper[0] - 0.035, lower[1] + 2.2 * r * layers, (lower[2] + upper[2]) / 2)
        top = np.minimum(at + xyz(0.034, 0.011, 0.018), upper)
        look = matt(pick(rng, ((0.95, 0.95, 0.95), (0.9, 0.5, 0.55), (0.3, 0.4, 0.7))))
        pieces += plate(np.minimum(at, top - 0.004), top, 1, look, radius=0.003, bevel=0.002)
    return pieces


def sachets(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Tea bags standing in compartments, a colour each."""
    size = upper - lower
    look = matt(tinted(rng, (0.75, 0.6, 0.42)))
    columns, rows = max(2, round(size[0] / 0.085)), max(1, round(size[2] / 0.09))
    walls, rooms = divided(lower, upper - xyz(0, 0.1 * size[1], 0), columns, rows, look, 0.004)
    pieces = list(walls)
    for low, high in rooms:
        bag = Material(color=tinted(rng, pick(rng, VIVID)), roughness=0.6)
        z = low[2] + 0.002
        while z < high[2] - 0.008 - 0.03 * rng.random():
            top = low[1] + min(0.065, (0.85 + 0.1 * rng.random()) * (high[1] - low[1]))
            inset = 0.04 * (high[0] - low[0])
            pieces.append(box((low[0] + inset, low[1], z), (high[0] - inset, top, z + 0.005), bag))
            z += 0.0065
    return pieces


def spools(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Reels of thread upright in rows, for sewing."""
    size = upper - lower
    r = min(0.014, 0.2 * size[2])
    tall = min(0.04, 0.9 * size[1])
    ends = matt((0.9, 0.85, 0.75))
    pieces = []
    for x in np.arange(lower[0] + 1.1 * r, upper[0] - r, 2.4 * r)[:12]:
        for z in np.arange(lower[2] + 1.1 * r, upper[2] - r, 2.4 * r)[:5]:
            if chance(rng, 0.2):
                continue
            thread = matt(tinted(rng, pick(rng, VIVID)), 0.6)
            at = xyz(x, lower[1] + tall / 2, z)
            pieces += cylinder(at, 1, 0.85 * r, 0.8 * tall, thread, segments=10)
            pieces += cylinder(at + xyz(0, 0.45 * tall, 0), 1, r, 0.1 * tall, ends, segments=10)
    return pieces


def equipment(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Apparatus sunk into foam: blocks, tubes and discs, each in its cut-out."""
    size = upper - lower
    shade = between(rng, 0.1, 0.2)
    foam, pit = matt((shade, shade, shade + 0.005), 1.0), matt((0.03, 0.03, 0.03), 1.0)
    y = lower[1] + between(rng, 0.5, 0.8) * size[1]
    pieces = [box(lower, xyz(upper[0], y, upper[2]), foam)]
    columns, rows = max(2, round(size[0] / 0.13)), max(1, round(size[2] / 0.12))
    _, rooms = divided(lower, upper, columns, rows, foam, 0.02)
    tones: tuple[Color, ...] = (
        (0.08, 0.08, 0.09),
        (0.5, 0.5, 0.52),
        (0.85, 0.6, 0.1),
        (0.15, 0.3, 0.5),
    )
    for low, high in rooms:
        if chance(rng, 0.12):
            continue
        look = Material(color=tinted(rng, pick(rng, tones)), roughness=between(rng, 0.25, 0.6))
        middle = (low + high) / 2 * (1, 0, 1) + xyz(0, y, 0)
        room = (high - low)[[0, 2]] * rng.uniform(0.55, 0.95, 2)
        rise = min(between(rng, 0.004, 0.02), upper[1] - y)
        half = xyz(room[0] / 2, 0, room[1] / 2)
        pieces += plate(
            middle - half - xyz(0.004, 2e-3, 0.004),
            middle + half + xyz(0.004, 6e-4, 0.004),
            1,
            pit,
            radius=0.01,
        )
        kind = pick(rng, ("block", "round", "tube"))
        if kind == "block":
            pieces += plate(
                middle - half,
                middle + half + xyz(0, rise, 0),
                1,
                look,
                radius=0.006,
                bevel=(0, 0.003),
            )
            face = (middle - half * 0.5, middle + half * 0.5 + xyz(0, rise, 0))
            pieces.append(
                decal(*face, "top", Material(color=(1, 1, 1), texture=label(rng), roughness=0.5))
            )
        elif kind == "round":
            r = float(min(room)) / 2
            pieces += cylinder(
                middle + xyz(0, rise / 2, 0), 1, r, rise, look, segments=20, bevel=0.003
            )
            glass = Material(color=(0.05, 0.06, 0.1), roughness=0.06)
            pieces += cylinder(middle + xyz(0, rise, 0), 1, 0.7 * r, 0.002, glass, segments=20)
        else:
            r = min(0.5 * room[1], rise + 0.01)
            pieces += cylinder(
                middle + xyz(0, rise - r, 0), 0, r, room[0], look, segments=14, bevel=0.003
            )
    return pieces


def egg_crate(
    lower: FloatArray, upper: FloatArray, low: float, high: float, look: Material
) -> Surface:
    """The underside of waved foam between the heights ``low`` and ``high``."""
    size = upper - lower
    count = np.clip((size[[0, 2]] / 0.02).astype(int), 4, 9)
    x = np.linspace(lower[0], upper[0], 4 * count[0] + 1)
    z = np.linspace(lower[2], upper[2], 4 * count[1] + 1)
    wave = np.outer(np.cos(np.arange(len(z)) * np.pi / 2), np.cos(np.arange(len(x)) * np.pi / 2))
    rows = np.stack(
        [
            np.broadcast_to(x, wave.shape),
            (low + high) / 2 + wave * (high - low) / 2,
            np.broadcast_to(z[:, None], wave.shape),
        ],
        axis=-1,
    )
    normals = np.cross(np.gradient(rows, axis=1), np.gradient(rows, axis=0))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return skin(rows, normals, rows[..., [0, 2]], look, wrap=False)


def tools(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Hand tools, one per lane, along the box."""
    size = upper - lower
    lanes = int(np.clip(size[2] / between(rng, 0.03, 0.05), 2, 7))
    pieces = []
    for z in np.linspace(lower[2], upper[2], lanes + 1)[:-1] + size[2] / lanes / 2:
        length = min(between(rng, 0.14, 0.3), 0.94 * size[0])
        x = between(rng, lower[0] + length / 2, max(upper[0] - length / 2, lower[0] + length / 2))
        at = xyz(x, lower[1] + between(rng, 0.0, 0.5) * max(size[1] - 0.04, 0), float(z))
        make = pick(rng, (screwdriver, screwdriver, screwdriver, hammer, wrench, wrench))
        pieces += make(rng, at, length, min(0.45 * size[2] / lanes, 0.4 * size[1]))
    if min(size) > 0.045 and chance(rng, 0.6):
        corner = lower + xyz(between(rng, 0.1, 0.7) * size[0], 0, 0.3 * size[2])
        pieces += tape_measure(rng, np.minimum(corner, upper - (0.07, 0, 0.05)))
    return pieces
