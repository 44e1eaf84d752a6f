"""`r2art serve`: predictions over HTTP."""

from pathlib import Path
from typing import Annotated

from r2art.cli.option import option


def serve(
    *,
    host: Annotated[str, option("ADDRESS", "127.0.0.1, this machine alone")] = "127.0.0.1",
    port: Annotated[int, option("PORT", "8000; 0: any that is free")] = 8000,
    model: Annotated[Path | None, option("PATH", "the one inside r2art")] = None,
    workers: Annotated[int, option("N", "2")] = 2,
    queue: Annotated[int, option("N", "16")] = 16,
    max_megabytes: Annotated[float, option("MB", "25")] = 25.0,
    max_megapixels: Annotated[float, option("MP", "40")] = 40.0,
    timeout: Annotated[float, option("S", "30")] = 30.0,
) -> int:
    """Serve predictions over HTTP, until Ctrl-C.

    Send a photo, get what `r2art predict --json` prints:

    $ curl -F photo=@laptop.jpg http://127.0.0.1:8000/predict

    $ curl -F photo=@laptop.jpg -F fov=65 -F size=0.34 http://127.0.0.1:8000/predict

    $ curl -F photo=@laptop.jpg -F format=overlay -o overlay.png http://127.0.0.1:8000/predict

    The server has no passwords and no encryption: with another --host, put a proxy that has
    both in front of it. All about it: docs/serve.md, and http://127.0.0.1:8000/openapi.json.

    Args:
        host: Address to listen on.
        port: Port to listen on.
        model: A model that `r2art export` made.
        workers: Predictions at a time.
        queue: Requests that may wait beside those; more are told to come back later.
        max_megabytes: Largest upload.
        max_megapixels: Largest photo.
        timeout: Seconds a request may take, upload and waiting included.
    """
    from r2art.run.predictor import load
    from r2art.serve.limits import Limits
    from r2art.serve.run import serve as serve_until_stopped

    limits = Limits(
        megabytes=max_megabytes,
        megapixels=max_megapixels,
        seconds=timeout,
        workers=workers,
        queue=queue,
    )
    serve_until_stopped(load(model), host, port, limits)
    return 0
