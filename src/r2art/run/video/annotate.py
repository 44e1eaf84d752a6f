"""Frames of the annotated film: the picture with the object drawn on it, and its joints below."""

from PIL import Image, ImageDraw

from r2art.core.draw import SMALLEST, annotated
from r2art.core.image import Photo
from r2art.core.palette import AMBER, CARD, GREY, WHITE, Color
from r2art.core.pen import font
from r2art.run.video.frame import Status, Tracked
from r2art.run.video.history import History
from r2art.run.video.plot import draw_panels

WINDOW = 5.0
"""Seconds that the curves show."""
HEADER, PANELS = 44, 180
"""Heights of what is below the picture, in units of 1/960 of its longer side."""
GREEN: Color = (96, 200, 120)
LOOKS: dict[Status, Color] = {"tracked": GREEN, "coasting": AMBER, "lost": AMBER}


class Annotator:
    """Draws one frame after the other, all of the first one's size."""

    def __init__(self) -> None:
        self._history = History()
        self._size: tuple[int, int] | None = None

    @property
    def history(self) -> History:
        """The frames so far."""
        return self._history

    def add(self, seen: Tracked) -> None:
        """Take note of a frame."""
        self._history.add(seen)

    def draw(self, seen: Tracked) -> Image.Image:
        """The frame just added, as a picture."""
        picture = _picture(seen)
        if self._size is None:
            self._size = picture.size if picture is not None else (960, 720)
        if picture is None:
            picture = Image.new("RGB", self._size, CARD)
        elif picture.size != self._size:
            picture = picture.resize(self._size)
        unit = max(self._size) / 960
        width, height = self._size
        below = round((HEADER + PANELS) * unit)
        card = Image.new("RGB", (width, height + below), CARD)
        card.paste(picture)
        _write_header(card, seen, height + HEADER * unit / 2, unit)
        card.paste(
            self._panels(width, round(PANELS * unit), unit), (0, height + round(HEADER * unit))
        )
        return card

    def _panels(self, width: int, height: int, unit: float) -> Image.Image:
        """The joints' newest curves side by side."""
        history = self._history.last(WINDOW)
        count = max(1, len(history.joints))
        each = width / count
        boxes = [(k * each, 0.0, (k + 1) * each, float(height)) for k in range(count)]
        end = history.times[-1]
        start = max(end - WINDOW, self._history.times[0])
        span = (start, start + WINDOW)
        return draw_panels(history, (width, height), boxes, span, unit)


def _picture(seen: Tracked) -> Image.Image | None:
    if seen.photo is None:
        return None
    if seen.prediction is not None:
        return annotated(seen.prediction, seen.photo)
    return _enlarged(seen.photo)


def _enlarged(photo: Photo) -> Image.Image:
    """As large as `annotated` makes it."""
    from r2art.core.draw import LARGEST

    longer = max(photo.width, photo.height)
    scale = min(max(longer, SMALLEST), LARGEST) / longer
    size = (max(1, round(photo.width * scale)), max(1, round(photo.height * scale)))
    return Image.fromarray(photo.pixels).resize(size, Image.Resampling.BICUBIC)


def _write_header(card: Image.Image, seen: Tracked, y: float, unit: float) -> None:
    """Category, status and time, each always in its place."""
    pen = ImageDraw.Draw(card)
    name = "" if seen.prediction is None else seen.prediction.category
    large, normal = font(22 * unit), font(18 * unit)
    x = 20 * unit
    pen.text((x, y), name, WHITE, large, "lm")
    x += (large.getlength(name) + 24 * unit) if name else 0
    pen.text((x, y), seen.status, LOOKS[seen.status], normal, "lm")
    if seen.deviations is not None and seen.prediction is not None:
        away = float(seen.prediction.parts[0].cam_T_part[2, 3])
        sure = away * seen.deviations.size
        text = f"{away:.2f} ± {sure:.2f} m away"
        pen.text((card.width / 2, y), text, GREY, normal, "mm")
    right = card.width - 20 * unit
    pen.text((right, y), f"frame {seen.index}", GREY, normal, "rm")
    pen.text((right - 150 * unit, y), f"{seen.time:.2f} s", WHITE, normal, "rm")
