"""What a laptop's screen shows."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from r2art.data.procedural.randomness import between, chance, pick, weighted
from r2art.data.procedural.textures import Texture, font, smooth_noise, word, words

_WIDTH = 320


def screen_texture(
    rng: np.random.Generator, photos: Sequence[Path] = (), aspect: float = 1.6
) -> Texture:
    """An image for a lit screen of width / height ``aspect``; photos serve now and then."""
    size = (_WIDTH, int(_WIDTH / aspect))
    if photos and chance(rng, 0.4):
        image = _photo(rng, photos, size)
        if chance(rng, 0.4):
            _windows(rng, image)
        return np.asarray(image)
    scene = weighted(
        rng, {_desktop: 4, _document: 2, _code: 1.5, _browser: 2.5, _landscape: 1.5, _plain: 0.7}
    )
    return np.asarray(scene(rng, size))


def _photo(rng: np.random.Generator, photos: Sequence[Path], size: tuple[int, int]) -> Image.Image:
    with Image.open(pick(rng, photos)) as photo:
        photo.draft("RGB", (2 * size[0], 2 * size[1]))
        whole = photo.convert("RGB")
    share = between(rng, 0.5, 1.0)
    scale = share * min(whole.width / size[0], whole.height / size[1])
    w, h = scale * size[0], scale * size[1]
    x, y = between(rng, 0, whole.width - w), between(rng, 0, whole.height - h)
    return whole.resize(size, Image.Resampling.BILINEAR, box=(x, y, x + w, y + h))


def _gradient(rng: np.random.Generator, size: tuple[int, int]) -> Image.Image:
    corners = rng.integers(0, 256, (2, 2, 3)).astype(np.uint8)
    if chance(rng, 0.5):  # most wallpapers keep to one hue
        corners = (corners[:1, :1] * rng.uniform(0.4, 1.0, (2, 2, 1))).astype(np.uint8)
    return Image.fromarray(corners).resize(size, Image.Resampling.BICUBIC)


def _plain(rng: np.random.Generator, size: tuple[int, int]) -> Image.Image:
    return Image.new("RGB", size, tuple(int(v) for v in rng.integers(0, 256, 3)))


def _landscape(rng: np.random.Generator, size: tuple[int, int]) -> Image.Image:
    """A sky and some ridges, like many a wallpaper."""
    w, h = size
    top, low = rng.integers(60, 256, 3), rng.integers(120, 256, 3)
    color = rng.integers(40, 200, 3)
    if chance(rng, 0.6):  # mostly muted
        color = (0.35 * color + 0.65 * color.mean() * np.array([0.85, 1.05, 1.0])).astype(int)
        top, low = (top + 2 * top.mean()) / 3, (low + 2 * low.mean()) / 3
    blend = np.linspace(0, 1, h)[:, None, None]
    sky = np.broadcast_to(top * (1 - blend) + low * blend, (h, w, 3))
    image = Image.fromarray(sky.astype(np.uint8))
    draw = ImageDraw.Draw(image)
    for k in range(int(rng.integers(1, 4))):
        base = h * (0.45 + 0.17 * k)
        ridge = base + (smooth_noise(rng, (1, w), (1, 6 + 3 * k))[0] - 0.5) * h * 0.4
        outline = np.stack([np.arange(w), ridge], axis=-1).ravel().tolist()
        draw.polygon([*outline, w, h, 0, h], fill=tuple(int(v) for v in color))
        color = (color * 0.7).astype(int)
    return image


def _desktop(rng: np.random.Generator, size: tuple[int, int]) -> Image.Image:
    image = _landscape(rng, size) if chance(rng, 0.45) else _gradient(rng, size)
    draw = ImageDraw.Draw(image)
    for k in range(int(rng.integers(0, 14))):
        x, y = 8 + 30 * (k // 5), 8 + 32 * (k % 5)
        draw.rectangle([x, y, x + 14, y + 14], fill=tuple(int(v) for v in rng.integers(60, 256, 3)))
        draw.rectangle([x - 2, y + 17, x + 17, y + 19], fill="white")
    if chance(rng, 0.7):
        _windows(rng, image)
    _taskbar(rng, image)
    return image


def _taskbar(rng: np.random.Generator, image: Image.Image) -> None:
    w, h = image.size
    draw = ImageDraw.Draw(image)
    color = pick(rng, ((36, 94, 220), (25, 25, 30), (200, 200, 205), (190, 190, 190), (15, 40, 70)))
    if chance(rng, 0.25):
        draw.rectangle([0, 0, w, 8], fill=(225, 225, 225))
        draw.rounded_rectangle([w * 0.25, h - 24, w * 0.75, h - 3], 5, fill=(120, 130, 150))
        for x in range(int(w * 0.28), int(w * 0.72), 20):
            shade = tuple(int(v) for v in rng.integers(40, 256, 3))
            draw.rounded_rectangle([x, h - 21, x + 15, h - 6], 3, fill=shade)
        return
    draw.rectangle([0, h - 12, w, h], fill=color)
    draw.rectangle([0, h - 12, 26, h], fill=pick(rng, ((60, 150, 60), color, (80, 80, 90))))
    for k in range(int(rng.integers(0, 6))):
        draw.rectangle(
            [32 + 40 * k, h - 10, 68 + 40 * k, h - 2], fill=tuple(c * 3 // 4 for c in color)
        )
    draw.rectangle([w - 40, h - 8, w - 8, h - 4], fill="white")


def _windows(rng: np.random.Generator, image: Image.Image) -> None:
    w, h = image.size
    for _ in range(int(rng.integers(1, 3))):
        inner = (int(w * between(rng, 0.35, 0.8)), int(h * between(rng, 0.35, 0.75)))
        x, y = int(between(rng, 0, w - inner[0])), int(between(rng, 0, h - inner[1] - 10))
        content = pick(rng, (_document, _code, _browser, _landscape))(rng, inner)
        draw = ImageDraw.Draw(image)
        bar = pick(rng, ((30, 80, 200), (220, 220, 220), (60, 60, 65), (235, 235, 240)))
        draw.rectangle([x - 1, y - 1, x + inner[0], y + 9 + inner[1]], fill=bar)
        draw.rectangle([x + inner[0] - 8, y + 1, x + inner[0] - 3, y + 6], fill=(220, 70, 50))
        image.paste(content, (x, y + 9))


def _lines(
    rng: np.random.Generator, draw: ImageDraw.ImageDraw, box: list[float], ink: str, step: int
) -> None:
    """Lines of text in a box; real letters at the larger sizes only."""
    x0, y0, x1, y1 = box
    letters = font(max(6, step - 2))
    real = step >= 9
    y = y0
    while y < y1 - step:
        long = (x1 - x0) * (between(rng, 0.3, 0.7) if chance(rng, 0.2) else 1.0)
        if real:
            text = words(rng, 12)[: int(long / (step * 0.5))]
            draw.text((x0, y), text, fill=ink, font=letters)
        else:
            x = x0
            while x < x0 + long:
                wide = between(rng, 4, 18)
                draw.line([x, y + step // 2, min(x + wide, x0 + long), y + step // 2], fill=ink)
                x += wide + 3
        y += step


def _document(rng: np.random.Generator, size: tuple[int, int]) -> Image.Image:
    w, h = size
    image = Image.new("RGB", size, pick(rng, ((255, 255, 255), (240, 240, 245), (225, 230, 240))))
    draw = ImageDraw.Draw(image)
    draw.rectangle([0, 0, w, 14], fill=pick(rng, ((210, 215, 225), (230, 230, 230), (40, 80, 160))))
    margin = w * between(rng, 0.04, 0.2)
    draw.rectangle([margin * 0.6, 18, w - margin * 0.6, h], fill="white")
    draw.text((margin, 22), words(rng, 2).title(), fill="black", font=font(13))
    _lines(rng, draw, [margin, 42, w - margin, h], "#333333", int(rng.integers(5, 12)))
    return image


def _code(rng: np.random.Generator, size: tuple[int, int]) -> Image.Image:
    h = size[1]
    dark = chance(rng, 0.75)
    image = Image.new(
        "RGB", size, pick(rng, ((30, 30, 34), (0, 0, 0), (10, 30, 45))) if dark else "white"
    )
    draw = ImageDraw.Draw(image)
    inks = (
        ("#9cdcfe", "#ce9178", "#6a9955", "#c586c0", "#d4d4d4")
        if dark
        else ("#000", "#06c", "#080")
    )
    indent = 0
    for y in range(6, h - 6, 7):
        indent = int(np.clip(indent + rng.integers(-1, 2), 0, 5))
        x = 14.0 + 10 * indent
        for _ in range(int(rng.integers(0, 6))):
            wide = between(rng, 6, 40)
            draw.rectangle([x, y, x + wide, y + 2], fill=pick(rng, inks))
            x += wide + 5
    return image


def _browser(rng: np.random.Generator, size: tuple[int, int]) -> Image.Image:
    w, h = size
    image = Image.new("RGB", size, "white")
    draw = ImageDraw.Draw(image)
    draw.rectangle([0, 0, w, 16], fill=pick(rng, ((222, 225, 230), (60, 60, 70), (200, 210, 225))))
    draw.rounded_rectangle([w * 0.15, 4, w * 0.8, 13], 3, fill="white")
    banner = tuple(int(v) for v in rng.integers(30, 256, 3))
    draw.rectangle([0, 16, w, 16 + h * 0.16], fill=banner)
    draw.text((10, 20), word(rng).title(), fill="white", font=font(max(8, int(h * 0.09))))
    column = w * between(rng, 0.2, 0.35)
    for y in range(int(h * 0.3), h - 20, 40):
        shade = tuple(int(v) for v in rng.integers(80, 256, 3))
        draw.rectangle([8, y, column - 8, y + 30], fill=shade)
    _lines(rng, draw, [column, h * 0.3, w - 12, h], "#444444", int(rng.integers(5, 10)))
    return image
