"""Handles of scissors: a finger loop, and the arm that carries it.

Points are (x, z) in the plane y = 0, where the handle of the right half lies. Outlines are
counter-clockwise with z upwards.
"""

import numpy as np

from r2art.data.categories.scissors.style import LoopStyle, ScissorsStyle
from r2art.data.procedural.bands import band
from r2art.data.procedural.outlines import evenly, grown, outward, oval
from r2art.data.procedural.swept import swept
from r2art.data.procedural.wires import wires
from r2art.data.shape import Surface

FloatArray = np.ndarray
_UP = (0.0, 1.0, 0.0)


class Handle:
    """The handle on the right."""

    def __init__(self, style: ScissorsStyle, loop: LoopStyle) -> None:
        self.style = style
        wide, long = loop.wide, loop.long
        shape = oval((wide, long, wide, long), loop.exponents, count=44)
        cos, sin = np.cos(loop.turn), np.sin(loop.turn)
        shape = shape @ np.array([[cos, sin], [-sin, cos]])
        wall = style.ring * (1 + style.heavy * np.clip(outward(shape)[:, 1], 0, None))
        around = grown(shape, wall)
        end = style.handle - loop.end
        shift = np.array([style.gap / 2 - around[:, 0].min(), end - around[:, 1].max()])
        self.hole, self.around = shape + shift, around + shift
        self.middle = (self.hole + self.around) / 2
        self.broad = style.broad * style.width
        self.start = style.neck * style.width

    @property
    def tang(self) -> tuple[float, float, float]:
        """Where (x, z) the handle hides the end of the blade, and half the width (m) there."""
        reach = 0.5 if self.style.solid else 0.35
        x = self.style.gap / 2 + self.broad / 2
        return x, self.start + reach * self.style.width, 0.4 * self.broad

    def surfaces(self, rest: bool) -> list[Surface]:
        """All of it, with a rest for the little finger or without."""
        pieces = self._solid() if self.style.solid else self._slender()
        return [*pieces, *(self._finger_rest() if rest else [])]

    def _solid(self) -> list[Surface]:
        """Loop and arm in one piece, perhaps with a soft lining."""
        style = self.style
        outer = evenly(self._body(), 90)
        hole = grown(self.hole, style.lining)
        center = hole.mean(axis=0)
        outer_angle, hole_angle = (np.arctan2(*(p - center).T[::-1]) for p in (outer, hole))
        inner = np.stack(
            [np.interp(outer_angle, hole_angle, hole[:, k], period=2 * np.pi) for k in range(2)],
            axis=-1,
        )
        share = np.clip((outer[:, 1] - self.start) / (0.4 * (style.handle - self.start)), 0, 1)
        tall = style.height * (style.slim + (1 - style.slim) * share**2 * (3 - 2 * share))
        look = style.handle_look
        pieces = [band(_seen(inner), _seen(outer), 1, tall[::-1], look, radius=style.edge)]
        pieces += self._teeth()
        if style.lining > 0:
            around = grown(self.hole, style.lining + 6e-4)
            tall, soft = 0.9 * style.height, style.lining_look
            lined = (_seen(self.hole), _seen(around))
            pieces.append(band(*lined, 1, tall, soft, radius=0.8 * style.lining))
        return pieces

    def _body(self) -> FloatArray:
        """Outline of loop and arm: straight on the inner side, with a waist on the outer."""
        style = self.style
        left, right = style.gap / 2, style.gap / 2 + self.broad
        cut = 0.22 * self.broad
        corner = np.array([right, self.start + cut])
        away = self.around - corner
        touch = int(np.argmax(np.arctan2(away[:, 0], away[:, 1])))
        innermost = int(np.argmin(self.around[:, 0]))
        count = (innermost - touch) % len(self.around) + 1
        loop = np.roll(self.around, -touch, axis=0)[:count]
        reach = loop[0] - corner
        knee = corner + reach / 2 + style.waist * np.array([-reach[1], reach[0]])
        outer_side = _bezier(corner, knee, loop[0])[:-1]
        foot = np.array([[left + cut, self.start], [right - cut, self.start]])
        return np.concatenate([foot, outer_side, loop, self._inner_side()])

    def _inner_side(self, pieces: int = 14) -> FloatArray:
        """From the loop to the neck, straight unless a jaw is let into it."""
        neck = self.start + 0.22 * self.broad
        low, high = self._jaw()
        z = np.linspace(self.around[np.argmin(self.around[:, 0]), 1], neck, pieces)[1:]
        hollow = np.sin(np.pi * np.clip((z - low) / (high - low), 0, 1))
        return np.stack([self.style.gap / 2 + self.style.jaw * hollow, z], axis=-1)

    def _jaw(self) -> tuple[float, float]:
        """Where the hollow between the arms begins and ends (z)."""
        low = self.start + 0.3 * self.broad
        return low, low + 0.85 * (self.hole[:, 1].min() + 0.25 * self.style.main.long - low)

    def _teeth(self) -> list[Surface]:
        """The teeth of the jaw, upright ridges."""
        style = self.style
        if style.jaw == 0.0:
            return []
        low, high = self._jaw()
        share = np.linspace(0.15, 0.85, 6)
        x = style.gap / 2 + style.jaw * np.sin(np.pi * share) + 2e-4
        places = np.stack([x, 0 * x, low + share * (high - low)], axis=-1)
        half = np.array([0.0, 0.36 * style.height, 0.0])
        ends = np.stack([places - half, places + half], axis=1)
        return [wires(ends, 0.0013, style.steel, sides=6)]

    def _slender(self) -> list[Surface]:
        """A forged ring on a thin arm."""
        style = self.style
        look = style.handle_look
        around = outward(self.hole)
        ring = swept(_flat(self.middle), _flat(around), style.ring, style.height, look, closed=True)
        left, top = np.argmin(self.middle[:, 0]), np.argmin(self.middle[:, 1])
        joint = self.middle[round(left + style.splay * (top - left))]
        start = np.array([style.gap / 2 + self.broad / 2, self.start])
        knee = np.array(
            [joint[0] - 0.3 * style.splay * style.ring, 0.4 * self.start + 0.6 * joint[1]]
        )
        path = _bezier(start, knee, joint)
        share = np.linspace(0, 1, len(path))
        narrow = (1 - np.minimum(1.6 * share, 1)) ** 1.5
        wide = style.ring + (self.broad - style.ring) * narrow
        path[:, 0] = np.maximum(path[:, 0], style.gap / 2 + wide / 2)
        low = min(style.height, 2.1 * style.thickness)
        tall = low + (style.height - low) * np.minimum(2 * share, 1)
        tall[0] *= 0.6
        across = np.cross(_UP, _flat(np.gradient(path, axis=0)))
        return [ring, swept(_flat(path), across, wide, tall, look, segments=3)]

    def _finger_rest(self) -> list[Surface]:
        """A small hook behind the loop."""
        last = self.middle[np.argmax(self.middle[:, 1])]
        reach = np.array([0.0, 0.012])
        path = _bezier(last, last + reach, last + reach + np.array([0.007, 0.008]))
        wide = self.style.ring * np.linspace(0.8, 0.5, len(path))
        return [swept(_flat(path), _UP, wide, wide, self.style.handle_look)]


def _bezier(a: FloatArray, b: FloatArray, c: FloatArray, pieces: int = 12) -> FloatArray:
    """(pieces + 1, 2) points from a to c, drawn towards b."""
    t = np.linspace(0, 1, pieces + 1)[:, None]
    return (1 - t) ** 2 * a + 2 * t * (1 - t) * b + t**2 * c


def _flat(points: FloatArray) -> FloatArray:
    """(x, z) in the plane y = 0."""
    return np.insert(points, 1, 0.0, axis=-1)


def _seen(outline: FloatArray) -> FloatArray:
    """(x, z) as seen from above, where -z is up; still counter-clockwise."""
    return outline[::-1] * (1, -1)
