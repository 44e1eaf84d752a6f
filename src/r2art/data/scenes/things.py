"""Shapes that stand about: boxes, cans, balls, dishes, mugs, bottles, piles, leaves.

Each has its foot at y = 0, is about as large as 1, and is one surface.
"""

from collections.abc import Callable

import numpy as np

from r2art.data.procedural.curved import revolved, tube
from r2art.data.procedural.dishes import dish
from r2art.data.procedural.solids import box, cylinder, merged, xyz
from r2art.data.shape import Material, Surface

UP = 1


def carton(rng: np.random.Generator, material: Material) -> Surface:
    """A box, from a cube to a flat slab."""
    x, y, z = rng.uniform(0.4, 1, 3) * (1, rng.choice([1.0, 0.15], p=[0.7, 0.3]), 1)
    return box([-x / 2, 0, -z / 2], [x / 2, y, z / 2], material)


def can(rng: np.random.Generator, material: Material) -> Surface:
    """A cylinder, from a coin to a candle."""
    radius, height = rng.uniform(0.15, 0.5), rng.uniform(0.3, 1)
    parts = cylinder([0, height / 2, 0], UP, radius, height, material, segments=24, bevel=0.02)
    return merged(parts)[0]


def ball(rng: np.random.Generator, material: Material) -> Surface:
    """A ball, an egg, or a flattened one."""
    polar = np.linspace(-np.pi / 2, np.pi / 2, 12)
    radius, height = rng.uniform(0.35, 0.5), rng.uniform(0.3, 1)
    profile = np.stack([radius * np.cos(polar), height / 2 * (1 + np.sin(polar))], axis=-1)
    return revolved(profile, [0, 0, 0], UP, material, segments=20)


def vessel(rng: np.random.Generator, material: Material) -> Surface:
    """A plate, bowl, cup, glass or pot, open above."""
    kind = str(rng.choice(["plate", "bowl", "cup", "glass", "pot"]))
    flat = {"plate": 0.25, "bowl": 0.8}.get(kind, 1.6)
    radius = rng.uniform(0.3, 0.5)
    profile = dish(kind, radius, radius * flat * rng.uniform(0.7, 1.3))
    return revolved(profile, [0, 0, 0], UP, material, segments=24)


def mug(rng: np.random.Generator, material: Material) -> Surface:
    """A cup with a handle."""
    radius, height = rng.uniform(0.28, 0.38), rng.uniform(0.6, 0.9)
    body = revolved(dish("cup", radius, height), [0, 0, 0], UP, material, segments=24)
    turn = np.linspace(-np.pi / 2, np.pi / 2, 9)
    out, bow = rng.uniform(0.2, 0.3), 0.3 * height
    path = np.stack(
        [0.9 * radius + out * np.cos(turn), height / 2 + bow * np.sin(turn), 0 * turn], axis=-1
    )
    handle = tube(path, rng.uniform(0.03, 0.05), material, up=[0, 0, 1])
    return merged([body, handle])[0]


def bottle(rng: np.random.Generator, material: Material) -> Surface:
    """A bottle, jar or vase."""
    belly, neck = rng.uniform(0.14, 0.25), rng.uniform(0.3, 0.9)
    shoulder = rng.uniform(0.4, 0.8)
    share = np.array([(0, 0), (0.95, 0), (1, 0.03), (1, 0), (neck, 0), (neck, 0), (0, 0)])
    height = np.array([0, 0, 0.03, shoulder, shoulder + 0.15, 1, 1])
    profile = np.stack([belly * share[:, 0], height], axis=-1)
    return revolved(profile, [0, 0, 0], UP, material, segments=20)


def pile(rng: np.random.Generator, material: Material) -> Surface:
    """One to five books or boards, each turned a little."""
    y, parts = 0.0, []
    width, depth = rng.uniform(0.6, 0.9), rng.uniform(0.45, 0.7)
    for _ in range(rng.integers(1, 6)):
        thick = rng.uniform(0.03, 0.14)
        half = np.array([width, 0, depth]) / 2 * rng.uniform(0.8, 1)
        slab = box(-half + xyz(0, y, 0), half + xyz(0, y + thick, 0), material)
        parts.append(turned(slab, rng.normal(0, 0.15)))
        y += thick
    return merged(parts)[0]


def leaves(rng: np.random.Generator, material: Material) -> Surface:
    """A plant: bent leaves that spread from its foot."""
    parts = []
    for _ in range(rng.integers(7, 20)):
        length, half = rng.uniform(0.4, 1), rng.uniform(0.04, 0.13)
        along = np.linspace(0, 1, 5)
        rise, bend = rng.uniform(0.4, 1.4), rng.uniform(0, 1.3)
        angle = rise - bend * along
        reach = np.cumsum(np.stack([np.cos(angle), np.sin(angle)], axis=-1), axis=0)
        reach *= length / 5
        wide = half * np.sin(np.pi * (0.12 + 0.88 * along))
        side = np.stack([-wide, wide], axis=-1)
        x, y = np.repeat(reach[..., None], 2, axis=-1).transpose(1, 0, 2)
        vertices = np.stack([x, y, side], axis=-1)
        normal = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=-1)
        normals = np.repeat(normal[:, None], 2, axis=1).reshape(-1, 3)
        i = 2 * np.arange(4)[:, None]
        faces = np.concatenate([i + np.array([0, 1, 3]), i + np.array([0, 3, 2])])
        uv = np.stack(np.broadcast_arrays(along[:, None], [0.0, 1.0]), axis=-1).reshape(-1, 2)
        leaf = Surface(
            vertices=vertices.reshape(-1, 3), faces=faces, normals=normals, uv=uv, material=material
        )
        parts.append(turned(leaf, rng.uniform(0, 2 * np.pi)))
    return merged(parts)[0]


def turned(surface: Surface, angle: float) -> Surface:
    """Turned about the vertical (rad)."""
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return Surface(
        vertices=surface.vertices @ R.T,
        faces=surface.faces,
        normals=surface.normals @ R.T,
        uv=surface.uv,
        material=surface.material,
    )


Shape = Callable[[np.random.Generator, Material], Surface]
SHAPES: tuple[Shape, ...] = (carton, can, ball, vessel, mug, bottle, pile, leaves)


def some_thing(rng: np.random.Generator, material: Material) -> Surface:
    """Any of them."""
    return SHAPES[rng.integers(len(SHAPES))](rng, material)
