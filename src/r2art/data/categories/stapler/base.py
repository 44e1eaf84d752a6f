"""The base of a stapler: slab or folded sheet, anvil, ears of the hinge, rubber."""

import numpy as np

from r2art.data.categories.stapler.style import StaplerStyle
from r2art.data.procedural.curved import prism
from r2art.data.procedural.profiles import arch, curve, rounded, stations
from r2art.data.procedural.randomness import between, chance
from r2art.data.procedural.sheets import loft, sheet
from r2art.data.procedural.solids import box, cylinder, decal, plate
from r2art.data.shape import Material, Surface

_GROOVE = Material(color=(0.08, 0.08, 0.085), roughness=0.5, metallic=0.4)
_TILE = 0.06  # m


def base(rng: np.random.Generator, style: StaplerStyle) -> list[Surface]:
    """All that stays on the desk; y = 0 is the desk."""
    body_rng, anvil_rng, hinge_rng, pad_rng = rng.spawn(4)
    pieces = [*_body(body_rng, style), *_anvil(anvil_rng, style), *_hinge(hinge_rng, style)]
    if style.kind == "heavy":
        pieces += _paper_stop(body_rng, style)
    if style.gap > 0.004 and chance(hinge_rng, 0.6):
        pieces += _leaf_spring(hinge_rng, style)
    return pieces + _pads(pad_rng, style)


def _top(style: StaplerStyle, z: np.ndarray) -> np.ndarray:
    """Height of the base along z: lower at the waist, level below anvil and hinge."""
    rear, front = style.hinge[1] + 0.012, style.mouth - 0.035 * min(1.0, style.length / 0.12)
    middle = (rear + front) / 2
    low = style.base_height * (1 - style.waist)
    knots = [(rear, style.base_height), (middle, low), (front, style.base_height)]
    return curve(z, knots)


def _half(style: StaplerStyle, z: np.ndarray) -> np.ndarray:
    """Half the width of the base along z, its corners rounded."""
    rear, waist, front = style.base_half
    end = style.length / 2
    knots = [(-end, rear), (-0.6 * end, rear), (0, waist), (0.6 * end, front), (end, front)]
    return np.maximum(curve(z, knots) - rounded(z, -end, end, style.corner), 0.2 * front)


def _body(rng: np.random.Generator, style: StaplerStyle) -> list[Surface]:
    end = style.length / 2
    z = stations(-end, end, 0.012, style.corner)
    half, top = _half(style, z), _top(style, z)
    bottom = style.pad * 0.7
    rail: list[Surface] = []
    if style.folded and chance(rng, 0.45):
        top = top - between(rng, 0.2, 0.5) * style.base_height
        rail = _rail(rng, style)
    if not style.folded:
        rows = arch(z, half, bottom, top, style.edge, segments=4)
        return [loft(rows, style.base, tile=_TILE)]
    return [*_folded(style, z, half, top), *rail]


def _folded(style: StaplerStyle, z: np.ndarray, half: np.ndarray, top: np.ndarray) -> list[Surface]:
    """A pressed tray, upside down; its first and last row are its end walls."""
    thick = 0.0011
    z, half, top = (np.pad(v, 1, mode="edge") for v in (z, half, top))
    end, low = style.length / 2, 3e-4
    outer_top, inner_top = top.copy(), top - thick
    outer_top[[0, -1]] = inner_top[[0, -1]] = low
    outer = arch(z, half, 0.0, outer_top, style.edge, segments=4)
    inner = arch(
        np.clip(z, thick - end, end - thick),
        half - thick,
        0.0,
        inner_top,
        max(style.edge - thick, 3e-4),
        segments=4,
    )
    return [*sheet(outer, inner, style.base, tile=_TILE)]


def _rail(rng: np.random.Generator, style: StaplerStyle) -> list[Surface]:
    """A raised middle of the base that carries hinge and anvil."""
    half = min(style.magazine[0] + between(rng, 0.001, 0.005), 0.8 * min(style.base_half))
    end = style.length / 2
    z = stations(0.003 - end, style.mouth + 0.001, 0.015, (0.004, 0.004))
    narrow = np.maximum(half - rounded(z, z[0], z[-1], (0.004, 0.004)), 0.3 * half)
    low = 0.3 * style.base_height
    rows = arch(z, narrow, low, _top(style, z), between(rng, 5e-4, 0.002), segments=3)
    return [loft(rows, style.base, tile=_TILE)]


