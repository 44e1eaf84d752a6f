"""The front of glasses: rims, lenses, bridge, nose pads, end pieces.

Everything is built flat, its middle in the plane z = 0, for the right side (x > 0); then it is
bent, and mirrored to the left.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from r2art.data.categories.eyeglasses.lenses import outline
from r2art.data.categories.eyeglasses.style import TILE, GlassesStyle
from r2art.data.pose import transformed
from r2art.data.procedural.curved import ellipsoid
from r2art.data.procedural.outlines import grown, outward
from r2art.data.procedural.randomness import between, chance
from r2art.data.procedural.solids import cylinder, skin, xyz
from r2art.data.procedural.swept import mirrored, swept
from r2art.data.shape import Material, Surface
from r2art.data.staging import about

FloatArray = np.ndarray
_UP = (0.0, 1.0, 0.0)
_ALONG = np.linspace(-1, 1, 13)  # of a bridge
_PAD = Material(color=(0.82, 0.83, 0.82), roughness=0.2, emission=0.06)


class Front:
    """The outlines of the right lens and rim, seen from the front, and the parts around them."""

    def __init__(self, rng: np.random.Generator, style: GlassesStyle) -> None:
        self.style = style
        shape = outline(style.shape, style.lens_width, style.lens_height)
        self.lens = shape + np.array([style.center, 0.0])
        self.normals = outward(self.lens)
        self.width = self._rim_width()
        self.outer = grown(self.lens, self.width)
        self.middle = grown(self.lens, self.width / 2)
        self.bridge_height = style.lens_height * between(rng, 0.08, 0.3)
        self.rng = rng

    def surfaces(self) -> list[Surface]:
        """All of the front but the end pieces, in its place."""
        right = [*self._rim(), *self._lens(), *self._pads()]
        whole = [*right, *(mirrored(s) for s in right), *self._bridge()]
        return bent(whole, self.style)

    def at(self, height: float, side: int) -> FloatArray:
        """The place (x, y) on the middle of the rim at a height; side 1: temple, -1: nose."""
        away = side * (self.middle[:, 0] - self.style.center)
        return self.middle[np.argmin(np.abs(self.middle[:, 1] - height) + 1e3 * (away < 0))]

    def _rim_width(self) -> FloatArray:
        style = self.style
        if style.kind in ("rimless", "half"):
            return np.full(len(self.lens), 0.0006)
        x, y = (self.lens - (style.center, 0.0)).T / np.hypot(style.lens_width, style.lens_height)
        upward = np.clip(2 * y, 0, None)
        corner = np.exp(-(((np.arctan2(y, x) - 0.7) / 0.45) ** 2))
        more = (style.brow - style.rim) * upward**2 + style.flare * corner
        return style.rim + (more if style.plastic else np.zeros_like(more))

    def _rim(self) -> list[Surface]:
        style = self.style
        look, height, radius = style.metal, style.depth, None
        if style.kind in ("rimless", "half"):  # the polished edge of the lens
            look, height, radius = style.lens.edge, 0.0012 if style.kind == "half" else 0.0019, 1e-4
        elif style.plastic:
            look, radius = style.front_look, 0.32 * style.depth
        path, side = flat(self.middle), flat(self.normals)
        rim = swept(path, side, self.width, height, look, radius=radius, closed=True, tile=TILE)
        return [rim, *self._upper()] if style.kind in ("half", "browline") else [rim]

    def _upper(self) -> list[Surface]:
        """The bar over the lens of half rims and browlines."""
        style = self.style
        brow = style.kind == "browline"
        above = self.lens[:, 1] > style.lens_height * (0.02 if brow else -0.08)
        first = int(np.flatnonzero(above & ~np.roll(above, 1))[0])
        order = np.roll(np.arange(len(above)), -first)[: int(above.sum())]
        share = np.linspace(0, 1, len(order))
        swell = np.sin(np.pi * share) ** 0.5
        look = style.brow_look if brow else style.front_look
        if brow:
            width = 0.0022 + (1.5 * style.brow + 0.0022) * swell * (1.1 - 0.3 * share)
            depth, radius = 0.0042, 0.0012
        else:
            thin = look.metallic > 0.5
            width = (0.0016 if thin else 0.003) * (0.6 + 0.5 * swell)
            depth, radius = (0.0022 if thin else 0.0034), 0.0006
        side = self.normals[order]
        path = flat(self.lens[order] + side * (width / 2 - 3e-4)[:, None])
        return [swept(path, flat(side), width, depth, look, radius=radius, tile=TILE)]

    def _lens(self) -> list[Surface]:
        look = self.style.lens
        if look.front is None:
            return []
        bulge = between(self.rng, 0.0006, 0.0022)
        shape = grown(self.lens, 0.0005 if self.style.rim > 0.001 else 0.0002)
        front = _shell(shape, look.front, 0.0004, bulge)
        back = _shell(shape, look.back, -0.0012, bulge)
        return [front, replace(back, faces=back.faces[:, ::-1], normals=-back.normals)]

    def _bridge(self) -> list[Surface]:
        style, rng = self.style, self.rng
        end = self.at(self.bridge_height, -1)
        if not style.plastic:
            return self._metal_bridge(end)
        along, over = _ALONG, 1 - _ALONG**2
        y = end[1] + between(rng, 0.0005, 0.003) * over
        tall = between(rng, 0.0045, 0.008) * (1 + between(rng, 0.3, 0.9) * along**2)
        path = np.stack([end[0] * along, y, 0.3 * style.depth * over], axis=-1)
        look, soft = style.front_look, 0.32 * style.depth
        return [swept(path, _UP, tall, style.depth, look, radius=soft, tile=TILE)]

    def _metal_bridge(self, end: FloatArray) -> list[Surface]:
        """A bow between the rims, or, rimless, screwed before the lenses; perhaps a second bar."""
        style, rng = self.style, self.rng
        along, over = _ALONG, 1 - _ALONG**2
        lift = 0.0016 if style.kind == "rimless" else 0.0
        y = end[1] + between(rng, 0.0008, 0.004) * over
        z = lift + between(rng, 0.0005, 0.0025) * over
        thick = between(rng, 0.0014, 0.0026)
        tall = thick * between(rng, 1.0, 1.8)
        look = style.brow_look if style.kind == "browline" and chance(rng, 0.3) else style.metal
        if style.kind == "half" and style.front_look is not style.metal:
            look, tall = style.front_look, 0.0045
        pieces = [swept(np.stack([end[0] * along, y, z], axis=-1), _UP, tall, thick, look)]
        if style.double_bridge:
            height = self.bridge_height + 0.25 * style.lens_height
            high = self.at(min(height, 0.43 * style.lens_height), -1)
            bar = np.stack([high[0] * along, high[1] + 0.0005 * over, 0 * along], axis=-1)
            pieces.append(swept(bar, _UP, thick, thick, style.metal))
        if style.kind == "rimless":
            stub = np.array([[end[0] - 5e-4, end[1], lift], [end[0] + 0.003, end[1], lift]])
            mount = [swept(stub, _UP, 0.002, 0.001, style.metal)]
            mount += _screw(end[0] + 0.002, end[1], style.metal)
            pieces += [*mount, *(mirrored(s) for s in mount)]
        return pieces

    def _pads(self) -> list[Surface]:
        """The nose pad of the right side, and what holds it."""
        style = self.style
        place = self.at(-0.1 * style.lens_height, -1)
        if style.pads == "moulded":
            return [
                ellipsoid(
                    (place[0], place[1], -style.depth / 2),
                    (0.4 * style.rim + 0.0008, 0.006, 0.003),
                    style.front_look,
                    rings=7,
                    segments=10,
                )
            ]
        top = self.at(0.06 * style.lens_height, -1)
        pad = xyz(place[0] - 0.0012, place[1], -0.0065)
        turn = np.eye(4)
        turn[:3, :3] = about(1, -0.5) @ about(2, 0.22)
        turn[:3, 3] = pad
        share = np.linspace(0, 1, 8)[:, None]
        start, knee = xyz(top[0], top[1], -0.0005), xyz(top[0] + 0.0025, top[1] - 0.001, -0.0075)
        arm = (1 - share) ** 2 * start + 2 * share * (1 - share) * knee + share**2 * pad
        oval = ellipsoid((0, 0, 0), (0.0014, 0.0062, 0.0033), _PAD, rings=7, segments=10)
        return [
            transformed(oval, turn),
            swept(arm, _UP, 0.001, 0.001, style.metal, segments=1),
        ]


def end_piece(front: Front, z_end: float) -> list[Surface]:
    """The right corner of the front and what leads back from it to the hinge at ``z_end``."""
    style = front.style
    temple, y = style.temple, style.hinge_height
    start = front.at(y, 1)
    inset = 0.003 if style.kind == "rimless" else -0.0002
    x0, x1 = float(start[0]) - inset, style.width / 2 - temple.thickness / 2
    lift = 0.0016 if style.kind == "rimless" else 0.0
    turn = min(0.005 if style.plastic else 0.0035, 0.7 * (x1 - x0))
    straight = np.linspace(x0, x1 - turn, 4)
    face = style.front(straight, y) + lift
    angle = np.linspace(0, np.pi / 2, 6)[1:]
    path = np.concatenate(
        [
            np.stack([straight, np.full(4, y), face], axis=-1),
            np.stack(
                [
                    x1 - turn + turn * np.sin(angle),
                    np.full(5, y),
                    face[-1] - turn * (1 - np.cos(angle)),
                ],
                axis=-1,
            ),
            [[x1, y, z_end]],
        ]
    )
    share = np.linspace(0, 1, len(path))
    first = temple.heights[0] * (1.25 if style.plastic or style.kind == "browline" else 1.0)
    first = min(first, 0.62 * style.lens_height)
    tall = first + share * (temple.heights[0] - first)
    deep = min(style.depth, 0.0016) if not style.plastic else style.depth
    thick = deep + share * (temple.thickness - deep)
    look = style.brow_look if style.kind == "browline" else style.front_look
    if style.kind in ("rimless", "half"):
        look = style.metal if style.temple_look is style.metal else style.front_look
    soft = min(0.3 * temple.thickness, 0.0009)
    pieces = [swept(path, _UP, tall, thick, look, radius=soft, tile=TILE)]
    if style.kind == "rimless":
        pieces += bent(_screw(x0 + 0.0012, y, style.metal), style)
    if style.rivets:
        for dy in (-0.0016, 0.0016):
            x = 0.5 * (x0 + x1 - turn) + 0.001
            at = xyz(x, y + dy, float(style.front(x, y)) + style.depth / 2)
            pieces += cylinder(at, 2, 0.0008, 0.0006, style.metal, segments=10)
    return pieces


def _screw(x: float, y: float, look: Material) -> tuple[Surface, ...]:
    return cylinder(xyz(x, y, 0), 2, 0.0011, 0.0048, look, segments=10)


def _shell(shape: FloatArray, look: Material, z: float, bulge: float) -> Surface:
    """A lens seen from the front: it stands out in its middle by ``bulge``."""
    center = (shape.min(axis=0) + shape.max(axis=0)) / 2
    reach = shape - center
    share = np.array([1.0, 0.8, 0.6, 0.4, 0.2, 0.0])[:, None, None]
    flat_points = center + share * reach
    height = np.broadcast_to(z + bulge * (1 - share**2), (*flat_points.shape[:2], 1))
    slope = 2 * bulge * share * reach / (reach**2).sum(axis=-1, keepdims=True)
    normals = np.concatenate([slope, np.ones_like(height)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    uv = (flat_points - shape.min(axis=0)) / np.ptp(shape, axis=0)
    rings = np.concatenate([flat_points, height], axis=-1)
    return skin(rings, normals, np.clip(uv, 0.02, 0.98), look, wrap=True)


def flat(points: FloatArray) -> FloatArray:
    """(N, 2) points or directions in the plane z = 0."""
    return np.concatenate([points, np.zeros((len(points), 1))], axis=-1)


def bent(surfaces: Iterable[Surface], style: GlassesStyle) -> list[Surface]:
    """Surfaces of the flat front, curved and slanted as `GlassesStyle.front` says."""
    moved = []
    for surface in surfaces:
        x, y, z = surface.vertices.T
        normals = surface.normals.copy()
        normals[:, 0] += x / style.curve * normals[:, 2]
        normals[:, 1] -= style.slant * normals[:, 2]
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        vertices = np.stack([x, y, z + style.front(x, y)], axis=-1)
        moved.append(replace(surface, vertices=vertices, normals=normals))
    return moved
