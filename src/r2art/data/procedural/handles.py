"""Handles of drawers in their real sizes, so that a photo tells how large the cabinet is."""

from dataclasses import dataclass

import numpy as np

from r2art.data.procedural.curved import ellipsoid, prism, revolved, tube
from r2art.data.procedural.randomness import Color, between, chance, pick, weighted
from r2art.data.procedural.solids import box, cylinder, decal, plate, xyz
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
_METALS: tuple[Color, ...] = (
    (0.72, 0.72, 0.73),  # nickel, chrome
    (0.5, 0.5, 0.51),
    (0.72, 0.58, 0.3),  # brass
    (0.4, 0.28, 0.18),  # bronze
    (0.05, 0.05, 0.05),
)
_DARK = Material(color=(0.03, 0.03, 0.03), roughness=0.8)
_SHADE = Material(color=(0.09, 0.085, 0.08), roughness=0.7)


@dataclass(frozen=True)
class HandleStyle:
    """One handle: its kind, length (m), how many a front carries, and its height there."""

    kind: str
    length: float
    reach: float
    count: int
    at: float
    look: Material
    lock: bool


def sample_handle(
    rng: np.random.Generator, cabinet: str, width: float, front: Material
) -> HandleStyle:
    """Draw a handle that suits the kind of cabinet."""
    kinds = {
        "bedside": {"bar": 2, "bow": 1.5, "knob": 5, "recess": 0.8, "cup": 1.2, "lip": 0.8},
        "dresser": {"bar": 2, "bow": 1.5, "knob": 4, "recess": 0.8, "cup": 1.5, "lip": 0.8},
        "pedestal": {"bar": 3, "bow": 2, "recess": 3, "lip": 1, "knob": 0.4},
        "tool": {"lip": 5, "bar": 2},
        "tower": {"recess": 4, "cup": 1.5, "lip": 1},
    }[cabinet]
    kind = weighted(rng, kinds)
    length = pick(rng, (0.096, 0.096, 0.128, 0.128, 0.16, 0.192))
    if kind == "knob":
        length = between(rng, 0.026, 0.036)
    metal = Material(color=pick(rng, _METALS), roughness=between(rng, 0.15, 0.45), metallic=0.9)
    plain = Material(color=pick(rng, ((0.06, 0.06, 0.06), (0.9, 0.9, 0.88))), roughness=0.5)
    look = weighted(rng, {0: 6, 1: 2, 2: 2})
    two = width > 0.55 and kind not in ("lip",) and chance(rng, 0.6)
    return HandleStyle(
        kind=kind,
        length=min(length, 0.4 * width),
        reach=between(rng, 0.022, 0.035),
        count=2 if two else 1,
        at=0.5 if chance(rng, 0.65) else between(rng, 0.62, 0.78),
        look=(metal, plain, front)[look],
        lock=cabinet in ("pedestal", "tool") and chance(rng, 0.7),
    )


