"""Glasses: plastic and wire frames, half rims, rimless, browlines, sunglasses, sports glasses."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from r2art.core.category import Joint, Mirror
from r2art.data.categories.eyeglasses.front import Front, end_piece
from r2art.data.categories.eyeglasses.style import GlassesStyle, sample_style
from r2art.data.categories.eyeglasses.temples import SLEEVE, temples
from r2art.data.pose import joint_matrix, transformed
from r2art.data.procedural.assembly import assembled
from r2art.data.procedural.randomness import between, chance
from r2art.data.procedural.solids import cylinder, xyz
from r2art.data.procedural.swept import mirrored
from r2art.data.shape import Instance, Surface
from r2art.data.staging import Rest, Spread, Staging

_TEMPLE = Spread(closed=0.12, opened=0.55)
_CLEARANCE = 4e-4  # m between folded temples


def _rests(pitch: float) -> tuple[Rest, ...]:
    """Upright on rims and tips, on the brow, lenses up, lenses down."""
    return (
        Rest(weight=7, axis="x", angle=pitch),
        Rest(weight=1.6, axis="z", angle=np.pi),
        Rest(weight=0.8, axis="x", angle=-np.pi / 2),
        Rest(weight=0.6, axis="x", angle=np.pi / 2),
    )


STAGING = Staging(
    azimuth=float(np.radians(60)),
    azimuth_limit=np.pi,
    elevation=(float(np.radians(27)), float(np.radians(15))),
    elevation_limits=(float(np.radians(5)), float(np.radians(60))),
    joints={"hinge_left": _TEMPLE, "hinge_right": _TEMPLE},
    together=0.85,
    rests=_rests(0.0),
)

MIRROR = Mirror(swap=(0, 2, 1))


def generate(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Instance:
    """A ``frame`` with ``temple_left`` and ``temple_right``, both folded at rest."""
    del photos  # nothing on glasses shows one
    style_rng, front_rng, temple_rng, joint_rng = rng.spawn(4)
    style = sample_style(style_rng)
    front = Front(front_rng, style)
    ahead, tilt, right_first = _folding(joint_rng, style)
    z_hinge = float(style.front(style.width / 2, style.hinge_height)) - style.end_depth
    left_z, right_z = z_hinge, z_hinge - ahead
    if right_first:
        left_z, right_z = right_z, left_z
    splay = between(joint_rng, -0.05, 0.1)
    joints, opened = [], []
    for name, side, z in (("left", -1, left_z), ("right", 1, right_z)):
        straight = np.pi / 2 + (tilt if (side > 0) == right_first else -tilt)
        opened.append(straight)
        joints.append(_hinge(style, name, side, z, straight + splay))
    frame = front.surfaces()
    for side, z in ((-1, left_z), (1, right_z)):
        corner = [*end_piece(front, z), *_barrel(style, z)]
        frame += corner if side > 0 else [mirrored(s) for s in corner]
    both = temples(temple_rng, style, (left_z, right_z))
    rests = _rests(_pitch(frame, both[1]))
    folded = [
        [transformed(s, joint_matrix(joint, -state)) for s in temple]
        for joint, state, temple in zip(joints, opened, both, strict=True)
    ]
    parts = {"frame": frame, "temple_left": folded[0], "temple_right": folded[1]}
    return assembled("eyeglasses", parts, joints, rests)


def _folding(rng: np.random.Generator, style: GlassesStyle) -> tuple[float, float, bool]:
    """How the temples pass each other when folded.

    Half by a hinge that lies further back (m), half by a tilt towards the front or away from
    it (rad); and whether the right one (the wearer's left) is folded first, as most are.
    """
    temple = style.temple
    room = temple.thickness + 0.5 * temple.inward + (SLEEVE if temple.sleeve else 0) + _CLEARANCE
    return 0.5 * room, 0.5 * room / (style.width - 0.01), chance(rng, 0.75)


def _hinge(style: GlassesStyle, name: str, side: int, z: float, limit: float) -> Joint:
    return Joint(
        name=f"hinge_{name}",
        kind="revolute",
        parent=0,
        axis=(0.0, float(-side), 0.0),
        pivot=(
            side * (style.width / 2 - style.temple.thickness),
            style.hinge_height,
            z,
        ),
        limits=(0.0, limit),
    )


def _barrel(style: GlassesStyle, z: float) -> tuple[Surface, ...]:
    """The right hinge."""
    radius = 0.0011
    x = style.width / 2 - style.temple.thickness - 0.6 * radius
    tall = max(0.0028, min(0.006, 0.6 * style.temple.heights[0]))
    at = xyz(x, style.hinge_height, z + 0.5 * radius)
    return cylinder(at, 1, radius, tall, style.metal, segments=10)


def _pitch(frame: list[Surface], temple: list[Surface]) -> float:
    """How far (rad) open glasses lean back to rest on both their rims and the temples' tips."""
    rim, tip = (_lowest(surfaces) for surfaces in (frame, temple))
    return float(np.arctan2(rim[1] - tip[1], rim[2] - tip[2]))


def _lowest(surfaces: list[Surface]) -> np.ndarray:
    vertices = np.concatenate([s.vertices for s in surfaces])
    return vertices[np.argmin(vertices[:, 1])]
