"""Pieces of HTML with the behaviour that viser's own controls lack.

viser's panels take HTML but run no script elements in it; the handler of an image that fails to
load does run. Through it `page.js` enters the page once: a place to drop photos, a webcam, and
drawing the box on the photo. It hands all to controls of viser, the file to its upload button and
the box to its text field, so the server hears of it as if they had been used by hand.
"""

import base64
from functools import cache
from html import escape
from importlib.resources import files
from io import BytesIO

from PIL import Image

from r2art.core.image import Box

BOX_LABEL = "Box (px)"
"""Label of the text field into which a drawn box goes; `page.js` looks for it."""
JPEG_QUALITY = 88


@cache
def _resource(name: str) -> str:
    return (files("r2art") / "view" / name).read_text(encoding="utf-8")


def drop_zone(limit: int) -> str:
    """Where a photo is dropped or taken.

    Args:
        limit: Most bytes a file may have.
    """
    return (
        f"<style>{_resource('page.css')}</style>"
        f'<img alt="" hidden src="data:," onerror="{escape(_resource("page.js"))}">'
        f'<div class="r2art-drop" data-limit="{limit}">'
        "<div class='r2art-idle'><b>Drop a photo here</b><span>or paste it, or "
        "<button type='button' class='r2art-webcam'>use the webcam</button></span></div>"
        "<div class='r2art-live' hidden><video autoplay muted playsinline></video>"
        "<button type='button' class='r2art-take'>Take the picture</button>"
        "<button type='button' class='r2art-cancel'>Cancel</button></div>"
        "<p class='r2art-message r2art-error' role='alert' hidden></p></div>"
    )


def photo(picture: Image.Image, size: tuple[int, int], box: Box) -> str:
    """The photo with its overlay, and a box that can be drawn and corrected.

    Args:
        picture: The photo as it is shown.
        size: Width and height (px) of the photo itself.
        box: x1 y1 x2 y2 in its pixels.
    """
    width, height = size
    left, top = 100 * box[0] / width, 100 * box[1] / height
    right, bottom = 100 * (1 - box[2] / width), 100 * (1 - box[3] / height)
    edges = f"left:{left:.3f}%;top:{top:.3f}%;right:{right:.3f}%;bottom:{bottom:.3f}%"
    return (
        f'<div class="r2art-photo" data-width="{width}" data-height="{height}" '
        f'data-field="{BOX_LABEL}"><img alt="the photo with the parts drawn on it" '
        f'src="data:image/jpeg;base64,{_jpeg(picture)}">'
        f'<div class="r2art-box" style="{edges}"><i></i><i></i><i></i><i></i></div></div>'
    )


def _jpeg(picture: Image.Image) -> str:
    data = BytesIO()
    picture.save(data, "JPEG", quality=JPEG_QUALITY)
    return base64.b64encode(data.getvalue()).decode()
