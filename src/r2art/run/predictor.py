"""A photo in, the poses of the parts and the states of the joints out.

The model's graph holds all the mathematics (rotation, depth, kinematics, boxes); what is left is
to show it the right window of the photo, and to name what comes out. See docs/prediction.md.
"""

import os
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np

from r2art.core.camera import Camera
from r2art.core.category import Category
from r2art.core.errors import InputError, UsageError
from r2art.core.image import Box, ImageLike, Photo, View, crop_square, read_image
from r2art.core.prediction import CameraSource, JointEstimate, PartEstimate, Prediction, Scale
from r2art.run.boxes import check_box
from r2art.run.confidence import calibrated
from r2art.run.guess import best_camera, cameras
from r2art.run.looks import Found, Outputs, Posed, Scores, find, finite, together
from r2art.run.mirror import between, in_mirror, out_of_mirror
from r2art.run.model import MASK, SCORES, Model, ModelCategory
from r2art.run.refinement.keypoint_fit import fitted_to_keypoints
from r2art.run.refinement.mask_fit import (
    STEPS,
    box_of,
    check_steps,
    fitted,
    given_target,
    own_target,
    read_mask,
)
from r2art.run.refinement.refine import Body, resolutions

SHIPPED_MODEL = files("r2art") / "weights" / "r2art.onnx"

# EXIF focal lengths outside this range (in units of the longer side) are taken for nonsense.
PLAUSIBLE_FOCAL = (0.2, 20.0)

# On the unsure side of these an answer is still given, with a warning.
UNSURE_CATEGORY = 0.6
UNSURE_PART = 0.3
# Above this probability that a photo shows no known object, it is rejected. The score is shy:
# photos of objects seldom have a hundredth of it.
NOTHING_KNOWN = 0.1
BLANK = "the photo is blank"
BLANK_RANGE = 8  # of 255: a photo whose pixels differ by no more shows nothing
SMALL_BOX = 24  # px
# A given size or depth that changes all lengths by more than these factors gets a warning.
ODD_SCALE = (0.4, 2.5)


def load(model: str | Path | None = None) -> "Predictor":
    """Load a model: the file ``model``, or the one that ships with r2art.

    Raises:
        ModelError: There is no such file, or it is not a model of r2art's present format.
    """
    if model is not None:
        return Predictor(Model(Path(model)))
    with as_file(SHIPPED_MODEL) as path:
        return Predictor(Model(path))