def _anvil(rng: np.random.Generator, style: StaplerStyle) -> list[Surface]:
    """The steel plate below the mouth whose grooves bend the staples."""
    half = min(style.magazine[0] * between(rng, 1.0, 1.35), 0.8 * style.base_half[2])
    deep = between(rng, 0.013, 0.03) * min(1.0, style.length / 0.13)
    front = min(style.mouth + 0.3 * deep, style.length / 2 - 0.002)
    low = (-half, style.base_height - 0.002, front - deep)
    high = (half, style.base_height + 0.0008, front)
    pieces = [*plate(low, high, 1, style.steel, radius=between(rng, 0.001, 0.004), bevel=4e-4)]
    at = (style.mouth - 0.0022 - low[2]) / deep
    width, wide = 2 * half, style.magazine[0] * 0.8
    for side in (-1, 1):  # the legs bend inwards
        place = (0.5 + side * 0.55 * wide / width, 1 - at)
        pieces.append(decal(low, high, "top", _GROOVE, at=place, size=(0.75 * wide, 0.0022)))
    if chance(rng, 0.4):  # the second pair bends outwards
        at = max(at - 0.006 / deep, 0.1)
        pieces.append(decal(low, high, "top", _GROOVE, at=(0.5, 1 - at), size=(1.7 * wide, 0.0018)))
    return pieces


def _hinge(rng: np.random.Generator, style: StaplerStyle) -> list[Surface]:
    """Two ears with the pin between."""
    y, z = style.hinge
    thick = 0.0012 if style.folded else between(rng, 0.0018, 0.0032)
    inner = (max(style.cover_half) if style.ears_outside else style.magazine[0]) + 0.0004
    if not style.ears_outside:
        thick = min(thick, style.cover_half[0] - style.wall - inner - 0.0003)
    look = style.steel if style.folded and chance(rng, 0.4) else style.base
    radius = min(style.tail * between(rng, 0.75, 1.0), style.inset - 0.001)
    low = style.base_height - 0.003
    ahead = radius * between(rng, 1.05, 2.4) + 0.002
    turn = np.linspace(0, np.pi, 9)
    outline = [
        (-z + radius, low),
        *zip(-z + radius * np.cos(turn), y + radius * np.sin(turn), strict=True),
        (-z - ahead, low),
    ]
    pieces: list[Surface] = []
    for side in (-1, 1):
        span = sorted((side * inner, side * (inner + thick)))
        pieces += prism(outline, 0, (span[0], span[1]), look, tile=_TILE)
    pin = 2 * (inner + thick) + between(rng, 0.0008, 0.002)
    size = between(rng, 0.0015, 0.0026)
    pieces += cylinder((0, y, z), 0, size, pin, style.steel, bevel=3e-4)
    return pieces


def _leaf_spring(rng: np.random.Generator, style: StaplerStyle) -> list[Surface]:
    """The bent strip that holds the magazine up."""
    reach = style.mouth - style.hinge[1]
    start, end = style.hinge[1] + 0.22 * reach, style.hinge[1] + between(rng, 0.4, 0.6) * reach
    z = np.linspace(start, end, 6)
    rest = style.floor + (z[-1] - style.hinge[1]) * style.gap / reach - style.base_height
    y = _top(style, z) + 0.0004 + (0.55 * rest) * np.linspace(0, 1, 6) ** 1.6
    half = 0.6 * style.magazine[0]
    x = np.array([half, -half])
    top = np.stack(np.broadcast_arrays(x, y[:, None], z[:, None]), axis=-1)
    return [*sheet(top, top - (0, 0.0006, 0), style.steel)]


def _paper_stop(rng: np.random.Generator, style: StaplerStyle) -> list[Surface]:
    """The sliding guide of a heavy-duty stapler."""
    z = between(rng, -0.1, 0.2) * style.length
    top, half = float(_top(style, np.array([z]))[0]), style.base_half[1] * 0.9
    steel = style.steel
    low, high = (-half, top - 0.002, z), (half, top + 0.0012, z + 0.009)
    return [*plate(low, high, 1, steel, bevel=4e-4)]


def _pads(rng: np.random.Generator, style: StaplerStyle) -> list[Surface]:
    look, end = style.pad_look, style.length / 2
    if style.folded or chance(rng, 0.45):
        inset = 0.0017 if style.folded else 0.0008
        z = stations(-end, end, 0.015, style.corner)
        half = np.maximum(_half(style, z) - inset, 0.002)
        top = 0.15 * style.base_height
        deep = np.clip(z, inset - end, end - inset)
        return [loft(arch(deep, half, 0.0, top, 3e-4, segments=1), look)]
    long, inset = between(rng, 0.09, 0.2) * style.length, between(rng, 0.04, 0.1) * style.length
    half = 0.75 * min(style.base_half)
    if chance(rng, 0.4):
        radius = 0.3 * min(style.base_half)
        return [
            s
            for x in (-0.55 * half, 0.55 * half)
            for z in (inset + radius - end, end - inset - radius)
            for s in cylinder((x, style.pad / 2, z), 1, radius, style.pad, look, segments=10)
        ]
    return [
        box((-half, 0, z), (half, style.pad, z + long), look)
        for z in (inset - end, end - inset - long)
    ]
