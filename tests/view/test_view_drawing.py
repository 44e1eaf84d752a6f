"""What the scene looks like, drawn in software: minutes on a busy machine."""

import io

import numpy as np
import pytest

pytest.importorskip("viser", reason="needs the extra `view`")

from chromium import CHROMIUM, PATIENCE
from PIL import Image
from viewer_tab import LAPTOP

pytestmark = pytest.mark.slow


def orange(page) -> int:
    """Pixels of the middle of the page that have the lid's hue, or nearly."""
    middle = {"x": 400, "y": 0, "width": 300, "height": 400}
    picture = Image.open(io.BytesIO(page.screenshot(clip=middle))).convert("HSV")
    hue, saturation, value = np.moveaxis(np.asarray(picture, int), -1, 0)
    return int(((abs(hue - 28) < 6) & (saturation > 150) & (value > 60)).sum())


def test_the_lid_is_drawn_in_its_colour(playwright, viewer):
    flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    browser = playwright.chromium.launch(executable_path=CHROMIUM, args=flags)
    page = browser.new_page(viewport={"width": 1100, "height": 400})
    page.set_default_timeout(4 * PATIENCE)
    page.goto(viewer.url)
    page.wait_for_selector(".r2art-drop")
    assert orange(page) == 0
    page.set_input_files("input[type=file]", LAPTOP)
    page.locator(".r2art-facts h1").wait_for()
    page.wait_for_timeout(20_000)
    assert orange(page) > 300
    browser.close()
