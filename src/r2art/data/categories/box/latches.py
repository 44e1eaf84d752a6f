"""What keeps boxes shut: hasps, spring latches, clips, hooks, locks, tabs."""

import numpy as np

from r2art.data.categories.box.shells import GAP, Pieces, Shell
from r2art.data.procedural.curved import ellipsoid, tube
from r2art.data.procedural.randomness import chance
from r2art.data.procedural.solids import box, cylinder, decal, plate, xyz
from r2art.data.shape import Material, Surface

_DARK = Material(color=(0.03, 0.03, 0.03), roughness=0.8)
FloatArray = np.ndarray


def hasp(
    rng: np.random.Generator, shell: Shell, look: Material, *, at: float = 0.0, locked: bool = False
) -> Pieces:
    """A strap on the lid that falls over a staple on the base; perhaps a padlock."""
    s, h, z = shell.scale, shell.height, shell.z
    wide, drop = 0.013 * s, min(0.036 * s, 0.7 * h)
    plate_top = h + min(0.03 * s, 0.8 * shell.lid)
    leaf = plate((at - wide, h + 0.001, z), (at + wide, plate_top, z + 0.0016), 2, look)
    strap = plate(
        (at - 0.75 * wide, h - drop, z + 0.0016),
        (at + 0.75 * wide, h + 0.006 * s, z + 0.0036),
        2,
        look,
        radius=0.6 * wide,
        bevel=(0.0, 6e-4),
    )
    y = h - 0.6 * drop
    staple = box((at - 0.002, y - 0.005 * s, z), (at + 0.002, y + 0.005 * s, z + 0.011 * s), look)
    shield = plate((at - wide, h - 1.1 * drop, z), (at + wide, h - 0.001, z + 0.001), 2, look)
    base = [staple, *shield]
    if locked:
        base += _padlock(rng, xyz(at, y, z + 0.008 * s), s)
    return Pieces(base, [*leaf, *strap])


def _padlock(rng: np.random.Generator, at: FloatArray, s: float) -> list[Surface]:
    """It hangs from ``at``."""
    color = (0.75, 0.6, 0.3) if chance(rng, 0.6) else (0.35, 0.35, 0.37)
    look = Material(color=color, roughness=0.3, metallic=0.9)
    steel = Material(color=(0.7, 0.7, 0.72), roughness=0.2, metallic=0.9)
    r = 0.009 * s
    angle = np.linspace(0, np.pi, 9)
    bow = np.stack([r * np.cos(angle), r * np.sin(angle) - r, 0 * angle], axis=-1)
    body = plate(
        at + xyz(-0.015 * s, -0.033 * s, 0),
        at + xyz(0.015 * s, -0.009 * s, 0.01 * s),
        2,
        look,
        radius=0.004 * s,
        bevel=0.001,
    )
    shackle = tube(at + bow + xyz(0, 0, 0.005 * s), 0.0022 * s, steel, up=(0, 0, 1), segments=6)
    hole = decal(
        at + xyz(-0.002 * s, -0.026 * s, 0),
        at + xyz(0.002 * s, -0.017 * s, 0.01 * s),
        "front",
        _DARK,
    )
    return [*body, shackle, hole]


def draw_latch(shell: Shell, look: Material, *, at: float = 0.0) -> Pieces:
    """A spring latch on the base whose lever hooks over a catch on the lid."""
    s, h, z = shell.scale, shell.height, shell.z
    low = h - min(0.042 * s, 0.85 * h)
    body = plate(
        (at - 0.014 * s, low, z),
        (at + 0.014 * s, h - 0.006 * s, z + 0.007 * s),
        2,
        look,
        radius=0.002,
        bevel=(0.0, 0.0015),
    )
    lever = box(
        (at - 0.009 * s, h - 0.012 * s, z + 0.0055 * s),
        (at + 0.009 * s, h + min(0.01 * s, 0.6 * shell.lid), z + 0.0075 * s),
        look,
    )
    catch = plate(
        (at - 0.011 * s, h + 0.002, z),
        (at + 0.011 * s, h + min(0.02 * s, 0.9 * shell.lid), z + 0.005 * s),
        2,
        look,
        bevel=(0.0, 0.001),
    )
    return Pieces([*body, lever], [*catch])


