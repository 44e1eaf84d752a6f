"""The viewer's server: many browser tabs, one predictor."""

import contextlib
import io
import ipaddress
import socket
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import urlsplit

from viser import ClientHandle, SceneApi, ViserServer

from r2art.core.errors import UsageError
from r2art.core.image import Photo
from r2art.run.predictor import Predictor
from r2art.view import HOST, MAX_MEGABYTES, PORT
from r2art.view.session import Session
from r2art.view.upload import MEGABYTE

WORKERS = 2
"""Estimates made at once, each of which uses several threads; the others wait their turn."""
BLUE = (34, 139, 206)


class _Server(ViserServer):
    """viser without its way out: any tab may ask viser to publish the page through a tunnel."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Nothing: what is shown here stays here."""


class Viewer:
    """A running viewer; it serves until :meth:`stop`.

    Attributes:
        url: Where a browser finds it.
        sessions: The tabs that are open, by viser's number of the client.
    """

    def __init__(
        self,
        predictor: Predictor,
        photo: Photo | None = None,
        *,
        host: str = HOST,
        port: int = PORT,
        max_megabytes: float = MAX_MEGABYTES,
    ) -> None:
        """Start serving.

        Args:
            predictor: Shared by all tabs.
            photo: What every new tab shows.
            host: Name or address to listen on; only a loopback one keeps others out.
            port: To listen on; the next that is free where it is taken, any that is free for 0.
            max_megabytes: Most that a photo's file may have, in 10⁶ bytes.

        Raises:
            UsageError: This machine has no such host, or nobody may listen there.
        """
        _check_host(host, port)
        self._predictor = predictor
        self._photo = photo
        self._limit = round(max_megabytes * MEGABYTE)
        self._workers = ThreadPoolExecutor(WORKERS, thread_name_prefix="r2art-view")
        self._local = is_loopback(host)
        self.sessions: dict[int, Session] = {}
        with contextlib.redirect_stdout(io.StringIO()):  # viser's own banner
            self._server = _Server(host=host, port=port, label="r2art", verbose=False)
        self._server.gui.configure_theme(
            dark_mode=True, show_logo=False, show_share_button=False, brand_color=BLUE
        )
        _light(self._server.scene)
        self._server.on_client_connect(self._welcome)
        self._server.on_client_disconnect(self._part)
        shown = f"[{host}]" if ":" in host else host
        self.url = f"http://{shown}:{self._server.get_port()}"

    def stop(self) -> None:
        """End all sessions and free the port."""
        with contextlib.redirect_stdout(io.StringIO()):
            self._server.stop()
        self._workers.shutdown(wait=True, cancel_futures=True)

    def _welcome(self, client: ClientHandle) -> None:
        if self._local and not self._comes_from_here(client):
            return
        session = Session(client, self._predictor, self._workers, self._limit, self._photo)
        self.sessions[client.client_id] = session
        if client.client_id not in self._server.get_clients():  # it has left meanwhile
            self._part(client)

    def _part(self, client: ClientHandle) -> None:
        self.sessions.pop(client.client_id, None)

    def _comes_from_here(self, client: ClientHandle) -> bool:
        """Whether the page that speaks to us is ours.

        A browser lets any page of the internet open a websocket to this machine, and viser asks
        nobody who he is; the page's origin, which it cannot forge, tells.
        """
        connection = self._server._websock_server._live_connections.get(client.client_id)
        if connection is None or connection.request is None:
            return False
        origin = connection.request.headers.get("Origin", "")
        return is_loopback(urlsplit(origin).hostname or "")


def _light(scene: SceneApi) -> None:
    """Light for all tabs, cheap enough for browsers without a graphics card: no shadows, no sky.

    The camera's axes: the sun stands to the upper left behind the photographer.
    """
    scene.set_up_direction("-y")
    scene.configure_default_lights(False)
    scene.configure_environment_map(None)
    scene.add_light_hemisphere("/sky", ground_color=(170, 170, 180), intensity=1.7)
    scene.add_light_directional("/sun", position=(-0.5, -1.0, -0.8), intensity=0.9)


def is_loopback(host: str) -> bool:
    """Whether a host's name or address means this machine alone."""
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(host).is_loopback
    return host == "localhost"


def _check_host(host: str, port: int) -> None:
    """viser would look for a free port for ever."""
    if not 0 <= port <= 65535:
        raise UsageError(f"a port lies between 0 (any that is free) and 65535, got {port}")
    try:
        family = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0][0]
        with socket.socket(family, socket.SOCK_STREAM) as trial:
            trial.bind((host, 0))
    except (OSError, UnicodeError) as error:
        raise UsageError(
            f"cannot listen on {host}: {error}; --host 127.0.0.1 is this machine alone, "
            "0.0.0.0 all of its addresses"
        ) from None
