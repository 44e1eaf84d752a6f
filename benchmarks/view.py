"""How long the viewer takes from a photo to its result in the browser.

    python benchmarks/view.py [--photos ONE.png OTHER.png] [--times 20] [--pictures docs/images]

Chromium, without a window, gets two photos in turn, as if they had been chosen, and the clock
stops when the numbers stand in the page. Nothing is drawn (tests/view/blind.js), for without a
graphics card that would measure the card's absence. Beside it, in the same run: reading the photo
and estimating alone, in Python.

``--pictures`` draws the viewer instead, in software, and writes what docs/viewer.md shows.
"""

import argparse
import shutil
import statistics
import time
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

import r2art
from r2art.core.image import read_image
from r2art.view.server import Viewer

BLIND = Path(__file__).parents[1] / "tests" / "view" / "blind.js"
# Software rendering takes seconds a frame: draw only when a picture is taken.
DRAW_ON_DEMAND = """
  window.drawing = false;
  for (const name of ['drawElements', 'drawArrays', 'drawElementsInstanced',
                      'drawArraysInstanced', 'clear']) {
    const draw = WebGL2RenderingContext.prototype[name];
    WebGL2RenderingContext.prototype[name] = function (...args) {
      if (window.drawing) return draw.apply(this, args);
    };
  }"""
TWO_FRAMES = """() => new Promise((done) => {
  window.drawing = true;
  const stop = () => { window.drawing = false; done(); };
  requestAnimationFrame(() => requestAnimationFrame(stop));
})"""
QUALITY = 82
NUMBERS = "document.querySelector('.r2art-facts')?.innerHTML"
PHOTOS = [Path("examples/laptop.png"), Path("examples/drawer.png")]


def chromium() -> str:
    found = filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome")))
    path = next(found, None)
    if path is None:
        raise SystemExit("needs Chromium (Debian: apt-get install chromium)")
    return path


def give(page: Page, photo: Path) -> None:
    page.set_input_files("input[type=file]", photo)
    page.locator(".r2art-facts h1").wait_for()
    page.locator(".r2art-busy").wait_for(state="detached")


def measure(page: Page, photos: list[Path], times: int) -> None:
    """Give one photo after the other: the page shows nothing new if the numbers stay the same."""
    predictor = r2art.load()
    shown, alone = [], []
    for turn in range(times + 2):
        photo = photos[turn % len(photos)]
        before = page.evaluate(NUMBERS)
        start = time.perf_counter()
        page.set_input_files("input[type=file]", photo)
        page.wait_for_function(f"(before) => {NUMBERS} !== before", arg=before)
        shown.append(time.perf_counter() - start)
        start = time.perf_counter()
        predictor.predict(read_image(photo))
        alone.append(time.perf_counter() - start)
    for name, seconds in (("upload to numbers", shown[2:]), ("read and estimate", alone[2:])):
        middle = statistics.median(seconds)
        print(f"{name:18} median {1000 * middle:.0f} ms, worst {1000 * max(seconds):.0f} ms")


def take_pictures(page: Page, photo: Path, folder: Path) -> None:
    give(page, photo)
    field = page.locator("label", has_text="hinge").locator("xpath=ancestor::*[.//input][1]")
    _take(page, folder / "viewer.jpg")
    page.get_by_text("from the camera").click()
    field.locator("input[type=text]").last.fill("125")
    page.keyboard.press("Enter")
    _take(page, folder / "viewer_moved.jpg")


def _take(page: Page, path: Path) -> None:
    page.wait_for_timeout(2000)
    for close in page.locator("button.mantine-Notification-closeButton").all():
        close.click()
    page.wait_for_timeout(1000)
    page.evaluate(TWO_FRAMES)
    page.screenshot(path=path, type="jpeg", quality=QUALITY)
    print(f"written: {path} ({path.stat().st_size / 1000:.0f} kB)")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--photos", type=Path, nargs=2, default=PHOTOS)
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--pictures", type=Path, default=None)
    options = parser.parse_args()
    drawn = options.pictures is not None
    flags = (
        ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"] if drawn else ["--disable-gpu"]
    )
    viewer = Viewer(r2art.load(), port=0)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=chromium(), args=["--no-sandbox", *flags]
        )
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.set_default_timeout(300_000)
        page.add_init_script(DRAW_ON_DEMAND) if drawn else page.add_init_script(path=BLIND)
        page.goto(viewer.url)
        page.wait_for_selector(".r2art-drop")
        if drawn:
            take_pictures(page, options.photos[0], options.pictures)
        else:
            measure(page, options.photos, options.times)
        browser.close()
    viewer.stop()


if __name__ == "__main__":
    main()