def clip(
    shell: Shell, look: Material, *, at: float = 0.0, wide: float = 0.018, out: float = 0.0
) -> Pieces:
    """A plastic clip that hangs from the lid over a ledge of the base, ``out`` before it."""
    s, h = shell.scale, shell.height
    z = shell.z + out
    low, high = h - min(0.038 * s, 0.6 * h), h + min(0.016 * s, 0.85 * shell.lid)
    half = wide * s
    flap = plate(
        (at - half, low, z + 0.0025),
        (at + half, high, z + 0.0085 * s + 0.002),
        2,
        look,
        radius=0.004 * s,
        bevel=(0.0, 0.0025 * s),
    )
    grip = plate(
        (at - 0.8 * half, low - 0.004 * s, z + 0.004),
        (at + 0.8 * half, low + 0.006 * s, z + 0.013 * s),
        2,
        look,
        radius=0.002,
        bevel=(0.0, 0.001),
    )
    pin = cylinder((at, high - 0.004 * s, z + 0.002), 0, 0.004 * s, 2.1 * half, look, segments=8)
    ledge = box(
        (at - 0.7 * half, h - 0.02 * s, z - 0.003),
        (at + 0.7 * half, h - 0.012 * s, z + 0.002),
        _DARK,
    )
    return Pieces([ledge], [*flap, *grip, *pin])


def hook(shell: Shell, look: Material, *, at: float = 0.0) -> Pieces:
    """A small swivel hook and the knob that it catches."""
    s, h, z = max(shell.scale, 0.55), shell.height, shell.z
    up = h + min(0.009 * s, 0.6 * shell.lid)
    down = h - min(0.008 * s, 0.5 * h)
    disc = cylinder((at, up, z + 0.001), 2, 0.005 * s, 0.002, look, segments=10)
    arm = plate((at - 0.002 * s, down, z + 0.002), (at + 0.003 * s, up, z + 0.0035), 2, look)
    eye = cylinder((at, down, z + 0.001), 2, 0.0055 * s, 0.002, look, segments=10)
    bead = ellipsoid((at, down, z + 0.004), (0.0032 * s,) * 3, look, rings=5, segments=8)
    return Pieces([*eye, bead], [*disc, *arm])


def key_lock(shell: Shell, look: Material, *, at: float = 0.0) -> Pieces:
    """A key cylinder in the front of the base."""
    s = shell.scale
    y = shell.height - min(0.022 * s, 0.45 * shell.height)
    r = 0.0095 * s
    disc = cylinder((at, y, shell.z + 0.001), 2, r, 0.004, look, segments=14, bevel=0.001)
    slot = decal(
        (at - 0.13 * r, y - 0.5 * r, shell.z),
        (at + 0.13 * r, y + 0.5 * r, shell.z + 0.003),
        "front",
        _DARK,
    )
    return Pieces([*disc, slot])


def escutcheon(shell: Shell, look: Material) -> Pieces:
    """A brass keyhole plate on a wooden base."""
    s, y = shell.scale, shell.height - min(0.026 * shell.scale, 0.5 * shell.height)
    low, high = (
        xyz(-0.009 * s, y - 0.013 * s, shell.z),
        xyz(0.009 * s, y + 0.013 * s, shell.z + 8e-4),
    )
    shield = plate(low, high, 2, look, radius=0.008 * s)
    hole = decal(low, high, "front", _DARK, size=(0.003 * s, 0.011 * s))
    return Pieces([*shield, hole])


def lip(shell: Shell, look: Material, width: float = 0.03) -> Pieces:
    """A thumb tab at the front of the lid."""
    half, y = 0.5 * min(width, 0.4 * shell.width), shell.height + GAP
    tab = plate(
        (-half, y, shell.z - 1e-3), (half, y + 0.003, shell.z + 0.0055), 1, look, radius=0.004
    )
    return Pieces(lid=[*tab])
