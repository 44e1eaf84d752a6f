"""A pen that draws points of the camera frame on a picture.

Lines go to a layer of twice the size that is averaged down at the end (Pillow's own lines are
jagged), labels straight onto the picture. Everything bright has a dark rim, to read on white too.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from r2art.core.camera import Camera
from r2art.core.palette import CARD, RIM, Color

FloatArray = NDArray[np.floating]

SUPERSAMPLE = 2
RIM_WIDTH = 1.5


@cache
def font(size: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Pillow's built-in font, ``size`` pixels high."""
    return ImageFont.load_default(size)


def clip_near(polygon: FloatArray, near: float) -> FloatArray:
    """What of a closed polygon (N, 3) lies in front of the plane z = near."""
    kept = []
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        if a[2] >= near:
            kept.append(a)
        if (a[2] >= near) != (b[2] >= near):
            kept.append(a + (near - a[2]) / (b[2] - a[2]) * (b - a))
    return np.reshape(kept, (-1, 3))


class Pen:
    """Draws on ``picture`` as ``camera`` (of the picture's size) sees it, from ``near`` (m) on.

    Widths and radii are in units of 1/960 of the picture's longer side.
    """

    def __init__(self, picture: Image.Image, camera: Camera, near: float) -> None:
        self._picture = picture
        self._camera = camera
        self._near = near
        self._unit = max(picture.size) / 960
        width, height = picture.size
        self._layer = Image.new("RGBA", (SUPERSAMPLE * width, SUPERSAMPLE * height))
        self._draw = ImageDraw.Draw(self._layer)
        self._labels: list[tuple[FloatArray, str, Color]] = []

    def finish(self) -> Image.Image:
        """The picture with everything on it."""
        lines = self._layer.reduce(SUPERSAMPLE)
        self._picture.paste(lines, mask=lines)
        for center, text, color in self._labels:
            self._write(center, text, color)
        return self._picture

    def _write(self, center: FloatArray, text: str, color: Color) -> None:
        """Write on a small dark plate, moved to where the picture holds all of it."""
        letters = font(16 * self._unit)
        half = np.array([letters.getlength(text) / 2 + 6 * self._unit, 12 * self._unit])
        x, y = np.maximum(np.minimum(center, self._picture.size - half - 1), half)
        pen = ImageDraw.Draw(self._picture)
        plate = (x - half[0], y - half[1], x + half[0], y + half[1])
        pen.rounded_rectangle(plate, 5 * self._unit, CARD)
        pen.text((x, y), text, color, letters, "mm")

    def fill(self, polygon: FloatArray, color: Color, alpha: int) -> None:
        """Tint a polygon (N, 3)."""
        if len(outline := self._seen(polygon)) >= 3:
            self._draw.polygon(outline, fill=(*color, alpha))

    def line(
        self, a: FloatArray, b: FloatArray, color: Color, width: float, alpha: int = 255
    ) -> None:
        """Draw a segment; one that is opaque gets round ends."""
        if len(ends := self._seen([a, b])) < 2:
            return
        pixels = width * self._unit * SUPERSAMPLE
        self._draw.line(ends[:2], fill=(*color, alpha), width=max(1, round(pixels)))
        if alpha == 255:
            for end in ends[:2]:
                self._draw.circle(end, pixels / 2, fill=(*color, 255))

    def dot(self, point: FloatArray, color: Color, radius: float) -> None:
        """Draw a rimmed dot."""
        for center in self._seen([point])[:1]:
            for r, fill in ((radius + RIM_WIDTH, RIM), (radius, color)):
                self._draw.circle(center, r * self._unit * SUPERSAMPLE, fill=(*fill, 255))

    def arrow(
        self,
        a: FloatArray,
        b: FloatArray,
        color: Color,
        width: float,
        label: str,
        label_color: Color | None = None,
    ) -> None:
        """Draw a rimmed arrow from a to b, labelled beyond its tip."""
        if b[2] < self._near:
            return
        tail, tip = (np.array(end) for end in self._seen([a, b])[:2])
        length = float(np.linalg.norm(tip - tail))
        pixel = SUPERSAMPLE * self._unit
        along = (tip - tail) / length if length > 1e-6 else np.array([0.0, -1.0])
        across = np.array([-along[1], along[0]])
        head = min(5 * width * pixel, 0.7 * length)
        for rim, fill in ((RIM_WIDTH * pixel, RIM), (0.0, color)):
            back = tip - (head + rim) * along
            wing = (0.4 * head + 1.4 * rim) * across
            shaft = round(width * pixel + 2 * rim)
            self._draw.line([*tail, *(tip - 0.8 * head * along)], (*fill, 255), shaft)
            outline = [tip + 2.2 * rim * along, back + wing, back - wing]
            self._draw.polygon([(float(x), float(y)) for x, y in outline], (*fill, 255))
        beyond = (16 + 4 * len(label) * abs(along[0])) * self._unit
        self._labels.append((tip / SUPERSAMPLE + beyond * along, label, label_color or color))

    def _seen(self, points: Sequence[FloatArray] | FloatArray) -> list[tuple[float, float]]:
        """Layer pixels of what of a polygon, line or point lies in front of the near plane.

        A line's first two are its ends, in its own direction.
        """
        clipped = clip_near(np.asarray(points), self._near)
        return [(float(u), float(v)) for u, v in SUPERSAMPLE * self._camera.project(clipped)]
