"""The deck of a laptop seen from above: keyboard, trackpad, speakers, stickers.

Key pitch is real (19.05 mm where the deck is wide enough), so that a photo tells how large the
laptop is.
"""

from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw

from r2art.data.procedural.randomness import Color, between, chance, mixed, pick, pixel
from r2art.data.procedural.textures import Texture, font, sticker, word, worn

KEY_PITCH = 0.01905
_ROWS = (
    ("`1234567890-=", 13 * (1.0,) + (2.0,)),
    ("\tqwertyuiop[]", (1.5,) + 12 * (1.0,) + (1.5,)),
    ("\tasdfghjkl;'", (1.75,) + 11 * (1.0,) + (2.25,)),
    ("\tzxcvbnm,./", (2.25,) + 10 * (1.0,) + (2.75,)),
    ("", (1.25, 1.0, 1.0, 1.25, 5.5, 1.0, 1.0, 1.0, 1.0, 1.0)),
)


@dataclass(frozen=True)
class DeckStyle:
    """How a deck looks; ``age`` runs from 0 (about 2002) to 1 (now), lengths in metres."""

    width: float
    depth: float
    age: float
    color: Color
    key_color: Color
    well_color: Color


def deck(rng: np.random.Generator, style: DeckStyle) -> Texture:
    """The deck as an image of its whole top face; its upper edge is at the hinge."""
    scale = 512 / max(style.width, style.depth)  # px per metre
    w, h = int(style.width * scale), int(style.depth * scale)
    image = Image.new("RGB", (w, h), pixel(style.color))
    draw = ImageDraw.Draw(image)
    numpad = style.width > 0.36 and chance(rng, 0.65)
    units = 19.25 if numpad else 15.0
    pitch = min(KEY_PITCH, (style.width - 0.008) / units)
    function_row = between(rng, 0.5, 0.95)
    wide, tall = units * pitch, (5.08 + function_row) * pitch
    spare = max(style.depth - tall, 0.04)
    behind = spare * between(rng, 0.08, 0.3)
    left = (style.width - wide) / 2
    _speakers(rng, draw, style, scale, left, behind, tall)
    _keyboard(rng, draw, style, scale, (left, behind, pitch, function_row), numpad)
    centre = left + 6.6 * pitch if chance(rng, 0.75) else style.width / 2
    _trackpad(rng, draw, style, scale, centre, behind + tall)
    _palm_rest(rng, draw, style, scale, behind + tall)
    texture = np.asarray(image)
    return worn(rng, texture, between(rng, 0.2, 1.2)) if chance(rng, 0.8) else texture


def _mixed(color: Color, other: Color, share: float) -> tuple[int, int, int]:
    return pixel(mixed(color, other, share))


def _contrast(color: Color) -> Color:
    return (0.92, 0.92, 0.9) if sum(color) < 1.5 else (0.1, 0.1, 0.12)


def _key_boxes(pitch: float, function_row: float, numpad: bool) -> list[tuple[float, ...]]:
    """Left, top, width, height of every key (m), and the index of its row (-1: function)."""
    keys = []
    count = 16
    for k in range(count):
        step = 15 / count
        keys.append((k * step * pitch, 0.0, step * pitch, function_row * pitch, -1, k))
    for row, (_, widths) in enumerate(_ROWS):
        x = 0.0
        for k, unit in enumerate(widths):
            y = (function_row + 0.08 + row) * pitch
            keys.append((x * pitch, y, unit * pitch, pitch, row, k))
            x += unit
    if numpad:
        for row in range(5):
            for k in range(4):
                y = (function_row + 0.08 + row) * pitch
                keys.append(((15.25 + k) * pitch, y, pitch, pitch, row, 100 + k))
    return keys


def _keyboard(
    rng: np.random.Generator,
    draw: ImageDraw.ImageDraw,
    style: DeckStyle,
    scale: float,
    placement: tuple[float, float, float, float],
    numpad: bool,
) -> None:
    left, top, pitch, function_row = placement
    island = chance(rng, 0.15 + 0.8 * style.age)
    gap = pitch * (between(rng, 0.13, 0.2) if island else between(rng, 0.04, 0.09))
    keys = _key_boxes(pitch, function_row, numpad)
    right = max(k[0] + k[2] for k in keys)
    bottom = max(k[1] + k[3] for k in keys)
    margin = between(rng, 0.001, 0.004)
    well = [left - margin, top - margin, left + right + margin, top + bottom + margin]
    draw.rounded_rectangle([v * scale for v in well], 3, fill=pixel(style.well_color))
    face = pixel(style.key_color)
    edge = _mixed(style.key_color, (0.0, 0.0, 0.0), 0.45)
    light = _mixed(style.key_color, (1.0, 1.0, 1.0), 0.16)
    legend = _mixed(style.key_color, _contrast(style.key_color), between(rng, 0.55, 1.0))
    accent = pixel(pick(rng, (style.key_color,) * 5 + ((0.3, 0.35, 0.5), (0.6, 0.6, 0.6))))
    dish = 0 if island else scale * pitch * between(rng, 0.07, 0.13)
    small = font(max(6, int(pitch * scale * 0.36)))
    for x, y, wide, tall, row, k in keys:
        x0, y0 = (left + x + gap / 2) * scale, (top + y + gap / 2) * scale
        x1, y1 = (left + x + wide - gap / 2) * scale, (top + y + tall - gap / 2) * scale
        special = row < 0 or k >= 100 or wide > 1.1 * pitch or (row == 4 and k != 4)
        fill = accent if special else face
        draw.rectangle([x0, y0, x1, y1], fill=edge if dish else fill)
        if dish:
            draw.rectangle([x0 + dish, y0 + dish * 0.6, x1 - dish, y1 - 1.4 * dish], fill=fill)
            draw.line([x0 + dish, y0, x1 - dish, y0], fill=light)
        row, k = int(row), int(k)
        letters = _ROWS[row][0]
        if row >= 0 and k < len(letters) and letters[k] != "\t":
            draw.text((x0 + dish + 2, y0 + dish), letters[k].upper(), fill=legend, font=small)
        elif k >= 100 or row < 0:
            draw.point([(x0 + x1) / 2, (y0 + y1) / 2], fill=legend)
            draw.rectangle([x0 + 3, y0 + 3, x0 + 6, y0 + 4], fill=legend)
        elif wide > 1.1 * pitch and k != 4:
            draw.rectangle([x0 + 4, y0 + 4, x0 + 12, y0 + 5], fill=legend)
    if chance(rng, 0.35 * (1 - style.age)):
        x, y, r = (left + 6.05 * pitch) * scale, (top + pitch * (function_row + 2.55)) * scale, 4
        draw.ellipse([x - r, y - r, x + r, y + r], fill=pick(rng, ((190, 25, 30), (40, 60, 150))))


