"""Pictures of where the shipped model fails; `python docs/make_pictures.py --gallery` draws them.

Nothing is chosen by eye: of 24 test photos of each category the worst is shown, and one photo is
made harder in fixed ways.
"""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFilter

import r2art
from r2art.core.draw import annotated
from r2art.core.image import read_image
from r2art.core.legend import state_text
from r2art.core.palette import CARD, GREY, WHITE
from r2art.core.pen import font
from r2art.core.prediction import Prediction
from r2art.data.categories import CATEGORIES
from r2art.data.objects import Procedural
from r2art.data.synth import Synth, synthesise
from r2art.learn.evaluation.scores import Scores, score
from r2art.run.predictor import Predictor

ROOT = Path(__file__).resolve().parent.parent
COUNT = 24
SEED = 3  # no other set of photos uses it
TILE, LINE = 400, 22  # px


def draw_gallery(folder: Path) -> None:
    """Write failures.jpg and harder.jpg."""
    predictor = r2art.load()
    known = [name for name in predictor.categories if name in CATEGORIES]
    _save(_sheet([_worst(predictor, name, folder) for name in known]), folder / "failures.jpg")
    _save(_sheet(_harder(predictor)), folder / "harder.jpg")


def _worst(predictor: Predictor, name: str, folder: Path) -> Image.Image:
    """The photo of a category with the largest error, and what it is."""
    objects = Procedural(name)
    job = Synth(
        objects=objects, n=COUNT, seed=SEED, split="test", size=400, backgrounds=None, out=folder
    )
    prior = objects.prior()

    def tried(index: int) -> tuple[float, Prediction, Scores]:
        sample = synthesise(job, index)
        prediction = predictor.predict(sample.image, sample.camera)
        scores = score(sample, prior, prediction)
        return float(np.max(scores.add_aligned) / scores.diagonal), prediction, scores

    error, prediction, scores = max(map(tried, range(COUNT)), key=lambda found: found[0])
    if not math.isfinite(error):
        lines = [f"{name}: taken for a {prediction.category}"]
    else:
        pairs = zip(prediction.joints, scores.state_aligned, strict=True)
        off = ", ".join(state_text(joint, float(e)) for joint, e in pairs)
        lines = [f"{name}: worst part off by {error:.0%}", f"joints off by {off}"]
    sure = min(part.confidence for part in prediction.parts)
    seen = float(np.min(scores.visible))
    return _tile(prediction, [*lines, f"sure {sure:.0%}; least part seen {seen:.0%}"])


def _harder(predictor: Predictor) -> list[Image.Image]:
    """The example laptop as it is, and under worse and worse conditions."""
    with Image.open(ROOT / "examples" / "laptop.png") as file:
        photo = file.convert("RGB")
    focal = read_image(ROOT / "examples" / "laptop.png").focal
    assert focal is not None
    width, height = photo.size
    camera = r2art.Camera(focal, focal, width / 2, height / 2, width, height)
    tiles = []
    for title, change in CHANGES.items():
        prediction = predictor.predict(np.asarray(change(photo)), camera)
        states = ", ".join(f"{j.name} {state_text(j)}" for j in prediction.joints)
        sure = min(part.confidence for part in prediction.parts)
        said = "rejected" if prediction.rejected else f"sure {sure:.0%}"
        tiles.append(_tile(prediction, [title, f"{prediction.category}: {states}", said]))
    return tiles


def _dark(photo: Image.Image) -> Image.Image:
    return photo.point([round(0.12 * v) for v in range(256)] * 3)


def _noisy(photo: Image.Image) -> Image.Image:
    noise = np.random.default_rng(0).normal(0, 45, (photo.height, photo.width, 3))
    return Image.fromarray(np.clip(np.asarray(photo) + noise, 0, 255).astype(np.uint8))


def _far(photo: Image.Image) -> Image.Image:
    """At a fifth of its size, in the middle of a grey wall."""
    wall = Image.new("RGB", photo.size, (128, 128, 128))
    small = photo.resize((photo.width // 5, photo.height // 5), Image.Resampling.LANCZOS)
    wall.paste(small, ((photo.width - small.width) // 2, (photo.height - small.height) // 2))
    return wall


def _shifted(photo: Image.Image) -> Image.Image:
    """So that much of the object is beyond the left edge."""
    moved = Image.new("RGB", photo.size, (128, 128, 128))
    moved.paste(photo, (-photo.width * 2 // 5, 0))
    return moved


def _covered(photo: Image.Image) -> Image.Image:
    hidden = photo.copy()
    w, h = photo.size
    ImageDraw.Draw(hidden).rectangle((0.45 * w, 0.15 * h, 0.9 * w, 0.6 * h), fill=(150, 150, 150))
    return hidden


CHANGES: dict[str, Callable[[Image.Image], Image.Image]] = {
    "as it is": lambda photo: photo,
    "dark": _dark,
    "blurred": lambda photo: photo.filter(ImageFilter.GaussianBlur(9)),
    "noisy": _noisy,
    "a fifth of the size": _far,
    "cut off": _shifted,
    "hidden in part": _covered,
    "on its head": lambda photo: photo.transpose(Image.Transpose.ROTATE_180),
}


def _tile(prediction: Prediction, lines: list[str]) -> Image.Image:
    """The photo with the prediction on it, and lines of text below."""
    assert prediction.photo is not None
    picture = annotated(prediction, prediction.photo)
    picture.thumbnail((TILE, TILE), Image.Resampling.LANCZOS)
    tile = Image.new("RGB", (TILE, picture.height + LINE * len(lines) + 8), CARD)
    tile.paste(picture, ((TILE - picture.width) // 2, 0))
    pen = ImageDraw.Draw(tile)
    for k, text in enumerate(lines):
        size = 15.0
        while font(size).getlength(text) > TILE - 16:
            size -= 0.5
        y = picture.height + 4 + LINE * (k + 0.5)
        pen.text((8, y), text, WHITE if k == 0 else GREY, font(size), "lm")
    return tile


def _sheet(tiles: list[Image.Image]) -> Image.Image:
    columns = min(4, len(tiles))
    rows = -(-len(tiles) // columns)
    height = max(tile.height for tile in tiles)
    sheet = Image.new("RGB", (columns * (TILE + 4) - 4, rows * (height + 4) - 4), CARD)
    for k, tile in enumerate(tiles):
        sheet.paste(tile, (k % columns * (TILE + 4), k // columns * (height + 4)))
    return sheet


def _save(picture: Image.Image, path: Path) -> None:
    picture.save(path, quality=82, optimize=True)
    print(f"wrote {path}")
