"""One browser tab: its photo, what its user knows, and what came of it."""

import asyncio
import threading
import traceback
from concurrent.futures import Executor

from PIL import Image
from viser import ClientHandle

from r2art.core.draw import annotated
from r2art.core.errors import InputError, R2ArtError
from r2art.core.image import Photo
from r2art.core.prediction import Prediction
from r2art.run.predictor import Predictor
from r2art.view.inputs import Inputs
from r2art.view.results import Results
from r2art.view.upload import cap_uploads, read_upload, too_large

HINT = "Is the box wrong? Draw it on the photo, or drag a corner."


class Session:
    """The state of one tab; no two tabs share anything but the predictor.

    Whatever the user does asks for a new estimate of the tab's photo as it then is. Estimates
    are made by ``workers``, off the event loop; one that has been overtaken is dropped.

    Attributes:
        prediction: The last one shown.
        inputs: The left panel.
        results: The right panel and the scene.
    """

    def __init__(
        self,
        client: ClientHandle,
        predictor: Predictor,
        workers: Executor,
        limit: int,
        photo: Photo | None,
    ) -> None:
        """Build a tab's panels, and show ``photo`` if there is one.

        Args:
            client: The tab.
            predictor: Shared by all tabs.
            workers: Likewise.
            limit: Most bytes a photo's file may have.
            photo: What to show at first.
        """
        self._predictor = predictor
        self._workers = workers
        self._limit = limit
        self._turn = 0
        self._turns = threading.Lock()
        self._reading = threading.Lock()
        self._showing = threading.Lock()
        self._upload: tuple[str, bytes] | None = None
        self._photo = photo
        self.prediction: Prediction | None = None
        self.inputs = Inputs(client, predictor.categories, limit, self._open, self._changed)
        self.results = Results(client)
        cap_uploads(client, limit, lambda why: self.inputs.say(why, "error"))
        if photo is not None:
            self._ask(self._next_turn())

    def _open(self, name: str, content: bytes) -> None:
        """Take a photo's file."""
        if len(content) > self._limit:
            self.inputs.say(too_large(len(content), self._limit), "error")
            return
        self._upload = (name, content)
        self.inputs.forget_box()
        self._ask(self._next_turn())

    async def _changed(self, wait: float) -> None:
        """Estimate again, unless the user does something else within ``wait`` seconds."""
        turn = self._next_turn()
        await asyncio.sleep(wait)
        self._ask(turn)

    def _next_turn(self) -> int:
        with self._turns:
            self._turn += 1
            return self._turn

    def _ask(self, turn: int) -> None:
        if turn == self._turn and (self._upload or self._photo):
            self.inputs.say("Estimating", "busy")
            self._workers.submit(self._estimate, turn)

    def _estimate(self, turn: int) -> None:
        """Estimate and show, unless overtaken; whatever is wrong is said, and the rest stays."""
        if turn != self._turn:
            return
        try:
            photo = self._current_photo()
            known = self.inputs.known()
            prediction = self._predictor.predict(
                photo, known.camera(photo), known.category, known.box, size=known.size
            )
            overlay = annotated(prediction, photo)
        except R2ArtError as error:
            self._fail(turn, str(error))
        except Exception:
            traceback.print_exc()
            self._fail(turn, "Something went wrong that should not; the terminal tells more.")
        else:
            self._show(turn, prediction, photo, overlay)

    def _current_photo(self) -> Photo:
        """The photo last opened, read when it is first needed."""
        with self._reading:
            upload, self._upload = self._upload, None
            if upload is not None:
                self._photo = read_upload(*upload)
            if self._photo is None:
                raise InputError("there is no photo yet; drop one into the field above")
            return self._photo

    def _fail(self, turn: int, text: str) -> None:
        if turn == self._turn:
            self.inputs.say(text, "error")

    def _show(self, turn: int, prediction: Prediction, photo: Photo, overlay: Image.Image) -> None:
        with self._showing:
            if turn != self._turn:
                return
            self.prediction = prediction
            self.inputs.show(prediction, overlay)
            self.results.show(prediction, photo)
            self.inputs.say(HINT)