def handles(style: HandleStyle, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """All handles of the front that fills ``lower``..``upper``; they stand on its +z side."""
    middle = (lower[0] + upper[0]) / 2
    y = lower[1] + style.at * (upper[1] - lower[1])
    z = upper[2]
    quarter = 0.26 * (upper[0] - lower[0])
    places = [middle] if style.count == 1 else [middle - quarter, middle + quarter]
    if style.kind == "lip":
        return _lip(style, lower, upper)
    make = {"bar": _bar, "bow": _bow, "knob": _knob, "cup": _cup, "recess": _recess}[style.kind]
    room = upper[1] - lower[1]
    return [s for x in places for s in make(style, np.array([x, y, z]), room)]


def _bar(style: HandleStyle, at: FloatArray, room: float) -> list[Surface]:
    half, reach = style.length / 2, style.reach
    square = style.length > 0.12
    outer = half + (0.02 if style.length > 0.15 else 0.006)
    if square:
        pieces = [
            *plate(
                at + xyz(-outer, -0.005, reach - 0.008),
                at + xyz(outer, 0.005, reach),
                2,
                style.look,
                radius=0.002,
                bevel=0.001,
            )
        ]
    else:
        pieces = [
            *cylinder(at + xyz(0, 0, reach - 0.005), 0, 0.005, 2 * outer, style.look, bevel=1e-3)
        ]
    for x in (-half, half):
        post = at + xyz(x, 0, 0)
        pieces.append(
            box(post - xyz(0.004, 0.004, 0), post + xyz(0.004, 0.004, reach - 0.006), style.look)
        )
    return pieces


def _bow(style: HandleStyle, at: FloatArray, room: float) -> list[Surface]:
    angle = np.linspace(0, np.pi, 13)
    bend = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** 0.6
    path = np.stack(
        [-style.length / 2 * bend, 0 * angle, style.reach * np.sin(angle) ** 0.7], axis=-1
    )
    pieces = [tube(at + path, 0.0045, style.look, up=(0, 1, 0))]
    for x in (-style.length / 2, style.length / 2):
        pieces += cylinder(at + xyz(x, 0, 0.0015), 2, 0.009, 0.003, style.look, segments=10)
    return pieces


def _knob(style: HandleStyle, at: FloatArray, room: float) -> list[Surface]:
    r, reach = min(style.length / 2, 0.3 * room), style.reach
    profile = [
        (0.45 * r, 0.0),
        (0.4 * r, 0.35 * reach),
        (0.6 * r, 0.5 * reach),
        (0.95 * r, 0.62 * reach),
        (r, 0.75 * reach),
        (0.85 * r, 0.9 * reach),
        (0.45 * r, 0.98 * reach),
        (0.0, reach),
    ]
    return [revolved(profile, at, 2, style.look)]


def _cup(style: HandleStyle, at: FloatArray, room: float) -> list[Surface]:
    wide, tall, deep = style.length / 2, min(0.035, 0.4 * room), style.reach * 0.9
    low = at - xyz(0, tall / 2, 0)
    shell = ellipsoid(
        (0, 0, 0),
        (deep, wide, tall),
        style.look,
        polar=(0, np.pi / 2),
        around=(-np.pi / 2, np.pi / 2),
    )
    x, y, z = np.eye(3)
    turn = np.stack([z, x, y])  # its first axis comes out of the front, its third points up
    floor = (low - xyz(wide, 0, 0), low + xyz(wide, tall * 0.8, 0))
    return [
        decal(*floor, "front", _SHADE, size=(1.7 * wide, 0.6 * tall), at=(0.5, 0.4), lift=2e-4),
        Surface(
            vertices=low + shell.vertices @ turn,
            faces=shell.faces,
            normals=shell.normals @ turn,
            uv=shell.uv,
            material=shell.material,
        ),
    ]


def _recess(style: HandleStyle, at: FloatArray, room: float) -> list[Surface]:
    """A grip let into the front, drawn as its dark opening within a frame."""
    wide, tall = style.length / 2 + 0.01, min(0.036, 0.42 * room) / 2
    lower, upper = at - xyz(wide, tall, 0), at + xyz(wide, tall, 0)
    frame = plate(
        lower - xyz(0.005, 0.005, 0.0),
        upper + xyz(0.005, 0.005, 0.002),
        2,
        style.look,
        radius=0.008,
    )
    face = upper + xyz(0, 0, 0.002)
    return [
        *frame,
        decal(lower, face, "front", _SHADE),
        decal(lower, face, "front", _DARK, at=(0.5, 0.68), size=(2 * wide, 1.28 * tall), lift=5e-4),
    ]


def _lip(style: HandleStyle, lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """A profile along the upper edge of the front, to pull from above or from below."""
    out, drop = 0.4 * style.reach + 0.006, 0.02
    top, z = upper[1] - 0.001, upper[2]
    inset = 0.004
    # corners are (-z, y), counter-clockwise
    polygon = [(-z - out, top - drop), (-z, top - 0.6 * drop), (-z, top), (-z - out, top)]
    return [*prism(polygon, 0, (lower[0] + inset, upper[0] - inset), style.look)]


def lock(lower: FloatArray, upper: FloatArray) -> list[Surface]:
    """A key cylinder in the upper right corner of a front."""
    look = Material(color=(0.6, 0.6, 0.6), roughness=0.3, metallic=0.9)
    at = np.array([upper[0] - 0.035, upper[1] - min(0.03, 0.3 * (upper[1] - lower[1])), upper[2]])
    slot = (at - xyz(0.0008, 0.004, 0), at + xyz(0.0008, 0.004, 0.003))
    return [
        *cylinder(at + xyz(0, 0, 0.0015), 2, 0.009, 0.003, look, segments=12),
        decal(*slot, "front", _DARK),
    ]
