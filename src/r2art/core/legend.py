"""The legend below a drawn prediction: what it is, how sure, how far open, and the warnings."""

from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw

from r2art.core.palette import AMBER, CARD, GREY, RED, WHITE, Color, part_color
from r2art.core.pen import font
from r2art.core.prediction import JointEstimate, Prediction

CAMERA = {"given": "camera given", "exif": "camera from EXIF", "guessed": "camera guessed"}
LEAST_WIDTH = 480
MARGIN = 20


@dataclass(frozen=True)
class Item:
    """Words that stay on one line, each with its colour; ``swatch`` puts a square before them."""

    words: tuple[tuple[str, Color], ...]
    swatch: Color | None = None


@dataclass(frozen=True)
class Row:
    """Items one after the other, wrapped where the line is full."""

    items: tuple[Item, ...]
    size: float = 17
    gap: float = 28


def state_text(joint: JointEstimate, state: float | None = None) -> str:
    """The joint's state (or another one) in degrees or centimetres."""
    state = joint.state if state is None else state
    return f"{np.degrees(state):.0f}°" if joint.kind == "revolute" else f"{100 * state:.1f} cm"


def legend(prediction: Prediction, picture: Image.Image) -> Image.Image:
    """The picture on a dark card, with the legend below it."""
    unit = max(picture.size) / 960
    width = max(picture.width, round(LEAST_WIDTH * unit))
    placed, height = _flow(_rows(prediction), width, unit)
    card = Image.new("RGB", (width, picture.height + height), CARD)
    card.paste(picture, ((width - picture.width) // 2, 0))
    pen = ImageDraw.Draw(card)
    for x, y, size, item in placed:
        y += picture.height
        if item.swatch is not None:
            pen.rounded_rectangle(
                (x, y - 0.36 * size, x + 0.72 * size, y + 0.36 * size), 0.15 * size, item.swatch
            )
            x += 1.15 * size
        for word, color in item.words:
            pen.text((x, y), word, color, font(size), "lm")
            x += font(size).getlength(word + " ")
    return card


def _rows(prediction: Prediction) -> list[Row]:
    parts = [
        Item(((p.name, WHITE), (f"{p.confidence:.0%}", GREY)), swatch=part_color(i))
        for i, p in enumerate(prediction.parts)
    ]
    joints = [
        Item(
            (
                (j.name, WHITE),
                (state_text(j), part_color(i + 1)),
                (f"of {state_text(j, j.limits[1])}", GREY),
            )
        )
        for i, j in enumerate(prediction.joints)
    ]
    score = prediction.category_score
    sure = "given" if score is None else f"{score:.0%}"
    distance = float(np.linalg.norm(prediction.parts[0].cam_T_part[:3, 3]))
    camera = CAMERA[prediction.camera_source]
    title = Item(((prediction.category, WHITE), (sure, GREY)))
    facts = (Item(((f"{distance:.2f} m away", GREY),)), Item(((camera, GREY),)))
    warnings = [
        Row(tuple(Item(((word, AMBER),)) for word in f"Warning: {text}".split()), 15, 0)
        for text in prediction.warnings
    ]
    if prediction.rejected is not None:
        words = f"Rejected: {prediction.rejected}".split()
        warnings.insert(0, Row(tuple(Item(((word, RED),)) for word in words), 15, 0))
    return [Row((title, *facts), 20), Row(tuple(parts)), Row(tuple(joints)), *warnings]


def _flow(
    rows: list[Row], width: int, unit: float
) -> tuple[list[tuple[float, float, float, Item]], int]:
    """Where each item goes (left, middle, font size, item), and the height of all lines (px)."""
    placed = []
    margin = MARGIN * unit
    y = 0.8 * margin
    for row in filter(lambda row: row.items, rows):
        size = row.size * unit
        x = margin
        y += 0.8 * size
        for item in row.items:
            length = sum(font(size).getlength(word + " ") for word, _ in item.words)
            length += 0.0 if item.swatch is None else 1.15 * size
            if x > margin and x + length > width - margin:
                x = margin
                y += 1.4 * size
            placed.append((x, y, size, item))
            x += length + row.gap * unit
        y += 0.8 * size
    return placed, round(y + 0.8 * margin)
