"""What is on the upper edge of the door: name, switch, programmes, display, or hidden keys."""

from dataclasses import dataclass, field, replace

import numpy as np

from r2art.data.procedural.controls import button, display, knob
from r2art.data.procedural.prints import Print
from r2art.data.procedural.randomness import between, chance, pick
from r2art.data.procedural.solids import decal, xyz
from r2art.data.procedural.textures import Texture, word
from r2art.data.shape import Material, Surface

_LAMP = Material(color=(0.3, 0.9, 0.4), roughness=0.4, emission=1.0)
_GRADES = (
    (0, 150, 60),
    (80, 180, 50),
    (190, 210, 30),
    (250, 230, 0),
    (250, 180, 0),
    (235, 100, 20),
)


@dataclass
class Strip:
    """The strip ``lower``..``upper`` (m) above the main panel; its print grows piece by piece.

    Attributes:
        lower: Lower corner of its box.
        upper: Upper corner of its box.
        look: Its material without the print.
        pocket: Left and right x of the pocket in it, if any.
    """

    lower: np.ndarray
    upper: np.ndarray
    look: Material
    pocket: tuple[float, float] | None
    sheet: Print = field(init=False)

    def __post_init__(self) -> None:
        wide, tall, _ = (self.upper - self.lower).tolist()
        self.sheet = Print(wide, tall, self.look.color, px=512)

    def face(self) -> Material:
        """Its material with all that was printed so far."""
        return replace(self.look, color=(1, 1, 1), texture=self.sheet.texture())

    def at(self, x: float, y: float) -> np.ndarray:
        """The point on its front that is ``x``, ``y`` from its lower left corner."""
        return xyz(self.lower[0] + x, self.lower[1] + y, self.upper[2])

    def zones(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Spans, in x from the left edge, left and right of the pocket or of the middle."""
        left, right = self.pocket or (-0.02, 0.02)
        return (0.02, left - self.lower[0] - 0.015), (
            right - self.lower[0] + 0.015,
            self.sheet.width - 0.02,
        )


def controls(rng: np.random.Generator, strip: Strip) -> list[Surface]:
    """Print and place the controls: the name on one side, display and programmes on the other."""
    (a, b), (c, d) = strip.zones()
    sheet, tall = strip.sheet, strip.sheet.height
    part = pick(
        rng,
        (
            strip.look,
            Material(color=sheet.ink, roughness=0.4),
            Material(color=(0.7, 0.7, 0.71), roughness=0.3, metallic=0.8),
        ),
    )
    pieces: list[Surface] = []
    switch = min(0.018, 0.3 * tall)
    sheet.symbol(rng, (a + 0.012, 0.72 * tall), 0.008)
    pieces += button(strip.at(a + 0.012, 0.45 * tall), (switch, switch), 0.003, part)
    sheet.text(
        (a + 0.035, between(rng, 0.5, 0.7) * tall), min(0.014, 0.16 * tall), word(rng), anchor="lm"
    )
    if b - a > 0.2:
        pieces += _row(rng, strip, a + 0.12, b, part)
    if chance(rng, 0.2):
        radius = 0.27 * tall
        sheet.dial(
            (d - 1.6 * radius, tall / 2), 1.15 * radius, ("", "1", "2", "3", "4", "5", ""), 0.005
        )
        pieces += knob(
            rng, strip.at(d - 1.6 * radius, tall / 2), radius, between(rng, 0.012, 0.02), part
        )
        d -= 3.4 * radius
    elif chance(rng, 0.65):
        size = between(rng, 0.045, 0.075), min(0.028, 0.36 * tall)
        pieces.append(display(rng, strip.at(d - size[0] / 2, 0.55 * tall), size))
        d -= size[0] + 0.012
    return [*pieces, *_row(rng, strip, c, d, part)]


def _row(
    rng: np.random.Generator, strip: Strip, left: float, right: float, part: Material
) -> list[Surface]:
    """Buttons or printed keys side by side, a symbol above each, a lamp on some."""
    sheet, tall = strip.sheet, strip.sheet.height
    count = int(min(rng.integers(3, 8), (right - left) / 0.02))
    solid, wide = chance(rng, 0.6), between(rng, 0.012, 0.02)
    height = pick(rng, (0.5 * wide, wide, 0.35 * wide))
    pieces: list[Surface] = []
    for k in range(count):
        x = left + (k + 0.5) * (right - left) / count
        if solid:
            pieces += button(
                strip.at(x, 0.4 * tall),
                (min(wide, 0.7 * (right - left) / count), height),
                0.002,
                part,
            )
        else:
            sheet.ring((x, 0.4 * tall), 0.0045)
        sheet.symbol(rng, (x, 0.72 * tall), 0.012)
        if chance(rng, 0.2):
            at = strip.at(x, 0.56 * tall)
            pieces.append(decal(at, at, "front", _LAMP, size=(0.003, 0.003)))
    return pieces


def top_edge(rng: np.random.Generator, lower: np.ndarray, upper: np.ndarray) -> list[Surface]:
    """Keys and display on the upper edge of the door, which are seen only when it is open."""
    wide, tall = (upper[0] - lower[0]) * 0.96, (upper[2] - lower[2]) * 0.7
    sheet = Print(wide, tall, pick(rng, ((0.06, 0.06, 0.06), (0.62, 0.63, 0.64))), px=512)
    sheet.text((0.07, tall / 2), 0.4 * tall, word(rng))
    for x in np.linspace(0.3, 0.92, int(rng.integers(6, 13))):
        sheet.symbol(rng, (x * wide, 0.62 * tall), 0.3 * tall)
        sheet.ring((x * wide, 0.2 * tall), 0.002)
    look = Material(color=(1, 1, 1), texture=sheet.texture(), roughness=0.25)
    at = upper - ((upper[0] - lower[0]) / 2, 0, (upper[2] - lower[2]) / 2)
    return [
        decal(lower, upper, "top", look, size=(wide, tall)),
        decal(
            at,
            at,
            "top",
            Material(color=(0.6, 0.85, 1.0), emission=0.8),
            at=(0.5, 0.5),
            size=(0.03, 0.3 * tall),
            lift=6e-4,
        ),
    ]


def energy_label(rng: np.random.Generator) -> Texture:
    """The label that new machines wear: arrows from green to red."""
    sheet = np.full((128, 64, 3), 245, np.uint8)
    sheet[:14] = (20, 60, 140)
    for k, color in enumerate(_GRADES):
        sheet[22 + 11 * k : 30 + 11 * k, 6 : 22 + 5 * k] = color
    grade = 20 + 11 * int(rng.integers(0, len(_GRADES)))
    sheet[grade : grade + 12, 46:60] = 10
    sheet[100:103, 8:56] = sheet[110:112, 8:40] = sheet[117:119, 8:48] = 90
    return sheet
