"""The viewer in Chromium: what a user does, and what the server makes of it."""

import base64
import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("viser", reason="needs the extra `view`")

from viewer_tab import DRAWER, LAPTOP

from r2art.cli import main
from r2art.run.export.mechanism import part_poses


@pytest.fixture(scope="module")
def shown(open_page):
    """A page that shows the laptop, and its session."""
    page, session = open_page()
    give(page, LAPTOP)
    return page, session


def give(page, path):
    page.set_input_files("input[type=file]", path)
    page.locator(".r2art-facts h1", has_text=path.stem).wait_for()
    page.locator(".r2art-busy").wait_for(state="detached")


def wait(page, happened):
    """Let the page and the server go on until something has happened."""
    for _ in range(2000):
        if happened():
            return
        page.wait_for_timeout(50)
    raise AssertionError("waited 100 s in vain")


def field(page, label):
    """The text input beside a label of viser's."""
    place = page.locator("label", has_text=label).locator("xpath=ancestor::*[.//input][1]")
    return place.locator("input:not([type=hidden])").last


def test_an_uploaded_photo_shows_its_parts(shown):
    page, session = shown
    text = page.locator(".r2art-facts").inner_text()
    for part in session.prediction.parts:
        assert part.name in text
    for joint in session.prediction.joints:
        assert joint.name in text
    assert page.locator(".r2art-photo img").evaluate("e => e.naturalWidth") > 100
    poses = part_poses(session.prediction, {})
    for frame, pose in zip(session.results.scene.parts, poses, strict=True):
        np.testing.assert_allclose(frame.position, pose[:3, 3], atol=1e-6)


def test_a_slider_moves_the_part(shown):
    page, session = shown
    (joint,) = session.prediction.joints
    base, lid = session.results.scene.parts
    before = base.position.copy(), lid.position.copy()
    number = field(page, joint.name)
    number.fill("20")
    number.press("Enter")
    expected = part_poses(session.prediction, {joint.name: np.radians(20)})[1]
    wait(page, lambda: np.allclose(lid.position, expected[:3, 3], atol=1e-5))
    assert not np.allclose(lid.position, before[1], atol=0.01)
    np.testing.assert_array_equal(base.position, before[0])
    page.get_by_role("button", name="As in the photo").click()
    wait(page, lambda: np.allclose(lid.position, before[1], atol=1e-6))


def test_the_downloaded_json_is_that_of_the_command_line(shown, monkeypatch, capsys):
    page, _ = shown
    with page.expect_download() as download:
        page.get_by_text("JSON", exact=True).click()
    assert download.value.suggested_filename == "laptop.json"
    downloaded = json.loads(Path(download.value.path()).read_text())
    monkeypatch.chdir(LAPTOP.parent)
    assert main(["predict", LAPTOP.name, "--json"]) == 0
    assert downloaded == json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(
    ("label", "suffix", "head"),
    [("GLB", "glb", b"glTF"), ("URDF", "urdf", b"<?xml"), ("Overlay", "overlay.png", b"\x89PNG")],
)
def test_models_and_pictures_are_downloaded(shown, label, suffix, head):
    page, _ = shown
    with page.expect_download() as download:
        page.get_by_text(label, exact=True).click()
    assert download.value.suggested_filename == f"laptop.{suffix}"
    assert Path(download.value.path()).read_bytes().startswith(head)


def test_a_box_is_drawn_and_corrected_on_the_photo(shown):
    page, session = shown
    width, height = session.prediction.camera.width, session.prediction.camera.height

    def drag(start, end):
        page.locator(".r2art-busy").wait_for(state="detached")
        box = page.locator(".r2art-photo").bounding_box()
        for action, (x, y) in (("down", start), ("up", end)):
            page.mouse.move(box["x"] + x * box["width"], box["y"] + y * box["height"])
            getattr(page.mouse, action)()

    drag((0.2, 0.1), (0.85, 0.95))
    drawn = (0.2 * width, 0.1 * height, 0.85 * width, 0.95 * height)
    wait(page, lambda: np.allclose(session.prediction.box, drawn, atol=3))
    assert field(page, "Box").input_value() == " ".join(f"{v:g}" for v in session.prediction.box)
    drag((0.85, 0.95), (0.8, 0.9))  # the lower right corner
    corrected = (*drawn[:2], 0.8 * width, 0.9 * height)
    wait(page, lambda: np.allclose(session.prediction.box, corrected, atol=5))
    page.get_by_role("button", name="Find everything again").click()
    wait(page, lambda: not np.allclose(session.prediction.box, corrected, atol=5))
    assert field(page, "Box").input_value() == ""


def test_the_object_can_be_named(shown):
    page, session = shown
    field(page, "Object").click()
    page.get_by_role("option", name="drawer").first.click()
    wait(page, lambda: session.prediction.category == "drawer")
    page.locator(".r2art-warning", has_text="takes this for a laptop").wait_for()
    page.get_by_role("button", name="Find everything again").click()
    wait(page, lambda: session.prediction.category == "laptop")


def test_a_bad_file_is_told_and_the_result_stays(shown, tmp_path):
    page, session = shown
    before = session.prediction
    (tmp_path / "notes.txt").write_text("no photo")
    page.set_input_files("input[type=file]", tmp_path / "notes.txt")
    page.get_by_role("alert").filter(has_text="notes.txt is not an image").wait_for()
    assert session.prediction is before
    assert page.locator(".r2art-facts h1", has_text="laptop").is_visible()


def test_a_file_too_large_never_leaves_the_browser(shown, tmp_path):
    page, session = shown
    (tmp_path / "large.png").write_bytes(bytes(2_000_000))
    page.set_input_files("input[type=file]", tmp_path / "large.png")
    page.get_by_role("alert").filter(
        has_text="large.png has 2.0 MB, the limit is 1.0 MB"
    ).wait_for()
    assert session.inputs.upload.value.name != "large.png"


def test_two_windows_do_not_mix(shown, open_page):
    page, session = shown
    laptop = session.prediction
    other, others = open_page()
    assert not other.locator(".r2art-facts").is_visible()
    give(other, DRAWER)
    assert others.prediction.image_path == "drawer.png"
    assert session.prediction is laptop
    assert "laptop" in page.locator(".r2art-facts h1").inner_text()
    other.close()


DROP = """(content) => {
  const bytes = Uint8Array.from(atob(content), (c) => c.charCodeAt(0));
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File([bytes], 'dropped.png', { type: 'image/png' }));
  const more = { dataTransfer, bubbles: true, cancelable: true };
  for (const kind of ['dragover', 'drop'])
    document.body.dispatchEvent(new DragEvent(kind, more));
}"""


def test_a_photo_is_dropped_on_the_page_or_taken_with_the_webcam(open_page):
    page, session = open_page()
    page.evaluate(DROP, base64.b64encode(LAPTOP.read_bytes()).decode())
    wait(page, lambda: session.prediction is not None)
    assert session.prediction.image_path == "dropped.png"
    page.get_by_role("button", name="use the webcam").click()
    page.wait_for_function("document.querySelector('.r2art-live video').videoWidth > 0")
    page.get_by_role("button", name="Take the picture").click()
    wait(page, lambda: session.prediction.image_path == "webcam.jpg")
    assert page.locator(".r2art-idle").is_visible()


def test_no_request_has_left_this_machine(shown, elsewhere):
    page, _ = shown
    assert page.evaluate("document.fonts.ready.then(() => document.title)") == "r2art"
    assert elsewhere == []
