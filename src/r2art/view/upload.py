"""What a browser sends: its size capped while it arrives, its bytes read as a photo."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from viser import ClientHandle
from viser._messages import FileTransferPart, FileTransferStartUpload

from r2art.core.errors import InputError
from r2art.core.image import Photo, read_image

MEGABYTE = 1_000_000


def cap_uploads(client: ClientHandle, limit: int, refuse: Callable[[str], None]) -> None:
    """Drop what a browser sends beyond ``limit`` bytes, and tell ``refuse`` why.

    viser keeps every part of an upload until the last has come and knows no limit, so this looks
    at its transfers after each message (viser calls handlers in the order in which they were
    registered, its own first): at the size that is announced, and at what has really come.
    """
    transfers: dict[str, Any] = client.gui._current_file_upload_states

    def check(_client: int, _message: FileTransferStartUpload | FileTransferPart) -> None:
        announced = max((t["total_bytes"] for t in transfers.values()), default=0)
        come = sum(t["transferred_bytes"] for t in transfers.values())
        if max(announced, come) > limit:
            transfers.clear()
            refuse(too_large(max(announced, come), limit))

    for message in (FileTransferStartUpload, FileTransferPart):
        client.gui._websock_interface.register_handler(message, check)


def too_large(size: int, limit: int) -> str:
    """Why a file of ``size`` bytes is refused."""
    return (
        f"the file has {size / MEGABYTE:.1f} MB, the limit is {limit / MEGABYTE:g} MB; "
        "make the photo smaller, or start the viewer with a larger --max-megabytes"
    )


def read_upload(name: str, content: bytes) -> Photo:
    """A photo from the bytes of a file called ``name``, by the rules of `read_image`.

    The name serves messages and ``path`` alone: no file of that name is read or written.

    Raises:
        InputError: As `read_image` does.
    """
    shown = name.replace("\\", "/").rpartition("/")[2] or "photo"
    try:
        return replace(read_image(content), path=Path(shown))
    except InputError as error:
        raise InputError(str(error).replace("the image", shown, 1)) from None
