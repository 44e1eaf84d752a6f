"""What lies loose in boxes. A filler puts things into the room ``lower``..``upper`` (m)."""

from collections.abc import Callable

import numpy as np

from r2art.data.categories.box.goods import matt, sneaker
from r2art.data.categories.box.insets import divided
from r2art.data.categories.box.prints import VIVID, parcel_label
from r2art.data.categories.drawer.contents import contents as drawer_contents
from r2art.data.procedural.curved import ellipsoid
from r2art.data.procedural.randomness import Color, between, chance, pick, tinted
from r2art.data.procedural.solids import box, cylinder, decal, plate, skin, xyz
from r2art.data.procedural.textures import label
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
Filler = Callable[[np.random.Generator, FloatArray, FloatArray], list[Surface]]


def tissue(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Crumpled paper, or the folds of a cloth."""
    color = pick(rng, ((0.95, 0.95, 0.94), (0.95, 0.95, 0.94), (0.85, 0.8, 0.7), *VIVID))
    count = int(rng.integers(9, 15))
    x = np.linspace(lower[0], upper[0], count)
    z = np.linspace(upper[2], lower[2], count)
    height = rng.random((count, count))
    high = lower[1] + (upper[1] - lower[1]) * (0.35 + between(rng, 0.2, 0.6) * height)
    rows = np.stack(
        [
            np.broadcast_to(x, high.shape),
            high,
            np.broadcast_to(z[:, None], high.shape),
        ],
        axis=-1,
    )
    normals = np.cross(np.gradient(rows, axis=1), np.gradient(rows, axis=0))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    look = matt(tinted(rng, color), between(rng, 0.4, 0.9))
    return [skin(rows, normals, rows[..., [0, 2]], look, wrap=False)]


def shoes(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """A pair, side by side, toes to either end; perhaps on tissue paper."""
    size = upper - lower
    length, wide = min(0.94 * size[0], 0.3), min(0.46 * size[2], 0.105)
    upper_look = matt(tinted(rng, pick(rng, (*VIVID, *(3 * ((0.1, 0.1, 0.11), (0.9, 0.9, 0.9)))))))
    sole = matt(pick(rng, ((0.92, 0.92, 0.9), (0.1, 0.1, 0.1), (0.65, 0.45, 0.28))))
    pieces = []
    for sign in (-1, 1):
        at = (lower + upper) / 2 + xyz(0, -size[1] / 2, sign * 0.25 * size[2])
        pieces += sneaker(at, sign, length, wide, min(0.95 * size[1], 0.1), upper_look, sole)
    if chance(rng, 0.5):
        pieces += tissue(rng, lower, lower + size * (1, 0.35, 1))
    return pieces


def lunch(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """A sandwich, fruit, vegetables, in compartments."""
    tray = matt(pick(rng, ((0.93, 0.93, 0.92), (0.75, 0.85, 0.8), (0.9, 0.6, 0.3))), 0.4)
    size = upper - lower
    roof = xyz(upper[0], lower[1] + 0.7 * size[1], upper[2])
    walls, rooms = divided(lower, roof, int(rng.integers(2, 4)), 1, tray, 0.003)
    pieces = list(walls)
    foods: tuple[Color, ...] = (
        (0.75, 0.1, 0.08),
        (0.35, 0.55, 0.15),
        (0.9, 0.55, 0.1),
        (0.35, 0.15, 0.35),
        (0.9, 0.85, 0.6),
        (0.15, 0.35, 0.1),
    )
    for low, high in rooms:
        room = high - low
        if chance(rng, 0.35):
            for k in range(3):
                look = matt(((0.8, 0.62, 0.38), pick(rng, foods), (0.8, 0.62, 0.38))[k], 0.9)
                y0 = low[1] + k * 0.28 * room[1]
                inset = (0.1 - 0.03 * (k == 1)) * room[[0, 2]]
                pieces += plate(
                    xyz(low[0] + inset[0], y0, low[2] + inset[1]),
                    xyz(high[0] - inset[0], y0 + 0.28 * room[1], high[2] - inset[1]),
                    1,
                    look,
                    radius=0.012,
                    bevel=0.002,
                )
            continue
        r = min(between(rng, 0.012, 0.03), 0.45 * room[1], 0.3 * min(room[0], room[2]))
        look = matt(tinted(rng, pick(rng, foods)), 0.35)
        for x in np.arange(low[0] + r, high[0] - 0.9 * r, 2.1 * r):
            for z in np.arange(low[2] + r, high[2] - 0.9 * r, 2.1 * r):
                if chance(rng, 0.85):
                    y = low[1] + r * between(rng, 0.8, 1.2)
                    pieces.append(ellipsoid((x, y, z), (r, r * 0.95, r), look, rings=5, segments=8))
    return pieces


def medical(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Rolls of bandage, printed boxes, bottles."""
    size = upper - lower
    walls, rooms = divided(
        lower,
        lower + size * (1, 0.2, 1),
        max(2, int(size[0] / 0.07)),
        2,
        matt((0.85, 0.85, 0.85)),
        0.002,
    )
    pieces = list(walls)
    white = matt((0.93, 0.92, 0.88), 0.95)
    for low, high in rooms:
        room = xyz(high[0], upper[1], high[2]) - low
        middle = low + room * (0.5, 0, 0.5)
        kind = pick(rng, ("roll", "roll", "box", "box", "bottle", "packs"))
        r = 0.42 * min(room[0], room[2])
        if kind == "roll":
            tall = min(between(rng, 0.03, 0.06), 0.9 * room[1])
            look = white if chance(rng, 0.7) else matt((0.8, 0.65, 0.5))
            pieces += cylinder(
                middle + xyz(0, tall / 2, 0), 1, min(r, 0.025), tall, look, segments=14, bevel=0.002
            )
            hole = middle + xyz(0, tall, 0)
            pieces.append(decal(hole, hole, "top", matt((0.5, 0.5, 0.48)), size=(0.012, 0.012)))
        elif kind == "bottle":
            tall, r = min(0.07, 0.8 * room[1]), min(r, 0.018)
            look = Material(color=pick(rng, ((0.4, 0.2, 0.08), (0.93, 0.93, 0.95))), roughness=0.2)
            pieces += cylinder(middle + xyz(0, tall / 2, 0), 1, r, tall, look, bevel=0.004)
            pieces += cylinder(middle + xyz(0, tall, 0), 1, 0.6 * r, 0.2 * tall, white, segments=10)
        else:
            print_ = Material(color=(1, 1, 1), texture=label(rng), roughness=0.6)
            tall = room[1] * (between(rng, 0.4, 0.9) if kind == "box" else 0.25)
            high_corner = low + xyz(0.92 * room[0], tall, 0.92 * room[2])
            pieces.append(box(low + 0.06 * room * (1, 0, 1), high_corner, print_))
    return pieces


def papers(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Letters and photographs in a pile."""
    y, pieces = lower[1], []
    size = upper - lower
    for _ in range(int(rng.integers(3, 10))):
        thick = between(rng, 0.0006, 0.09 * size[1] + 0.001)
        if y + thick > upper[1]:
            break
        share = rng.uniform(0.5, 0.9, 2)
        room = size[[0, 2]] * (1 - share)
        x, z = lower[[0, 2]] + room * rng.random(2)
        color = tinted(rng, pick(rng, ((0.94, 0.93, 0.9), (0.88, 0.82, 0.7), (0.75, 0.8, 0.88))))
        top = Material(color=(1, 1, 1), texture=label(rng, (128, 96)), roughness=0.7)
        corner = xyz(x + share[0] * size[0], y + thick, z + share[1] * size[2])
        pieces += plate((x, y, z), corner, 1, matt(color), top=top if chance(rng, 0.5) else None)
        y += thick
    return pieces


def toys(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """Building blocks and balls, heaped."""
    size, pieces = upper - lower, []
    unit = min(0.05, 0.22 * float(size.min()) + 0.012)
    for _ in range(int(rng.integers(12, 30))):
        look = Material(color=tinted(rng, pick(rng, VIVID)), roughness=0.35)
        half = unit * rng.uniform(0.3, 0.6, 3)
        half = np.minimum(half, 0.45 * size)
        center = lower + half + rng.random(3) * (size - 2 * half) * (1, 0.45, 1)
        if chance(rng, 0.35):
            pieces.append(ellipsoid(center, np.full(3, half.min()), look, rings=6, segments=10))
        else:
            pieces.append(box(center - half, center + half, look))
    return pieces


def goods(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """What a parcel brings: cartons with labels on crumpled paper."""
    size = upper - lower
    pieces = tissue(rng, lower, lower + size * (1, 0.55, 1))
    for _ in range(int(rng.integers(1, 4))):
        half = size * rng.uniform(0.12, 0.3, 3)
        center = lower + half + rng.random(3) * (size - 2 * half) * (1, 0.1, 1)
        center[1] = lower[1] + 0.2 * size[1] + half[1]
        look = matt(tinted(rng, pick(rng, (*VIVID, (0.93, 0.93, 0.92), (0.1, 0.1, 0.1)))), 0.5)
        low, high = center - half, np.minimum(center + half, upper)
        pieces.append(box(low, high, look))
        front = Material(color=(1, 1, 1), texture=parcel_label(rng), roughness=0.6)
        pieces.append(decal(low, high, "top", front, size=tuple(0.7 * (high - low)[[0, 2]])))
    return pieces


def pizza(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """A whole one, cut in four."""
    center, r = (lower + upper) / 2, 0.46 * float(np.min((upper - lower)[[0, 2]]))
    crust, sauce = matt((0.78, 0.56, 0.3), 0.9), matt(tinted(rng, (0.85, 0.55, 0.25)), 0.5)
    y = lower[1]
    pieces = [
        *cylinder((center[0], y + 0.008, center[2]), 1, r, 0.016, crust, segments=28, bevel=0.006),
        *cylinder((center[0], y + 0.014, center[2]), 1, 0.88 * r, 0.006, sauce, segments=28),
    ]
    colors: tuple[Color, ...] = ((0.65, 0.12, 0.1), (0.3, 0.4, 0.12), (0.95, 0.9, 0.75))
    looks = [matt(tinted(rng, c), 0.5) for c in colors]
    for _ in range(int(rng.integers(10, 34))):
        a, d = between(rng, 0, 2 * np.pi), 0.8 * r * np.sqrt(rng.random())
        at = (center[0] + d * np.cos(a), y + 0.018, center[2] + d * np.sin(a))
        pieces += cylinder(at, 1, between(rng, 0.008, 0.018), 0.003, pick(rng, looks), segments=10)
    cut = matt((0.45, 0.28, 0.12), 0.9)
    top = xyz(center[0], y + 0.0172, center[2])
    pieces.append(decal(top, top, "top", cut, size=(1.9 * r, 0.002)))
    pieces.append(decal(top, top, "top", cut, size=(0.002, 1.9 * r)))
    return pieces


def household(rng: np.random.Generator, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """As in drawers: clothes, folders, books."""
    return drawer_contents(rng, lower, upper)
