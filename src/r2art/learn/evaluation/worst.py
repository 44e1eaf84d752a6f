"""The worst photos of an evaluation, the truth beside the prediction."""

import io
import math

from PIL import Image, ImageDraw

from r2art.core.draw import annotated
from r2art.core.image import read_image
from r2art.core.pen import font
from r2art.learn.evaluation.equivalent import nearer_labels
from r2art.learn.evaluation.evaluate import Case, Report
from r2art.learn.evaluation.scores import truth

TILE = 384  # px
COLUMNS = 4
LINE = 24


def worst(report: Report) -> bytes:
    """PNG: the worst photos with box and category given; left the truth, right the prediction."""
    pairs = [_pair(report, case) for case in report.worst]
    height = max(pair.height for pair in pairs)
    rows = -(-len(pairs) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * 2 * TILE, rows * height), "white")
    for k, pair in enumerate(pairs):
        sheet.paste(pair, (k % COLUMNS * 2 * TILE, k // COLUMNS * height))
    out = io.BytesIO()
    sheet.save(out, "PNG")
    return out.getvalue()


def _pair(report: Report, case: Case) -> Image.Image:
    image = case.sample.image
    sample, said, category = case.sample, case.prediction, report.category
    if said is not None and said.category == category.name:
        sample = nearer_labels(sample, category, said)
    labelled = [truth(sample, category), said]
    pictures = [annotated(p, read_image(image)) for p in labelled if p is not None]
    for picture in pictures:
        picture.thumbnail((TILE - 4, 2 * TILE), reducing_gap=2)
    height = max(picture.height for picture in pictures)
    pair = Image.new("RGB", (2 * TILE, height + LINE), "white")
    for k, picture in enumerate(pictures):
        pair.paste(picture, (k * TILE, LINE))
    caption = _caption(report, case)
    ImageDraw.Draw(pair).text((4, LINE / 2), caption, "black", font(15), "lm")
    return pair


def _caption(report: Report, case: Case) -> str:
    said = case.prediction
    if said is None:
        return f"#{case.index}: truth | no prediction"
    if said.category != report.category.name:
        return f"#{case.index}: truth | taken for a {said.category}"
    rotation = math.degrees(case.scores.rotation[0])
    sure = min(part.confidence for part in said.parts)
    return (
        f"#{case.index}: truth | aligned ADD {100 * case.badness:.0f} %, root {rotation:.0f}°, "
        f"least confidence {sure:.2f}"
    )