class Predictor:
    """Predicts photos with one model; may be shared between threads.

    Args:
        model: The opened file.
        calibrated: Whether confidences are probabilities, of categories that the file holds a
            calibration for; else they are what the network says.
    """

    def __init__(self, model: Model, *, calibrated: bool = True) -> None:
        self.model = model
        self._calibrated = calibrated
        self._priors: dict[str, Category] = {}
        self._ready: dict[str, tuple[Body, ...]] = {}

    @property
    def categories(self) -> tuple[str, ...]:
        """Names of the categories the model knows."""
        return tuple(c.name for c in self.model.categories)

    def category(self, name: str) -> ModelCategory:
        """What the model knows of a category: its parts and joints.

        Raises:
            UsageError: It knows none of that name.
        """
        for category in self.model.categories:
            if category.name == name:
                return category
        known = ", ".join(self.categories)
        raise UsageError(f"unknown category {name!r}; this model knows: {known}")

    def predict(
        self,
        image: ImageLike,
        camera: Camera | None = None,
        category: str | None = None,
        box: Sequence[float] | None = None,
        *,
        size: float | None = None,
        depth: float | None = None,
        refine: int = STEPS,
        mask: ImageLike | None = None,
    ) -> Prediction:
        """Estimate the pose of every part and the state of every joint of one object.

        Args:
            image: A file, a Pillow image, an array, or a `Photo`; see `read_image`.
            camera: The photo's camera; else the EXIF focal length, else a guess (60°, 45° or
                35° across the longer side, whichever fits best), which the warnings then tell.
            category: One of ``categories``; else the model says which it sees.
            box: x1 y1 x2 y2 (px) around the whole object; it may leave the photo where the
                object does. Else the model finds it.
            size: The longest side of the root part's box (m), if known: a laptop's width, a
                cabinet's height. It fixes all lengths, which else are those of usual objects.
            depth: The distance (m) of the root part's centre along the viewing axis, instead.
            refine: Most steps to fit the estimate to ``mask``, or else to where the network sees
                the object; 0: none.
            mask: White where the object is seen, of the photo's size; its box serves where
                ``box`` is left out.

        Raises:
            InputError: The image is unreadable, or no finite answer comes of it.
            UsageError: An argument that cannot be meant.
        """
        wanted = None if category is None else self.category(category)
        check_lengths(size, depth)
        check_steps(refine)
        photo = read_image(image)
        seen_at = None if mask is None else read_mask(mask, photo)
        camera, source = choose_camera(photo, camera)
        warnings: tuple[str, ...] = ()
        if box is None and seen_at is not None:
            box = box_of(seen_at)
        box = None if box is None else check_box(box, photo)
        found: Found | None = None
        if wanted is None or box is None:
            found = find(self.model, photo, camera, box)
            box = found.box
        view = crop_square(photo.pixels, camera, box, self.model.input_size, self.model.crop_margin)

        def pose(of: ModelCategory) -> Posed:
            fixed = None if source == "guessed" else camera
            again = refine > 0
            return self._posed(photo, view, box, of, fixed, again=again, vote=found is not None)

        rejected, score = BLANK if _is_blank(photo) else None, None
        if wanted is not None and found is None:
            known, posed = wanted, pose(wanted)
        else:
            assert found is not None
            first = wanted or self._recognise(together(*found.scores), None)[0]
            posed = pose(first)
            scores = together(*found.scores, *posed.scores)
            rejected = rejected or _nothing_known(scores, self.categories)
            known, score, doubts = self._recognise(scores, wanted)
            warnings += found.doubts + doubts
            if known != first:
                posed = pose(known)
        if source == "guessed":
            warnings = (guess_doubt(posed.camera), *warnings)
        camera, outputs = posed.camera, posed.outputs
        prediction = Prediction(
            image_path=None if photo.path is None else _text(photo.path),
            category=known.name,
            category_score=score,
            box=box,
            camera=camera,
            camera_source=source,
            parts=_parts(known, outputs),
            joints=_joints(known, outputs),
            rejected=rejected,
            warnings=warnings,
            scale=Scale(spread=known.size_spread),
            photo=photo if photo.path is None else None,
        )
        if refine > 0:
            prediction = self._refined(prediction, known, outputs, view, photo, seen_at, refine)
        if self._calibrated:
            own_mask = seen_at is None
            prediction = calibrated(prediction, known, own_mask=own_mask)
        doubts = _doubts(prediction.parts, box)
        prediction = replace(prediction, warnings=(*prediction.warnings, *doubts))
        return _rescaled(prediction, size, depth)

    def _posed(
        self,
        photo: Photo,
        view: View,
        box: Box,
        known: ModelCategory,
        camera: Camera | None,
        *,
        again: bool,
        vote: bool,
    ) -> Posed:
        """An object of a category, as it looks in a crop.

        Args:
            photo: Upright.
            view: The crop.
            box: The object's, in the photo.
            known: The category.
            camera: The photo's; None: it is guessed.
            again: Whether to look a second time, in a mirror, and take the middle; of categories
                without a mirror, only ...
            vote: ... if every look is to name the category.
        """
        inside = view.from_photo(box)

        def poses(cameras: Sequence[Camera]) -> list[Outputs]:
            return [finite(o) for o in self.model.poses(view, inside, known, cameras)]

        if camera is None:
            camera, outputs = best_camera(view, photo.width, photo.height, inside, poses)
        else:
            outputs = poses((view.camera,))[0]
        scores = (outputs[SCORES],)
        if again:
            mirrored = in_mirror(view.through(camera), inside)
            mirror = known.embedded and self._prior(known).mirror
            if mirror:
                seen = finite(self.model.pose(*mirrored, known))
                parents = tuple(joint.parent for joint in known.joints)
                other = out_of_mirror(seen, mirror, parents)
                outputs = between(self._bodies(known)[0], outputs, other)
                scores += (seen[SCORES],)
            elif vote:
                scores += (finite(self.model.look(mirrored[0]))[SCORES],)
        return Posed(outputs=outputs, camera=camera, scores=scores)

    def _refined(
        self,
        prediction: Prediction,
        known: ModelCategory,
        posed: Outputs,
        view: View,
        photo: Photo,
        mask: Photo | None,
        steps: int,
    ) -> Prediction:
        """The prediction, fitted to keypoints where they are known, and to a mask."""
        keypoints = self._prior(known).keypoints if known.has_keypoints else None
        if keypoints is not None:
            K = view.through(prediction.camera).camera.K
            body = self._bodies(known)[0]
            prediction = fitted_to_keypoints(prediction, body, keypoints, posed, K, steps)
            if mask is None:
                return prediction
        if mask is not None:
            target = given_target(mask, prediction, self.model.crop_margin)
        elif MASK in posed:
            target = own_target(posed[MASK], view.through(prediction.camera), photo)
        else:
            return prediction
        try:
            return fitted(prediction, self._bodies(known), target, steps)
        except InputError:
            doubt = "not refined: the mask shows nothing of the object"
            return replace(prediction, warnings=(*prediction.warnings, doubt))

    def _prior(self, category: ModelCategory) -> Category:
        """The category's mean object, read once."""
        if category.name not in self._priors:
            self._priors[category.name] = category.prior()
        return self._priors[category.name]

    def _bodies(self, category: ModelCategory) -> tuple[Body, ...]:
        """The same, made ready once."""
        if category.name not in self._ready:
            self._ready[category.name] = resolutions(self._prior(category))
        return self._ready[category.name]

    def _recognise(
        self, scores: Scores, wanted: ModelCategory | None
    ) -> tuple[ModelCategory, float, tuple[str, ...]]:
        """The category, its score, and what makes it doubtful."""
        known = self.model.categories
        likely = np.clip(scores[: len(known)], 0, 1)
        best = known[likely.argmax()]
        if wanted is None:
            score = float(likely.max())
            doubt = f"unsure that this is a {best.name} (score {score:.2f})"
            return best, score, (doubt,) if score < UNSURE_CATEGORY else ()
        doubt = f"the model takes this for a {best.name}, not a {wanted.name}"
        return wanted, float(likely[known.index(wanted)]), (doubt,) if best != wanted else ()


