"""What is printed on boxes: brands, patterns, vintage labels, bar codes, crosses, pictures."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from r2art.data.procedural.randomness import Color, between, chance, mixed, pick, pixel, tinted
from r2art.data.procedural.textures import Texture, font, smooth_noise, word, words, worn

_LONGEST = 288
Ink = tuple[int, int, int]
VIVID: tuple[Color, ...] = (
    (0.8, 0.12, 0.12),
    (0.9, 0.45, 0.08),
    (0.95, 0.78, 0.15),
    (0.15, 0.5, 0.25),
    (0.1, 0.25, 0.6),
    (0.35, 0.65, 0.8),
    (0.45, 0.2, 0.5),
    (0.85, 0.5, 0.6),
)
MUTED: tuple[Color, ...] = (
    (0.93, 0.93, 0.91),
    (0.88, 0.84, 0.76),
    (0.12, 0.12, 0.13),
    (0.35, 0.36, 0.38),
    (0.2, 0.24, 0.32),
    (0.55, 0.6, 0.55),
    (0.72, 0.62, 0.55),
    (0.6, 0.2, 0.22),
)


def paper_color(rng: np.random.Generator) -> Color:
    """Of printed board: muted more often than vivid."""
    return tinted(rng, pick(rng, MUTED if chance(rng, 0.68) else VIVID))


def ink_for(color: Color) -> Color:
    """White on dark, near black on bright."""
    return (0.95, 0.95, 0.93) if sum(color) < 1.6 else (0.1, 0.1, 0.12)


def _blank(aspect: float, color: Color) -> tuple[Image.Image, ImageDraw.ImageDraw]:
    wide, high = (1.0, 1 / aspect) if aspect > 1 else (aspect, 1.0)
    size = max(16, int(_LONGEST * wide)), max(16, int(_LONGEST * high))
    image = Image.new("RGB", size, pixel(color))
    return image, ImageDraw.Draw(image)


def fitted(
    draw: ImageDraw.ImageDraw, at: tuple[float, float], text: str, ink: Ink, room: tuple[float, ...]
) -> None:
    """Text centred at a point, as large as ``room`` (width, height in px) allows."""
    size = max(6, int(min(room[1], 1.7 * room[0] / max(len(text), 1))))
    draw.text(at, text, fill=ink, font=font(size), anchor="mm")


def brand(rng: np.random.Generator, aspect: float, color: Color) -> Texture:
    """A maker's name, a mark or stripes on a plain ground, as on shoe boxes and parcels."""
    image, draw = _blank(aspect, color)
    w, h = image.size
    accent = pixel(pick(rng, VIVID))
    ink = pixel(ink_for(color)) if chance(rng, 0.75) else accent
    style = pick(rng, ("plain", "plain", "stripe", "band", "mark", "corner", "big"))
    name = word(rng, int(rng.integers(2, 4)))
    name = name.upper() if chance(rng, 0.6) else name.title()
    if style == "stripe":
        for k in range(int(rng.integers(1, 4))):
            x = w * between(rng, 0.05, 0.25) + k * 0.07 * w
            draw.polygon([(x, h), (x + 0.04 * w, h), (x + 0.24 * w, 0), (x + 0.2 * w, 0)], accent)
    elif style == "band":
        draw.rectangle([0, 0.7 * h, w, 0.88 * h], fill=accent)
    elif style == "mark":
        r = 0.22 * min(w, h)
        draw.ellipse([w / 2 - r, 0.36 * h - r, w / 2 + r, 0.36 * h + r], fill=accent)
        draw.pieslice([w / 2 - r, 0.36 * h - r, w / 2 + r, 0.36 * h + r], 20, 200, fill=ink)
    if style == "corner":
        draw.text((0.06 * w, 0.8 * h), name, fill=ink, font=font(max(9, int(0.12 * h))))
    else:
        y = 0.75 * h if style == "mark" else 0.5 * h
        share = (0.92, 0.7) if style == "big" else (between(rng, 0.4, 0.7), 0.3)
        fitted(draw, (w / 2, y), name, ink, (share[0] * w, share[1] * h))
        if style == "plain" and chance(rng, 0.4):
            fitted(draw, (w / 2, 0.72 * h), words(rng, 2), ink, (0.35 * w, 0.1 * h))
    return _used(rng, image)


