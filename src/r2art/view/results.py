"""The right panel and the 3D scene: what came of the photo, and joints to move."""

import threading
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from viser import ClientHandle, GuiEvent, GuiSliderHandle

from r2art.core.image import Photo
from r2art.core.prediction import JointEstimate, Prediction
from r2art.run import files
from r2art.run.export import FORMATS
from r2art.view.facts import facts
from r2art.view.scene import Scene

WIDTH = 400  # px
LAST = 1e12
"""Order of what stands below everything added later, which viser numbers by the clock."""
SHOWN = 1024
"""Longer side (px) of the photo in the 3D scene, at most."""
OVERLAY = "Overlay"
BESIDE, CAMERA = "from beside", "from the camera"


class Results:
    """The right panel and the scene of one browser tab.

    Attributes:
        scene: The 3D scene, once there is one.
        sliders: By name of the joint, in degrees or centimetres.
    """

    def __init__(self, client: ClientHandle) -> None:
        """Build the panel, hidden until there is something to show."""
        gui = client.gui
        self._client = client
        self._lock = threading.Lock()
        self._prediction: Prediction | None = None
        self._photo: Photo | None = None
        self._count = 0
        self.scene: Scene | None = None
        self.sliders: dict[str, GuiSliderHandle[float]] = {}
        self._facts = gui.add_html("", visible=False)
        self._joints = gui.add_folder("Move the joints", visible=False)
        with self._joints:
            reset = gui.add_button("As in the photo", color="gray", order=LAST)
        self._looks = gui.add_folder("Look", visible=False)
        with self._looks:
            view = gui.add_button_group("View", (BESIDE, CAMERA))
            self._shown = {
                name: gui.add_checkbox(label, initial_value=True)
                for name, label in (("photo", "Photo"), ("boxes", "Parts"), ("axes", "Axes"))
            }
        self._save = gui.add_folder("Download", visible=False)
        with self._save:
            names = [OVERLAY, *(name.upper() for name in FORMATS)]
            download = gui.add_button_group(
                "As estimated", names, hint="Of the photo, wherever the sliders stand"
            )
        gui.main_panel.dock_right()
        gui.main_panel.set_width(WIDTH)

        reset.on_click(lambda _: self._reset())

        @view.on_click
        def _(event: GuiEvent) -> None:
            self._look(event.target.value)

        for checkbox in self._shown.values():

            @checkbox.on_update
            def _(_: GuiEvent) -> None:
                self._show_chosen()

        @download.on_click
        def _(event: GuiEvent) -> None:
            self._download(event.target.value)

    def show(self, prediction: Prediction, photo: Photo) -> None:
        """Show a prediction; where the last one was of the same photo, the view stays."""
        with self._lock:
            same_photo = photo is self._photo
            self._prediction, self._photo = prediction, photo
            self._facts.content = facts(prediction)
            if self.scene is not None:
                self.scene.remove()
            self._count += 1
            name = f"/estimate_{self._count}"
            self.scene = Scene(self._client, prediction, _small(photo), name)
            self._build_sliders(prediction)
        self._show_chosen()
        for shown in (self._facts, self._looks, self._save):
            shown.visible = True
        self._joints.visible = bool(prediction.joints)
        if not same_photo:
            self._look(BESIDE)

    def _build_sliders(self, prediction: Prediction) -> None:
        for slider in self.sliders.values():
            slider.remove()
        with self._joints:
            self.sliders = {j.name: _slider(self._client, j) for j in prediction.joints}
        for slider in self.sliders.values():
            slider.on_update(lambda event: self._move() if event.client is not None else None)

    def _move(self) -> None:
        """Bring the parts to where the sliders stand."""
        with self._lock:
            if self.scene is None or self._prediction is None:
                return
            joints = [j for j in self._prediction.joints if j.name in self.sliders]
            self.scene.move({j.name: self.sliders[j.name].value / _unit(j)[1] for j in joints})

    def _reset(self) -> None:
        with self._lock:
            if self.scene is None or self._prediction is None:
                return
            for joint in self._prediction.joints:
                self.sliders[joint.name].value = _in_unit(joint)
            self.scene.move({})

    def _look(self, view: str) -> None:
        if self.scene is not None:
            (self.scene.look_from_camera if view == CAMERA else self.scene.look_from_beside)()

    def _show_chosen(self) -> None:
        if self.scene is not None:
            self.scene.show(**{name: box.value for name, box in self._shown.items()})

    def _download(self, name: str) -> None:
        prediction, photo = self._prediction, self._photo
        if prediction is None or photo is None:
            return
        if name == OVERLAY:
            suffix, content = files.OVERLAY, files.png_bytes(prediction.draw(photo))
        else:
            form = FORMATS[name.lower()]
            suffix, content = form.suffix, form.encode(prediction)
        stem = Path(prediction.image_path or "").stem or "photo"
        self._client.send_file_download(stem + suffix, content, save_immediately=True)


def _small(photo: Photo) -> NDArray[np.uint8]:
    """(H, W, 3) the photo's pixels, few enough to be sent to a browser."""
    picture = Image.fromarray(photo.pixels)
    picture.thumbnail((SHOWN, SHOWN))
    return np.asarray(picture)


def _unit(joint: JointEstimate) -> tuple[str, float]:
    """What a joint's slider counts in, and how many of it make a radian or metre."""
    return ("°", 180 / np.pi) if joint.kind == "revolute" else ("cm", 100.0)


def _in_unit(joint: JointEstimate) -> float:
    return round(float(joint.state * _unit(joint)[1]), 1)


def _slider(client: ClientHandle, joint: JointEstimate) -> GuiSliderHandle[float]:
    unit, factor = _unit(joint)
    state = _in_unit(joint)
    low, high = (round(float(limit * factor), 1) for limit in joint.limits)
    return client.gui.add_slider(
        f"{joint.name} ({unit})",
        min=min(low, state),
        max=max(high, state),
        step=0.1,
        initial_value=state,
    )