def _is_blank(photo: Photo) -> bool:
    channels = np.ascontiguousarray(photo.pixels[::4, ::4].transpose(2, 0, 1)).reshape(3, -1)
    return int(np.ptp(channels, axis=1).max()) <= BLANK_RANGE


def _nothing_known(scores: Scores, categories: tuple[str, ...]) -> str | None:
    """Why a photo is rejected, by a model whose last score says that it shows no category."""
    doubt = float(scores[len(categories) :].sum())
    if doubt <= NOTHING_KNOWN:
        return None
    known = ", ".join(categories)
    return f"it looks like nothing this model knows ({doubt:.0%} sure; it knows {known})"


def _text(path: Path) -> str:
    """The path as text that can be written anywhere, whatever bytes the file's name is made of."""
    return os.fsencode(path).decode(errors="replace")


def choose_camera(photo: Photo, given: Camera | None) -> tuple[Camera, CameraSource]:
    """The photo's camera and where it comes from; a guessed one is only the first to try.

    Raises:
        UsageError: The given camera belongs to an image of another size.
    """
    width, height = photo.width, photo.height
    if given is not None:
        if (given.width, given.height) != (width, height):
            raise UsageError(
                f"the camera is that of a {given.width}×{given.height} image, but the photo "
                f"(upright) has {width}×{height} px; resize the camera along with the photo"
            )
        return given, "given"
    if photo.focal is not None:
        shortest, longest = (f * max(width, height) for f in PLAUSIBLE_FOCAL)
        if shortest <= photo.focal <= longest:
            f = photo.focal
            return Camera(f, f, width / 2, height / 2, width, height), "exif"
    return next(cameras(width, height)), "guessed"


def guess_doubt(camera: Camera) -> str:
    """The warning that goes with a guessed camera."""
    fov = 2 * np.degrees(np.arctan(max(camera.width, camera.height) / 2 / camera.fx))
    return (
        f"the photo tells no focal length: guessed a field of view of {fov:.0f}° across the longer "
        "side, so distance and size may be off; give the camera (--fov, --camera) if known"
    )


def check_lengths(size: float | None, depth: float | None) -> None:
    """Refuse lengths that cannot be meant.

    Raises:
        UsageError: Both are given, or one is not positive.
    """
    if size is not None and depth is not None:
        raise UsageError("a size and a depth both fix the scale; give one of them")
    for name, length in (("size", size), ("depth", depth)):
        if length is not None and not (np.isfinite(length) and length > 0):
            raise UsageError(f"a {name} must be a positive number of metres, got {length:g}")


def _rescaled(prediction: Prediction, size: float | None, depth: float | None) -> Prediction:
    """The prediction with the lengths that a known one demands."""
    root = prediction.parts[0]
    if size is not None:
        factor, source = size / float(np.max(root.box_size)), "size"
    elif depth is not None:
        factor, source = depth / float(root.cam_T_part[2, 3]), "depth"
    else:
        return prediction
    scaled = prediction.scaled(factor, source)
    if ODD_SCALE[0] < factor < ODD_SCALE[1]:
        return scaled
    doubt = f"the given {source} makes the object {factor:.2g} times as large as expected; metres?"
    return replace(scaled, warnings=(*scaled.warnings, doubt))


def _parts(category: ModelCategory, outputs: Outputs) -> tuple[PartEstimate, ...]:
    return tuple(
        PartEstimate(
            name=name,
            cam_T_part=outputs["cam_T_part"][p],
            box_center=outputs["box_center"][p],
            box_size=outputs["box_size"][p],
            confidence=float(np.clip(outputs["confidence"][p], 0, 1)),
        )
        for p, name in enumerate(category.parts)
    )


def _joints(category: ModelCategory, outputs: Outputs) -> tuple[JointEstimate, ...]:
    return tuple(
        JointEstimate(
            name=joint.name,
            kind=joint.kind,
            parent=category.parts[joint.parent],
            child=category.parts[j + 1],
            state=float(outputs["joint_state"][j]),
            limits=joint.limits,
            axis=outputs["axis"][j],
            pivot=outputs["pivot"][j],
        )
        for j, joint in enumerate(category.joints)
    )


def _doubts(parts: tuple[PartEstimate, ...], box: Box) -> tuple[str, ...]:
    doubts = []
    if weak := [f"{p.name} {p.confidence:.2f}" for p in parts if p.confidence < UNSURE_PART]:
        doubts.append(f"low confidence: {', '.join(weak)}")
    width, height = box[2] - box[0], box[3] - box[1]
    if max(width, height) < SMALL_BOX:
        doubts.append(f"the object is only {width:.0f} by {height:.0f} px large")
    return tuple(doubts)
