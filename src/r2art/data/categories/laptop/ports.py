"""What sits on the sides and under the base of a laptop: ports, vents, drives, latch, feet."""

import numpy as np

from r2art.data.categories.laptop.style import LaptopStyle
from r2art.data.procedural.randomness import between, chance, pick, weighted
from r2art.data.procedural.solids import box, cylinder, decal, xyz
from r2art.data.shape import Material, Surface

_HOLE = Material(color=(0.02, 0.02, 0.02), roughness=0.8)
_STEEL = Material(color=(0.6, 0.6, 0.62), roughness=0.35, metallic=0.9)
_BLUE = Material(color=(0.1, 0.15, 0.55), roughness=0.5)
_LINE = Material(color=(0.12, 0.12, 0.13), roughness=0.7)
_TRAY = Material(color=(0.3, 0.3, 0.32), roughness=0.5)
_LIGHT = Material(color=(0.2, 0.9, 0.4), roughness=0.4, emission=1.0)
# Width and height (m) on the outside, material of the shell.
_PORTS = {
    "usb": (0.0135, 0.0058, _STEEL),
    "ethernet": (0.0145, 0.0115, _STEEL),
    "modem": (0.0115, 0.0095, _HOLE),
    "jack": (0.0065, 0.0065, _HOLE),
    "vga": (0.031, 0.0115, _BLUE),
    "serial": (0.031, 0.0115, _STEEL),
    "hdmi": (0.0145, 0.005, _STEEL),
    "usb_c": (0.009, 0.0032, _HOLE),
    "power": (0.009, 0.009, _HOLE),
    "card": (0.054, 0.0055, _LINE),
    "vent": (0.06, 0.009, _LINE),
    "drive": (0.13, 0.0125, _TRAY),
    "lock": (0.007, 0.003, _HOLE),
}
_OLD = {"usb": 3, "jack": 2, "modem": 1, "ethernet": 1, "card": 2, "vent": 2, "drive": 1.6}
_NEW = {"usb": 2, "usb_c": 2, "hdmi": 1, "jack": 1, "vent": 0.7, "lock": 0.6, "card": 0.4}
_REAR = {"vga": 2, "serial": 1, "power": 1, "modem": 1, "ethernet": 1, "usb": 1.5, "vent": 1.5}


def ports(rng: np.random.Generator, style: LaptopStyle) -> list[Surface]:
    """Ports on the left, the right and, on old laptops, the back; lights and latch in front."""
    offered = _OLD if style.age < 0.5 else _NEW
    pieces: list[Surface] = []
    for side in ("left", "right"):
        pieces += _row(rng, style, side, style.depth, offered)
    if style.age < 0.4 and chance(rng, 0.7):
        pieces += _row(rng, style, "back", style.width, _REAR)
    return pieces + _front(rng, style)


def _body(style: LaptopStyle) -> tuple[np.ndarray, np.ndarray]:
    half = np.array([style.width / 2, 0.0, style.depth / 2])
    return -half, half + xyz(0.0, style.thickness, 0.0)


def _row(
    rng: np.random.Generator,
    style: LaptopStyle,
    side: str,
    length: float,
    offered: dict[str, float],
) -> list[Surface]:
    """Ports one after the other along a side."""
    lower, upper = _body(style)
    pieces: list[Surface] = []
    at = style.corner + between(rng, 0.01, 0.08)
    while at < length - 0.02:
        name = weighted(rng, offered)
        wide, tall, shell = _PORTS[name]
        tall = min(tall, 0.55 * style.thickness)
        if at + wide > length - style.corner - 0.008:
            break
        place = ((at + wide / 2) / length, 0.5)
        inner = (0.75 * wide, 0.45 * tall)
        if name == "vent":
            for k in range(8):
                spot = ((at + wide * (k + 0.5) / 8) / length, 0.5)
                pieces.append(
                    decal(lower, upper, side, _HOLE, at=spot, size=(wide / 16, tall), lift=2e-4)
                )
        else:
            pieces.append(decal(lower, upper, side, shell, at=place, size=(wide, tall), lift=2e-4))
        if shell in (_STEEL, _BLUE):
            pieces.append(decal(lower, upper, side, _HOLE, at=place, size=inner, lift=3e-4))
        if name == "drive":
            slit = (0.96 * wide, 0.001)
            pieces.append(decal(lower, upper, side, _HOLE, at=place, size=slit, lift=3e-4))
        at += wide + float(rng.exponential(0.025)) + 0.005
    return pieces


def _front(rng: np.random.Generator, style: LaptopStyle) -> list[Surface]:
    lower, upper = _body(style)
    pieces: list[Surface] = []
    if style.age < 0.5 and chance(rng, 0.75):  # the button of the latch
        z, y = style.depth / 2, 0.82 * style.thickness
        look = pick(rng, (_STEEL, style.accent, style.outside))
        wide = between(rng, 0.012, 0.03)
        pieces.append(
            box((-wide / 2, y - 0.002, z - 0.002), (wide / 2, y + 0.002, z + 0.0012), look)
        )
    if chance(rng, 0.5):
        start = between(rng, 0.05, 0.3)
        for k in range(int(rng.integers(1, 5))):
            look = _LIGHT if chance(rng, 0.4) else _LINE
            spot = (start + 0.03 * k, 0.6)
            pieces.append(decal(lower, upper, "front", look, at=spot, size=(0.004, 0.0015)))
    return pieces


def feet(rng: np.random.Generator, style: LaptopStyle) -> list[Surface]:
    """Four round feet, or two strips of rubber, under the base."""
    look = Material(color=(0.05, 0.05, 0.05), roughness=0.9)
    tall = between(rng, 0.0008, 0.0025)
    x, z = 0.42 * style.width, 0.4 * style.depth
    if chance(rng, 0.25):
        strips = ((-x, -tall, s * z - 0.004) for s in (-1, 1))
        return [box(low, (x, 0.0, low[2] + 0.008), look) for low in strips]
    radius = between(rng, 0.004, 0.008)
    return [
        piece
        for sx in (-x, x)
        for sz in (-z, z)
        for piece in cylinder((sx, -tall / 2, sz), 1, radius, tall, look, segments=10)
    ]
