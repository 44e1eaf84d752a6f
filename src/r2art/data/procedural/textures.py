"""Textures of materials: wood, metal, plastic, wear, labels. All (H, W, 3) uint8 sRGB."""

from functools import cache

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from r2art.data.procedural.randomness import Color, between, chance, mixed, pick, pixel

Texture = NDArray[np.uint8]

_SYLLABLES = (
    *("lo", "ra", "vi", "ten", "ko", "mar", "del", "zen", "pro", "nex", "ar", "ca", "to", "shi"),
    *("ba", "no", "vo", "ax", "is", "um", "cor", "ly", "tek", "sys", "on", "ac", "qu", "el", "fu"),
    *("ji", "gra", "wy", "th", "in", "mo", "ri", "san", "pi", "xel", "ber"),
)


@cache
def font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Pillow's own font, so that no system font is needed."""
    return ImageFont.load_default(size)


def word(rng: np.random.Generator, syllables: int = 2) -> str:
    """An invented word."""
    return "".join(pick(rng, _SYLLABLES) for _ in range(syllables))


def words(rng: np.random.Generator, count: int) -> str:
    """Invented words with spaces between."""
    chosen = rng.integers(len(_SYLLABLES), size=2 * count)
    pairs = zip(chosen[::2], chosen[1::2], strict=True)
    return " ".join(_SYLLABLES[a] + _SYLLABLES[b] for a, b in pairs)


def smooth_noise(
    rng: np.random.Generator, shape: tuple[int, int], cells: tuple[int, int]
) -> NDArray[np.float32]:
    """(H, W) noise in [0, 1]: ``cells`` random values, bicubically enlarged."""
    coarse = Image.fromarray(rng.random(cells, dtype=np.float32))
    return np.asarray(coarse.resize((shape[1], shape[0]), Image.Resampling.BICUBIC)).clip(0, 1)


def shaded(texture: Texture, factor: NDArray[np.floating]) -> Texture:
    """``texture`` multiplied by an (H, W) factor within [0, 1]."""
    parts_of_256 = (factor * 256).astype(np.uint16)
    return (texture * parts_of_256[..., None] >> 8).astype(np.uint8)


def _palette(colors: list[Color]) -> Texture:
    """(256, 3) lookup table through the colours."""
    table = np.array(colors) * 255
    at = np.linspace(0, 255, len(colors))
    channels = [np.interp(np.arange(256), at, table[:, c]) for c in range(3)]
    return np.stack(channels, axis=-1).clip(0, 255).astype(np.uint8)