def pattern(rng: np.random.Generator, aspect: float, color: Color) -> Texture:
    """Gift wrap: dots, stripes, checks, flowers, stars."""
    image, draw = _blank(aspect, color)
    w, h = image.size
    other = mixed(color, pick(rng, VIVID + MUTED), between(rng, 0.45, 1.0))
    ink, third = pixel(other), pixel(pick(rng, VIVID))
    step = _LONGEST / between(rng, 5, 13)
    style = pick(rng, ("dots", "stripes", "diagonal", "checks", "flowers", "stars"))
    if style == "stripes":
        for x in np.arange(0, w, step):
            draw.rectangle([x, 0, x + 0.5 * step, h], fill=ink)
    elif style == "diagonal":
        for x in np.arange(-h, w, step):
            draw.line([x, h, x + h, 0], fill=ink, width=max(2, int(0.35 * step)))
    elif style == "checks":
        for x in np.arange(0, w, step):
            draw.rectangle([x, 0, x + 0.5 * step, h], fill=ink)
        half = Image.new("RGB", image.size, pixel(color))
        bands = ImageDraw.Draw(half)
        for y in np.arange(0, h, step):
            bands.rectangle([0, y, w, y + 0.5 * step], fill=ink)
        image = Image.blend(image, half, 0.5)
    else:
        for row, y in enumerate(np.arange(step / 2, h, 0.8 * step)):
            for x in np.arange(step / 2 - (row % 2) * step / 2, w + step / 2, step):
                _motif(draw, style, (x, y), 0.26 * step, (ink, third))
    return _used(rng, image)


def _motif(
    draw: ImageDraw.ImageDraw,
    style: str,
    at: tuple[float, float],
    r: float,
    inks: tuple[Ink, Ink],
) -> None:
    x, y = at
    if style == "flowers":
        for angle in np.arange(5) * 2 * np.pi / 5:
            a, b = x + 0.8 * r * np.sin(angle), y - 0.8 * r * np.cos(angle)
            draw.ellipse([a - 0.6 * r, b - 0.6 * r, a + 0.6 * r, b + 0.6 * r], fill=inks[0])
        draw.ellipse([x - 0.4 * r, y - 0.4 * r, x + 0.4 * r, y + 0.4 * r], fill=inks[1])
    elif style == "stars":
        turn = np.arange(10) * np.pi / 5
        reach = np.where(np.arange(10) % 2, 0.45, 1.1) * r
        draw.polygon(
            list(zip(x + reach * np.sin(turn), y - reach * np.cos(turn), strict=True)), fill=inks[0]
        )
    else:
        draw.ellipse([x - r, y - r, x + r, y + r], fill=inks[0])


