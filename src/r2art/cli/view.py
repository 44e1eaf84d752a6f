"""`r2art view`: photos in the browser, posed parts in 3D."""

import os
import sys
import threading
import webbrowser
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from r2art.cli.option import option
from r2art.core.errors import UsageError
from r2art.run.report import say
from r2art.view import HOST, MAX_MEGABYTES, PORT


def view(
    image: Annotated[Positional[Path | None], arg(metavar="[IMAGE]", help_behavior_hint="")] = None,
    /,
    *,
    host: Annotated[str, option("HOST", f"{HOST}, this machine alone")] = HOST,
    port: Annotated[int, option("PORT", f"{PORT}, or the next that is free")] = PORT,
    max_megabytes: Annotated[float, option("MB", f"{MAX_MEGABYTES:g}")] = MAX_MEGABYTES,
    model: Annotated[Path | None, option("PATH", "the one inside r2art")] = None,
    no_open: Annotated[bool, arg(help_behavior_hint="")] = False,
) -> int:
    """Look at estimates in the browser: drop photos, see the parts in 3D, move the joints.

    Nothing leaves this machine. Every browser tab has its own photo. Ctrl-C ends it.

    Args:
        image: A photo to begin with.
        host: Name or address to listen on; 0.0.0.0 lets the whole network in.
        port: Port to listen on; 0 for any that is free.
        max_megabytes: Largest file of a photo.
        model: A model that `r2art export` made.
        no_open: Print the address, and open no browser.
    """
    if not 0 < max_megabytes < float("inf"):
        raise UsageError(f"--max-megabytes must be a positive number, got {max_megabytes:g}")

    from r2art.core.image import read_image
    from r2art.run.predictor import load
    from r2art.view.server import Viewer, is_loopback

    predictor = load(model)
    photo = None if image is None else read_image(image)
    viewer = Viewer(predictor, photo, host=host, port=port, max_megabytes=max_megabytes)
    try:
        if not is_loopback(host):
            say("warning", f"whoever reaches {host} can use this: it asks for no password")
        print(f"r2art view: {viewer.url} (Ctrl-C ends it)", flush=True)
        if not no_open and _has_screen():
            webbrowser.open(viewer.url)
        threading.Event().wait()
    except KeyboardInterrupt:
        pass
    finally:
        viewer.stop()
    return 0


def _has_screen() -> bool:
    """Whether a browser would get a window; without one, Python starts browsers of the terminal."""
    if sys.platform in ("win32", "darwin"):
        return True
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