def _trackpad(
    rng: np.random.Generator,
    draw: ImageDraw.ImageDraw,
    style: DeckStyle,
    scale: float,
    centre: float,
    keyboard_end: float,
) -> None:
    room = style.depth - keyboard_end - 0.008
    if room < 0.02:
        return
    modern = style.age + 0.15 * rng.standard_normal() > 0.6
    wide = between(rng, 0.095, 0.15) if modern else between(rng, 0.058, 0.085)
    buttons = 0.0 if modern else between(rng, 0.009, 0.016)
    tall = min(wide * between(rng, 0.55, 0.72), room - 2 * buttons)
    top = keyboard_end + 0.004 + max(0.0, room - tall - buttons) * between(rng, 0.1, 0.6)
    x0, x1 = (centre - wide / 2) * scale, (centre + wide / 2) * scale
    y0, y1 = top * scale, (top + tall) * scale
    shift = between(rng, 0.06, 0.3)
    toward = (0.0, 0.0, 0.0) if chance(rng, 0.6) else (1.0, 1.0, 1.0)
    line = _mixed(style.color, (0.0, 0.0, 0.0), between(rng, 0.25, 0.6))
    draw.rounded_rectangle(
        [x0, y0, x1, y1], 4, fill=_mixed(style.color, toward, shift), outline=line
    )
    if buttons:
        fill = _mixed(style.color, pick(rng, ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))), 0.25)
        middle, y2 = (x0 + x1) / 2, y1 + 2 + buttons * scale
        draw.rounded_rectangle([x0, y1 + 2, middle - 1, y2], 2, fill=fill, outline=line)
        draw.rounded_rectangle([middle + 1, y1 + 2, x1, y2], 2, fill=fill, outline=line)
        if chance(rng, 0.3):
            y = y0 - 2 - buttons * scale
            draw.rounded_rectangle([x0, y, x1, y0 - 2], 2, fill=fill, outline=line)


def _speakers(
    rng: np.random.Generator,
    draw: ImageDraw.ImageDraw,
    style: DeckStyle,
    scale: float,
    left: float,
    behind: float,
    tall: float,
) -> None:
    dots = _mixed(style.color, (0.0, 0.0, 0.0), 0.55)
    if left > 0.012 and chance(rng, 0.5):
        grilles = [(0.004, left - 0.006), (style.width - left + 0.006, style.width - 0.004)]
        spans = [(a, b, behind, behind + tall) for a, b in grilles]
    elif behind > 0.014 and chance(rng, 0.7):
        spans = [(0.1 * style.width, 0.9 * style.width, 0.004, behind - 0.007)]
        if chance(rng, 0.5):
            spans = [(x, x + 0.06, 0.004, behind - 0.007) for x in (0.015, style.width - 0.075)]
    else:
        return
    for x0, x1, y0, y1 in spans:
        xs = np.arange(x0 * scale, x1 * scale, 4)
        ys = np.arange(y0 * scale, y1 * scale, 4)
        grid = np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)
        draw.point(np.concatenate([grid, grid + np.array([1, 0])]).ravel().tolist(), fill=dots)


def _palm_rest(
    rng: np.random.Generator,
    draw: ImageDraw.ImageDraw,
    style: DeckStyle,
    scale: float,
    keyboard_end: float,
) -> None:
    room = style.depth - keyboard_end
    if room < 0.035:
        return
    for _ in range(int(rng.integers(1, 5)) if chance(rng, 0.55) else 0):
        size = int(between(rng, 0.012, 0.024) * scale)
        side = pick(rng, (0.01, style.width - 0.09))
        x = int((side + between(rng, 0, 0.055)) * scale)
        y = int((keyboard_end + 0.008 + between(rng, 0, 0.6) * (room - 0.03)) * scale)
        sticker(rng, draw, x, y, size)
    ink = _mixed(style.color, _contrast(style.color), 0.7)
    if chance(rng, 0.25):
        draw.text(
            (0.012 * scale, (style.depth - 0.018) * scale), word(rng), fill=ink, font=font(12)
        )
    if chance(rng, 0.5):  # power button or status lights behind the keyboard
        x = between(rng, 0.05, 0.95) * style.width * scale
        draw.ellipse([x - 5, 3, x + 5, 13], outline=ink, fill=_mixed(style.color, (1, 1, 1), 0.2))
