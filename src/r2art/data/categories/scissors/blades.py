"""Blades of scissors, and the screw that joins them.

A half is built as the main one lies: its blade to the left of its edge, its handle to the right.
"""

import numpy as np
from PIL import Image, ImageDraw

from r2art.data.categories.scissors.style import ScissorsStyle
from r2art.data.procedural.profiles import curve
from r2art.data.procedural.randomness import between, chance, mixed, pixel
from r2art.data.procedural.sheets import draped, loft
from r2art.data.procedural.solids import box, cylinder, xyz
from r2art.data.procedural.textures import Texture, font, word, words
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
_PLAY = 5e-5  # m, half the distance between the blades
_DARK = Material(color=(0.12, 0.12, 0.12), roughness=0.6, metallic=0.3)


def blade(style: ScissorsStyle, tang: tuple[float, float, float], up: bool) -> list[Surface]:
    """The blade of a half whose handle begins at ``tang``; ``up``: above y = 0."""
    z = _stations(style, tang[1])
    left, right = _sides(style, tang, z)
    thick = _thickness(style, z)
    ground = np.minimum(style.bevel, 0.6 * (right - left))
    ground = ground * np.interp(z, (-0.12 * style.width, 0.35 * style.width), (1.0, 0.0))
    inner, outer = np.full_like(z, _PLAY), _PLAY + thick
    blunt = _PLAY + np.where(ground > 1e-5, 0.12 * thick, thick)
    x = np.stack([left, right, right, right - ground, left], axis=-1)
    y = np.stack([inner, inner, blunt, outer, outer], axis=-1)
    rings = np.stack([x, y, np.broadcast_to(z[:, None], x.shape)], axis=-1)
    rings = rings if up else rings[:, ::-1] * (1, -1, 1)
    rings[..., 1] += style.curl * (np.clip(-z, 0, None) / style.blade)[:, None] ** 2
    pieces = [loft(rings, style.steel, angle=0.35, tile=0.06)]
    edge = [2, 3] if up else [1, 2]
    pieces.append(draped(rings[ground > 2e-4][:, edge], style.ground, lift=3e-5))
    return pieces


def _stations(style: ScissorsStyle, end: float) -> FloatArray:
    """Places along z, denser at the tip and about the pivot."""
    round_tip = style.tip / 2 * (1 - np.cos(np.linspace(0, np.pi / 2, 6)))
    long = np.linspace(-style.blade + style.tip / 2, -0.12 * style.width, 10)[1:]
    return np.concatenate([-style.blade + round_tip, long, np.linspace(0, end, 8)])


def _thickness(style: ScissorsStyle, z: FloatArray) -> FloatArray:
    return style.thickness * np.interp(z, (-style.blade, 0.0), (0.55, 1.0))


def _sides(
    style: ScissorsStyle, tang: tuple[float, float, float], z: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """x of the back (left) and of the edge (right) of the blade, and of the tang behind it."""
    half, b, (x, end, wide) = style.width / 2, style.blade, tang
    point = style.tip / 2
    full = point + (half - point) * (0.5 + style.belly * 0.5)
    left = curve(
        z,
        [(-b, -point), (-0.5 * b, -full), (0.0, -half), (0.3 * end, -0.9 * half), (end, x - wide)],
    )
    right = curve(
        z,
        [(-b, point), (-0.02 * b, 0.85 * half), (0.35 * end, 0.9 * half), (end, x + wide)],
    )
    from_tip = np.clip((z + b) / point, 0, 1)
    round_off = np.sqrt(1 - (1 - from_tip) ** 2)
    middle = (left + right) / 2
    share = np.where(z + b < point, np.maximum(round_off, 0.1), 1.0)
    return middle + share * (left - middle), middle + share * (right - middle)


def screw(style: ScissorsStyle, up: bool) -> list[Surface]:
    """Its head above the upper blade, or its end below the lower one."""
    thick, sign = style.thickness + _PLAY, 1 if up else -1
    radius = style.screw if up else 0.75 * style.screw
    high = 0.35 * style.thickness + 0.0006
    at = xyz(0, sign * (thick + high / 2), 0)
    pieces = [*cylinder(at, 1, radius, high, style.screw_look, segments=18, bevel=0.4 * high)]
    if up and style.slot:
        slot = xyz(0.65 * radius, 0, 0.09 * radius)
        top = xyz(0, thick + high, 0)
        pieces.append(box(top - slot, top + slot + xyz(0, 4e-5, 0), _DARK))
    return pieces


def etching(
    rng: np.random.Generator,
    style: ScissorsStyle,
    tang: tuple[float, float, float],
    up: bool,
    side: int,
) -> list[Surface]:
    """A name, or a scale, along the back of a blade, outside; ``side`` -1: mirrored."""
    if style.kind in ("nail", "embroidery") or not chance(rng, 0.6):
        return []
    out, right = (1 if up else -1), (1 if chance(rng, 0.5) else -1)
    near = -0.1 * style.blade - 0.5 * style.width
    z = near - 0.36 * style.blade * np.array([1.0, 0.0])[::right]
    left, edge = _sides(style, tang, z)
    room = float((edge - left).min()) - style.bevel
    wide = 0.7 * room
    ruler = style.kind in ("office", "school") and chance(rng, 0.25)
    look = Material(
        color=(1, 1, 1),
        texture=_scale(style, 0.36 * style.blade, wide) if ruler else _name(rng, style),
        roughness=style.steel.roughness,
        metallic=style.steel.metallic,
    )
    middle = side * (left + 0.15 * room + wide / 2)
    x = middle + out * right * wide / 2 * np.array([[-1], [1]])
    y = np.broadcast_to(out * (_PLAY + _thickness(style, z)), x.shape)
    return [draped(np.stack([x, y, np.broadcast_to(z, x.shape)], axis=-1), look, lift=6e-5)]


def _name(rng: np.random.Generator, style: ScissorsStyle) -> Texture:
    color = pixel(style.steel.color)
    dark = sum(style.steel.color) > 0.9
    ink = pixel(mixed(style.steel.color, (0, 0, 0) if dark else (1, 1, 1), between(rng, 0.4, 0.8)))
    image = Image.new("RGB", (160, 40), color)
    draw = ImageDraw.Draw(image)
    draw.text((80, 14), word(rng).upper(), fill=ink, font=font(20), anchor="mm")
    text = "STAINLESS STEEL" if chance(rng, 0.6) else words(rng, 2)
    draw.text((80, 32), text, fill=ink, font=font(10), anchor="mm")
    return np.asarray(image)


def _scale(style: ScissorsStyle, long: float, wide: float) -> Texture:
    """Centimetres and millimetres."""
    width = 200
    per_metre = width / long
    image = Image.new("RGB", (width, max(8, int(wide * per_metre))), pixel(style.steel.color))
    draw = ImageDraw.Draw(image)
    for k in range(int(long * 1e3) + 1):
        tall = image.height * (0.55 if k % 10 == 0 else 0.4 if k % 5 == 0 else 0.25)
        x = k * 1e-3 * per_metre
        draw.line([x, 0, x, tall], fill=(30, 30, 30), width=2 if k % 10 == 0 else 1)
        if k % 10 == 0 and k:
            text = str(k // 10)
            draw.text((x, 0.8 * image.height), text, fill=(30, 30, 30), font=font(10), anchor="mm")
    return np.asarray(image)
