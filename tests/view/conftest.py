"""A viewer of the shipped model, and a browser that never speaks to another machine."""

from pathlib import Path
from urllib.parse import urlsplit

import pytest
from chromium import CHROMIUM, PATIENCE

import r2art

BLIND = Path(__file__).with_name("blind.js")
# As root Chromium refuses its sandbox; a webcam of its own shows moving test pictures.
WEBCAM = ("--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream")


@pytest.fixture(scope="session")
def predictor():
    return r2art.load()


@pytest.fixture(scope="module")
def viewer(predictor):
    pytest.importorskip("viser", reason="needs the extra `view`")
    from r2art.view.server import Viewer

    viewer = Viewer(predictor, port=0, max_megabytes=1)
    yield viewer
    viewer.stop()


@pytest.fixture(scope="session")
def playwright():
    api = pytest.importorskip("playwright.sync_api", reason="needs playwright")
    if CHROMIUM is None:
        pytest.skip("needs Chromium (Debian: apt-get install chromium)")
    with api.sync_playwright() as playwright:
        yield playwright


@pytest.fixture(scope="session")
def browser(playwright):
    arguments = ["--no-sandbox", "--disable-gpu", *WEBCAM]
    browser = playwright.chromium.launch(executable_path=CHROMIUM, args=arguments)
    yield browser
    browser.close()


@pytest.fixture(scope="module")
def elsewhere():
    """Every address beyond this machine that a page has asked for."""
    return []


@pytest.fixture(scope="module")
def open_page(browser, viewer, elsewhere):
    """Open the viewer in a browser window of its own; gives the page and its session."""
    opened = []

    def open_one(script=BLIND):
        before = set(viewer.sessions)
        context = browser.new_context(viewport={"width": 1000, "height": 700})
        context.set_default_timeout(PATIENCE)
        context.route("**/*", lambda route: _only_here(route, elsewhere))
        context.add_init_script(path=script)
        page = context.new_page()
        opened.append(context)
        page.on("websocket", lambda socket: _note(socket.url, elsewhere))
        page.goto(viewer.url)
        page.wait_for_selector(".r2art-drop")
        (client,) = set(viewer.sessions) - before
        return page, viewer.sessions[client]

    yield open_one
    for context in opened:
        context.close()


def _only_here(route, elsewhere):
    if _note(route.request.url, elsewhere):
        route.continue_()
    else:
        route.abort()


def _note(url, elsewhere):
    """Whether a request stays on this machine."""
    address = urlsplit(url)
    stays = address.scheme in ("data", "blob") or address.hostname == "127.0.0.1"
    if not stays:
        elsewhere.append(url)
    return stays
