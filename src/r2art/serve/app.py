"""The routes: a photo in, a prediction out, by way of `Predictor.predict` alone."""

import asyncio
from collections.abc import AsyncIterator, Coroutine
from contextlib import asynccontextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

from fastapi import FastAPI, Request, Response
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect

import r2art
from r2art.core.category import JointKind
from r2art.core.errors import InputError, R2ArtError
from r2art.core.image import Photo, read_image
from r2art.run.predictor import Predictor
from r2art.serve.answers import answer
from r2art.serve.limits import Limits
from r2art.serve.log import RequestLog, instance, note
from r2art.serve.openapi import describe
from r2art.serve.options import Options, read_options
from r2art.serve.pool import Pool
from r2art.serve.problems import Kind, ProblemError, from_error, from_status
from r2art.serve.upload import Body, Upload, check_pixels

CLIENT_HAS_LEFT = 499  # as nginx logs it; nobody receives it

Result = TypeVar("Result")


@dataclass(frozen=True)
class Health:
    """How the server is.

    Attributes:
        status: Always ``"ok"``: a server that is not does not answer.
        version: Of r2art.
        taken: Places taken now ...
        places: ... of how many; where all are, `/predict` answers 503.
    """

    status: str
    version: str
    taken: int
    places: int


@dataclass(frozen=True)
class JointInfo:
    """A joint of a category; ``limits`` in rad or m."""

    name: str
    kind: JointKind
    parent: str
    child: str
    limits: tuple[float, float]


@dataclass(frozen=True)
class CategoryInfo:
    """A category the model knows: parts, the root first, and joints; joint j moves part j + 1."""

    name: str
    parts: tuple[str, ...]
    joints: tuple[JointInfo, ...]


def build_app(predictor: Predictor, limits: Limits | None = None) -> FastAPI:
    """The application around one model, to be run by any ASGI server."""
    service = Service(predictor, limits or Limits())

    @asynccontextmanager
    async def life(_: FastAPI) -> AsyncIterator[None]:
        yield
        service.pool.close()

    # No page of documentation: those that FastAPI brings load scripts from the internet.
    app = FastAPI(
        title="r2art",
        version=r2art.__version__,
        summary="One photo of an articulated object in, poses of its parts and joint states out.",
        docs_url=None,
        redoc_url=None,
        lifespan=life,
    )
    app.add_middleware(RequestLog)
    app.add_exception_handler(HTTPException, _no_route)
    app.add_api_route(
        "/predict",
        service.predict,
        methods=["POST"],
        response_model=None,
        response_class=Response,
    )
    app.add_api_route("/health", service.health, methods=["GET"])
    app.add_api_route("/categories", service.categories, methods=["GET"])
    describe(app, predictor.categories, service.limits)
    return app


class Service:
    """The routes, around one model.

    Attributes:
        limits: What a request may cost.
        pool: The threads and places.
    """

    def __init__(self, predictor: Predictor, limits: Limits) -> None:
        self._predictor = predictor
        self.limits = limits
        self.pool = Pool(limits)

    async def health(self) -> Health:
        """Whether the server is up, and how busy."""
        return Health("ok", r2art.__version__, self.pool.taken, self.limits.places)

    async def categories(self) -> list[CategoryInfo]:
        """What the model knows."""
        return [
            CategoryInfo(
                c.name,
                c.parts,
                tuple(
                    JointInfo(j.name, j.kind, c.parts[j.parent], c.parts[i + 1], j.limits)
                    for i, j in enumerate(c.joints)
                ),
            )
            for c in map(self._predictor.category, self._predictor.categories)
        ]

    async def predict(self, request: Request) -> Response:
        """Pose of every part and state of every joint of the object in a photo."""
        body = Body(request, self.limits)
        try:
            async with asyncio.timeout(self.limits.seconds):
                return await self._answer(request, body)
        except ClientDisconnect:
            note(request, bytes=body.received)
            return Response(status_code=CLIENT_HAS_LEFT)
        except TimeoutError:
            problem = self._late(body)
        except R2ArtError as error:
            problem = from_error(error)
        except ProblemError as error:
            problem = error
        if problem.kind is Kind.SLOW_UPLOAD or not await body.drain():
            problem.headers = {**problem.headers, "Connection": "close"}
        note(request, bytes=body.received, problem=problem.kind.uri, detail=problem.detail)
        return problem.response(instance(request))

    async def _answer(self, request: Request, body: Body) -> Response:
        in_address = request.query_params.multi_items()
        read_options(in_address).check(self._predictor)
        with self.pool.place():
            upload = await body.read()
            options = read_options([*in_address, *upload.options])
            options.check(self._predictor)
            chosen = answer(options.format)

            work = partial(self._predicted, upload, options)
            category, data = await unless_gone(request, self.pool.run(work))
        note(request, bytes=body.received, category=category, format=options.format)
        headers = {"Content-Disposition": f'inline; filename="prediction{chosen.suffix}"'}
        return Response(data, headers=headers, media_type=chosen.media_type)

    def _predicted(self, upload: Upload, options: Options) -> tuple[str, bytes]:
        """What the model says, encoded; done in a thread."""
        photo = _read(upload.photo, "photo", self.limits)
        mask = None if upload.mask is None else _read(upload.mask, "mask", self.limits)
        prediction = self._predictor.predict(
            photo,
            options.camera_of(photo),
            options.category,
            options.box,
            size=options.size,
            depth=options.depth,
            refine=options.refine,
            mask=mask,
        )
        return prediction.category, answer(options.format).encode(prediction)

    def _late(self, body: Body) -> ProblemError:
        seconds = self.limits.seconds
        if not body.ended:
            return ProblemError(
                Kind.SLOW_UPLOAD,
                f"the body had not arrived after {seconds:g} s",
                "send a smaller photo, or over a faster line",
            )
        wait = str(self.pool.wait())
        return ProblemError(
            Kind.SLOW_ANSWER,
            f"there was no answer after {seconds:g} s",
            f"try again in {wait} s, or send a smaller photo",
            {"Retry-After": wait},
        )


def _read(image: bytes, name: str, limits: Limits) -> Photo:
    check_pixels(image, limits)
    try:
        return read_image(image)
    except InputError as error:
        raise InputError(str(error).replace("the image", f"the {name}")) from None


async def unless_gone(request: Request, work: Coroutine[Any, Any, Result]) -> Result:
    """The result of ``work``, given up as soon as the client, whose body is read, has left.

    Raises:
        ClientDisconnect: It has.
    """
    task = asyncio.ensure_future(work)
    gone = asyncio.ensure_future(_until_gone(request))
    try:
        await asyncio.wait({task, gone}, return_when=asyncio.FIRST_COMPLETED)
        if not task.done():
            raise ClientDisconnect
        return task.result()
    finally:
        task.cancel()
        gone.cancel()


async def _until_gone(request: Request) -> None:
    while (await request.receive())["type"] != "http.disconnect":
        pass


async def _no_route(request: Request, error: Exception) -> Response:
    status = error.status_code if isinstance(error, HTTPException) else 500
    problem = from_status(status, request.url.path[:200])
    problem.headers = getattr(error, "headers", None) or {}
    note(request, problem=problem.kind.uri)
    return problem.response(instance(request))