def vintage(rng: np.random.Generator, aspect: float, color: Color) -> Texture:
    """A label of cigars, tea or biscuits: frames, an oval with a scene, lettering, rays."""
    image, draw = _blank(aspect, color)
    w, h = image.size
    gold = pixel(tinted(rng, (0.78, 0.62, 0.28)))
    ink = pixel(pick(rng, ((0.5, 0.08, 0.08), (0.1, 0.15, 0.35), (0.1, 0.1, 0.1), (0.1, 0.3, 0.2))))
    if chance(rng, 0.5):
        for angle in np.arange(0, 2 * np.pi, np.pi / 14):
            far = [(w / 2 + w * np.cos(a), h / 2 + w * np.sin(a)) for a in (angle, angle + 0.11)]
            draw.polygon([(w / 2, h / 2), *far], fill=pixel(mixed(color, (0.9, 0.75, 0.45), 0.5)))
    rim = 0.045 * min(w, h)
    for k, shade in enumerate((ink, gold, ink)):
        draw.rectangle(
            [k * rim, k * rim, w - 1 - k * rim, h - 1 - k * rim],
            outline=shade,
            width=max(2, int(0.7 * rim)),
        )
    a, b = 0.24 * min(w, 1.4 * h), 0.24 * h
    oval = [w / 2 - a, 0.4 * h - b, w / 2 + a, 0.4 * h + b]
    draw.ellipse(oval, fill=pixel(tinted(rng, (0.55, 0.7, 0.8), 0.1)), outline=gold, width=3)
    hills = [w / 2 - a, 0.4 * h - b, w / 2 + a, 0.4 * h + b]
    draw.chord(hills, 10, 170, fill=pixel(tinted(rng, (0.35, 0.5, 0.25), 0.1)))
    r = 0.35 * b
    draw.ellipse([w / 2 - r, 0.4 * h - r, w / 2 + r, 0.4 * h + r], fill=pixel(pick(rng, VIVID)))
    fitted(draw, (w / 2, 0.8 * h), word(rng, 3).upper(), ink, (0.7 * w, 0.2 * h))
    for x in (0.16 * w, 0.84 * w):
        r = 0.09 * h
        draw.ellipse([x - r, 0.4 * h - r, x + r, 0.4 * h + r], fill=gold, outline=ink)
        fitted(draw, (x, 0.4 * h), str(int(rng.integers(10, 99))), ink, (1.2 * r, 1.2 * r))
    return _used(rng, image)


def picture(
    rng: np.random.Generator, aspect: float, color: Color, photos: Sequence[Path] = ()
) -> Texture:
    """A photo where there are any; else bold shapes, as on tins and lunch boxes for children."""
    image, draw = _blank(aspect, color)
    w, h = image.size
    if photos and chance(rng, 0.6):
        with Image.open(pick(rng, photos)) as photo:
            photo.draft("RGB", (2 * w, 2 * h))
            whole = photo.convert("RGB")
        scale = between(rng, 0.6, 1.0) * min(whole.width / w, whole.height / h)
        x = between(rng, 0, whole.width - scale * w)
        y = between(rng, 0, whole.height - scale * h)
        region = (x, y, x + scale * w, y + scale * h)
        return np.asarray(whole.resize(image.size, Image.Resampling.BILINEAR, box=region))
    for _ in range(int(rng.integers(4, 12))):
        x, y, r = between(rng, 0, w), between(rng, 0, h), between(rng, 0.08, 0.3) * min(w, h)
        fill = pixel(tinted(rng, pick(rng, VIVID), 0.08))
        shape = pick(rng, ("disc", "star", "box", "cloud"))
        if shape == "box":
            draw.rounded_rectangle([x - r, y - 0.6 * r, x + r, y + 0.6 * r], 0.2 * r, fill=fill)
        elif shape == "cloud":
            for dx in (-0.7, 0, 0.7):
                draw.ellipse(
                    [x + (dx - 0.5) * r, y - 0.4 * r, x + (dx + 0.5) * r, y + 0.4 * r], fill=fill
                )
        else:
            _motif(draw, "stars" if shape == "star" else "dots", (x, y), r, (fill, fill))
    ink = pixel(ink_for(color))
    fitted(draw, (w / 2, between(rng, 0.2, 0.8) * h), word(rng).upper(), ink, (0.7 * w, 0.3 * h))
    return _used(rng, image)


