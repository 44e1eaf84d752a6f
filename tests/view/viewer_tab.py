"""A browser tab without a browser: it says over the websocket what viser's page would say."""

import time
from collections.abc import Callable
from pathlib import Path
from uuid import uuid4

import msgspec
import viser
from viser._messages import (
    FileTransferPart,
    FileTransferStartUpload,
    GuiUpdateMessage,
    Message,
    ViewerCameraMessage,
)
from websockets.sync.client import connect

ROOT = Path(__file__).parents[2]
LAPTOP, DRAWER = (ROOT / "examples" / f"{name}.png" for name in ("laptop", "drawer"))
PATIENCE = 120  # seconds


def until(happened: Callable[[], object], what: str) -> None:
    """Wait for something that other threads bring about."""
    end = time.monotonic() + PATIENCE
    while not happened():
        assert time.monotonic() < end, f"waited {PATIENCE} s for {what}"
        time.sleep(0.02)


class Tab:
    """An open tab, on a page of ``origin`` (by default the viewer's own)."""

    def __init__(self, viewer, origin: str | None = None) -> None:
        self._viewer = viewer
        self._before = set(viewer.sessions)
        address, protocol = viewer.url.replace("http", "ws"), f"viser-v{viser.__version__}"
        origin = viewer.url if origin is None else origin
        self._socket = connect(address, origin=origin, subprotocols=[protocol])
        self._say(CAMERA)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._socket.close()

    @property
    def session(self):
        """Its session, once the server has made it."""
        until(lambda: set(self._viewer.sessions) - self._before, "a session")
        return self._viewer.sessions[min(set(self._viewer.sessions) - self._before)]

    def upload(self, name: str, content: bytes, *, announced: int | None = None) -> None:
        """Upload a file in parts of 64 kB, perhaps lying about its size."""
        parts = [content[i : i + 65536] for i in range(0, len(content), 65536)]
        button, transfer = self.session.inputs.upload._impl.uuid, str(uuid4())
        size = len(content) if announced is None else announced
        start = FileTransferStartUpload(button, transfer, name, "image/png", len(parts), size)
        self._say(start)
        for i, part in enumerate(parts):
            self._say(FileTransferPart(button, transfer, i, part))

    def set(self, control, value) -> None:
        """Set a slider or a field."""
        self._say(GuiUpdateMessage(control._impl.uuid, {"value": value}))

    def _say(self, message: Message) -> None:
        self._socket.send(msgspec.msgpack.encode(message.as_serializable_dict([])))


CAMERA = ViewerCameraMessage(
    wxyz=(1, 0, 0, 0),
    position=(0, 0, 0),
    fov=1.0,
    near=0.01,
    far=100.0,
    image_height=300,
    image_width=400,
    look_at=(0, 0, 1),
    up_direction=(0, -1, 0),
)
