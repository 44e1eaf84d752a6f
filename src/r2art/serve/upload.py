"""The body of a request: a photo, perhaps a mask, never larger or slower than the limits."""

import asyncio
import contextlib
from dataclasses import dataclass
from io import BytesIO

from fastapi import Request
from PIL import Image
from starlette.datastructures import FormData, UploadFile
from starlette.exceptions import HTTPException
from starlette.types import Message

from r2art.core.image import FORMATS
from r2art.serve.limits import Limits
from r2art.serve.options import PARAMETERS
from r2art.serve.problems import Kind, ProblemError

FORM = "multipart/form-data"
FILES = ("photo", "mask")
FIELD_BYTES = 1000  # of one option in a form
LINGER = 3.0  # s: how long a refused upload is listened to, so that its sender hears the answer


@dataclass(frozen=True)
class Upload:
    """What a body held.

    Attributes:
        photo: The photo's file.
        mask: The mask's, if there was one.
        options: Names and texts of the other fields of a form.
    """

    photo: bytes
    mask: bytes | None = None
    options: tuple[tuple[str, str], ...] = ()


class Body:
    """The body of a request as it arrives, never more of it than the limits allow.

    Attributes:
        received: Bytes so far.
        ended: Whether all of it has arrived.
    """

    def __init__(self, request: Request, limits: Limits) -> None:
        self._request = request
        self._limits = limits
        self.received = 0
        self.ended = not ({"content-length", "transfer-encoding"} & set(request.headers))

    async def _receive(self) -> Message:
        message = await self._request.receive()
        self.received += len(message.get("body", b""))
        self.ended = self.ended or not message.get("more_body", False)
        return message

    async def _receive_counted(self) -> Message:
        message = await self._receive()
        if self.received > self._limits.bytes:
            raise _too_large(self._limits)
        return message

    async def read(self) -> Upload:
        """Read it all: a form with a file ``photo``, or the photo itself.

        Raises:
            ProblemError: It is of another type, too large, empty, or no form.
            ClientDisconnect: The client has left.
        """
        kind = media_type(self._request)
        if not (kind == FORM or kind.startswith("image/")):
            shown = f"the body is of type {kind[:60]!r}" if kind else "the body is of no type"
            raise ProblemError(
                Kind.WRONG_MEDIA_TYPE,
                f"{shown}, but a photo (image/…) or a form ({FORM}) is expected",
                "with curl, give -F photo=@photo.jpg, or "
                "-H 'Content-Type: image/jpeg' --data-binary @photo.jpg",
            )
        announced = self._request.headers.get("content-length", "0")
        if announced.isdigit() and int(announced) > self._limits.bytes:
            raise _too_large(self._limits)
        counted = Request(self._request.scope, self._receive_counted)
        if kind == FORM:
            return await _read_form(counted)
        return _complete(Upload(await counted.body()))

    async def drain(self) -> bool:
        """Let a refused client finish sending, so that it reads the answer instead of a reset.

        Returns:
            Whether the body has ended; the connection cannot be used on where it has not.
        """
        if self._request.headers.get("expect", "").lower() == "100-continue":
            return self.ended  # else it waits for leave to send
        most = self.received + 2 * self._limits.bytes
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(LINGER):
                while not self.ended and self.received < most:
                    await self._receive()
        return self.ended


def media_type(request: Request) -> str:
    """The type of the body without its parameters, in lower case."""
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


def _too_large(limits: Limits) -> ProblemError:
    return ProblemError(
        Kind.TOO_LARGE,
        f"the body has more than {limits.megabytes:g} MB",
        "send a smaller photo; 1000 px across the object are plenty",
    )


async def _read_form(request: Request) -> Upload:
    try:
        form = await request.form(
            max_files=len(FILES), max_fields=len(PARAMETERS), max_part_size=FIELD_BYTES
        )
    except HTTPException as error:  # what Starlette makes of a form that is none
        raise ProblemError(
            Kind.MALFORMED_REQUEST,
            f"the form cannot be read: {error.detail}",
            "send multipart/form-data with a file `photo`, as curl -F photo=@photo.jpg does",
        ) from None
    try:
        return await _from_form(form)
    finally:
        await form.close()


async def _from_form(form: FormData) -> Upload:
    images: dict[str, bytes] = {}
    options = []
    for name, value in form.multi_items():
        if isinstance(value, str) and name not in FILES:
            options.append((name, value))
        elif isinstance(value, UploadFile) and name in FILES and name not in images:
            images[name] = await value.read()
        else:
            raise ProblemError(
                Kind.MALFORMED_REQUEST,
                f"the field {name[:40]!r} is a text instead of a file, no option, or given twice",
                "files are `photo` and `mask`, once each, as curl -F photo=@photo.jpg sends them; "
                "neither addresses nor names of files are taken",
            )
    return _complete(Upload(images.get("photo", b""), images.get("mask"), tuple(options)))


def _complete(upload: Upload) -> Upload:
    for name, image in (("photo", upload.photo), ("mask", upload.mask)):
        if image is not None and not image:
            raise ProblemError(
                Kind.MALFORMED_REQUEST,
                f"there is no {name} in the body, or it is empty",
                f"send the {name}'s file, as curl -F {name}=@{name}.jpg does",
            )
    return upload


def check_pixels(image: bytes, limits: Limits) -> None:
    """Refuse an image whose header announces more pixels than allowed.

    One without a readable header is left to `r2art.core.image.read_image`, which tells why.

    Raises:
        ProblemError: So it does.
    """
    pixels = 0.0
    try:
        with Image.open(BytesIO(image), formats=FORMATS) as opened:
            pixels = opened.width * opened.height / 1e6
    except Image.DecompressionBombError:
        pixels = float("inf")
    except Exception:  # decoders raise whatever a damaged file makes them trip over
        return
    if pixels > limits.megapixels:
        raise ProblemError(
            Kind.TOO_LARGE,
            f"an image has more than {limits.megapixels:g} megapixels",
            "make it smaller first; 1000 px across the object are plenty",
        )