def pizzeria(rng: np.random.Generator, color: Color) -> Texture:
    """The lid of a pizza box: a round emblem, lettering, a border."""
    image, draw = _blank(1.0, color)
    w = image.size[0]
    inks = ((190, 25, 30), (20, 110, 60), (30, 30, 32), (30, 60, 130))
    ink, other = pick(rng, inks), pick(rng, inks)
    r, y = between(rng, 0.2, 0.33) * w, 0.45 * w
    draw.ellipse([w / 2 - r, y - r, w / 2 + r, y + r], outline=ink, width=max(3, int(0.06 * r)))
    for angle in np.arange(0, 2 * np.pi, np.pi / 4):
        tip = (w / 2 + 0.88 * r * np.cos(angle), y + 0.88 * r * np.sin(angle))
        draw.line([w / 2, y, *tip], fill=ink, width=3)
    for _ in range(9):
        a, d = between(rng, 0, 2 * np.pi), between(rng, 0.2, 0.75) * r
        x0, y0 = w / 2 + d * np.cos(a), y + d * np.sin(a)
        draw.ellipse([x0 - 0.1 * r, y0 - 0.1 * r, x0 + 0.1 * r, y0 + 0.1 * r], fill=other)
    name = pick(rng, ("PIZZA", "PIZZERIA", word(rng).upper(), "Pizza", word(rng).title()))
    fitted(draw, (w / 2, 0.87 * w), name, ink, (0.7 * w, 0.16 * w))
    if chance(rng, 0.5):
        draw.rectangle([6, 6, w - 7, w - 7], outline=other, width=5)
    return _used(rng, image)


def parcel_label(rng: np.random.Generator) -> Texture:
    """A white shipping or size label: address lines, a bar code, a large figure."""
    w, h = 150, 104
    image = Image.new("RGB", (w, h), (244, 244, 240))
    draw = ImageDraw.Draw(image)
    ink = (25, 25, 28)
    draw.rectangle([2, 2, w - 3, h - 3], outline=ink)
    for k in range(4):
        draw.text((8, 6 + 11 * k), words(rng, 3)[:20], fill=ink, font=font(10))
    fitted(draw, (122, 24), str(int(rng.integers(35, 48))), ink, (40, 34))
    draw.line([2, 54, w - 3, 54], fill=ink)
    x = 10
    while x < w - 12:
        thick = int(rng.integers(1, 4))
        draw.rectangle([x, 60, x + thick - 1, 92], fill=ink)
        x += thick + int(rng.integers(1, 4))
    return np.asarray(image)


def cross(rng: np.random.Generator, aspect: float, color: Color) -> Texture:
    """The sign of first aid, on a disc or alone, with its name."""
    image, draw = _blank(aspect, color)
    w, h = image.size
    white = chance(rng, 0.35) or sum(color) < 1.2
    ink = (240, 240, 240) if white else pick(rng, ((200, 25, 30), (10, 130, 70)))
    named = chance(rng, 0.6)
    x, y, r = w / 2, h * (0.42 if named else 0.5), 0.3 * min(w, h)
    if chance(rng, 0.45):
        r *= 0.75
        draw.ellipse([x - 1.5 * r, y - 1.5 * r, x + 1.5 * r, y + 1.5 * r], fill=ink)
        ink = pixel(color) if white else (245, 245, 245)
    for a, b in ((r, 0.34 * r), (0.34 * r, r)):
        draw.rectangle([x - a, y - b, x + a, y + b], fill=ink)
    if named:
        text = pick(rng, ("FIRST AID", "FIRST AID KIT", "ERSTE HILFE", "FIRST AID"))
        tone = (240, 240, 240) if white else (200, 25, 30)
        fitted(draw, (x, 0.86 * h), text, tone, (0.7 * w, 0.13 * h))
    return _used(rng, image)


def stripes_of_board() -> Texture:
    """The cut edge of corrugated board: light liners, dark flutes between."""
    x = np.linspace(0, 2 * np.pi * 8, 256)
    row = 0.62 + 0.3 * np.sin(x)
    edge = np.ones(16) * 0.95
    edge[4:12] = 0.0
    value = np.where(edge[:, None] > 0, edge[:, None], row[None])
    image = (255 * value[..., None] * np.array([0.74, 0.58, 0.41])).astype(np.uint8)
    return np.ascontiguousarray(image)


def _used(rng: np.random.Generator, image: Image.Image) -> Texture:
    """With the rubbed patches and scratches of use, often."""
    texture = np.asarray(image)
    if chance(rng, 0.35):
        return worn(rng, texture, between(rng, 0.2, 0.9))
    if chance(rng, 0.3):  # faded
        clouds = smooth_noise(rng, texture.shape[:2], (4, 4))[..., None]
        return (texture * (0.86 + 0.14 * clouds)).astype(np.uint8)
    return texture
