"""The temples of glasses, built open for the right side, straight back from the hinge."""

import numpy as np
from PIL import Image, ImageDraw

from r2art.data.categories.eyeglasses.style import TILE, GlassesStyle
from r2art.data.procedural.randomness import between, chance, pixel
from r2art.data.procedural.solids import box, cylinder, decal, xyz
from r2art.data.procedural.swept import mirrored, swept
from r2art.data.procedural.textures import Texture, font, sticker_image
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
_RIGHT = (1.0, 0.0, 0.0)
SLEEVE = 0.0009  # m by which a plastic tip is thicker than the bar in it
_BEND = 0.024  # m along the temple over which it turns down


def temples(
    rng: np.random.Generator, style: GlassesStyle, z_ends: tuple[float, float]
) -> tuple[list[Surface], list[Surface]]:
    """Left and right temple, open; each begins at its own z (m)."""
    bare = _bare(style)
    marks = _Marks(rng, style)
    right = [_moved(s, z_ends[1]) for s in bare] + marks.surfaces(z_ends[1], 1)
    left = [mirrored(_moved(s, z_ends[0])) for s in bare] + marks.surfaces(z_ends[0], -1)
    return left, right


def _moved(surface: Surface, z: float) -> Surface:
    return Surface(
        vertices=surface.vertices + xyz(0, 0, z),
        faces=surface.faces,
        normals=surface.normals,
        uv=surface.uv,
        material=surface.material,
    )


def path(style: GlassesStyle, along: FloatArray) -> FloatArray:
    """(K, 3) middle of the right temple at distances (m) from its hinge, which is at z = 0."""
    temple = style.temple
    fine = np.linspace(0, temple.length, 400)
    turned = np.clip((fine - temple.bend + _BEND / 2) / _BEND, 0, 1)
    slope = temple.drop * turned**2 * (3 - 2 * turned)
    step = temple.length / 399
    down, back = np.cumsum(np.sin(slope)) * step, np.cumsum(np.cos(slope)) * step
    middle = style.width / 2 - temple.thickness / 2
    inward = temple.inward * np.clip(2 * fine / temple.length - 1, 0, 1) ** 2
    y = style.hinge_height - (down - down[0])
    points = np.stack([middle - inward, y, -(back - back[0])], axis=-1)
    return np.stack([np.interp(along, fine, points[:, k]) for k in range(3)], axis=-1)


def _bare(style: GlassesStyle) -> list[Surface]:
    temple = style.temple
    high, low, tip = temple.heights
    length, bend = temple.length, temple.bend
    if temple.sleeve == 0.0:
        along = _stations(0.0, bend - _BEND, length, tip / 2)
        knots = (
            (0.0, high),
            (0.25 * length, 0.85 * high + 0.15 * low),
            (bend - _BEND, low),
        )
        return [_bar(style, along, (*knots, (bend + 0.012, tip)), style.temple_look, 0.0)]
    start = length - temple.sleeve
    metal = _stations(0.0, 0.5 * length, start + 0.02, 0.0)
    sleeve = _stations(start, bend - _BEND / 2, length, tip / 2)
    thin = ((0.0, high), (0.03, low), (length, low))
    thick = ((start, low + 0.0012), (bend, tip), (length, tip))
    return [
        _bar(style, metal, thin, style.temple_look, 0.0),
        _bar(style, sleeve, thick, style.tip_look, SLEEVE),
    ]


def _stations(start: float, bend: float, end: float, tip: float) -> FloatArray:
    """Distances along a temple, denser where it bends and at its rounded tip."""
    straight = np.linspace(start, bend, 6)
    curved = np.linspace(bend, end - tip, 14)[1:]
    rounded = end - tip * (1 - np.sin(np.linspace(0, np.pi / 2, 6)[1:])) if tip else []
    return np.concatenate([straight, curved, rounded])


def _bar(
    style: GlassesStyle,
    along: FloatArray,
    heights: tuple[tuple[float, float], ...],
    look: Material,
    extra: float,
) -> Surface:
    temple = style.temple
    at, value = np.array(heights).T
    tall = np.interp(along, at, value)
    thick = np.full_like(tall, temple.thickness + extra)
    left = temple.length - along
    tip = temple.heights[2] / 2
    if left[-1] < 1e-9:
        close = np.sqrt(np.clip(1 - (1 - np.clip(left / tip, 0, 1)) ** 2, 0.04, 1))
        tall, thick = tall * close, thick * (0.4 + 0.6 * close)
    soft = 0.3 * (temple.thickness + extra)
    return swept(path(style, along), _RIGHT, thick, tall, look, radius=soft, tile=TILE)


class _Marks:
    """Hinge leaves, rivets and what is printed on both temples."""

    def __init__(self, rng: np.random.Generator, style: GlassesStyle) -> None:
        self.style = style
        plain = style.temple_look.texture is None
        high = style.temple.heights[0]
        self.name = None
        self.sizes = None
        color = style.temple_look.color
        if plain and high > 0.004 and chance(rng, 0.6):
            self.name = Material(color=(1, 1, 1), texture=sticker_image(rng, color), roughness=0.3)
        if plain and high > 0.004 and chance(rng, 0.7):
            self.sizes = Material(color=(1, 1, 1), texture=_imprint(rng, style), roughness=0.35)
        self.at = between(rng, 0.012, 0.03)

    def surfaces(self, z: float, side: int) -> list[Surface]:
        """On the right (side 1) or the left (-1) temple that begins at ``z``."""
        style, temple = self.style, self.style.temple
        outer = side * style.width / 2
        inner = outer - side * temple.thickness
        y = style.hinge_height
        high = min(0.0025, 0.45 * temple.heights[0])
        low_x, high_x = sorted((inner - side * 0.0006, inner + side * 0.0002))
        pieces = [box((low_x, y - high, z - 0.008), (high_x, y + high, z), style.metal)]
        if style.rivets:
            for dy in (-0.0016, 0.0016):
                at = xyz(outer, y + dy, z - 0.006)
                pieces += cylinder(at, 0, 0.0008, 0.0005, style.metal, segments=10)
        tall = 0.55 * min(temple.heights[0], temple.heights[1] + 0.002)
        if self.name is not None:
            pieces.append(self._print(self.name, outer, z, ("left", "", "right")[side + 1], tall))
        if self.sizes is not None:
            pieces.append(self._print(self.sizes, inner, z, ("right", "", "left")[side + 1], tall))
        return pieces

    def _print(self, look: Material, x: float, z: float, face: str, tall: float) -> Surface:
        y = self.style.hinge_height
        assert look.texture is not None
        wide = tall * look.texture.shape[1] / look.texture.shape[0]
        middle = z - self.at - wide / 2
        lower, upper = (
            xyz(x, y - tall / 2, middle - wide / 2),
            xyz(x, y + tall / 2, middle + wide / 2),
        )
        return decal(lower, upper, face, look, lift=1.5e-4)


def _imprint(rng: np.random.Generator, style: GlassesStyle) -> Texture:
    """Model and sizes as they stand on the inside: lens, bridge, temple in millimetres."""
    color = style.temple_look.color
    sizes = [round(1e3 * v) for v in (style.lens_width, style.bridge, style.temple.length)]
    image = Image.new("RGB", (192, 20), pixel(color))
    ink = (200, 200, 200) if sum(color) < 1.4 else (70, 70, 75)
    model = f"M{int(rng.integers(100, 9999))}"
    text = f"{model}  {sizes[0]} - {sizes[1]}  {sizes[2]}"
    ImageDraw.Draw(image).text((96, 10), text, fill=ink, font=font(15), anchor="mm")
    return np.asarray(image)