def wood(rng: np.random.Generator, color: Color, size: int = 224) -> Texture:
    """Grain along the horizontal: growth rings cut lengthwise, and fine fibres."""
    shape = (size, size)
    height = np.linspace(0, between(rng, 2.5, 8.0), size, dtype=np.float32)[:, None]
    bend = smooth_noise(rng, shape, (5, 3))
    rings = np.sin(2 * np.pi * (height + between(rng, 0.8, 3.0) * bend)) * 0.5 + 0.5
    fibres = smooth_noise(rng, shape, (size // 2, 10))
    streaks = smooth_noise(rng, shape, (24, 3))
    weight = between(rng, 0.15, 0.5)
    value = weight * rings + (0.75 - weight) * streaks + 0.25 * fibres
    contrast = between(rng, 0.12, 0.4)
    dark = np.clip(np.array(color) * (1 - contrast) - (0, 0.01, 0.02), 0, 1).tolist()
    light = np.clip(np.array(color) * (1 + 0.5 * contrast), 0, 1).tolist()
    return _palette([tuple(dark), color, tuple(light)])[(value * 255).astype(np.uint8)]


def brushed(rng: np.random.Generator, strength: float = 0.06, size: int = 192) -> Texture:
    """Near white with fine horizontal lines, to multiply a metal's colour with."""
    lines = smooth_noise(rng, (size, size), (size, 4))
    value = (255 * (1 - strength * lines)).astype(np.uint8)
    return np.repeat(value[..., None], 3, axis=-1)


def speckled(rng: np.random.Generator, strength: float = 0.05, size: int = 128) -> Texture:
    """Near white with fine grain, to multiply the colour of plastic or lacquer with."""
    grain = rng.random((size, size), dtype=np.float32)
    clouds = smooth_noise(rng, (size, size), (4, 4))
    value = (255 * (1 - strength * (0.6 * grain + 0.4 * clouds))).astype(np.uint8)
    return np.repeat(value[..., None], 3, axis=-1)


def worn(rng: np.random.Generator, texture: Texture, amount: float = 1.0) -> Texture:
    """Dust, stains and scratches over a texture."""
    height, width = texture.shape[:2]
    image = Image.fromarray(texture)
    draw = ImageDraw.Draw(image, "RGBA")
    for _ in range(int(rng.poisson(2.5 * amount))):
        x, y, dx, dy = rng.random(4) * (width, height, 60, 60) - (0, 0, 30, 30)
        tone = 255 if chance(rng, 0.6) else 20
        draw.line([(x, y), (x + dx, y + dy)], fill=(tone, tone, tone, int(rng.integers(20, 90))))
    for _ in range(int(rng.poisson(1.0 * amount))):
        x, y = rng.random(2) * (width, height)
        r = between(rng, 2, 0.07 * width)
        alpha = int(rng.integers(10, 45))
        draw.ellipse([x - r, y - r, x + r, y + r * between(rng, 0.4, 1)], fill=(60, 45, 30, alpha))
    clouds = smooth_noise(rng, (height, width), (5, 6))
    return shaded(np.asarray(image), 1 - 0.12 * amount * clouds)


def seamless(texture: Texture) -> Texture:
    """Mirrored to twice its width and height, so that its repeats join without an edge."""
    wide = np.concatenate([texture, texture[:, ::-1]], axis=1)
    return np.concatenate([wide, wide[::-1]])


def label(rng: np.random.Generator, size: tuple[int, int] = (96, 48)) -> Texture:
    """A paper label or sticker: a frame, some words, perhaps a bar code."""
    paper = pick(rng, ((245, 244, 238), (235, 228, 200), (200, 215, 235), (250, 220, 90)))
    image = Image.new("RGB", size, paper)
    draw = ImageDraw.Draw(image)
    ink = pick(rng, ((20, 20, 20), (20, 30, 110), (150, 20, 20)))
    if chance(rng, 0.5):
        draw.rectangle([2, 2, size[0] - 3, size[1] - 3], outline=ink)
    lines = int(rng.integers(1, 4))
    step = size[1] / (lines + 1)
    for k in range(lines):
        draw.text(
            (8, step * (k + 0.5)), words(rng, 2), fill=ink, font=font(max(8, int(step * 0.8)))
        )
    if chance(rng, 0.3):
        for x in range(size[0] // 2, size[0] - 8, 3):
            draw.line([x, size[1] * 0.6, x, size[1] - 6], fill=ink, width=int(rng.integers(1, 3)))
    return np.asarray(image)


def sticker(rng: np.random.Generator, draw: ImageDraw.ImageDraw, x: int, y: int, size: int) -> None:
    """Draw one of the small stickers that laptops carry, its upper left corner at (x, y)."""
    hue = tuple(int(v) for v in rng.integers(0, 256, 3))
    tall = int(size * between(rng, 0.6, 1.3))
    if chance(rng, 0.25):
        draw.ellipse([x, y, x + size, y + size], fill=hue)
        draw.ellipse(
            [x + size // 4, y + size // 4, x + 3 * size // 4, y + 3 * size // 4], fill="white"
        )
        return
    draw.rectangle([x, y, x + size, y + tall], fill=hue, outline=(200, 200, 200))
    draw.text((x + 2, y + tall // 4), word(rng), fill="white", font=font(max(6, size // 3)))
    draw.rectangle([x, y + 3 * tall // 4, x + size, y + tall], fill=(235, 235, 235))


def lid_back(
    rng: np.random.Generator, width: float, height: float, color: Color, stickers: int
) -> Texture:
    """The outside of a laptop's lid: its colour, a logo or a name, perhaps stickers."""
    w = 256
    h = int(w * height / width)
    image = Image.new("RGB", (w, h), pixel(color))
    draw = ImageDraw.Draw(image)
    bright = sum(color) / 3
    pale = bright < 0.5 or chance(rng, 0.2)
    ink = pixel(mixed(color, (0.95, 0.95, 0.95) if pale else (0.0, 0.0, 0.0), 0.65))
    if chance(rng, 0.12):
        stripe = h * between(rng, 0.1, 0.35)
        draw.rectangle([0, 0, w, stripe], fill=pixel(mixed(color, (0, 0, 0), 0.25)))
    _logo(rng, draw, w, h, ink)
    for _ in range(stickers):
        size = int(rng.integers(16, 60))
        sticker(rng, draw, int(rng.integers(0, w - size)), int(rng.integers(0, h - size)), size)
    if chance(rng, 0.35):  # lettering faces whoever opens the lid
        image = image.rotate(180)
    texture = np.asarray(image)
    return worn(rng, texture, between(rng, 0.2, 1.0)) if chance(rng, 0.7) else texture


def sticker_image(rng: np.random.Generator, color: Color) -> Texture:
    """A maker's name as it stands below a screen."""
    image = Image.new("RGB", (96, 24), pixel(color))
    ink = (215, 215, 215) if sum(color) < 1.4 else (60, 60, 65)
    ImageDraw.Draw(image).text((48, 12), word(rng), fill=ink, font=font(18), anchor="mm")
    return np.asarray(image)


def _logo(
    rng: np.random.Generator, draw: ImageDraw.ImageDraw, w: int, h: int, ink: tuple[int, int, int]
) -> None:
    style = pick(rng, ("disc", "ring", "text", "text", "corner", "tiles", "none"))
    x, y, r = w / 2, h * between(rng, 0.4, 0.6), w * between(rng, 0.04, 0.08)
    if style == "disc":
        draw.ellipse([x - r, y - r, x + r, y + r], fill=ink)
        draw.ellipse([x + 0.55 * r, y - r, x + 1.5 * r, y], fill=tuple(v // 2 for v in ink))
    elif style == "ring":
        draw.ellipse([x - r, y - r, x + r, y + r], outline=ink, width=3)
        draw.text((x - r * 0.6, y - r * 0.5), word(rng, 1), fill=ink, font=font(max(8, int(r))))
    elif style == "text":
        draw.text((x, y), word(rng).upper(), fill=ink, font=font(int(r * 1.6)), anchor="mm")
    elif style == "corner":
        draw.text((w * 0.06, h * 0.86), word(rng), fill=ink, font=font(14))
    elif style == "tiles":
        for dx, dy in ((-r, -r), (1, -r), (-r, 1), (1, 1)):
            draw.rectangle([x + dx, y + dy, x + dx + r - 1, y + dy + r - 1], fill=ink)
