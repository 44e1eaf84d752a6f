"""The left panel: the photo, and what the user knows about it."""

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image
from viser import ClientHandle, GuiEvent, GuiTextHandle, Icon

from r2art.core.camera import Camera
from r2art.core.errors import UsageError
from r2art.core.image import Photo
from r2art.core.prediction import Prediction
from r2art.view import page
from r2art.view.facts import message

AUTOMATIC = "automatic"
WIDTH = 400  # px
PAUSE = 0.5
"""Seconds without a key pressed after which a text counts as complete."""


@dataclass(frozen=True)
class Known:
    """What the user has said: see `Predictor.predict`; None is what the model shall find out.

    ``fov`` is across the photo's longer side (rad), ``size`` in metres.
    """

    category: str | None = None
    box: tuple[float, ...] | None = None
    fov: float | None = None
    size: float | None = None

    def camera(self, photo: Photo) -> Camera | None:
        """The photo's camera, where its field of view is known."""
        if self.fov is None:
            return None
        return Camera.from_fov(self.fov, photo.width, photo.height)


class Inputs:
    """The left panel of one browser tab.

    Attributes:
        upload: Where the photo's file arrives, however the user gives it.
        message: The line above the photo.
        box: Text of the box; empty where the model shall find it.
    """

    def __init__(
        self,
        client: ClientHandle,
        categories: Sequence[str],
        limit: int,
        opened: Callable[[str, bytes], None],
        changed: Callable[[float], Awaitable[None]],
    ) -> None:
        """Build the panel.

        Args:
            client: The tab.
            categories: Which the model knows.
            limit: Most bytes a photo's file may have.
            opened: Called with the name and bytes of a photo's file.
            changed: Called when the user has said something else, with seconds to wait for more.
        """
        gui = client.gui
        panel = gui.add_panel()
        with panel.add_tab("Photo"):
            gui.add_html(page.drop_zone(limit))
            self.upload = gui.add_upload_button(
                "Choose a photo", mime_type="image/*", icon=Icon.PHOTO
            )
            self.message = gui.add_html(message(_welcome(categories)))
            self._photo = gui.add_html("", visible=False)
            self._category = gui.add_dropdown("Object", (AUTOMATIC, *categories))
            self.box = _text(client, page.BOX_LABEL, "x1 y1 x2 y2; or draw it on the photo")
            self._fov = _text(client, "View (°)", "field of view across the photo's longer side")
            self._size = _text(
                client,
                "Size (m)",
                "longest side of the root part, a laptop's width; it fixes all lengths",
            )
            again = gui.add_button("Find everything again", icon=Icon.REFRESH, color="gray")
        panel.dock_left()
        panel.set_width(WIDTH)

        self.upload.on_upload(
            lambda event: opened(event.target.value.name, event.target.value.content)
        )

        @self._category.on_update
        async def _(event: GuiEvent) -> None:
            if event.client is not None:
                await changed(0)

        for text in (self.box, self._fov, self._size):

            @text.on_update
            async def _(event: GuiEvent) -> None:
                if event.client is not None:
                    await changed(PAUSE)

        @again.on_click
        async def _(_: GuiEvent) -> None:
            self.forget()
            await changed(0)

    def forget(self) -> None:
        """Empty every field: the model shall find out."""
        self._category.value = AUTOMATIC
        for text in (self.box, self._fov, self._size):
            text.value = ""

    def forget_box(self) -> None:
        """Empty the box, which belongs to the last photo."""
        self.box.value = ""

    def known(self) -> Known:
        """What the user has said.

        Raises:
            UsageError: A field holds something else than its numbers.
        """
        category = self._category.value
        fov = _number(self._fov)
        return Known(
            category=None if category == AUTOMATIC else category,
            box=_numbers(self.box) or None,
            fov=None if fov is None else float(np.radians(fov)),
            size=_number(self._size),
        )

    def say(self, text: str, kind: str = "note") -> None:
        """Show a line above the photo."""
        self.message.content = message(text, kind=kind)

    def show(self, prediction: Prediction, picture: Image.Image) -> None:
        """Show the photo with its overlay, and the box that was used."""
        camera = prediction.camera
        self._photo.content = page.photo(picture, (camera.width, camera.height), prediction.box)
        self._photo.visible = True


def _welcome(categories: Sequence[str]) -> str:
    known = ", ".join(categories)
    return f"One object, seen whole. The model knows: {known}."


def _text(client: ClientHandle, label: str, hint: str) -> GuiTextHandle:
    return client.gui.add_text(label, initial_value="", hint=f"{hint}. Empty: automatic")


def _numbers(field: GuiTextHandle) -> tuple[float, ...]:
    try:
        return tuple(float(word) for word in field.value.replace(",", " ").split())
    except ValueError:
        raise UsageError(f"{field.label}: {field.value!r} is not made of numbers") from None


def _number(field: GuiTextHandle) -> float | None:
    values = _numbers(field)
    if len(values) > 1:
        raise UsageError(f"{field.label}: one number is needed, not {len(values)}")
    return values[0] if values else None
