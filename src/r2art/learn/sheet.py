"""Labels drawn on their photos, many on one sheet: to see at a glance whether they are right."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from r2art.core.category import Category
from r2art.core.draw import annotated
from r2art.core.errors import R2ArtError
from r2art.core.image import read_image
from r2art.core.legend import state_text
from r2art.core.palette import AMBER, CARD, GREY, RIM, WHITE, Color, part_color
from r2art.core.pen import font
from r2art.core.prediction import JointEstimate
from r2art.data.sample import Sample
from r2art.data.source import Source
from r2art.learn.evaluation.scores import truth

TILE = 480  # px
MARGIN = 8
LINE = 20
LETTERS = 14
TINT = 0.45


Word = tuple[str, Color]
"""A piece of text that stays on one line, and its colour."""


def tinted(sample: Sample) -> NDArray[np.uint8]:
    """(H, W, 3) the photo, each part seen in it tinted in its colour."""
    image = sample.image.astype(float)
    for part in range(len(sample.cam_T_part)):
        seen = sample.mask == part + 1
        image[seen] = (1 - TINT) * image[seen] + TINT * np.array(part_color(part))
    return image.round().astype(np.uint8)


def overlay(sample: Sample, category: Category) -> Image.Image:
    """The photo with masks, part boxes, joint axes, root frame and 2D box drawn on it.

    Raises:
        InputError: Labels are not finite.
    """
    labels = truth(sample, category)
    picture = annotated(labels, read_image(tinted(sample)))
    scale = np.tile(picture.size, 2) / np.tile((sample.camera.width, sample.camera.height), 2)
    pen, corners = ImageDraw.Draw(picture), tuple((sample.box * scale).tolist())
    for color, width in ((RIM, 6), (WHITE, 2)):
        pen.rectangle(corners, outline=color, width=width)
    return picture


def sheet(
    source: Source, indices: Sequence[int], tile: int = TILE
) -> tuple[Image.Image, list[str]]:
    """Samples side by side, each with what its labels say below; broken ones say why.

    Args:
        source: Where they come from.
        indices: Which; at least one.
        tile: Width of each (px).

    Returns:
        The sheet, and what is wrong with each broken sample.
    """
    columns = min(len(indices), max(1, round((1.5 * len(indices)) ** 0.5)))
    tiles, broken = [], []
    for index in indices:
        name = Path(source.file(index)).name
        title: list[Word] = [(f"#{index}", WHITE), (name, GREY)]
        try:
            tiles.append(_tile(source[index], source.category, title, tile))
        except R2ArtError as error:
            broken.append(str(error))
            why: list[Word] = [(word, AMBER) for word in str(error).split()]
            tiles.append(_captioned(None, [title, why], tile))
    rows = [tiles[k : k + columns] for k in range(0, len(tiles), columns)]
    heights = [max(t.height for t in row) for row in rows]
    page = Image.new("RGB", (columns * tile, sum(heights)), CARD)
    for row, top in zip(rows, np.cumsum([0, *heights[:-1]]).tolist(), strict=True):
        for column, picture in enumerate(row):
            page.paste(picture, (column * tile, top))
    return page, broken


def _tile(sample: Sample, category: Category, title: list[Word], width: int) -> Image.Image:
    picture = overlay(sample, category)
    size = (width - 4, max(1, round(picture.height * (width - 4) / picture.width)))
    picture = picture.resize(size, Image.Resampling.LANCZOS)
    return _captioned(picture, [title, _parts(sample, category), _joints(sample, category)], width)


def _parts(sample: Sample, category: Category) -> list[Word]:
    """How much of each part is seen."""
    shares = zip(category.part_names, sample.visible, strict=True)
    return [(f"{name} {share:.0%}", part_color(p)) for p, (name, share) in enumerate(shares)]


def _joints(sample: Sample, category: Category) -> list[Word]:
    """How far each joint is open, of how far it may be."""
    joints = truth(sample, category).joints
    return [(f"{joint.name} {_opened(joint)}", part_color(j + 1)) for j, joint in enumerate(joints)]


def _opened(joint: JointEstimate) -> str:
    low, high = (state_text(joint, limit) for limit in joint.limits)
    if joint.limits[0] == 0:
        return f"{state_text(joint)} of {high}"
    return f"{state_text(joint)} in {low} to {high}"


def _captioned(picture: Image.Image | None, rows: list[list[Word]], width: int) -> Image.Image:
    """A picture, if there is one, and below it rows of words, wrapped where they are too long."""
    placed: list[tuple[float, int, Word]] = []
    letters, line = font(LETTERS), 0
    for row in rows:
        x = float(MARGIN)
        for word in row:
            length = letters.getlength(word[0])
            if x > MARGIN and x + length > width - MARGIN:
                x, line = float(MARGIN), line + 1
            placed.append((x, line, word))
            x += length + letters.getlength("  ")
        line += 1
    top = picture.height if picture else 0
    tile = Image.new("RGB", (width, top + LINE * line + 2 * MARGIN), CARD)
    if picture:
        tile.paste(picture, (2, 0))
    pen = ImageDraw.Draw(tile)
    for x, number, (text, color) in placed:
        pen.text((x, top + MARGIN + LINE * (number + 0.5)), text, color, letters, "lm")
    return tile
