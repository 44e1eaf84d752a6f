"""What is printed on control panels, drawn in metres: names, symbols, scales, digits."""

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw

from r2art.data.procedural.randomness import Color, between, chance, mixed, pick, pixel
from r2art.data.procedural.textures import Texture, font

Point = tuple[float, float]
_GLOW: tuple[Color, ...] = (
    (0.35, 0.95, 0.75),  # vacuum fluorescent
    (0.3, 0.9, 0.3),
    (0.95, 0.25, 0.15),
    (0.95, 0.6, 0.15),
    (0.9, 0.95, 1.0),
    (0.4, 0.7, 1.0),
)


def ink_on(color: Color) -> Color:
    """A colour that can be read on ``color``."""
    return (0.9, 0.9, 0.9) if sum(color) < 1.5 else (0.12, 0.12, 0.13)


class Print:
    """A drawing in one ink on a plain panel.

    Points are metres right and up from its lower left corner.
    """

    def __init__(
        self, width: float, height: float, color: Color, ink: Color | None = None, px: int = 448
    ) -> None:
        """A panel of ``width`` by ``height`` metres whose longer side has ``px`` pixels."""
        self.width, self.height = width, height
        self.color, self.ink = color, ink or ink_on(color)
        self.faint = mixed(self.color, self.ink, 0.4)
        self._scale = px / max(width, height)  # px per metre
        size = max(2, round(width * self._scale)), max(2, round(height * self._scale))
        self._image = Image.new("RGB", size, pixel(color))
        self._draw = ImageDraw.Draw(self._image)

    def texture(self) -> Texture:
        """The drawing so far."""
        return np.array(self._image)

    def text(self, at: Point, height: float, words: str, anchor: str = "mm") -> None:
        """Write ``words``, their letters ``height`` metres high; ``anchor`` as Pillow names it."""
        size = max(6, round(1.25 * height * self._scale))
        self._draw.text(self._px(at), words, fill=pixel(self.ink), font=font(size), anchor=anchor)

    def box(self, center: Point, size: Point, radius: float = 0.0, *, filled: bool = False) -> None:
        """A faint rectangle, its corners rounded by ``radius`` metres."""
        self._draw.rounded_rectangle(
            [
                *self._px((center[0] - size[0] / 2, center[1] + size[1] / 2)),
                *self._px((center[0] + size[0] / 2, center[1] - size[1] / 2)),
            ],
            radius * self._scale,
            fill=pixel(self.faint) if filled else None,
            outline=pixel(self.faint),
        )

    def line(self, points: Sequence[Point], width: float) -> None:
        """A line ``width`` metres wide."""
        wide = max(1, round(width * self._scale))
        self._draw.line([self._px(p) for p in points], fill=pixel(self.ink), width=wide)

    def ring(self, center: Point, radius: float, *, filled: bool = False) -> None:
        """A circle or a disc."""
        x, y = self._px(center)
        r = radius * self._scale
        where = [x - r, y - r, x + r, y + r]
        self._draw.ellipse(where, outline=pixel(self.ink), fill=pixel(self.ink) if filled else None)

    def dial(self, center: Point, radius: float, labels: Sequence[str], size: float) -> None:
        """Marks and labels around a knob, clockwise from the lower left."""
        for angle, words in zip(np.linspace(-0.75, 0.75, len(labels)) * np.pi, labels, strict=True):
            out = np.array([np.sin(angle), np.cos(angle)])
            a, b, c = (
                tuple((center + k * out).tolist()) for k in (radius, 1.15 * radius, 1.4 * radius)
            )
            self.line([a, b], 0.0008)
            if words:
                self.text(c, size, words)

    def symbol(self, rng: np.random.Generator, center: Point, size: float) -> None:
        """One of the small pictures that stand beside buttons, about ``size`` metres wide."""
        pick(rng, (_pot, _drop, _snowflake, _waves, _star, _glass, _dish, _clock))(
            self, np.array(center), size / 2
        )

    def _px(self, point: Point) -> Point:
        return point[0] * self._scale, (self.height - point[1]) * self._scale


def _path(sheet: Print, at: np.ndarray, r: float, points: Sequence[Point]) -> None:
    sheet.line([(at[0] + r * x, at[1] + r * y) for x, y in points], 0.25 * r)


def _pot(sheet: Print, at: np.ndarray, r: float) -> None:
    _path(sheet, at, r, [(-0.8, 0.4), (-0.7, -0.8), (0.7, -0.8), (0.8, 0.4), (-0.8, 0.4)])
    _path(sheet, at, r, [(0.8, 0.2), (1.2, 0.2)])


def _drop(sheet: Print, at: np.ndarray, r: float) -> None:
    _path(sheet, at, r, [(0, 1), (-0.6, -0.2), (-0.3, -0.9), (0.3, -0.9), (0.6, -0.2), (0, 1)])


def _snowflake(sheet: Print, at: np.ndarray, r: float) -> None:
    for angle in (0, np.pi / 3, 2 * np.pi / 3):
        x, y = 0.9 * np.sin(angle), 0.9 * np.cos(angle)
        _path(sheet, at, r, [(-x, -y), (x, y)])


def _waves(sheet: Print, at: np.ndarray, r: float) -> None:
    x = np.linspace(-0.9, 0.9, 9)
    for y in (-0.5, 0.0, 0.5):
        _path(sheet, at, r, list(zip(x, y + 0.18 * np.sin(5 * x), strict=True)))


def _star(sheet: Print, at: np.ndarray, r: float) -> None:
    turn = np.arange(6) * 0.8 * np.pi
    _path(sheet, at, r, list(zip(0.95 * np.sin(turn), 0.95 * np.cos(turn), strict=True)))


def _glass(sheet: Print, at: np.ndarray, r: float) -> None:
    _path(sheet, at, r, [(-0.6, 0.9), (-0.2, 0), (0.2, 0), (0.6, 0.9)])
    _path(sheet, at, r, [(0, 0), (0, -0.8)])
    _path(sheet, at, r, [(-0.45, -0.8), (0.45, -0.8)])


def _dish(sheet: Print, at: np.ndarray, r: float) -> None:
    sheet.ring((at[0], at[1]), r)
    sheet.ring((at[0], at[1]), 0.55 * r)


def _clock(sheet: Print, at: np.ndarray, r: float) -> None:
    sheet.ring((at[0], at[1]), r)
    _path(sheet, at, r, [(0, 0.6), (0, 0), (0.45, 0)])


def digits(rng: np.random.Generator, aspect: float) -> Texture:
    """A display of ``aspect`` (width over height): glowing time or minutes on black, or dark."""
    tall = 48  # px, and here the unit of length
    sheet = Print(
        aspect * tall, tall, (0.015, 0.02, 0.02), pick(rng, _GLOW), int(max(aspect, 1) * tall)
    )
    hour, minute = int(rng.integers(0, 24)), int(rng.integers(0, 60))
    shown = pick(rng, (f"{hour}:{minute:02d}", f"{hour:02d}:{minute:02d}", f"{minute}", "0:00"))
    if chance(rng, 0.85):
        size = min(0.62 * tall, 1.2 * aspect * tall / max(3, len(shown)))
        sheet.text((aspect * tall / 2, tall / 2), size, shown)
    for k in range(int(rng.integers(0, 4))):
        where = aspect * tall * (0.1 + 0.12 * k), between(rng, 0.08, 0.14) * tall
        sheet.ring(where, 2.0, filled=True)
    return sheet.texture()
