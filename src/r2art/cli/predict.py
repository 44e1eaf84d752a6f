"""`r2art predict`: photos in, poses out."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from tyro.conf import Positional, arg
from tyro.constructors import PrimitiveConstructorSpec

from r2art.cli.option import option
from r2art.cli.patterns import expand
from r2art.core.camera import Camera
from r2art.core.errors import InputError, R2ArtError, UsageError
from r2art.run.report import print_table, print_warnings, progress, say

if TYPE_CHECKING:
    from r2art.core.image import Photo
    from r2art.core.prediction import Prediction

DEFAULT_OUT = Path("r2art_out")

Numbers = tuple[float, float, float, float]

# Without it tyro lets an optional tuple swallow the images that follow it.
FOUR = PrimitiveConstructorSpec(
    nargs=4,
    metavar="",
    instance_from_str=lambda texts: tuple(map(float, texts)),
    is_instance=lambda value: value is None or isinstance(value, tuple),
    str_from_instance=lambda values: [str(v) for v in values or ()],
)


# A webcam's number may be left out.
WEBCAM = PrimitiveConstructorSpec(
    nargs="*",
    metavar="",
    instance_from_str=lambda texts: _webcam(texts),
    is_instance=lambda value: value is None or isinstance(value, str),
    str_from_instance=lambda value: [] if value is None else [value],
)


def _webcam(texts: list[str]) -> str:
    if len(texts) > 1:
        raise ValueError("--webcam takes one number")
    return texts[0] if texts else "0"


def predict(
    images: Annotated[tuple[str, ...], Positional, arg(metavar="IMAGE...", help_behavior_hint="")],
    /,
    *,
    category: Annotated[str | None, option("NAME", "the model says")] = None,
    box: Annotated[Numbers | None, FOUR, option("X1 Y1 X2 Y2", "the model finds it")] = None,
    camera: Annotated[Numbers | None, FOUR, option("FX FY CX CY", "EXIF, else a guess")] = None,
    fov: Annotated[float | None, option("DEG", "EXIF, else a guess")] = None,
    size: Annotated[float | None, option("METRES", "as usual objects")] = None,
    depth: Annotated[float | None, option("METRES", "as usual objects")] = None,
    video: Annotated[str | None, option("CLIP", "none")] = None,
    webcam: Annotated[str | None, WEBCAM, option("[N]", "none; 0 if N is left out")] = None,
    fps: Annotated[float, option("FPS", "30")] = 30.0,
    refine: Annotated[int | None, option("STEPS", "6")] = None,
    mask: Annotated[Path | None, option("PATH", "the network's own")] = None,
    model: Annotated[Path | None, option("PATH", "the one inside r2art")] = None,
    out: Annotated[Path | None, option("DIR", f"{DEFAULT_OUT}, with --json none")] = None,
    json: Annotated[bool, arg(help_behavior_hint="")] = False,
) -> int:
    """Estimate the pose of every part and the state of every joint in photos and films.

    For each image NAME this writes NAME.overlay.png (part boxes, joint axes and the root frame
    on the photo), NAME.json (documented in docs/prediction.md) and NAME.glb (a 3D scene of the
    posed parts). In a film the object is followed: NAME.tracked.mp4, NAME.tracked.jsonl and
    NAME.joints.png (docs/video.md).

    Args:
        images: Files, folders and globs.
        category: What the object is.
        box: A box around the whole object, in pixels of the upright photo.
        camera: Focal lengths and principal point, in pixels of the upright photo.
        fov: Field of view across the photo's longer side, instead of --camera.
        size: Longest side of the root part (a laptop's width), which fixes all lengths.
        depth: Distance of the root part's centre along the viewing axis, instead of --size.
        video: A film, or a folder or glob of pictures that are the frames of one.
        webcam: Follow the object before a webcam, until Ctrl-C.
        fps: Frames per second of pictures given with --video.
        refine: Most steps to fit the estimate to a mask of the object; 0 for none.
        mask: White where the object is seen: an image of the photo's size, from any segmentation
            tool, or a folder of such masks named like the photos.
        model: A model that `r2art export` made.
        out: Folder for the results; it is made if need be.
        json: Print one line of JSON per image or frame instead of a table.
    """
    films, images = _films_among(images)
    clips = [*films, *([] if video is None else [video])]
    if not (images or clips or webcam is not None):
        raise UsageError("no image given; try `r2art predict photo.jpg`")
    _check_camera(camera, fov)

    from r2art.core.image import read_image
    from r2art.run.files import find_images, make_folder, result_names
    from r2art.run.predictor import check_lengths, load
    from r2art.run.refinement.mask_fit import STEPS, check_steps

    check_lengths(size, depth)
    moving = clips or webcam is not None
    if moving:
        from r2art.cli.track import check_meant_for_clips  # the filter: photos do without

        check_meant_for_clips(depth, mask)
    steps = STEPS if refine is None else refine
    check_steps(steps)
    predictor = load(model)
    if category is not None:
        predictor.category(category)
    if (folder := out or (None if json else DEFAULT_OUT)) is not None:
        make_folder(folder)

    paths, exit_code = expand(images, find_images)
    done: list[Prediction] = []
    with progress(len(paths)) as advance:
        for path, name in zip(paths, result_names(paths), strict=True):
            try:
                photo = read_image(path)
                seen_by = _camera_of(photo, camera, fov)
                prediction = predictor.predict(
                    photo,
                    seen_by,
                    category,
                    box,
                    size=size,
                    depth=depth,
                    refine=steps,
                    mask=_mask_of(path, mask),
                )
            except R2ArtError as error:
                say("error", str(error))
                exit_code = max(exit_code, error.exit_code)
            else:
                done.append(prediction)
                if folder is not None:
                    _save(prediction, photo, folder / name)
                if json:
                    print(prediction.to_json(), flush=True)
            advance()
    if done and not json:
        print_table(done)
    print_warnings(done)
    if done and folder is not None:
        name = Path(done[0].image_path or "").stem if len(done) == len(paths) == 1 else "NAME"
        say("written", f"{folder / name}.overlay.png, {name}.json, {name}.glb")
    if moving:
        from r2art.cli.track import track_all

        code = track_all(
            predictor,
            clips,
            webcam,
            fps=fps,
            camera_of=lambda photo: _camera_of(photo, camera, fov),
            category=category,
            box=box,
            size=size,
            refine=steps,
            folder=folder,
            json=json,
        )
        exit_code = max(exit_code, code)
    return exit_code


def _films_among(patterns: Sequence[str]) -> tuple[list[str], tuple[str, ...]]:
    """Films by their names, globs expanded; and the other patterns."""
    from r2art.run.files import films_of

    films: list[str] = []
    others: list[str] = []
    for pattern in patterns:
        found = films_of(pattern)
        films += found
        others += [] if found else [pattern]
    return films, tuple(others)


def _check_camera(camera: Numbers | None, fov: float | None) -> None:
    """Refuse once what would otherwise be refused for every image."""
    if camera is not None and fov is not None:
        raise UsageError("--camera and --fov say the same thing; give one of them")
    if camera is not None:
        Camera(*camera, width=1, height=1)
    if fov is not None:
        Camera.from_fov(np.radians(fov), 1, 1)


def _camera_of(photo: "Photo", camera: Numbers | None, fov: float | None) -> Camera | None:
    if camera is not None:
        return Camera(*camera, width=photo.width, height=photo.height)
    if fov is not None:
        return Camera.from_fov(np.radians(fov), photo.width, photo.height)
    return None


def _mask_of(photo: Path, mask: Path | None) -> Path | None:
    """The mask that belongs to a photo: the file given, or the folder's file of its name."""
    if mask is None or not mask.is_dir():
        return mask
    found = sorted(p for p in mask.iterdir() if p.stem == photo.stem)
    if not found:
        raise InputError(f"{mask} holds no mask named {photo.stem}; give one mask for every photo")
    return found[0]


def _save(prediction: "Prediction", photo: "Photo", stem: Path) -> None:
    from r2art.run.export import FORMATS
    from r2art.run.files import OVERLAY, png_bytes, write_whole

    write_whole(stem.with_name(stem.name + OVERLAY), png_bytes(prediction.draw(photo)))
    for form in (FORMATS["json"], FORMATS["glb"]):
        write_whole(stem.with_name(stem.name + form.suffix), form.encode(prediction))
