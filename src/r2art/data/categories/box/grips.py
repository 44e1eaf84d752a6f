"""By what boxes are carried: bails, moulded grips, case handles, ropes, rings, straps."""

import numpy as np

from r2art.data.categories.box.shells import Pieces, Shell
from r2art.data.procedural.curved import tube
from r2art.data.procedural.randomness import between, chance
from r2art.data.procedural.slabs import bent
from r2art.data.procedural.solids import box, cylinder, plate, xyz
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray


def bail(rng: np.random.Generator, shell: Shell, look: Material, grip: Material) -> Pieces:
    """A wire handle on the lid, folded down to the front or standing up."""
    s = max(shell.scale, 0.6)
    half, reach = min(0.042 * s, 0.3 * shell.width), min(0.028 * s, 0.35 * shell.depth)
    angle = np.linspace(0, np.pi, 15)
    bend = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** 0.5
    tilt = between(rng, 1.2, 1.7) if chance(rng, 0.5) else between(rng, 0.0, 0.12)
    out = reach * np.sin(angle) ** 0.5
    foot = xyz(0, shell.top + 0.004, 0 if tilt > 1 else -0.4 * reach)
    path = foot + np.stack([half * bend, out * np.sin(tilt), out * np.cos(tilt)], axis=-1)
    up = (0.0, np.cos(tilt), -np.sin(tilt))
    pieces = [tube(path, 0.0028 * s, look, up=up, segments=7)]
    for x in (-half, half):
        low = foot + xyz(x - 0.006 * s, -0.0045, -0.007 * s)
        pieces += plate(low, low + xyz(0.012 * s, 0.006, 0.014 * s), 1, look, bevel=(0, 0.002))
    if chance(rng, 0.4):
        middle = path[len(path) // 2]
        pieces += cylinder(middle, 0, 0.0055 * s, 1.1 * half, grip, segments=10, bevel=0.001)
    return Pieces(lid=pieces)


def grip(
    rng: np.random.Generator, shell: Shell, look: Material, *, length: float, reach: float
) -> Pieces:
    """A moulded handle that stands on the lid along x."""
    half, thick = length / 2, between(rng, 0.011, 0.016) * shell.scale
    deep = between(rng, 0.01, 0.016) * shell.scale
    slope = between(rng, 0.1, 0.35) * half
    y, top = shell.top - 0.004, shell.top + reach
    corner = min(0.3 * reach, 0.3 * slope + 0.004)
    path = np.array(
        [
            (half, y),
            (half - slope, top - corner),
            (half - slope - corner, top),
            (-half + slope + corner, top),
            (-half + slope, top - corner),
            (-half, y),
        ]
    )
    return Pieces(lid=[*bent(path, thick, 2, (-deep, deep), look)])


def case_handle(shell: Shell, look: Material, mount: Material, *, length: float) -> Pieces:
    """A handle at the front of the base, as on cases that are carried upright."""
    s = shell.scale
    y, half, z = 0.62 * shell.height, length / 2, -shell.z
    reach, thick = 0.034 * s, 0.009 * s
    path = [
        (-half, z + 0.001),
        (-half + 0.004 * s, z - 0.7 * reach),
        (-half + 0.018 * s, z - reach),
        (half - 0.018 * s, z - reach),
        (half - 0.004 * s, z - 0.7 * reach),
        (half, z + 0.001),
    ]
    tall = min(0.009 * s, 0.3 * shell.height)
    pieces: list[Surface] = [*bent(path, thick, 1, (y - tall, y + tall), look)]
    for x in (-half, half):
        pieces += plate(
            (x - 0.012 * s, y - 1.4 * tall, shell.z - 0.001),
            (x + 0.012 * s, y + 1.4 * tall, shell.z + 0.008 * s),
            2,
            mount,
            radius=0.003,
            bevel=(0.0, 0.002),
        )
    return Pieces(pieces)


def side_handles(rng: np.random.Generator, shell: Shell, look: Material, kind: str) -> Pieces:
    """One on each end of the base: ``rope``, ``ring``, ``strap`` or ``bar``."""
    y = between(rng, 0.55, 0.72) * shell.height
    return Pieces([s for sign in (-1, 1) for s in _side_handle(shell, look, kind, sign, y)])


def _side_handle(shell: Shell, look: Material, kind: str, sign: int, y: float) -> list[Surface]:
    s = shell.scale
    at = xyz(sign * shell.x, y, 0)
    out = xyz(sign, 0, 0)
    half = min(0.05 * s, 0.3 * shell.depth)
    if kind == "strap":
        z = np.linspace(-half, half, 9)
        bulge = 0.004 + 0.014 * s * np.cos(z / half * np.pi / 2)
        path = np.stack([sign * (shell.x + bulge), -z], axis=-1)  # right and up, seen from above
        path = path if sign < 0 else path[::-1]
        strap = bent(path, 0.003, 1, (y - 0.012 * s, y + 0.012 * s), look)
        ends = [
            box(
                *_sorted(
                    at + xyz(-1e-3 * sign, -0.015 * s, z0), at + xyz(5e-3 * sign, 0.015 * s, z1)
                ),
                look,
            )
            for z0, z1 in ((-half - 0.012 * s, -half + 0.004), (half - 0.004, half + 0.012 * s))
        ]
        return [*strap, *ends]
    mount = plate(
        *_sorted(
            at + xyz(0, -0.012 * s, -0.6 * half), at + xyz(0, 0.012 * s, 0.6 * half) + 0.0025 * out
        ),
        0,
        look,
        radius=0.006 * s,
    )
    angle = np.linspace(0, np.pi, 13)
    if kind == "ring":
        angle, half = np.linspace(0, 2 * np.pi, 19), 0.45 * half
    drop = {"rope": 0.05, "ring": 0.0, "bar": 0.03}[kind] * s
    r = {"rope": 0.006, "ring": 0.0035, "bar": 0.0035}[kind] * s
    high = half if kind == "ring" else drop
    hang = -half if kind == "ring" else 0.0
    path = at + np.stack(
        [
            np.full_like(angle, sign * (r + 0.003)),
            hang - high * np.sin(angle) ** (1.0 if kind != "bar" else 0.5),
            half * np.cos(angle),
        ],
        axis=-1,
    )
    loop = tube(path, r, look, up=(1, 0, 0), segments=6)
    if kind == "rope":
        knots = [
            piece
            for z in (-half, half)
            for piece in cylinder(at + xyz(sign * r, 0, z), 0, 1.8 * r, 2.5 * r, look, segments=8)
        ]
        return [loop, *knots]
    return [*mount, loop]


def _sorted(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.minimum(a, b), np.maximum(a, b)


def knob(shell: Shell, look: Material, radius: float) -> Pieces:
    """A turned knob at the front of the lid, to lift it by."""
    y, z = shell.height + 0.5 * shell.lid, shell.z
    stem = cylinder((0, y, z + 0.3 * radius), 2, 0.5 * radius, 0.8 * radius, look, segments=10)
    head = cylinder(
        (0, y, z + radius), 2, min(radius, 0.45 * shell.lid), radius, look, bevel=0.3 * radius
    )
    return Pieces(lid=[*stem, *head])
